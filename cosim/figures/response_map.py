"""Figure of a response map: contours of every response over two dimensions, with the present design.

    save(response_map_figure(found), Path("results/map.png"))

The figure is blank where the design is not possible. Colours and lines span the 5th to the 95th percentile, so that a
pole does not dominate them.
"""

from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from hfsa.cosim.figures.style import ACCENT, COLOURS, INK, STYLE, save
from hfsa.cosim.results.response_map import MapQuantity, ResponseMap
from hfsa.cosim.signals.prefixes import prefixed, readable

__all__ = ["response_map_figure", "save"]

_COLOURS = LinearSegmentedColormap.from_list("response", ["#f3f6fa", COLOURS[0]])
_EXTREMES = (5, 95)
_LEVELS = 9
_COLUMNS = 3
_CONSTANT = 1e-6
"""Range of a response, relative to its size, below which its colours do not show rounding."""
_MARK: Any = {"color": ACCENT, "markersize": 9, "markeredgecolor": "white", "clip_on": False, "zorder": 5}


def response_map_figure(found: ResponseMap) -> Figure:
    """Return the figure of a map, one panel per response."""
    with mpl.rc_context(STYLE):
        columns = min(len(found.responses), _COLUMNS)
        rows = -(-len(found.responses) // columns)
        figure = Figure(figsize=(4.6 * columns, 4.4 * rows), layout="constrained", dpi=160)
        figure.suptitle(found.title, fontsize=12.5, fontweight="bold")
        panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        scales = [prefixed(float(np.abs(axis.values).max()), axis.unit) for axis in found.axes.values()]
        x, y = (factor * axis.values for (factor, _), axis in zip(scales, found.axes.values(), strict=True))
        present = [factor * axis.present for (factor, _), axis in zip(scales, found.axes.values(), strict=True)]
        labels = [_label(*item, unit) for item, (_, unit) in zip(found.axes.items(), scales, strict=True)]
        for unused in panels.ravel()[len(found.responses) :]:
            unused.remove()
        for axes, response in zip(panels.ravel(), found.responses.values(), strict=False):
            _draw(figure, axes, x, y, response.values.T, response.unit)
            value = f"the design: {readable(response.present, response.unit)}"
            axes.set_title(f"{response.description}\n{value}", fontsize=9.5, loc="left")
            axes.set_xlabel(labels[0])
            axes.tick_params(labelbottom=True)
            if x[0] <= present[0] <= x[-1] and y[0] <= present[1] <= y[-1]:
                axes.plot(*present, "o", label="the design", **_MARK)
            if np.any(np.isnan(response.values)):
                axes.plot([], [], "s", color="white", markeredgecolor=INK, label="blank: cannot be built")
        for axes in panels[:, 0]:
            axes.set_ylabel(labels[1])
        drawn = [zip(*axes.get_legend_handles_labels(), strict=True) for axes in figure.axes]
        if entries := {label: handle for pairs in drawn for handle, label in pairs}:
            figure.legend(list(entries.values()), list(entries), loc="outside lower center", ncols=2, fontsize=9)
        figure.draw_without_rendering()
        for axes in figure.axes:
            _thin_out(axes)
    return figure


def _draw(
    figure: Figure, axes: Any, x: NDArray[np.float64], y: NDArray[np.float64], values: NDArray[np.float64], unit: str
) -> None:
    """Draw one response, shape (y, x): filled contours, labelled lines, and a colour bar."""
    low, high = np.nanpercentile(values, _EXTREMES)
    if not high - low > _CONSTANT * abs(high):
        low, high = (1 - _CONSTANT) * low - _CONSTANT, (1 + _CONSTANT) * high + _CONSTANT
    factor, shown = prefixed(float(np.abs([low, high]).max()), unit)
    values = np.ma.masked_invalid(factor * values)
    levels = MaxNLocator(_LEVELS).tick_values(factor * low, factor * high)
    filled = axes.contourf(x, y, values, levels, cmap=_COLOURS, extend="both")
    lines = axes.contour(x, y, values, levels, colors=INK, linewidths=0.7)
    axes.clabel(lines, fontsize=8, fmt="%g")
    bar = figure.colorbar(filled, ax=axes, pad=0.02)
    bar.outline.set_visible(False)  # pyright: ignore[reportCallIssue]
    bar.ax.set_title("" if shown == "1" else shown, fontsize=9)


def _thin_out(axes: Any) -> None:
    """Remove the labels of lines that lie on an earlier one, as they do near a pole."""
    kept: list[Bbox] = []
    for text in list(axes.texts):
        box = text.get_window_extent()
        if any(box.overlaps(other) for other in kept):
            text.remove()
        else:
            kept.append(box)


def _label(name: str, axis: MapQuantity, unit: str) -> str:
    """Return the label of an axis with values in a unit."""
    return f"{axis.description}, {name} ({unit})"
