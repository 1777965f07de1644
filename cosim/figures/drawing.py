"""Figure of a drawing: points, lines and triangles in two or three dimensions, with a scale for coloured layers.

    save(drawing_figure(part.drawing()), Path("module.png"))

Both wings know drawings by their attributes alone (`components/_modelling/drawing.py`). Axes have equal scales. The
colours of a panel span the values of all its layers.
"""

from collections.abc import Sequence
from typing import Any, Protocol

import matplotlib as mpl
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from numpy.typing import NDArray

from hfsa.cosim.figures.style import ACCENT, COLOURS, INK, STYLE, save
from hfsa.cosim.signals.prefixes import prefixed

__all__ = ["ROLE_COLOURS", "VALUE_COLOURS", "drawing_figure", "save"]

VALUE_COLOURS = LinearSegmentedColormap.from_list("values", [COLOURS[0], "#f3e9d2", ACCENT])
"""Colours of values, from the least to the largest."""
_COLUMNS = 3
_ELEVATION, _AZIMUTH = 22, -58
_SHEER = 0.35
"""Opacity of faces without values."""
ROLE_COLOURS = {"body": COLOURS[0], "rest": "#a7aeb8", "moved": COLOURS[1], "axis": ACCENT, "mark": INK}
"""Colours of layers by their roles."""
_LINE: dict[str, dict[str, Any]] = {
    "body": {"linewidth": 2.6},
    "rest": {"linewidth": 1.6},
    "moved": {"linewidth": 2.0},
    "axis": {"linewidth": 1.2, "linestyle": (0, (6, 2, 1, 2))},
    "mark": {"linewidth": 0.8},
}


class Layer(Protocol):
    """Cells that look alike."""

    @property
    def points(self) -> NDArray[np.float64]: ...
    @property
    def cells(self) -> NDArray[np.int64]: ...
    @property
    def role(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def values(self) -> NDArray[np.float64] | None: ...
    @property
    def texts(self) -> Sequence[str]: ...
    @property
    def notes(self) -> Sequence[str]: ...
    @property
    def rest(self) -> NDArray[np.float64] | None: ...


class Panel(Protocol):
    """Layers along common axes."""

    @property
    def layers(self) -> Sequence[Layer]: ...
    @property
    def unit(self) -> str: ...
    @property
    def axes(self) -> Sequence[str]: ...
    @property
    def title(self) -> str: ...
    @property
    def quantity(self) -> str: ...
    @property
    def quantity_unit(self) -> str: ...


class Drawing(Protocol):
    """Panels below a title."""

    @property
    def title(self) -> str: ...
    @property
    def panels(self) -> Sequence[Panel]: ...


def drawing_figure(drawing: Drawing) -> Figure:
    """Return the figure of a drawing."""
    rows = -(-len(drawing.panels) // _COLUMNS)
    columns = -(-len(drawing.panels) // rows)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.4 * columns, 0.5 + 4.8 * rows), layout="constrained", dpi=160)
        figure.suptitle(drawing.title, fontsize=12.5, fontweight="bold")
        for place, panel in enumerate(drawing.panels, 1):
            is_solid = len(panel.axes) == 3
            axes = figure.add_subplot(rows, columns, place, **({"projection": "3d"} if is_solid else {}))
            _draw(figure, axes, panel, is_solid)
    return figure


def _draw(figure: Figure, axes: Any, panel: Panel, is_solid: bool) -> None:
    """Draw a panel."""
    everything = np.vstack([layer.points for layer in panel.layers])
    factor, unit = prefixed(float(np.abs(everything).max()), panel.unit)
    coloured = [layer.values for layer in panel.layers if layer.values is not None and layer.values.size]
    values = np.concatenate(coloured) if coloured else np.zeros(1)
    scale, shown = prefixed(float(np.abs(values).max()), panel.quantity_unit)
    span = Normalize(scale * values.min(), scale * values.max())
    for layer in panel.layers:
        if layer.cells.size:
            _draw_layer(axes, layer, factor, scale, span, is_solid)
        for text, point in zip(layer.texts, factor * layer.points, strict=False):
            axes.text(*point, f" {text}", fontsize=8)
    axes.set_title(panel.title, fontsize=9.5, loc="left")
    low, high = factor * everything.min(axis=0), factor * everything.max(axis=0)
    middle, half = (low + high) / 2, np.maximum(high - low, 1e-3 * (high - low).max()) / 2 * 1.05
    labels = [f"{name} ({unit})" if unit != "1" else name for name in panel.axes]
    for letter, label, center, size in zip("xyz", labels, middle, half, strict=False):
        getattr(axes, f"set_{letter}label")(label)
        getattr(axes, f"set_{letter}lim")(center - size, center + size)
    if is_solid:
        axes.set_box_aspect(np.maximum(half, 0.25 * half.max()), zoom=0.9)
        axes.view_init(_ELEVATION, _AZIMUTH)
        axes.locator_params(nbins=4)
    else:
        axes.set_aspect("equal")
    if coloured:
        bar = figure.colorbar(ScalarMappable(span, VALUE_COLOURS), ax=axes, pad=0.1 if is_solid else 0.02, shrink=0.8)
        bar.outline.set_visible(False)  # pyright: ignore[reportCallIssue]
        bar.set_label(panel.quantity if shown == "1" else f"{panel.quantity} ({shown})")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper left", fontsize=8, frameon=True)


def _draw_layer(axes: Any, layer: Layer, factor: float, scale: float, span: Normalize, is_solid: bool) -> None:
    """Draw the cells of a layer, with coordinates times `factor` and values times `scale`."""
    cells, size = factor * layer.points[layer.cells], layer.cells.shape[1]
    paint: dict[str, Any] = {"color": ROLE_COLOURS[layer.role]}
    if layer.values is not None:
        # a cell has one colour, that of the mean of its points
        paint = {"cmap": VALUE_COLOURS, "norm": span, "array": scale * layer.values[layer.cells].mean(axis=1)}
    label = layer.name or "_nolegend_"
    if size == 1:
        means = paint.pop("array", None)
        axes.scatter(*cells[:, 0].T, s=18 if means is None else 60, label=label, c=means, zorder=3, **paint)
        return
    kind: Any
    if size == 2:
        kind, look = (Line3DCollection if is_solid else LineCollection), _LINE[layer.role]
    else:
        kind = Poly3DCollection if is_solid else PolyCollection
        look = {"edgecolor": "none"} if "array" in paint else {"edgecolor": "none", "alpha": _SHEER}
    axes.add_collection(kind(list(cells), label=label, **paint, **look))
