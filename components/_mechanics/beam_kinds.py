"""The modules of beams and of sheets by name: what each is described by, and its normalised compliance.

    three_beam          beams along X, tips on a circle of the radius r; any number from three on
    double              one three_beam on another of the larger outer_radius, which comes from the other side
    tilted              beams tilted by beta, so that their axes meet at x = r / tan(beta) in front of the stage
    inverted            beams tilted by -beta, tips on the radius r + sin(beta): the axes meet behind the base
    double_tilted       tilted on inverted, so that both sets of axes meet in one point
    double_tilted_four  the same of four beams each; 3/4 of the compliance of three
    parallelogram       two sheets, wide along Z, at y = +-spacing / 2
    four_sheet          four sheets, radially wide, at spacing / 2 from the axis
    double_four_sheet   one four_sheet on another of the larger outer_spacing, as double

All lengths are by that of one beam. C is given at the stage, at the centre of the tips of its own beams.

Source: the paper of 2013 on beam modules; `one_on_another`, `mirrored` and `ring` of `_beam_assembly` say how.
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
    """Where the beams of a module are, by the length of one; what its kind does not have has no effect.

    Attributes:
        radius, outer_radius: of the circles of tips.
        tilt: beta [rad].
        spacing, outer_spacing: of opposite sheets.
        count: beams or sheets between two bodies.
    """

    radius: float
    outer_radius: float
    tilt: float
    spacing: float
    outer_spacing: float
    count: int


Stiffnesses = list[np.ndarray]
"""Of each beam in its own frame, shape (6, 6), those on the stage first."""


class Kind(NamedTuple):
    """One kind of module.

    Attributes:
        element: what it is made of.
        arguments: names in `Geometry` that describe it.
        count: beams between two bodies, unless `count` is an argument and says otherwise.
        layers: one, or two where a module stands on another.
        compliance: C from the geometry and the stiffnesses of `layers` times `count` beams, shape (6, 6).
    """

    element: Literal["beam", "sheet"]
    arguments: tuple[str, ...]
    count: int
    layers: int
    compliance: Callable[[Geometry, Stiffnesses], np.ndarray]


def _three_beam(g: Geometry, K: Stiffnesses) -> np.ndarray:
    """C22 = (r^2 d + 8) / (36 (r^2 d + 2)), C26 = 1 / (3 (r^2 d + 2)), C44 = 1 / (3 delta + 36 r^2) of three beams."""
    return side_by_side(K, ring(g.radius, 0.0, g.count))


def _double(g: Geometry, K: Stiffnesses) -> np.ndarray:
    """Three beams within three others that go back: the stage comes out where the base begins."""
    outer = side_by_side(K[g.count :], ring(g.outer_radius, 0.0, g.count))
    return one_on_another(_three_beam(g, K[: g.count]), mirrored(outer), 1.0)


def _tilted(g: Geometry, K: Stiffnesses) -> np.ndarray:
    """Beams whose axes meet in front of the stage."""
    return side_by_side(K, ring(g.radius, g.tilt, g.count))


def _inverted(g: Geometry, K: Stiffnesses) -> np.ndarray:
    """The same upside down: their axes meet behind the stage, their tips are where the others had their feet."""
    return side_by_side(K, ring(g.radius + math.sin(g.tilt), -g.tilt, g.count))


def _double_tilted(g: Geometry, K: Stiffnesses) -> np.ndarray:
    """The offset brings the centre ahead of the tilted half onto the one behind the inverted half."""
    inner, outer = _tilted(g, K[: g.count]), _inverted(g, K[g.count :])
    return one_on_another(inner, outer, -(2 * g.radius / math.tan(g.tilt) + math.cos(g.tilt)))


def _parallelogram(g: Geometry, K: Stiffnesses) -> np.ndarray:
    """Two sheets side by side."""
    return side_by_side(K, pair(g.spacing))


def _four_sheet(g: Geometry, K: Stiffnesses) -> np.ndarray:
    """Four sheets around the axis."""
    return side_by_side(K, cross(g.spacing))


def _double_four_sheet(g: Geometry, K: Stiffnesses) -> np.ndarray:
    """Four sheets within four others that go back."""
    outer = side_by_side(K[g.count :], cross(g.outer_spacing))
    return one_on_another(_four_sheet(g, K[: g.count]), mirrored(outer), 1.0)


_TILTED = ("radius", "tilt", "count")

KINDS: dict[str, Kind] = {
    "three_beam": Kind("beam", ("radius", "count"), 3, 1, _three_beam),
    "double": Kind("beam", ("radius", "outer_radius", "count"), 3, 2, _double),
    "tilted": Kind("beam", _TILTED, 3, 1, _tilted),
    "inverted": Kind("beam", _TILTED, 3, 1, _inverted),
    "double_tilted": Kind("beam", _TILTED, 3, 2, _double_tilted),
    "double_tilted_four": Kind("beam", ("radius", "tilt"), 4, 2, _double_tilted),
    "parallelogram": Kind("sheet", ("spacing",), 2, 1, _parallelogram),
    "four_sheet": Kind("sheet", ("spacing",), 4, 1, _four_sheet),
    "double_four_sheet": Kind("sheet", ("spacing", "outer_spacing"), 4, 2, _double_four_sheet),
}
"""All kinds by name."""
