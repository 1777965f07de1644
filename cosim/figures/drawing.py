"""Figure of a drawing: points, lines and triangles in two or three dimensions, with a scale for coloured layers.

    save(drawing_figure(part.drawing()), Path("module.png"))

Both wings know drawings by their attributes alone (`components/_modelling/drawing.py`). Axes have equal scales. The
colours of a panel span the values of all its layers. Panels of three dimensions are seen in parallel projection, all at
one scale, with a length and the directions of their axes in a corner: modes are compared by eye.
"""

import math
from collections.abc import Sequence
from typing import Any, Protocol

import matplotlib as mpl
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from hfsa.cosim.figures.labels import Text, place_texts
from hfsa.cosim.figures.style import ACCENT, COLOURS, INK, STYLE, save
from hfsa.cosim.signals.prefixes import prefixed

__all__ = ["ROLE_COLOURS", "VALUE_COLOURS", "draw", "drawing_figure", "save"]

VALUE_COLOURS = LinearSegmentedColormap.from_list("values", [COLOURS[0], "#f3e9d2", ACCENT])
"""Colours of values, from the least to the largest."""
_COLUMNS = 3
_WIDTHS = {1: 7.0, 2: 5.6, 3: 4.6}
"""Width of a panel by the number of columns [inch]."""
_LABELS, _HEADING = 0.75, 0.35
"""Room for the labels of an axis, and for a heading [inch]."""
_SHAPE = (0.4, 1.3)
"""Least and largest height of a panel, relative to its width."""
_ELEVATION, _AZIMUTH = math.radians(24), math.radians(-58)
"""Direction from which panels of three dimensions are seen."""
_TO_PAPER = np.array(
    [
        [-math.sin(_AZIMUTH), math.cos(_AZIMUTH), 0.0],
        [-math.cos(_AZIMUTH) * math.sin(_ELEVATION), -math.sin(_AZIMUTH) * math.sin(_ELEVATION), math.cos(_ELEVATION)],
    ]
)
"""From three coordinates to those on the paper, to the right and upwards."""
_TO_EYE = np.array(
    [math.cos(_AZIMUTH) * math.cos(_ELEVATION), math.sin(_AZIMUTH) * math.cos(_ELEVATION), math.sin(_ELEVATION)]
)
_MARGIN, _CORNER = 0.05, 0.11
"""Margin around a panel, and length of the directions in its corner, relative to its size."""
_THIN, _EDGE = 1e-6, 1.6
"""Area of a face, relative to the square of its size, below which it is seen from its side; and its line width then."""
_HALO = [withStroke(linewidth=2.5, foreground="white")]
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
    @property
    def kind(self) -> str: ...


class Drawing(Protocol):
    """Panels below a title."""

    @property
    def title(self) -> str: ...
    @property
    def panels(self) -> Sequence[Panel]: ...


def draw(drawing: Any, show: Sequence[str] = (), views: Sequence[str] = ()) -> Figure:
    """Return the figure of a part's drawing, as `hfsa view` draws it into a picture.

    Args:
        drawing: what `available_parts()["sdelta"].drawing()` returns, a `Drawing` of `hfsa.components`.
        show: kinds of panels to show, such as `modes` (default: all).
        views: views of each panel in three dimensions, of `top`, `front` and `side` (default: one oblique view).

    Raises:
        ModelError: a kind that the drawing has not; a view that is none, or of a flat panel.
    """
    chosen = drawing.showing(show) if show else drawing
    return drawing_figure(chosen.seen_from(views) if views else chosen)


