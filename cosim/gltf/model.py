"""A 3D model as data: shapes, scenes that show them, and animations that displace them, in metres, with Z up.

A shape at weights w has its points at `points + sum_k w_k targets[k]`. An animation gives weights over time, so that it
plays any displacement that is a sum of a few fields: a mode exactly, a recorded motion by its principal components.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.figures.drawing import Layer, Panel
from hfsa.cosim.results.records import ResultsError
from hfsa.cosim.systems.units import conversion, known_base

_METRE = known_base("m")


@dataclass(frozen=True)
class Shape:
    """Points with cells, displaced along targets.

    Attributes:
        name: name of its node.
        points: points at rest, (points, 3) [m].
        cells: indices of the points of each cell, (cells, 1) points, (cells, 2) lines or (cells, 3) faces.
        role: what it shows (`Layer.role`), which gives its colour.
        colours: colour of every point, sRGB from 0 to 1, (points, 3); `None` for that of its role.
        targets: displacements of the points at weight 1, (points, 3) [m] each.
        notes: texts of its points and cells.
    """

    name: str
    points: NDArray[np.float64]
    cells: NDArray[np.int64]
    role: str = "body"
    colours: NDArray[np.float64] | None = None
    targets: Sequence[NDArray[np.float64]] = ()
    notes: Sequence[str] = ()


@dataclass(frozen=True)
class Animation:
    """Weights of shapes over time.

    Attributes:
        name: name.
        time: times [s], rising from 0, (rows,).
        weights: by place of the shape, its weights (rows, targets).
        facts: what a reader needs to know of it: magnification, slow motion.
    """

    name: str
    time: NDArray[np.float64]
    weights: Mapping[int, NDArray[np.float64]]
    facts: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Model:
    """A 3D model.

    Attributes:
        title: title.
        shapes: shapes.
        scenes: name of each scene, and the places of the shapes that it shows; viewers open the first.
        animations: animations.
    """

    title: str
    shapes: Sequence[Shape]
    scenes: Sequence[tuple[str, Sequence[int]]]
    animations: Sequence[Animation] = ()


def metres(panel: Panel) -> float:
    """Return the factor from the unit of a panel to metres; `ResultsError` for a unit that is no length."""
    base = known_base(panel.unit)
    found = None if base is None or _METRE is None else conversion(base, _METRE, is_relative=True)
    if found is None:
        unit = "without a unit" if panel.unit == "1" else f"in {panel.unit}"
        raise ResultsError(
            f"the panel {panel.title!r} has coordinates {unit}, expected a length: a 3D model is in metres; "
            "where a part takes a length, -p gives it one"
        )
    return found[0]


def solid(points: NDArray[np.float64], factor: float) -> NDArray[np.float64]:
    """Return points times a factor in three dimensions, a plane at height 0, (..., 3)."""
    found = np.zeros((*points.shape[:-1], 3))
    found[..., : points.shape[-1]] = factor * points
    return found


def notes_of(layer: Layer) -> list[str]:
    """Return the texts of a layer."""
    return [text for text in (*layer.texts, *layer.notes) if text]
