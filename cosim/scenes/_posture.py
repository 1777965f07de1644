"""Posture of the SDelta, as an argument of scenes that is passed on to parts."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Posture:
    """Pose of the platform: `rotation`, three intrinsic z-x-y angles in degrees; `position` of S in metres."""

    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    position: tuple[float, float, float] = (0.0, 0.0, 0.150)

    @property
    def arguments(self) -> dict[str, tuple[float, ...]]:
        """The posture as arguments of a component."""
        return {"posture.rotation": self.rotation, "posture.position": self.position}


SYMMETRIC = Posture()
"""Posture with the platform level and centred."""
