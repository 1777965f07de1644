"""Dynamics of the 3-RRR stage: energies at two levels of fidelity, and the equations of motion that follow from them.

With coordinates p, the energies T(p, p', v_b) and P(p), and v_b the velocity of the base,

    M p'' + c(p, p') + dP/dp + G a_b = generalized forces,    M = d2T/dp'2,   G = d2T/dp' dv_b

    exact               p = pose. Every link keeps its length.
    constant_jacobian   p = elongations, pose = J0 p. A coupler's ends move as J0 and the crank say; its turn is the
                        sine (u0 x u) / L_BC^2, and its speed of turning |v_C - v_B| / L_BC.

Each hinge stores K_b phi^2 / 2. Couplers weigh at their middle; I_ab is about A, with the crank's mass at its middle.

Source: thesis of 2000 on the 3-RRR stage, ch. 4 and tables D.2, D.3. I_bc is M_bc L_BC^2 / 12: the table prints /3, the
source's own numbers were made with /12. The source drops the yaw inside P, an error of first order; it is kept here.
"""

from typing import NamedTuple

import casadi as ca
import numpy as np

from hfsa.components import _rrr_hinge as hinge
from hfsa.components._rrr_kinematics import Links, corner_motion, elongations, legs, rotated

PLATFORM_MASS = 0.1323
"""M_e [kg] (table D.2)."""
PLATFORM_INERTIA = 9.622e-6
"""I_e [kg.m2] (table D.2)."""
CRANK_MASS = 0.01416
"""M_ab [kg] (table D.2)."""
CRANK_INERTIA = 1.483e-6
"""I_ab, about A [kg.m2] (table D.2)."""
COUPLER_MASS = 7.628e-3
"""M_bc [kg] (table D.2)."""


class Mechanism(NamedTuple):
    """Kinematics and energy of the stage over coordinates p and rates p'.

    Attributes:
        coordinates: p, symbols (3, 1).
        rates: p', symbols (3, 1).
        base_velocity: v_b, symbols (2, 1) [m/s].
        pose: x, y, yaw from rest, shape (3, 1) [m, m, rad].
        elongation: shape (3, 1) [m].
        hinges: angles at A_i, B_i, C_i from rest, shape (9, 1) [rad].
        kinetic: T [J].
    """

    coordinates: ca.SX
    rates: ca.SX
    base_velocity: ca.SX
    pose: ca.SX
    elongation: ca.SX
    hinges: ca.SX
    kinetic: ca.SX

    def rate(self, expression: ca.SX) -> ca.SX:
        """Return the time derivative of an expression of the coordinates at the rates."""
        return ca.jtimes(expression, self.coordinates, self.rates)


class Terms(NamedTuple):
    """Terms of the equations of motion: `mass` (3, 3), `velocity` c (3, 1), `elastic` dP/dp (3, 1), `base` G (3, 2)."""

    mass: ca.SX
    velocity: ca.SX
    elastic: ca.SX
    base: ca.SX


def exact(geometry: Links, pose: ca.SX, rates: ca.SX) -> Mechanism:
    """Return the mechanism whose links keep their lengths, over the symbols of its pose and the pose's rates."""
    base = ca.SX.sym("base_velocity", 2)
    crank, coupler = legs(geometry, pose)
    corner_velocities = ca.reshape(ca.jtimes(ca.vec(corner_motion(geometry, pose)), pose, rates), 2, 3)
    ends = _crank_end_velocities(geometry, crank, ca.jtimes(crank, pose, rates))
    turning = ca.jtimes(coupler, pose, rates)
    kinetic = _kinetic(geometry, rates, ca.jtimes(crank, pose, rates), corner_velocities, ends, turning**2, base)
    hinges = ca.vertcat(crank, crank - coupler, coupler - pose[2])
    return Mechanism(pose, rates, base, pose, elongations(geometry, pose), hinges, kinetic)


