"""Neck of a hinge of the 3-RRR stage, between two semicircular notches: stiffnesses, and stress in it.

At its centre it gives along its axis, across it and in bending, the three independent of each other. With the thickness
t(x) = t + 2 r - 2 sqrt(r^2 - x^2), x along the axis from -r to r, depth b and shear factor kappa = 5/6 (Timoshenko),

    1/k_along  = integral dx / (E b t(x))
    1/k_across = integral dx / (kappa G b t(x)) + integral 12 x^2 dx / (E b t(x)^3)
    1/K_b      = integral 12 dx / (E b t(x)^3)

K_b exceeds that of the source (eq 2.3), which holds for t << r, by 11 % at its dimensions. A force N along, V across
and a moment M at the centre cause the stress

    max over x    |N| / (b t(x)) + 6 |M + V x| / (b t(x)^2)

at the surface. The moment of V grows away from the centre, faster than the section where the neck is thin. A
concentration of stress at the notch, 15 % in bending and 24 % in tension, is left out.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from hfsa.components._mechanics.rrr_contact import SHEAR_FACTOR
from hfsa.components._mechanics.rrr_hinge import Hinge

_POINTS = 400
"""Points of a Gauss quadrature, enough for necks of a thousandth of their radius."""


@dataclass(frozen=True)
class Neck:
    """A neck of a hinge.

    Attributes:
        hinge: its dimensions and material.
        poisson: Poisson's ratio.
    """

    hinge: Hinge
    poisson: float

    @cached_property
    def stiffness(self) -> np.ndarray:
        """Stiffnesses along and across [N/m] and in bending [N.m/rad], shape (3,)."""
        node, weight = np.polynomial.legendre.leggauss(_POINTS)
        angle = np.pi / 2 * node
        x, t = self.hinge.radius * np.sin(angle), self._thickness(np.sin(angle))
        dx = weight * np.pi / 2 * self.hinge.radius * np.cos(angle)
        E, b = self.hinge.elastic_modulus, self.hinge.width
        G = E / (2 * (1 + self.poisson))
        along, bending = np.sum(dx / t) / (E * b), np.sum(12 * dx / t**3) / (E * b)
        across = np.sum(dx / t) / (SHEAR_FACTOR * G * b) + np.sum(12 * x**2 * dx / t**3) / (E * b)
        return 1 / np.array([along, across, bending])

    @cached_property
    def stations(self) -> np.ndarray:
        """Places x of the stress, shape (7,) [m]: the centre, and on either side up to where x / t(x)^2 is largest."""
        share = np.linspace(0.0, 1.0, 1001)
        farthest = share[np.argmax(share / self._thickness(share) ** 2)]
        return self.hinge.radius * farthest * np.linspace(-1.0, 1.0, 7)

    def stresses(self, along: Any, across: Any, moment: Any, size: Any = abs) -> list[Any]:
        """Return the stress at each of the `stations` [Pa], from forces [N] and moment [N.m], numbers or expressions.

        `size` is the absolute value of what they are.
        """
        b = self.hinge.width
        thick = self._thickness(self.stations / self.hinge.radius)
        return [
            size(along) / (b * t) + 6 / (b * t**2) * size(moment + x * across)
            for x, t in zip(self.stations.tolist(), thick.tolist(), strict=True)
        ]

    def _thickness(self, share: np.ndarray) -> np.ndarray:
        """Return t(x) [m] at shares x / r."""
        return self.hinge.thickness + 2 * self.hinge.radius * (1 - np.sqrt(1 - share**2))
