"""The accelerometer of a scene, how it is mounted, and beside it an ideal one that shows the true acceleration."""

from dataclasses import dataclass
from typing import Any, Literal

from hfsa.cosim.systems.system import Component

Level = Literal["static", "planar", "spatial", "nonlinear"]
Design = Literal["mems", "optimum", "rapid_prototype"]

_ANY_DISPLACEMENT = 1.0
"""Travel of what never saturates [m]."""


@dataclass(frozen=True)
class Mounting:
    """How the sensor sits on what moves.

    Attributes:
        rotation: matrix by rows; its columns are the sensor's x, y and z along world axes.
        lever: from the reference point of what moves to the sensor, world axes [m].
    """

    rotation: tuple[float, float, float, float, float, float, float, float, float] = (1, 0, 0, 0, 1, 0, 0, 0, 1)
    lever: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def arguments(self) -> dict[str, tuple[float, ...]]:
        """The mounting as arguments of a component."""
        return {"mounting.rotation": self.rotation, "mounting.lever": self.lever}


UPRIGHT = Mounting()
"""Sensor axes along the world's, at the reference point."""


def accelerometer(level: Level, design: Design, mounting: Mounting, damping: float | None) -> Component:
    """Return the component `sensor`; `damping` is the ratio in its plane, the design's own without."""
    start: dict[str, Any] = {} if damping is None else {"damping_ratio.in_plane": damping}
    return Component("sensor", "tba_accelerometer", level, {"design": design, **mounting.arguments}, start)


def ideal(mounting: Mounting) -> Component:
    """Return the component `ideal`, whose estimate is the true acceleration along the axes of a sensor mounted so."""
    return Component("ideal", "tba_accelerometer", "static", mounting.arguments, {"travel": _ANY_DISPLACEMENT})
