"""What the SDelta's platform carries, as a scene's argument, handed on to every part that has the same argument."""

from dataclasses import dataclass
from typing import Any

from hfsa.cosim.scenes._given import given

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Payload:
    """By default the thesis' specimen, a steel cube of 3 kg; with a mass alone, a steel cube of that mass.

    Attributes:
        mass: [kg]; 0 for the platform alone.
        center: centre of mass from S in the platform's axes [m]; the cube's.
        inertia: about it, along the platform's axes [kg.m2]; the cube's.
    """

    mass: float | None = None
    center: Triple | None = None
    inertia: Triple | None = None

    @property
    def arguments(self) -> dict[str, Any]:
        """The payload as arguments of a component."""
        return given(self, "payload")


SPECIMEN = Payload()
"""The thesis' cube."""
