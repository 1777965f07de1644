"""Kinds of modules of beams and of sheets: the arguments of each kind and its normalised compliance.

    three_beam          beams along X, tips on a circle of radius r; three beams or more
    double              a three_beam in series with a mirrored one of the larger outer_radius
    tilted              beams tilted by beta; their axes meet at x = r / tan(beta) in front of the stage
    inverted            beams tilted by -beta, tips on the radius r + sin(beta); their axes meet behind the base
    double_tilted       tilted in series with inverted; both sets of axes meet in one point
    double_tilted_four  double_tilted with four beams in each half; 3/4 of the compliance of three
    parallelogram       two sheets, wide along Z, at y = +-spacing / 2
    four_sheet          four sheets, radially wide, at spacing / 2 from the axis
    double_four_sheet   a four_sheet in series with a mirrored one of the larger outer_spacing

Lengths are normalised by the length of one beam. The compliance C refers to the centre of the tips of the beams on the
stage.

Source: the paper of 2013 on beam modules. `one_on_another`, `mirrored` and `ring` are in `beam_assembly.py`.
"""

import math
from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np

from hfsa.components._mechanics.beam_assembly import cross, mirrored, one_on_another, pair, ring, side_by_side

KindName = Literal[
    "three_beam",
    "double",
    "tilted",
    "inverted",
    "double_tilted",
    "double_tilted_four",
    "parallelogram",
    "four_sheet",
    "double_four_sheet",
]


class Geometry(NamedTuple):
    """Positions of the beams of a module, normalised by the length of one; arguments of other kinds have no effect.

    Attributes:
        radius, outer_radius: radii of the circles of tips.
        tilt: angle beta of the beams against the axis [rad].
        spacing, outer_spacing: distances of opposite sheets.
        count: number of beams or sheets between two bodies.
    """

    radius: float
    outer_radius: float
    tilt: float
    spacing: float
    outer_spacing: float
    count: int  # pyright: ignore[reportIncompatibleMethodOverride]


Stiffnesses = list[np.ndarray]
"""Stiffness of each beam in its own frame, shape (6, 6), beams on the stage first."""


class ModuleKind(NamedTuple):
    """One kind of module.

    Attributes:
        element: `beam` or `sheet`.
        arguments: fields of `Geometry` that define the module.
        count: number of beams between two bodies; the default where `count` is an argument.
        layers: number of modules in series, 1 or 2.
        compliance: function that returns C, shape (6, 6), from the geometry and the stiffnesses of `layers` times
            `count` beams.
    """

    element: Literal["beam", "sheet"]
    arguments: tuple[str, ...]
    count: int  # pyright: ignore[reportIncompatibleMethodOverride]
    layers: int
    compliance: Callable[[Geometry, Stiffnesses], np.ndarray]


def _three_beam(g: Geometry, K: Stiffnesses) -> np.ndarray:
    """Three beams: C22 = (r^2 d + 8) / (36 (r^2 d + 2)), C26 = 1 / (3 (r^2 d + 2)), C44 = 1 / (3 delta + 36 r^2)."""
    return side_by_side(K, ring(g.radius, 0.0, g.count))


def _double(g: Geometry, K: Stiffnesses) -> np.ndarray:
    """Three beams inside three others that run back: the stage is at the height of the base."""
    outer = side_by_side(K[g.count :], ring(g.outer_radius, 0.0, g.count))
    return one_on_another(_three_beam(g, K[: g.count]), mirrored(outer), 1.0)


def _tilted(g: Geometry, K: Stiffnesses) -> np.ndarray:
    """Beams whose axes meet in front of the stage."""
    return side_by_side(K, ring(g.radius, g.tilt, g.count))


def _inverted(g: Geometry, K: Stiffnesses) -> np.ndarray:
    """The tilted module upside down: the axes meet behind the base, the tips are at the feet of the tilted one."""
    return side_by_side(K, ring(g.radius + math.sin(g.tilt), -g.tilt, g.count))


def _double_tilted(g: Geometry, K: Stiffnesses) -> np.ndarray:
    """A tilted module on an inverted one; the offset makes the intersections of both sets of axes coincide."""
    inner, outer = _tilted(g, K[: g.count]), _inverted(g, K[g.count :])
    return one_on_another(inner, outer, -(2 * g.radius / math.tan(g.tilt) + math.cos(g.tilt)))


def _parallelogram(g: Geometry, K: Stiffnesses) -> np.ndarray:
    """Two sheets side by side."""
    return side_by_side(K, pair(g.spacing))


def _four_sheet(g: Geometry, K: Stiffnesses) -> np.ndarray:
    """Four sheets around the axis."""
    return side_by_side(K, cross(g.spacing))


def _double_four_sheet(g: Geometry, K: Stiffnesses) -> np.ndarray:
    """Four sheets inside four others that run back."""
    outer = side_by_side(K[g.count :], cross(g.outer_spacing))
    return one_on_another(_four_sheet(g, K[: g.count]), mirrored(outer), 1.0)


_TILTED = ("radius", "tilt", "count")

KINDS: dict[str, ModuleKind] = {
    "three_beam": ModuleKind("beam", ("radius", "count"), 3, 1, _three_beam),
    "double": ModuleKind("beam", ("radius", "outer_radius", "count"), 3, 2, _double),
    "tilted": ModuleKind("beam", _TILTED, 3, 1, _tilted),
    "inverted": ModuleKind("beam", _TILTED, 3, 1, _inverted),
    "double_tilted": ModuleKind("beam", _TILTED, 3, 2, _double_tilted),
    "double_tilted_four": ModuleKind("beam", ("radius", "tilt"), 4, 2, _double_tilted),
    "parallelogram": ModuleKind("sheet", ("spacing",), 2, 1, _parallelogram),
    "four_sheet": ModuleKind("sheet", ("spacing",), 4, 1, _four_sheet),
    "double_four_sheet": ModuleKind("sheet", ("spacing", "outer_spacing"), 4, 2, _double_four_sheet),
}
"""All kinds by name."""
