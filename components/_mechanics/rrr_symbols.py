"""Links and masses of the 3-RRR stage as expressions."""

import math
from typing import Any, NamedTuple

import casadi as ca

from hfsa.components._mechanics.rrr_kinematics import OFFSETS, Links

LINKS = {
    "crank": ("m", "Length of a crank"),
    "coupler": ("m", "Length of a coupler"),
    "radius": ("m", "Radius of the platform's corners"),
    "psi1": ("rad", "Direction from A2 to C2"),
    "psi2": ("rad", "Angle of A B C at C"),
    "arm": ("m", "Arm of a stack on its crank"),
}
"""Unit and description of each dimension of the links."""
MASSES = {
    "platform": ("kg", "Mass of the platform"),
    "platform_inertia": ("kg.m2", "Moment of inertia of the platform about its centre"),
    "crank": ("kg", "Mass of a crank"),
    "crank_inertia": ("kg.m2", "Moment of inertia of a crank about its fixed hinge"),
    "coupler": ("kg", "Mass of a coupler"),
}
"""Unit and description of each mass and moment of inertia."""


class MassSymbols(NamedTuple):
    """Masses as expressions, with the attributes of `Masses`."""

    platform: ca.SX
    crank: ca.SX
    coupler: ca.SX
    platform_inertia: ca.SX
    crank_inertia: ca.SX


class LinkSymbols(NamedTuple):
    """Links as expressions, with the attributes of `Links` that level `constant_jacobian` uses."""

    crank: ca.SX
    coupler: ca.SX
    radius: ca.SX
    psi1: ca.SX
    psi2: ca.SX
    arm: ca.SX

    @property
    def psi(self) -> ca.SX:
        """Direction from B2 to C2 [rad]."""
        return self.psi1 + self.psi2

    @property
    def psi3(self) -> ca.SX:
        """Angle from a crank to its coupler [rad]."""
        return self.psi2 + ca.asin(self.coupler * ca.sin(self.psi2) / self.crank)

    @property
    def corners(self) -> list[tuple[ca.SX, ca.SX]]:
        """C_i0 [m]."""
        return _legs(self.radius, 0.0)

    @property
    def couplers(self) -> list[tuple[ca.SX, ca.SX]]:
        """B_i C_i at rest [m]."""
        return _legs(self.coupler, self.psi)

    @property
    def cranks(self) -> list[tuple[ca.SX, ca.SX]]:
        """A_i B_i at rest [m]."""
        return _legs(self.crank, self.psi - self.psi3)

    @property
    def jacobian(self) -> ca.SX:
        """J0, shape (3, 3) (eqs 2.21, 2.22)."""
        along = [(*leg, self.radius * ca.sin(self.psi)) for leg in _legs(1.0, self.psi)]
        rows = ca.vertcat(*[ca.horzcat(*row) for row in along])
        return -self.crank * ca.sin(self.psi3) / self.arm * ca.inv(rows)

    def conditions(self, present: Links) -> dict[str, ca.SX]:
        """Return conditions of links that can be built on the side of the present ones, above 0, by description."""
        side, obtuse = math.copysign(1.0, math.sin(present.psi)), self.psi2 >= math.pi / 2
        return {
            "an angle psi2 between 0 and pi": ca.sin(self.psi2),
            "links that close": 1 - self.coupler * ca.if_else(obtuse, 1, ca.sin(self.psi2)) / self.crank,
            "couplers on their side of the centre": side * ca.sin(self.psi),
        }


def _legs(length: Any, angle: Any) -> list[tuple[ca.SX, ca.SX]]:
    """Return vectors of one length at an angle from the direction of each leg."""
    return [(length * ca.cos(angle + offset), length * ca.sin(angle + offset)) for offset in OFFSETS.tolist()]
