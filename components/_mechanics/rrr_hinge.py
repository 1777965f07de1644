"""Flexure hinge of the 3-RRR stage: a neck between two semicircular notches, and the bending stress in it.

    K_b = 2 E b t^(5/2) / (9 pi r^(1/2))     (eq 2.3)         sigma = 6 K_b |phi| / (b t^2)     (eqs 2.4, 2.6)

The formula holds for t << r. Integration over the true profile gives 45.43 N.m/rad, 11 % more; the value of the source
is kept.
"""

import math
from dataclasses import dataclass, fields
from typing import Any

from hfsa.components._modelling.errors import ModelError

_MODULI = (1e3, 1e15)
"""Moduli of what a stage may be made of, from gels to beyond diamond [Pa]."""


def bending_stiffness(modulus: Any, width: Any, thickness: Any, radius: Any) -> Any:
    """Return K_b [N.m/rad], a number or an expression."""
    return 2 * modulus * width * thickness**2.5 / (9 * math.pi * radius**0.5)


def stress_per_angle(stiffness: Any, width: Any, thickness: Any) -> Any:
    """Return the bending stress per angle [Pa/rad], a number or an expression."""
    return 6 * stiffness / (width * thickness**2)


@dataclass(frozen=True)
class Hinge:
    """Dimensions and material of each of the nine hinges; by default those of the source (sec. 2.2).

    Attributes:
        elastic_modulus: Young's modulus E [Pa].
        width: b, width across the plane of the stage [m].
        thickness: t, thickness of the neck [m].
        radius: r, radius of the notches [m].
        yield_strength: yield strength [Pa] (eq 3.6).
        safety_factor: yield strength / allowable stress, 1 or more.

    Raises:
        ModelError: a value that is not finite or not above 0; a safety factor below 1.
    """

    elastic_modulus: float = 101e9
    width: float = 10e-3
    thickness: float = 0.8e-3
    radius: float = 1e-3
    yield_strength: float = 350e6
    safety_factor: float = 1.5

    def __post_init__(self):
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value > 0):
                raise ModelError(f"hinge.{field.name} is {value:g}, expected a finite number above 0")
        if not _MODULI[0] <= self.elastic_modulus <= _MODULI[1]:
            raise ModelError(
                f"hinge.elastic_modulus is {self.elastic_modulus:g} Pa, expected {_MODULI[0]:g} to {_MODULI[1]:g} Pa"
            )
        if self.safety_factor < 1:
            raise ModelError(f"hinge.safety_factor is {self.safety_factor:g}, expected 1 or more")

    @property
    def stiffness(self) -> float:
        """K_b, bending stiffness [N.m/rad]."""
        return bending_stiffness(self.elastic_modulus, self.width, self.thickness, self.radius)

    @property
    def stress_per_angle(self) -> float:
        """Bending stress per angle [Pa/rad]."""
        return stress_per_angle(self.stiffness, self.width, self.thickness)

    @property
    def allowed_stress(self) -> float:
        """Allowable stress, yield strength / safety factor [Pa]."""
        return self.yield_strength / self.safety_factor

    @property
    def allowed_angle(self) -> float:
        """Angle at the allowable stress [rad] (eq 2.6)."""
        return self.allowed_stress / self.stress_per_angle


THESIS_HINGE = Hinge()
"""Hinge of the source."""

HINGES = ("A1", "A2", "A3", "B1", "B2", "B3", "C1", "C2", "C3")
"""The nine hinges, in the order of their angles."""
