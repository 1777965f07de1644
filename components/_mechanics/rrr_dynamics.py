"""Dynamics of the 3-RRR stage: equations of motion from the energies at two levels of fidelity.

With coordinates p, the energies T(p, p') and P(p), and the linear momentum I_b(p, p') of the moving links,

    M p'' + c(p, p') + dP/dp + G a_b = generalized forces,    M = d2T/dp'2,   G^T = dI_b/dp'

    exact               p = pose. Every link keeps its length.
    constant_jacobian   p = elongations, pose = J0 p. The ends of a coupler move by J0 and by the crank; its rotation is
                        the sine (u0 x u) / L_BC^2, its angular speed |v_C - v_B| / L_BC.

The energies are simple functions of pose and elongations together, z(p). Lagrange's equations over z transform to p by

    z' = Z p',   M = Z^T M_z Z,   c = Z^T (M_z Z' p' + M_z' z' - dT/dz),   dP/dp = Z^T dP/dz

In `exact` both ends of a coupler u have the same velocity along it, so its crank r turns with u v_C / (r x u). Couplers
are uniform rods of kinetic energy M_bc / 6 (v_B^2 + v_B v_C + v_C^2), v_B and v_C the velocities of their ends. The sum
over three corners 120 degrees apart of v_C^2 is 3 (v^2 + R^2 yaw'^2), that of v_C is 3 v. A hinge stores K_b phi^2 / 2.

Source: thesis of 2000 on the 3-RRR stage, ch. 4 and tables D.2, D.3. I_bc is M_bc L_BC^2 / 12: the table prints /3, but
the numbers of the source agree with /12. The source omits the yaw inside P, an error of first order; P here has it.
"""

from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from hfsa.components._mechanics.rrr_hinge import THESIS_HINGE
from hfsa.components._mechanics.rrr_kinematics import (
    Links,
    columns,
    coupler_motion,
    coupler_turns,
    elongations,
    rotated,
)
from hfsa.components._mechanics.rrr_masses import THESIS_MASSES


class Mechanism(NamedTuple):
    """Kinematics and energies of the stage as functions of coordinates p and rates p'.

    Attributes:
        coordinates: p, symbols (3, 1).
        rates: p', symbols (3, 1).
        parts: z, symbols (6, 1): x, y, yaw of the platform, elongations of the stacks.
        part_rates: z', symbols (6, 1).
        placement: z(p), shape (6, 1).
        motion: z'(z, p'), linear in p', shape (6, 1).
        bends: angles of the hinges A_i, B_i, C_i from rest as functions of z, shape (9, 1) [rad].
        kinetic: T(z, z') [J].
        momentum: I_b(z, z'), shape (2, 1) [kg.m/s].
        hinge_stiffness: K_b [N.m/rad].
        springs: energy of further springs as a function of z [J].
    """

    coordinates: ca.SX
    rates: ca.SX
    parts: ca.SX
    part_rates: ca.SX
    placement: ca.SX
    motion: ca.SX
    bends: ca.SX
    kinetic: ca.SX
    momentum: ca.SX
    hinge_stiffness: Any
    springs: ca.SX | float = 0.0

    @property
    def pose(self) -> ca.SX:
        """x, y, yaw from rest as functions of p, shape (3, 1) [m, m, rad]."""
        return self.placement[:3]

    @property
    def elongation(self) -> ca.SX:
        """Elongations of the stacks as functions of p, shape (3, 1) [m]."""
        return self.placement[3:]

    @property
    def hinges(self) -> ca.SX:
        """Angles of the hinges from rest as functions of p, shape (9, 1) [rad]."""
        return self.over_coordinates(self.bends)[0]

    def rate(self, expression: ca.SX) -> ca.SX:
        """Return the time derivative of an expression of p at the rates p'."""
        return ca.jtimes(expression, self.coordinates, self.rates)

    def over_coordinates(self, *expressions: ca.SX) -> list[ca.SX]:
        """Return expressions of z and z' as expressions of p and p'."""
        moving = ca.substitute(list(expressions), [self.part_rates], [self.motion])
        return ca.substitute(moving, [self.parts], [self.placement])


class Terms(NamedTuple):
    """Terms of the equations of motion as functions of p and p', and the map from p' to pose and elongations.

    Attributes:
        mass: M, shape (3, 3).
        velocity: c, shape (3, 1).
        elastic: dP/dp, shape (3, 1).
        base: G, shape (3, 2).
        slope: Z, from p' to the rates of x, y, yaw and the elongations, shape (6, 3).
        bias: Z' p', the acceleration of pose and elongations at p'' = 0, shape (6, 1).
    """

    mass: ca.SX
    velocity: ca.SX
    elastic: ca.SX
    base: ca.SX
    slope: ca.SX
    bias: ca.SX


def exact(
    geometry: Links,
    pose: ca.SX,
    rates: ca.SX,
    hinge_stiffness: Any = THESIS_HINGE.stiffness,
    masses: Any = THESIS_MASSES,
) -> Mechanism:
    """Return the mechanism with rigid links, as functions of the symbols of its pose and the rates of the pose.

    `hinge_stiffness` [N.m/rad] and the attributes of `masses`, those of `Masses`, are numbers or expressions.
    """
    z, z_rate = ca.SX.sym("z", 6), ca.SX.sym("z_rate", 6)
    crank, corners = -z[3:] / geometry.arm, _turned(geometry.corners, z[[2, 2, 2]])
    arms, change = _turned(geometry.cranks, crank), coupler_motion(geometry, z[:3], crank)
    rods = ca.DM(geometry.couplers.T) + change
    at_C = _corner_velocities(corners, rates)
    cranking = ca.vertcat(*[ca.dot(rods[:, i], at_C[:, i]) / _cross(arms[:, i], rods[:, i]) for i in range(3)])
    coupler = coupler_turns(geometry, change)
    return Mechanism(
        pose,
        rates,
        z,
        z_rate,
        ca.vertcat(pose, elongations(geometry, pose)),
        ca.vertcat(rates, -geometry.arm * cranking),
        ca.vertcat(crank, crank - coupler, coupler - z[2]),
        *_inertial(geometry, masses, z_rate, arms, corners),
        hinge_stiffness,
    )


