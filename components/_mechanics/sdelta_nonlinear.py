"""Elastodynamics of the SDelta with finite kinematics: a rigid platform on springs along the actual axes of its limbs.

The tube of limb j, at slide u and angle phi, has the C axis e_c and the directions e_l = cos(phi) i + sin(phi) Z along
the limb and e_n = e_c x e_l across it. The joint S_j is at d from the foot of the limb,

    d = a + Q s_j - m_j - u e_c,    gam_c = d . e_c,    gam_n = d . e_n,    ell = d . e_l
    V = sum_j (k_c gam_c^2 + k_n(ell) gam_n^2) / 2,    1 / k_n(ell) = 1 / k_r + ell^2 / (2 iota^2 k_s)

The limb acts on S_j with -f_c e_c - f_n e_n - f_l e_l, f_c = k_c gam_c, f_n = k_n gam_n, f_l = k_n' gam_n^2 / 2, and on
its tube with f_c along the slide and ell f_n - gam_n f_l about the C axis: the derivatives of V by a, u and phi.

All is computed from deviations from the posture, where d = l_0 e_l0 (eq 3.17 gives the first order): with the
displacement m of S_j,

    gam_c = m . e_c - du,    gam_n = m . e_n - l_0 sin(dphi),    ell = m . e_l + l_0 cos(dphi)

so that a motion of 1 pm has all digits, and the deflections are exactly 0 at the posture.
"""

from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np

from hfsa.components._mechanics.sdelta_geometry import C_AXES, INWARDS
from hfsa.components._mechanics.sdelta_kinematics import CONDITION_LIMIT
from hfsa.components._mechanics.sdelta_robot import Robot

_ROUNDING = 1e-14
"""Largest rounding error of an entry of a constant matrix, relative to its row."""


class Loads(NamedTuple):
    """Forces of the limbs, world axes; columns of three, one entry per limb where no vector is meant.

    Attributes:
        force, moment: on the platform, the moment about C [N], [N.m].
        slide, angle: on the tubes, along +slide and +angle [N], [N.m]; `slide` is f_c on the tips of the rods, too.
        across: f_n on the tips of the rods [N].
        lever: ell, distance of the joint from the C axis along the limb [m].
    """

    force: ca.SX
    moment: ca.SX
    slide: ca.SX
    angle: ca.SX
    across: ca.SX
    lever: ca.SX