def constant_jacobian(geometry: Links, elongation: ca.SX, rates: ca.SX) -> Mechanism:
    """Return the mechanism whose pose is J0 times the elongations, over the symbols of these and of their rates."""
    base = ca.SX.sym("base_velocity", 2)
    J0 = ca.DM(geometry.jacobian)
    pose, twist, crank = J0 @ elongation, J0 @ rates, -elongation / geometry.arm
    across = ca.DM(np.column_stack([-geometry.corners[:, 1], geometry.corners[:, 0]]).T)
    corner_velocities = ca.repmat(twist[:2], 1, 3) + across * twist[2]
    ends = _crank_end_velocities(geometry, crank, -rates / geometry.arm)
    turning = ca.sum1((corner_velocities - ends) ** 2).T / geometry.coupler**2
    kinetic = _kinetic(geometry, twist, -rates / geometry.arm, corner_velocities, ends, turning, base)
    at_B, at_C = ca.sin(crank), _coupler_sines(geometry, pose, crank)
    hinges = ca.vertcat(crank, at_B - at_C, at_C - ca.sin(pose[2]))
    return Mechanism(elongation, rates, base, pose, elongation, hinges, kinetic)


def terms(mechanism: Mechanism) -> Terms:
    """Return the terms of Lagrange's equations of a mechanism."""
    p, rates, base = mechanism.coordinates, mechanism.rates, mechanism.base_velocity
    momentum = ca.gradient(mechanism.kinetic, rates)
    mass = ca.jacobian(momentum, rates)
    at_rest = ca.substitute(mechanism.kinetic, base, ca.DM.zeros(2))
    velocity = mechanism.rate(mass @ rates) - ca.gradient(at_rest, p)
    elastic = ca.gradient(potential(mechanism), p)
    return Terms(mass, velocity, elastic, ca.jacobian(momentum, base))


def potential(mechanism: Mechanism) -> ca.SX:
    """Return the energy P of the nine hinges [J]."""
    return hinge.STIFFNESS / 2 * ca.sumsqr(mechanism.hinges)


def _kinetic(
    geometry: Links, twist: ca.SX, cranking: ca.SX, at_C: ca.SX, at_B: ca.SX, turning_squared: ca.SX, base: ca.SX
) -> ca.SX:
    """Energy of platform, cranks and couplers; velocities relative to the base, a point of each leg per column."""
    coupler_inertia = COUPLER_MASS * geometry.coupler**2 / 12
    energy = PLATFORM_MASS * ca.sumsqr(twist[:2] + base) + PLATFORM_INERTIA * twist[2] ** 2
    energy += CRANK_INERTIA * ca.sumsqr(cranking) + coupler_inertia * ca.sum1(turning_squared)
    for i in range(3):
        energy += COUPLER_MASS * ca.sumsqr((at_B[:, i] + at_C[:, i]) / 2 + base)
        energy += CRANK_MASS * (ca.dot(at_B[:, i], base) + ca.sumsqr(base))
    return energy / 2


def _crank_end_velocities(geometry: Links, crank: ca.SX, cranking: ca.SX) -> ca.SX:
    """Velocities of the B_i, columns of shape (2, 3) [m/s]."""
    arms = geometry.crank_ends - geometry.base_hinges
    return ca.horzcat(*[cranking[i] * rotated(np.array([-arms[i, 1], arms[i, 0]]), crank[i]) for i in range(3)])


def _coupler_sines(geometry: Links, pose: ca.SX, crank: ca.SX) -> ca.SX:
    """The (u0 x u) / L_BC^2 of the couplers, shape (3, 1), from their change, so that they are zero at rest."""
    moved, sines = corner_motion(geometry, pose), []
    for i in range(3):
        arm, rest = geometry.crank_ends[i] - geometry.base_hinges[i], geometry.corners[i] - geometry.crank_ends[i]
        change = moved[:, i] - (rotated(arm, crank[i]) - ca.DM(arm))
        sines.append((rest[0] * change[1] - rest[1] * change[0]) / geometry.coupler**2)
    return ca.vertcat(*sines)