def constant_jacobian(
    geometry: Links,
    elongation: ca.SX,
    rates: ca.SX,
    hinge_stiffness: Any = THESIS_HINGE.stiffness,
    masses: Any = THESIS_MASSES,
    jacobian: np.ndarray | None = None,
) -> Mechanism:
    """Return the mechanism with pose = J elongations, as functions of the symbols of these and of their rates.

    J is `jacobian`, shape (3, 3), by default that of the links; the rest as in `exact`.
    """
    z, z_rate = ca.SX.sym("z", 6), ca.SX.sym("z_rate", 6)
    J0, crank = ca.SX(geometry.jacobian if jacobian is None else jacobian), -z[3:] / geometry.arm
    change = coupler_motion(geometry, z[:3], crank)
    across = ca.vertcat(*[_cross(rest, change[:, i]) for i, rest in enumerate(geometry.couplers)])
    crank_sine, coupler_sine = ca.sin(crank), across / geometry.coupler**2
    return Mechanism(
        elongation,
        rates,
        z,
        z_rate,
        ca.vertcat(J0 @ elongation, elongation),
        ca.vertcat(J0 @ rates, rates),
        ca.vertcat(crank, crank_sine - coupler_sine, coupler_sine - ca.sin(z[2])),
        *_inertial(geometry, masses, z_rate, _turned(geometry.cranks, crank), ca.SX(columns(geometry.corners))),
        hinge_stiffness,
    )


def terms(mechanism: Mechanism) -> Terms:
    """Return the terms of Lagrange's equations of a mechanism."""
    z, z_rate = mechanism.parts, mechanism.part_rates
    momenta = ca.gradient(mechanism.kinetic, z_rate)
    mass = ca.jacobian(momenta, z_rate)
    velocity = ca.jtimes(momenta, z, z_rate) - ca.gradient(mechanism.kinetic, z)
    elastic = ca.gradient(_energy(mechanism), z)
    slope = ca.jacobian(mechanism.motion, mechanism.rates)
    bias = ca.jtimes(mechanism.motion, z, z_rate)
    return Terms(
        *mechanism.over_coordinates(
            ca.tril2symm(ca.tril(slope.T @ mass @ slope)),
            slope.T @ (mass @ bias + velocity),
            slope.T @ elastic,
            slope.T @ ca.jacobian(mechanism.momentum, z_rate).T,
            slope,
            bias,
        )
    )


def potential(mechanism: Mechanism) -> ca.SX:
    """Return the energy P of hinges and further springs as a function of p [J]."""
    return mechanism.over_coordinates(_energy(mechanism))[0]


def _energy(mechanism: Mechanism) -> ca.SX:
    """Return the energy of hinges and further springs as a function of z [J]."""
    return mechanism.hinge_stiffness / 2 * ca.sumsqr(mechanism.bends) + mechanism.springs


def _inertial(geometry: Links, masses: Any, z_rate: ca.SX, arms: ca.SX, corners: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return T and I_b as functions of the rates of pose and elongations.

    `arms` are the A_i B_i, `corners` the C_i from the centre of the platform, shape (2, 3) each.
    """
    velocity, spin, cranking = z_rate[:2], z_rate[2], -z_rate[3:] / geometry.arm
    at_B = _across(arms) * ca.repmat(cranking.T, 2, 1)
    at_C = _corner_velocities(corners, z_rate[:3])
    energy = (masses.platform + masses.coupler) * ca.sumsqr(velocity)
    energy += (masses.platform_inertia + masses.coupler * geometry.radius**2) * spin**2
    energy += (masses.crank_inertia + masses.coupler * geometry.crank**2 / 3) * ca.sumsqr(cranking)
    energy += masses.coupler / 3 * ca.dot(at_B, at_C)
    momentum = (masses.platform + 1.5 * masses.coupler) * velocity + (masses.crank + masses.coupler) / 2 * ca.sum2(at_B)
    return energy / 2, momentum


def _corner_velocities(corners: ca.SX, twist: ca.SX) -> ca.SX:
    """Return the velocities of the C_i, columns of shape (2, 3) [m/s]."""
    return ca.repmat(twist[:2], 1, 3) + _across(corners) * twist[2]


def _turned(vectors: np.ndarray, angles: ca.SX) -> ca.SX:
    """Return constant vectors (3, 2), each rotated by its angle, columns of shape (2, 3)."""
    return ca.horzcat(*[rotated(vector, angles[i]) for i, vector in enumerate(vectors)])


def _across(vectors: ca.SX) -> ca.SX:
    """Return columns (2, n) rotated by 90 degrees."""
    return ca.vertcat(-vectors[1, :], vectors[0, :])


def _cross(first: ca.SX | np.ndarray, second: ca.SX) -> ca.SX:
    """Return the cross product of two vectors of the plane, shape (2,)."""
    return first[0] * second[1] - first[1] * second[0]
