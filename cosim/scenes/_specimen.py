"""Payload of the SDelta's platform, as an argument of scenes that is passed on to parts."""

from dataclasses import dataclass
from typing import Any

from hfsa.cosim.scenes._given import given

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Payload:
    """Payload; by default the specimen of the thesis, a steel cube of 3 kg; with a mass alone, a cube of that mass.

    Attributes:
        mass: mass [kg], 0 for no payload.
        center: mass centre from S along the axes of the platform [m] (default: the cube's).
        inertia: inertia about the mass centre along the axes of the platform [kg.m2] (default: the cube's).
    """

    mass: float | None = None
    center: Triple | None = None
    inertia: Triple | None = None

    @property
    def arguments(self) -> dict[str, Any]:
        """The payload as arguments of a component."""
        return given(self, "payload")


SPECIMEN = Payload()
"""Steel cube of the thesis."""
