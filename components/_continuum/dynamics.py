"""Equations of the small model: modes that the stacks, the wrench and an accelerated base excite.

    eta'' = -2 zeta omega eta' - omega^2 eta + Phi^T (f - c l') - Phi^T B a,      f = blocking forces and wrench
    (l, q) = Phi eta + R (f - c l') - R_a a,    l' = Phi_l eta',    q' = Phi_q eta',    q'' = Phi_q eta''

The static residuals R and R_a are constant feedthroughs. Rates and accelerations are those of the modes alone, without
R: by about 1 % of the static ones too small at low frequency. The coordinate of a mode is the largest displacement of
l and q in it, the yaw at the bolts.
"""

from typing import NamedTuple

import casadi as ca
import numpy as np

from hfsa.components._continuum.reduced import Reduced


class Motion(NamedTuple):
    """Elongations and pose (6, 1), their rates and accelerations."""

    place: ca.SX
    rate: ca.SX
    acceleration: ca.SX


class Equations(NamedTuple):
    """Equations of the modes.

    Attributes:
        acceleration: second derivatives of the coordinates, shape (n, 1).
        motion: elongations and pose, with their derivatives.
    """

    acceleration: ca.SX
    motion: Motion


def largest_displacements(small: Reduced, radius: float) -> np.ndarray:
    """Return the largest displacement in each mode of mass 1, of l, q and the bolts at a radius [m], shape (n,)."""
    return np.abs(small.shapes * np.array([1.0, 1.0, 1.0, 1.0, 1.0, radius])[:, None]).max(axis=0)


def equations(
    small: Reduced, radius: float, coordinates: ca.SX, rates: ca.SX, force: ca.SX, base: ca.SX, damping: ca.SX, c: ca.SX
) -> Equations:
    """Return the equations of modes over their coordinates and rates (n, 1); the bolts are at a radius [m].

    `force` (6, 1) are blocking forces and wrench [N; N.m], `base` the acceleration of the base (2, 1) [m/s2], `damping`
    the damping ratio, `c` the damping of the stacks [N.s/m].
    """
    largest = largest_displacements(small, radius)
    shapes, omega = ca.DM(small.shapes / largest), ca.DM(small.omega)
    rate = shapes @ rates
    loads = force - ca.vertcat(c * rate[:3], ca.SX.zeros(3, 1))
    excited = ca.DM((small.shapes * largest).T) @ loads - ca.DM((small.base.T * largest).T) @ base
    acceleration = excited - 2 * damping * omega * rates - omega**2 * coordinates
    place = shapes @ coordinates + ca.DM(small.residual) @ loads - ca.DM(small.base_residual) @ base
    return Equations(acceleration, Motion(place, rate, shapes @ acceleration))
