"""Payload of a beam module, as an argument of scenes that is passed on to parts."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
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


Beams = Path | Mapping[str, Any]
"""The path of a .toml file that lists beams, or its table."""


def module(kind: str, tilt: float | None, beams: Beams | None) -> dict[str, Any]:
    """Return a beam module as arguments of a component."""
    arguments = {"kind": kind, "tilt": tilt, "beams": beams}
    return {name: value for name, value in arguments.items() if value is not None}