def drawing_figure(drawing: Drawing) -> Figure:
    """Return the figure of a drawing."""
    rows = -(-len(drawing.panels) // _COLUMNS)
    columns = -(-len(drawing.panels) // rows)
    width, boxes = _WIDTHS[columns], _boxes(drawing.panels)
    shapes = [_shape(*each) for each in zip(drawing.panels, boxes, strict=True)]
    heights = [_HEADING + width * max(shapes[row * columns : (row + 1) * columns]) for row in range(rows)]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(width * columns, 0.5 + sum(heights)), layout="constrained", dpi=160)
        figure.suptitle(drawing.title, fontsize=12.5, fontweight="bold")
        grid = figure.add_gridspec(rows, columns, height_ratios=heights)
        texts = []
        for place, panel in enumerate(drawing.panels):
            axes = figure.add_subplot(grid[place // columns, place % columns])
            texts.append((axes, _draw(figure, axes, panel, boxes[place])))
        drawn = [zip(*axes.get_legend_handles_labels(), strict=True) for axes, _ in texts]
        entries = {label: handle for pairs in drawn for handle, label in pairs}
        if entries:
            figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=6, fontsize=9)
        figure.draw_without_rendering()
        figure.set_layout_engine("none")  # freeze the layout before placing the texts
        for axes, words in texts:
            place_texts(axes, words, fontsize=8, path_effects=_HALO, zorder=20)
    return figure


def _is_solid(panel: Panel) -> bool:
    """Whether a panel has three dimensions."""
    return len(panel.axes) == 3


def _on_paper(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points (n, 3) or (n, 2) as they are seen, (n, 2)."""
    return points @ _TO_PAPER.T if points.shape[1] == 3 else points


def _bounds(panels: Sequence[Panel]) -> NDArray[np.float64]:
    """Return the corners of the box around panels on the paper, shape (2, 2)."""
    seen = np.vstack([_on_paper(layer.points) for panel in panels for layer in panel.layers])
    return np.array([seen.min(axis=0), seen.max(axis=0)])


def _boxes(panels: Sequence[Panel]) -> list[NDArray[np.float64]]:
    """Return the box of each panel: at one scale for all of three dimensions, and for flat ones of one kind.

    Below a panel of three dimensions is room for what stands in its corner.
    """
    boxes = []
    for panel in panels:
        low, high = _bounds([panel, *(other for other in panels if _is_alike(panel, other))])
        size = float((high - low).max())
        if _is_solid(panel):
            boxes.append(np.array([low - [_MARGIN * size, 2.2 * _CORNER * size], high + _MARGIN * size]))
            continue
        same = [np.ptp(_bounds([other]), axis=0)[0] for other in panels if other.kind == panel.kind and panel.kind]
        half = np.maximum((high - low) / 2, [max(same, default=0.0) / 2, 1e-3 * size]) + _MARGIN * size
        boxes.append((low + high) / 2 + np.array([-half, half]))
    return boxes


def _is_alike(panel: Panel, other: Panel) -> bool:
    """Whether both panels have three dimensions in one unit."""
    return _is_solid(panel) and _is_solid(other) and panel.unit == other.unit


def _shape(panel: Panel, box: NDArray[np.float64]) -> float:
    """Return the height of a panel relative to its width, with room for the labels of its axes."""
    across, up = np.ptp(box, axis=0)
    room = 0.0 if _is_solid(panel) else _LABELS / _WIDTHS[_COLUMNS]
    return float(np.clip(up / across * (1 - room) + room, *_SHAPE))


def _draw(figure: Figure, axes: Any, panel: Panel, box: NDArray[np.float64]) -> list[Text]:
    """Draw a panel within a box on the paper; return its texts, which are yet to be placed."""
    everything = np.vstack([layer.points for layer in panel.layers])
    factor, unit = prefixed(float(np.abs(everything).max()), panel.unit)
    coloured = [layer.values for layer in panel.layers if layer.values is not None and layer.values.size]
    values = np.concatenate(coloured) if coloured else np.zeros(1)
    scale, shown = prefixed(float(np.abs(values).max()), panel.quantity_unit)
    span = Normalize(scale * values.min(), scale * values.max())
    texts = []
    for place, layer in enumerate(panel.layers):
        if layer.cells.size:
            _draw_layer(axes, layer, factor, scale, span, place)
        seen = factor * _on_paper(layer.points)
        texts += [Text(x, y, text) for (x, y), text in zip(seen, layer.texts, strict=False) if text]
    axes.set_title(panel.title, fontsize=9.5, loc="left")
    axes.set_aspect("equal")
    for letter, limits in zip("xy", factor * box.T, strict=True):
        getattr(axes, f"set_{letter}lim")(*limits)
    if _is_solid(panel):
        _add_corner(axes, panel, factor * box, unit)
    else:
        for letter, name in zip("xy", panel.axes, strict=True):
            getattr(axes, f"set_{letter}label")(f"{name} ({unit})" if unit != "1" else name)
        axes.locator_params(nbins=6)
    if coloured:
        bar = figure.colorbar(ScalarMappable(span, VALUE_COLOURS), ax=axes, pad=0.02, shrink=0.8)
        bar.outline.set_visible(False)  # pyright: ignore[reportCallIssue]
        bar.set_label(panel.quantity if shown == "1" else f"{panel.quantity} ({shown})")
    return texts


def _add_corner(axes: Any, panel: Panel, box: NDArray[np.float64], unit: str) -> None:
    """Draw the directions of the axes of a panel of three dimensions, and a length, below it, in place of ticks."""
    axes.set_axis_off()
    size = np.ptp(box, axis=0)[0] / (1 + 2 * _MARGIN)
    origin = box[0] + [1.2 * _CORNER * size, 0.75 * _CORNER * size]
    ink = {"color": INK, "fontsize": 8}
    for name, direction in zip(panel.axes, _TO_PAPER.T, strict=True):
        arrow = {"arrowstyle": "->", "color": INK, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", origin + _CORNER * size * direction, origin, arrowprops=arrow)
        axes.text(*(origin + 1.35 * _CORNER * size * direction), name, ha="center", va="center", **ink)
    length = _round_length(size / 4)
    end = np.array([box[1, 0] - _MARGIN * size, box[0, 1] + 0.6 * _CORNER * size])
    axes.plot([end[0] - length, end[0]], [end[1], end[1]], color=INK, linewidth=1.6, solid_capstyle="butt")
    words = f"{length:g}" if unit == "1" else f"{length:g} {unit}"
    axes.text(end[0] - length / 2, end[1] + 0.15 * _CORNER * size, words, ha="center", va="bottom", **ink)


def _round_length(most: float) -> float:
    """Return the largest length of 1, 2 or 5 times a power of ten below another."""
    power = 10.0 ** math.floor(math.log10(most))
    return next(times * power for times in (5.0, 2.0, 1.0) if times * power <= most * (1 + 1e-9))


def _draw_layer(axes: Any, layer: Layer, factor: float, scale: float, span: Normalize, place: int) -> None:
    """Draw the cells of a layer, the farthest first, with coordinates times `factor` and values times `scale`."""
    index = layer.cells
    if layer.points.shape[1] == 3:
        index = index[np.argsort((layer.points @ _TO_EYE)[index].mean(axis=1), kind="stable")]
    cells, size = factor * _on_paper(layer.points)[index], index.shape[1]
    # lines and points lie over faces, which are sheer
    paint: dict[str, Any] = {"color": ROLE_COLOURS[layer.role], "zorder": (1.5 if size == 3 else 2.0) + 0.001 * place}
    if layer.values is not None:
        # a cell has one colour, that of the mean of its points
        values = scale * layer.values[index].mean(axis=1)
        paint |= {"cmap": VALUE_COLOURS, "norm": span, "array": values}
        del paint["color"]
    label = layer.name or "_nolegend_"
    if size == 1:
        means = paint.pop("array", None)
        axes.scatter(*cells[:, 0].T, s=18 if means is None else 60, label=label, c=means, **paint)
        return
    kind: Any
    if size == 2:
        kind, look = LineCollection, _LINE[layer.role]
    else:
        kind = PolyCollection
        look = {"edgecolor": "none"} if "array" in paint else {"alpha": _SHEER, "linewidth": _widths_edge_on(cells)}
    axes.add_collection(kind(list(cells), label=label, **paint, **look))


def _widths_edge_on(cells: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return widths of the edges of faces (n, 3, 2): none, but of those that are seen from their side."""
    (a, b), (c, d) = (cells[:, 1] - cells[:, 0]).T, (cells[:, 2] - cells[:, 0]).T
    return np.where(np.abs(a * d - b * c) < _THIN * np.ptp(cells, axis=(0, 1)).max() ** 2, _EDGE, 0.0)
