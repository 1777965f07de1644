"""Dimensions of the SDelta, as arguments of scenes that are passed on to parts; by default those of the thesis.

A scene owns them once: `Machine` hands each part those that it uses.
"""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from hfsa.cosim.scenes._given import given

Triple = tuple[float, float, float]

_BASE_RADIUS = 0.45
"""Circumradius of the base of the thesis [m]."""


@dataclass(frozen=True)
class Geometry:
    """Circumradii [m] of the base triangle and of the platform's joint triangle."""

    base_radius: float | None = None
    platform_radius: float | None = None


@dataclass(frozen=True)
class Rods:
    """Rods: length, diameter [m], elastic modulus [Pa], density [kg/m3], tip stiffness [N/m] (the preset's)."""

    length: float | None = None
    diameter: float | None = None
    elastic_modulus: float | None = None
    density: float | None = None
    tip_stiffness: float | None = None


@dataclass(frozen=True)
class Shafts:
    """Shafts: length, diameter [m], shear modulus [Pa], torsional stiffness of the coupling [N.m/rad]."""

    length: float | None = None
    diameter: float | None = None
    shear_modulus: float | None = None
    coupling: float | None = None


@dataclass(frozen=True)
class Limbs:
    """Inertia of a rotor, of a screw [kg.m2], and of a tube [kg], [kg.m2]."""

    rotor_inertia: float | None = None
    screw_inertia: float | None = None
    tube_mass: float | None = None
    tube_inertia: float | None = None


@dataclass(frozen=True)
class Platform:
    """Mass [kg] and moments of inertia about S [kg.m2] of the platform without payload."""

    mass: float | None = None
    inertia: Triple | None = None


def reference_level(robot: str) -> str:
    """Return the level of a reference that converts a pose for a robot at a level: exact for finite motion."""
    return {"nonlinear": "exact", "auto": "auto"}.get(robot, "linear")


@dataclass(frozen=True)
class Machine:
    """Dimensions of the robot, arguments of a scene by their own names; each property is arguments of a component.

    Attributes:
        geometry, rods, shafts, limbs, platform: dimensions, material and inertia of its parts.
        gear: motor turns per turn of a tube.
        pitch: travel of a nut per turn of its motor [m].
        stiffness: preset of the stiffnesses.
        damping_model: the damping ratio in every mode, `modal`, or in the first and fourth mode, `rayleigh`.
    """

    is_argument_group: ClassVar[bool] = True

    geometry: Geometry = Geometry()
    rods: Rods = Rods()
    shafts: Shafts = Shafts()
    limbs: Limbs = Limbs()
    platform: Platform = Platform()
    gear: float | None = None
    pitch: float | None = None
    stiffness: Literal["ch3_full", "ch3_rods", "ch4", "ch4_full"] = "ch4"
    damping_model: Literal["modal", "rayleigh"] = "modal"

    @property
    def reach(self) -> float:
        """Half a side of the base, the farthest that a tube slides either way [m]."""
        return math.sqrt(3) / 2 * (_BASE_RADIUS if self.geometry.base_radius is None else self.geometry.base_radius)

    @property
    def kinematic(self) -> dict[str, Any]:
        """Of a part that converts motions of platform, tubes and motors."""
        return {**given(self.geometry, "geometry"), **self._transmission}

    @property
    def rigid(self) -> dict[str, Any]:
        """Of a part that has a model of the rigid robot."""
        return {**self.kinematic, **given(self.limbs, "limbs"), **given(self.platform, "platform")}

    @property
    def elastic(self) -> dict[str, Any]:
        """Of a part that has a model of the elastic robot."""
        springs = {"stiffness": self.stiffness, "damping_model": self.damping_model}
        return {**self.rigid, **springs, **given(self.rods, "rods"), **given(self.shafts, "shafts")}

    @property
    def drive(self) -> dict[str, Any]:
        """Of a drive."""
        return {**self._transmission, **given(self.limbs, "limbs"), **given(self.shafts, "shafts")}

    @property
    def _transmission(self) -> dict[str, Any]:
        return {name: value for name, value in (("gear", self.gear), ("pitch", self.pitch)) if value is not None}


THESIS = Machine()
"""The robot of the thesis."""
