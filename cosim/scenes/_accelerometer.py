"""Accelerometer of a scene with its mounting, and an ideal accelerometer that shows the true acceleration."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from hfsa.cosim.scenes._posture import Posture
from hfsa.cosim.systems.system import Component

Level = Literal["static", "planar", "spatial", "nonlinear"]
Design = Literal["mems", "optimum", "rapid_prototype"]

_ANY_DISPLACEMENT = 1.0
"""Travel of the ideal accelerometer, which never saturates [m]."""


@dataclass(frozen=True)
class Mounting:
    """Mounting of the sensor on a moving body.

    Attributes:
        rotation: matrix by rows; its columns are the sensor's x, y and z along the axes of `frame`.
        lever: vector from the reference point of the body to the sensor along the axes of `frame` [m].
        frame: `world`, or `platform`, whose axes turn with the posture of the body as a bolted sensor does.
    """

    rotation: tuple[float, float, float, float, float, float, float, float, float] = (1, 0, 0, 0, 1, 0, 0, 0, 1)
    lever: tuple[float, float, float] = (0.0, 0.0, 0.0)
    frame: Literal["world", "platform"] = "world"

    def at(self, posture: Posture) -> "Mounting":
        """Return the mounting along world axes on a body at a posture."""
        if self.frame == "world":
            return self
        Q = posture.matrix
        rotation, lever = Q @ np.reshape(self.rotation, (3, 3)), Q @ np.array(self.lever)
        return Mounting(tuple(rotation.ravel().tolist()), tuple(lever.tolist()))

    @property
    def arguments(self) -> dict[str, tuple[float, ...]]:
        """The mounting as arguments of a component."""
        return {"mounting.rotation": self.rotation, "mounting.lever": self.lever}


UPRIGHT = Mounting()
"""Sensor axes along the world axes, at the reference point."""


def accelerometer(level: Level, design: Design, mounting: Mounting, damping: float | None) -> Component:
    """Return the component `sensor`; `damping` is the damping ratio in its plane (default: the design's)."""
    start: dict[str, Any] = {} if damping is None else {"damping_ratio.in_plane": damping}
    return Component("sensor", "tba_accelerometer", level, {"design": design, **mounting.arguments}, start)


def ideal(mounting: Mounting) -> Component:
    """Return the component `ideal`; its estimate is the true acceleration along the axes of this mounting."""
    return Component("ideal", "tba_accelerometer", "static", mounting.arguments, {"travel": _ANY_DISPLACEMENT})
