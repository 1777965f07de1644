"""Posture of the SDelta, as an argument of scenes that is passed on to parts."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Posture:
    """Pose of the platform.

    Attributes:
        rotation: angles of intrinsic rotations about z, x, y in degrees.
        position: position of S, the centroid of the platform's joints [m].
    """

    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    position: tuple[float, float, float] = (0.0, 0.0, 0.150)

    @property
    def arguments(self) -> dict[str, tuple[float, ...]]:
        """The posture as arguments of a component."""
        return {"posture.rotation": self.rotation, "posture.position": self.position}

    @property
    def matrix(self) -> np.ndarray:
        """Attitude, platform to world, shape (3, 3): rotations about z, then the new x, then the new y."""
        z, x, y = np.deg2rad(self.rotation)
        about_z = np.array([[np.cos(z), -np.sin(z), 0.0], [np.sin(z), np.cos(z), 0.0], [0.0, 0.0, 1.0]])
        about_x = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(x), -np.sin(x)], [0.0, np.sin(x), np.cos(x)]])
        about_y = np.array([[np.cos(y), 0.0, np.sin(y)], [0.0, 1.0, 0.0], [-np.sin(y), 0.0, np.cos(y)]])
        return about_z @ about_x @ about_y


SYMMETRIC = Posture()
"""Posture with the platform level and centred."""
