"""Kinds of modules of beams and of sheets: the arguments of each kind, and where its beams are.

    three_beam          beams along X, tips on a circle of radius r; three beams or more
    double              a three_beam in series with a mirrored one of the larger outer_radius
    tilted              beams tilted by beta; their axes meet at x = r / tan(beta) in front of the stage
    inverted            beams tilted by -beta, tips on the radius r + sin(beta); their axes meet behind the base
    double_tilted       tilted in series with inverted, whose tilt may be another; both sets of axes meet in one point
    double_tilted_four  double_tilted with four beams in each half; 3/4 of the compliance of three
    parallelogram       two sheets, wide along Z, at y = +-spacing / 2
    four_sheet          four sheets, radially wide, at spacing / 2 from the axis
    double_four_sheet   a four_sheet in series with a mirrored one of the larger outer_spacing
    sheet_ring          sheets, radially wide, at spacing / 2 from the axis; three or more
    double_sheet_ring   a sheet_ring in series with a mirrored one on the same circle, its sheets between the others

Lengths are normalised by the length of one beam. The reference point is the centre of the tips on the platform.

Source: the paper of 2013 on beam modules; double_sheet_ring with four sheets per body is Figure B.2b. Not in it: other
numbers of sheets, and two tilts.
"""

import math
from collections.abc import Callable
from typing import Literal, NamedTuple

from hfsa.components._mechanics.beam_assembly import BASE, PLATFORM, Place, backwards, between, pair, ring

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
    "sheet_ring",
    "double_sheet_ring",
    "assembly",
]
"""Kinds of `KINDS`, and `assembly`, whose beams a file lists (`beam_list.py`)."""

ASSEMBLY = "assembly"

_MIDDLE = "middle"


class Geometry(NamedTuple):
    """Positions of the beams of a module, normalised by the length of one; arguments of other kinds have no effect.

    Attributes:
        radius, outer_radius: radii of the circles of tips.
        tilt, outer_tilt: angles beta of the beams on the platform and of those on the base against the axis [rad].
        spacing, outer_spacing: distances of opposite sheets.
        count: number of beams or sheets between two bodies.
    """

    radius: float
    outer_radius: float
    tilt: float
    outer_tilt: float
    spacing: float
    outer_spacing: float
    count: int  # pyright: ignore[reportIncompatibleMethodOverride]


class ModuleKind(NamedTuple):
    """One kind of module.

    Attributes:
        element: `beam` or `sheet`.
        arguments: fields of `Geometry` that define the module.
        count: number of beams between two bodies; the default where `count` is an argument.
        layers: number of modules in series, 1 or 2.
        places: function that returns the places of `layers` times `count` beams, those on the platform first.
    """

    element: Literal["beam", "sheet"]
    arguments: tuple[str, ...]
    count: int  # pyright: ignore[reportIncompatibleMethodOverride]
    layers: int
    places: Callable[[Geometry], list[Place]]


def _three_beam(g: Geometry) -> list[Place]:
    """Three beams: C22 = (r^2 d + 8) / (36 (r^2 d + 2)), C26 = 1 / (3 (r^2 d + 2)), C44 = 1 / (3 delta + 36 r^2)."""
    return ring(g.radius, 0.0, g.count)


def _double(g: Geometry) -> list[Place]:
    """Three beams inside three others that run back: the platform is at the height of the base."""
    return _there_and_back(_three_beam(g), ring(g.outer_radius, 0.0, g.count))


def _tilted(g: Geometry) -> list[Place]:
    """Beams whose axes meet in front of the platform."""
    return ring(g.radius, g.tilt, g.count)


def _inverted(g: Geometry) -> list[Place]:
    """The tilted module upside down: the axes meet behind the base, the tips are at the feet of the tilted one."""
    return ring(g.radius + math.sin(g.tilt), -g.tilt, g.count)


def _double_tilted(g: Geometry) -> list[Place]:
    """A tilted module on an inverted one; the offset makes the intersections of both sets of axes coincide."""
    foot = g.radius + math.sin(g.outer_tilt)
    outer = ring(foot, -g.outer_tilt, g.count)
    ahead = g.radius / math.tan(g.tilt) + foot / math.tan(g.outer_tilt)
    return between(_tilted(g), _MIDDLE, PLATFORM) + between(outer, BASE, _MIDDLE, ahead)


def _parallelogram(g: Geometry) -> list[Place]:
    """Two sheets side by side."""
    return pair(g.spacing)


def _sheet_ring(g: Geometry) -> list[Place]:
    """Sheets around the axis."""
    return ring(g.spacing / 2, 0.0, g.count)


def _double_four_sheet(g: Geometry) -> list[Place]:
    """Four sheets inside four others that run back."""
    return _there_and_back(_sheet_ring(g), ring(g.outer_spacing / 2, 0.0, g.count))


def _double_sheet_ring(g: Geometry) -> list[Place]:
    """Sheets around the axis between as many others that run back."""
    return _there_and_back(_sheet_ring(g), ring(g.spacing / 2, 0.0, g.count, math.pi / g.count))


def _there_and_back(inner: list[Place], outer: list[Place]) -> list[Place]:
    """Return an inner module on a body that an outer one, reflected along X, joins to the base beside the platform."""
    return between(inner, _MIDDLE, PLATFORM) + between(backwards(outer), BASE, _MIDDLE, -1.0)


_TILTED = ("radius", "tilt", "count")

KINDS: dict[str, ModuleKind] = {
    "three_beam": ModuleKind("beam", ("radius", "count"), 3, 1, _three_beam),
    "double": ModuleKind("beam", ("radius", "outer_radius", "count"), 3, 2, _double),
    "tilted": ModuleKind("beam", _TILTED, 3, 1, _tilted),
    "inverted": ModuleKind("beam", _TILTED, 3, 1, _inverted),
    "double_tilted": ModuleKind("beam", ("radius", "tilt", "outer_tilt", "count"), 3, 2, _double_tilted),
    "double_tilted_four": ModuleKind("beam", ("radius", "tilt", "outer_tilt"), 4, 2, _double_tilted),
    "parallelogram": ModuleKind("sheet", ("spacing",), 2, 1, _parallelogram),
    "four_sheet": ModuleKind("sheet", ("spacing",), 4, 1, _sheet_ring),
    "double_four_sheet": ModuleKind("sheet", ("spacing", "outer_spacing"), 4, 2, _double_four_sheet),
    "sheet_ring": ModuleKind("sheet", ("spacing", "count"), 4, 1, _sheet_ring),
    "double_sheet_ring": ModuleKind("sheet", ("spacing", "count"), 4, 2, _double_sheet_ring),
}
"""All kinds by name but `assembly`."""