@dataclass(frozen=True)
class MovedPlatform:
    """Pose of the platform from the posture.

    Attributes:
        robot: robot at the posture.
        turn: R - 1, rotation from the posture, world axes, shape (3, 3).
        move: displacement of C, shape (3, 1) [m].
    """

    robot: Robot
    turn: ca.SX
    move: ca.SX

    @property
    def center(self) -> ca.SX:
        """C - S, shape (3, 1) [m]."""
        return _turned(self.turn, self._offset)

    @property
    def centroid(self) -> ca.SX:
        """Displacement of S, shape (3, 1) [m]."""
        return self.move - self.turn @ self._offset

    @property
    def arms(self) -> list[ca.SX]:
        """Three vectors from S to its joints, columns of three [m]; their sum is zero."""
        first, second = (_turned(self.turn, arm) for arm in self._arms[:2])
        return [first, second, -first - second]

    @property
    def joints(self) -> list[ca.SX]:
        """Displacements of the three joints, columns of three [m]."""
        first, second = (self.turn @ arm for arm in self._arms[:2])
        return [self.centroid + swing for swing in (first, second, -first - second)]

    def loads(self, slide: ca.SX, angle: ca.SX) -> Loads:
        """Return the forces of the limbs for slides [m] and angles [rad] of the tubes, columns of three."""
        limbs, springs = self.robot.kinematics.limbs, self.robot.springs
        k_c = self.robot.limb_stiffness[::2]
        bend = 2 * self.robot.machine.mechanism.transmission.gear**2 * springs.shaft
        on_joints, on_tubes = [], []
        for j, moved in enumerate(self.joints):
            axis, inward = sparse(C_AXES[j]), sparse(INWARDS[j])
            axes = limb_axes(float(limbs.angle[j]), angle[j])
            into = ca.dot(inward, moved)
            gam_n = axes.cos * moved[2] - axes.sin * into - limbs.length[j] * axes.sin_change
            ell = axes.cos * into + axes.sin * moved[2] + limbs.length[j] * axes.cos_change
            f_c = k_c[j] * (ca.dot(axis, moved) - slide[j])
            if np.isinf(bend):
                f_n, f_l = springs.rod * gam_n, 0
            else:
                k_n = 1 / (1 / springs.rod + ell**2 / bend)
                f_n = k_n * gam_n
                f_l = -f_n * f_n * ell / bend
            radial = f_l * axes.cos - f_n * axes.sin
            on_joints.append(-f_c * axis - radial * inward - ca.vertcat(0, 0, f_n * axes.cos + f_l * axes.sin))
            on_tubes.append((f_c, ell * f_n - gam_n * f_l, f_n, ell))
        first, second, third = on_joints
        force = first + second + third
        a, b, _ = self.arms
        moment = ca.cross(a, first - third) + ca.cross(b, second - third) - ca.cross(self.center, force)
        f_c, about, f_n, ell = (ca.vertcat(*column) for column in zip(*on_tubes, strict=True))
        return Loads(force, moment, f_c, about, f_n, ell)

    def angular_acceleration(self, moment: ca.SX, angular_velocity: ca.SX) -> ca.SX:
        """Return the angular acceleration for a moment about C, world axes, columns of three."""
        inertia, back = self.robot.mass[:3, :3], self.turn.T
        w, n = angular_velocity + back @ angular_velocity, moment + back @ moment
        own = sparse(np.linalg.inv(inertia)) @ (n - ca.cross(w, sparse(inertia) @ w))
        return own + self.turn @ own

    def has_left_workspace(self, slide: ca.SX, angle: ca.SX, levers: ca.SX) -> ca.SX:
        """Return 1 where the machine is beyond what it can reach, else 0.

        A limb is not longer than its rod, a tube is beyond the end of its side of the base, or the platform is at or
        beyond a singular pose. There the platform can move while the tubes are locked, and the joints S_j move along
        their limbs: the determinant of their three distances, which has the zeros of det N, has fallen to the part of
        its value at the posture that corresponds to the largest condition number of a posture, or has changed sign.
        """
        kinematics, machine = self.robot.kinematics, self.robot.machine
        at_posture = MovedPlatform(self.robot, ca.SX(3, 3), ca.SX(3, 1))._closure(ca.SX(3, 1))
        part = kinematics.condition_number / CONDITION_LIMIT
        singular = self._closure(angle) / at_posture < part
        short = ca.mmin(levers) <= machine.rods.length
        beyond = ca.mmax(ca.fabs(ca.DM(kinematics.limbs.slide) + slide)) > machine.mechanism.geometry.reach
        return ca.fmax(ca.fmax(singular, short), beyond)

    def _closure(self, angle: ca.SX) -> ca.SX:
        """Return the determinant of the rates of the distances S_1 S_2, S_2 S_3, S_3 S_1 by those along limbs [m3]."""
        along = []
        for phi, change, inward in zip(self.robot.kinematics.limbs.angle, ca.vertsplit(angle), INWARDS, strict=True):
            axes = limb_axes(float(phi), change)
            along.append(axes.cos * sparse(inward) + ca.vertcat(0, 0, axes.sin))
        arms, forward, backward = self.arms, ca.SX(1), ca.SX(1)
        for j in range(3):
            other = (j + 1) % 3
            side = arms[other] - arms[j]
            forward, backward = forward * ca.dot(side, along[j]), backward * ca.dot(side, along[other])
        return forward - backward

    @property
    def _offset(self) -> ca.DM:
        """C - S at the posture, shape (3, 1) [m]."""
        return sparse(self.robot.offset)

    @property
    def _arms(self) -> list[ca.DM]:
        """Vectors from S to its joints at the posture, columns of three [m]."""
        arms = self.robot.machine.mechanism.geometry.joints @ self.robot.kinematics.Q.T
        return [sparse(arm) for arm in arms]


class LimbAxes(NamedTuple):
    """Sine and cosine of the angle of a tube, and of its change from the posture."""

    sin: ca.SX
    cos: ca.SX
    sin_change: ca.SX
    cos_change: ca.SX


def limb_axes(angle_at_posture: float, change: ca.SX) -> LimbAxes:
    """Return the axes of a limb by the sum formulas, so that the library is called once per limb."""
    s0, c0, s, c = np.sin(angle_at_posture), np.cos(angle_at_posture), ca.sin(change), ca.cos(change)
    return LimbAxes(s0 * c + c0 * s, c0 * c - s0 * s, s, c)


def deflections(robot: Robot, loads: Loads) -> ca.SX:
    """Return twists of the shafts [rad] and deflections of the rods' tips [m], shape (12, 1), as level `cartesian`."""
    transmission = robot.machine.mechanism.transmission.matrix
    rows = []
    for j in range(3):
        torques = ca.vertcat(loads.slide[j], loads.lever[j] * loads.across[j])
        rows.append(ca.DM(transmission.T / robot.springs.shaft) @ torques)
    tips = ca.vec(ca.horzcat(loads.slide, loads.across).T) / robot.springs.rod
    return ca.vertcat(*rows, tips)


def sparse(matrix: np.ndarray) -> ca.DM:
    """Return a constant matrix or vector with exact zeros for rounding errors relative to its rows."""
    scale = np.abs(matrix).max(axis=-1, keepdims=True)
    return ca.DM(np.where(np.abs(matrix) <= _ROUNDING * scale, 0.0, matrix))


def _turned(turn: ca.SX, vector: ca.DM) -> ca.SX:
    """Return a vector of the posture after a rotation R = 1 + `turn`."""
    return vector + turn @ vector
