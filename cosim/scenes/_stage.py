"""Design of the 3-RRR stage, as arguments of scenes that are passed on to parts; by default that of the source.

A scene owns it once: `Stage` hands each part what it uses.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal

from hfsa.cosim.scenes._given import given

Kinematics = Literal["nominal", "calibrated"] | Path | Mapping[str, Any]
"""Name of a parameter set of the links, the path of the .toml file of one, or its table."""
Matrix = tuple[float, float, float, float, float, float, float, float, float]
"""A matrix of shape (3, 3), row by row."""


@dataclass(frozen=True)
class Links:
    """Links: crank L_AB, coupler L_BC, radius R, arm R0 [m], angles psi1, psi2 [rad] (those of the set)."""

    crank: float | None = None
    coupler: float | None = None
    radius: float | None = None
    psi1: float | None = None
    psi2: float | None = None
    arm: float | None = None


@dataclass(frozen=True)
class Hinge:
    """Hinges: elastic modulus, yield strength [Pa], width, thickness of the neck, radius of the notches [m]."""

    elastic_modulus: float | None = None
    width: float | None = None
    thickness: float | None = None
    radius: float | None = None
    yield_strength: float | None = None
    safety_factor: float | None = None


@dataclass(frozen=True)
class Masses:
    """Masses of the platform, a crank, a coupler [kg], inertia of the platform, of a crank about A [kg.m2]."""

    platform: float | None = None
    platform_inertia: float | None = None
    crank: float | None = None
    crank_inertia: float | None = None
    coupler: float | None = None


@dataclass(frozen=True)
class Outline:
    """Plate that the stage is cut from: lengths [m], Poisson's ratio, density [kg/m3] (`components`, `rrr_outline`)."""

    drive_height: float | None = None
    bolt_distance: float | None = None
    pad_height: float | None = None
    poisson: float | None = None


@dataclass(frozen=True)
class Stage:
    """Design of the stage, arguments of a scene by their own names; each property is arguments of a component.

    Attributes:
        kinematics: parameter set of the links.
        links, hinge, masses: dimensions, material and masses of its parts.
        jacobian, stiffness, mass: matrices on the elongations in place of those of its parts.
        contact, bolts, outline: contact with the stacks, joint of the platform, plate (levels
            `flexible_hinges` and `continuum`).
    """

    is_argument_group: ClassVar[bool] = True

    kinematics: Kinematics = "nominal"
    links: Links = Links()
    hinge: Hinge = Hinge()
    masses: Masses = Masses()
    jacobian: Matrix | None = None
    stiffness: Matrix | None = None
    mass: Matrix | None = None
    contact: Literal["locked", "slide", "ball", "stack"] = "stack"
    bolts: Literal["pin", "rigid"] = "pin"
    outline: Outline = Outline()

    @property
    def modes(self) -> int:
        """Number of modes at level `continuum`: pinned end blocks swing about their bolts."""
        return 6 if self.bolts == "pin" else 3

    def damping(self, level: str, damping_time: float) -> dict[str, float]:
        """Start value of the damping; modes of level `continuum` have a damping ratio of their own."""
        return {} if level == "continuum" else {"damping_time": damping_time}

    @property
    def itself(self) -> dict[str, Any]:
        """Of the stage."""
        plate = {"contact": self.contact, "bolts": self.bolts, **given(self.outline, "outline")}
        return {**self.dynamic, **plate}

    @property
    def kinematic(self) -> dict[str, Any]:
        """Of a part that converts poses and elongations."""
        known = {"kinematics": self.kinematics, **given(self.links, "links")}
        return known if self.jacobian is None else {**known, "jacobian": self.jacobian}

    @property
    def dynamic(self) -> dict[str, Any]:
        """Of a part that has a model of the stage."""
        known = {**self.kinematic, **given(self.hinge, "hinge"), **given(self.masses, "masses")}
        matrices = {"stiffness": self.stiffness, "mass": self.mass}
        return known | {name: matrix for name, matrix in matrices.items() if matrix is not None}

    @property
    def has_published_inertia(self) -> bool:
        """Whether its inertia on the elongations is that of a parameter set."""
        has_links = isinstance(self.kinematics, str) and self.links == Links() and self.jacobian is None
        return has_links and self.masses == Masses() and self.mass is None


THESIS = Stage()
"""The stage of the source."""
