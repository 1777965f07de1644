"""Drawings of a part, as data: points, lines and triangles with values, which `hfsa view PART` draws.

    def picture(*, kind: str = "tilted") -> Drawing:
        ends = np.array([[0.0, 0.0, 0.0], [0.05, 0.0, 0.0]])
        beam = Layer(ends, np.array([[0, 1]]), "body", "beam")
        return Drawing("One beam", [Panel([beam], unit="m")])

A part offers pictures by such a function beside `analyze`, with arguments of its own, and by `moving` the drawing of
what it does in a run: a panel, and the displacements of its layers as functions of the part's signals (`Moving`). How a
layer looks follows from its role and from the number of points of a cell; with values it is coloured, and the panel has
a scale. A drawing can be reduced to the kinds of panels that a reader wants, and to views of orthographic projection:

    drawing.showing(["posture"]).seen_from(["top", "front", "side"])
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from hfsa.components._modelling.errors import ModelError, one_of

Role = Literal["body", "rest", "moved", "axis", "mark"]
"""What a layer shows: a body, one at rest beside its moved self, the moved one, an axis, or a mark."""

View = Literal["top", "front", "side"]
"""Direction of an orthographic projection: against Z, along Y, or against X."""

_SEEN: dict[str, tuple[int, int]] = {"top": (0, 1), "front": (0, 2), "side": (1, 2)}
"""Axes that a view shows, to the right and upwards."""


@dataclass(frozen=True)
class Layer:
    """Cells that look alike; arrays may be given as lists.

    Attributes:
        points: coordinates, (points, 2) or (points, 3), in the unit of the panel.
        cells: indices of the points of each cell: (cells, 1) for points, (cells, 2) for lines, (cells, 3) for faces.
        role: what they show.
        name: entry in the legend, empty for none.
        values: value of every point, (points,), in the unit of the panel's scale; `None` without.
        texts: text beside every point; empty for none.
        notes: text on every cell, shown where a reader points at it; empty for none.
        rest: points at rest, of the shape of `points`, from which a layer that moves departs; `None` for one that
            does not.

    Raises:
        ModelError: arrays of other shapes; an index of no point; a number that is not finite.
    """

    points: NDArray[np.float64]
    cells: NDArray[np.int64]
    role: Role = "body"
    name: str = ""
    values: NDArray[np.float64] | None = None
    texts: Sequence[str] = ()
    notes: Sequence[str] = ()
    rest: NDArray[np.float64] | None = None

    def __post_init__(self):
        points, cells = np.asarray(self.points, dtype=float), np.asarray(self.cells, dtype=int)
        values = None if self.values is None else np.asarray(self.values, dtype=float)
        rest = None if self.rest is None else np.asarray(self.rest, dtype=float)
        if points.ndim != 2 or points.shape[1] not in (2, 3):
            raise ModelError(f"a layer's points are of shape {points.shape}, expected (points, 2) or (points, 3)")
        if cells.ndim != 2 or cells.shape[1] not in (1, 2, 3):
            raise ModelError(f"a layer's cells are of shape {cells.shape}, expected (cells, 1), (cells, 2), (cells, 3)")
        if cells.size and not 0 <= cells.min() <= cells.max() < len(points):
            raise ModelError(
                f"a layer's cells have indices from {cells.min()} to {cells.max()}, expected 0 to {len(points) - 1}"
            )
        if values is not None and values.shape != (len(points),):
            raise ModelError(f"a layer's values are of shape {values.shape}, expected ({len(points)},)")
        if rest is not None and rest.shape != points.shape:
            raise ModelError(f"a layer's points at rest are of shape {rest.shape}, expected {points.shape}")
        for words, numbers in (("points", points), ("values", values), ("points at rest", rest)):
            if numbers is not None and not np.all(np.isfinite(numbers)):
                raise ModelError(f"a layer's {words} have NaN or infinity, expected finite numbers")
        if self.texts and len(self.texts) != len(points):
            raise ModelError(f"a layer has {len(self.texts)} texts, expected {len(points)}, one per point")
        if self.notes and len(self.notes) != len(cells):
            raise ModelError(f"a layer has {len(self.notes)} notes, expected {len(cells)}, one per cell")
        one_of(self.role, get_args(Role), "a layer's role")
        for field, array in (("points", points), ("cells", cells), ("values", values), ("rest", rest)):
            object.__setattr__(self, field, array)


def departing(moved: Sequence[Layer], rest: Sequence[Layer]) -> list[Layer]:
    """Return layers that move, each from the points of the one at rest in its place."""
    return [replace(layer, rest=still.points) for layer, still in zip(moved, rest, strict=True)]


@dataclass(frozen=True)
class Panel:
    """Layers along common axes, of two or of three dimensions.

    Attributes:
        layers: layers, the first behind.
        unit: unit of the coordinates.
        axes: names of the axes, (2,) or (3,).
        title: heading; empty for none.
        quantity, quantity_unit: words and unit of the layers' values; empty without.
        kind: what it shows, in one word by which readers choose it, as `modes`; empty for none.

    Raises:
        ModelError: layers of different dimensions, or of another number than there are axes.
    """

    layers: Sequence[Layer]
    unit: str = "m"
    axes: Sequence[str] = ("X", "Y", "Z")
    title: str = ""
    quantity: str = ""
    quantity_unit: str = "1"
    kind: str = ""

    def __post_init__(self):
        found = {layer.points.shape[1] for layer in self.layers}
        if found != {len(self.axes)}:
            words = " and ".join(map(str, sorted(found))) or "no"
            raise ModelError(f"a panel has {len(self.axes)} axes and layers of {words} dimensions, expected the same")

    def seen_from(self, view: View) -> "Panel":
        """Return a panel of three dimensions in an orthographic projection; `ModelError` for one of two."""
        if len(self.axes) != 3:
            raise ModelError(f"the panel {self.title!r} is flat; of three dimensions there are views from {view}")
        seen = list(_SEEN[one_of(view, get_args(View), "a view")])
        layers = [
            replace(layer, points=layer.points[:, seen], rest=None if layer.rest is None else layer.rest[:, seen])
            for layer in self.layers
        ]
        title = f"{self.title}, {view}" if self.title else view
        return replace(self, layers=layers, axes=[self.axes[i] for i in seen], title=title)


@dataclass(frozen=True)
class Drawing:
    """A drawing: panels beside each other below a title; `ModelError` without a panel."""

    title: str
    panels: Sequence[Panel]

    def __post_init__(self):
        if not self.panels:
            raise ModelError(f"the drawing {self.title!r} has no panel, expected one or more")

    @property
    def kinds(self) -> list[str]:
        """Kinds of its panels, each once."""
        return list(dict.fromkeys(panel.kind for panel in self.panels if panel.kind))

    def showing(self, kinds: Sequence[str]) -> "Drawing":
        """Return the drawing of the panels of some kinds alone; `ModelError` for a kind that it has not."""
        for kind in kinds:
            if not self.kinds:
                raise ModelError(f"the drawing {self.title!r} has no kinds of panels to choose from, found {kind!r}")
            one_of(kind, self.kinds, "a kind of panel")
        return replace(self, panels=[panel for kind in kinds for panel in self.panels if panel.kind == kind])

    def seen_from(self, views: Sequence[View]) -> "Drawing":
        """Return the drawing with every panel in each of some views; `ModelError` for one of two dimensions."""
        return replace(self, panels=[panel.seen_from(view) for panel in self.panels for view in views])


@dataclass(frozen=True)
class Moving:
    """A part that moves in a run.

    Attributes:
        panel: the part where all signals are zero.
        signals: names of the inputs and outputs of the part that move it.
        displacements: from signals by name, (rows,) each in SI units, to the displacements of the points of every
            layer, (rows, points, axes) in the unit of the panel; `None` for a layer that stands still.
    """

    panel: Panel
    signals: Sequence[str]
    displacements: Callable[[Mapping[str, NDArray[np.float64]]], Sequence[NDArray[np.float64] | None]]


def columns(signals: Mapping[str, NDArray[np.float64]], name: str, count: int) -> NDArray[np.float64]:
    """Return the signals `name[1]` to `name[count]` as columns, (rows, count)."""
    return np.column_stack([signals[f"{name}[{i}]"] for i in range(1, count + 1)])


def named(name: str, count: int) -> list[str]:
    """Return `name[1]` to `name[count]`."""
    return [f"{name}[{i}]" for i in range(1, count + 1)]
