"""Elastodynamics of the SDelta with the inertia of its limbs: twists of six shafts and deflections of six rod tips.

    q = [psi; gamma],   N x = D_J (q + [theta; 0]),   K_q = diag(k_s 1, k_r 1)                               (eq 3.18)
    M_E = D_J^T N^-T M N^-1 D_J + eps (screws, tubes and rods)

with motor angles theta. A rod bends in the shape of a static load at its tip, f(s) = (3 l_r s^2 - s^3) / (2 l_r^3), and
slides with its piston along the limb. Without the limbs' inertia, eps = 0, M_E has rank 6: the other six modes have
infinite frequencies, and the platform moves as at level `cartesian`. F = K_q^-1 D_J^T K_D N distributes a displacement
of the platform at least energy; F^T M_E F and K are the Ritz model of six degrees of freedom, whose frequencies are not
below the first six of M_E and K_q.
"""

from typing import NamedTuple

import numpy as np

from hfsa.components._mechanics.sdelta_geometry import INWARDS, UP
from hfsa.components._mechanics.sdelta_robot import Robot
from hfsa.components._mechanics.sdelta_stiffness import spring_forces

_RANK = 1e-15
"""Largest 1 / omega^2, relative to that of the first mode, of a mode whose inertia is rounding."""


class GeneralizedModes(NamedTuple):
    """Modes with locked motors.

    Attributes:
        omega: natural frequencies, ascending, infinite without inertia, shape (12,) [rad/s].
        shapes: mass-normalised shapes, columns [psi; gamma] of the finite modes, shape (12, 12 or 6).
    """

    omega: np.ndarray
    shapes: np.ndarray


def mass_matrix(robot: Robot) -> np.ndarray:
    """Return M_E, shape (12, 12) [kg.m2, kg.m; kg.m, kg]; eps is the robot's `extra_inertia`."""
    return robot.of_limbs.T @ robot.mass @ robot.of_limbs + robot.extra_inertia * _limb_inertia(robot)


def generalized_modes(robot: Robot, M_E: np.ndarray) -> GeneralizedModes:
    """Return the modes of M_E on shafts and rods, from the symmetric K_q^-1/2 M_E K_q^-1/2."""
    root = np.sqrt(robot.springs.compliance)
    inverse_squares, V = np.linalg.eigh(root[:, None] * M_E * root)
    inverse_squares, V = inverse_squares[::-1], V[:, ::-1]
    finite = inverse_squares > _RANK * inverse_squares[0]
    omega = np.full(12, np.inf)
    omega[finite] = 1 / np.sqrt(inverse_squares[finite])
    return GeneralizedModes(omega, root[:, None] * V[:, finite] * omega[finite])


def minimum_energy(robot: Robot) -> np.ndarray:
    """Return F, deflections [psi; gamma] per displacement of C, shape (12, 6) (eq 3.24)."""
    forces = spring_forces(robot.kinematics, robot.springs, robot.offset)
    return robot.springs.compliance[:, None] * forces


def ritz_mass(robot: Robot, M_E: np.ndarray) -> np.ndarray:
    """Return F^T M_E F, the mass matrix of six degrees of freedom about C, shape (6, 6)."""
    F = minimum_energy(robot)
    return F.T @ M_E @ F


def _limb_inertia(robot: Robot) -> np.ndarray:
    """Return the mass matrix of screws, tubes and rods, shape (12, 12)."""
    machine, kinematics = robot.machine, robot.kinematics
    rods, J_C = machine.rods, machine.mechanism.transmission.matrix
    M = np.diag(np.repeat([machine.limbs.screw_inertia, 0.0], 6))
    p = machine.mechanism.geometry.joints @ kinematics.Q.T - robot.offset
    along = np.cos(kinematics.limbs.angle)[:, None] * INWARDS + np.sin(kinematics.limbs.angle)[:, None] * UP
    pistons = np.hstack([np.cross(p, along), along]) @ robot.of_limbs
    for j in range(3):
        tube, tip = np.zeros((2, 12)), np.zeros((2, 12))
        tube[:, 2 * j : 2 * j + 2] = J_C
        tip[:, 6 + 2 * j : 8 + 2 * j] = np.eye(2)
        M += tube.T @ machine.limbs.tube @ tube
        moved = np.vstack([tube, tip])
        M += rods.mass * moved.T @ _rod(kinematics.limbs.length[j] - rods.length, rods.length) @ moved
        M += rods.mass * np.outer(pistons[j], pistons[j])
    return M


def _rod(root: float, length: float) -> np.ndarray:
    """Return the mass matrix of a rod of 1 kg in slide and angle of its tube and the deflections of its tip, (4, 4).

    `root` is the distance of its clamped end from the C axis [m]. With s in units of the length, the integrals over the
    rod are of f 3/8, of f^2 33/140, and of s f 11/40.
    """
    turned, coupled = root**2 + root * length + length**2 / 3, 3 / 8 * root + 11 / 40 * length
    along, across = [[1.0, 3 / 8], [3 / 8, 33 / 140]], [[turned, coupled], [coupled, 33 / 140]]
    M = np.zeros((4, 4))
    M[np.ix_([0, 2], [0, 2])], M[np.ix_([1, 3], [1, 3])] = along, across
    return M
