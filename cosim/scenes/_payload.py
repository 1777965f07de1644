"""What a beam module carries, as a scene's argument, handed on to the parts that have the same argument."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Payload:
    """A rigid body, by default a disc of 0.1 kg and 30 mm radius with its axis along X.

    Attributes:
        mass: [kg].
        inertia: about its mass centre along the module's axes [kg.m2].
        center: of mass, from the stage's reference point, X from base to stage [m].
    """

    mass: float = 0.1
    inertia: tuple[float, float, float] = (4.5e-5, 2.25e-5, 2.25e-5)
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def arguments(self, name: str) -> dict[str, Any]:
        """Return it as the argument `name` of a component."""
        return {f"{name}.mass": self.mass, f"{name}.inertia": self.inertia, f"{name}.center": self.center}


def module(kind: str, tilt: float | None) -> dict[str, Any]:
    """Return a beam module as arguments of a component."""
    return {"kind": kind} if tilt is None else {"kind": kind, "tilt": tilt}
