"""Payload of a beam module, as an argument of scenes that is passed on to parts."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Payload:
    """Rigid body; by default a disc of 0.1 kg and 30 mm radius with its axis along X.

    Attributes:
        mass: mass [kg].
        inertia: moments about the mass centre along the axes of the module [kg.m2].
        center: mass centre from the reference point of the stage, X from base to stage [m].
    """

    mass: float = 0.1
    inertia: tuple[float, float, float] = (4.5e-5, 2.25e-5, 2.25e-5)
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def arguments(self, name: str) -> dict[str, Any]:
        """Return the payload as the argument `name` of a component."""
        return {f"{name}.mass": self.mass, f"{name}.inertia": self.inertia, f"{name}.center": self.center}


def module(kind: str, tilt: float | None) -> dict[str, Any]:
    """Return a beam module as arguments of a component."""
    return {"kind": kind} if tilt is None else {"kind": kind, "tilt": tilt}
