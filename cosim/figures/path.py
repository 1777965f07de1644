"""Figure of the numbers of a part along a path: one panel per unit of the responses, over time or row.

    save(path_figure(found), Path("results/path.png"))

Responses of one unit whose sizes differ by more than a thousand, such as indices of a stiffness, are drawn alike: the
scale is logarithmic. Lines are broken where the part cannot be.
"""

from collections.abc import Mapping

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from hfsa.cosim.figures.style import COLOURS, GRID, STYLE, save
from hfsa.cosim.results.path import PathQuantity, PathTable
from hfsa.cosim.signals.prefixes import prefixed

__all__ = ["path_figure", "save"]

_COLUMNS = 3
_WIDE = 1e3
"""Ratio of largest to smallest value from which on a panel is logarithmic."""


def path_figure(found: PathTable) -> Figure:
    """Return the figure of a path."""
    panels = _by_unit(found.responses)
    columns = min(len(panels), _COLUMNS)
    rows = -(-len(panels) // columns)
    if found.time is None:
        x, label = np.arange(1, len(next(iter(found.responses.values())).values) + 1), "Row of the path"
    else:
        x, label = found.time, "Time (s)"
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(4.6 * columns, 3.2 * rows), layout="constrained", dpi=160)
        figure.suptitle(found.title, fontsize=12.5, fontweight="bold")
        grid = figure.subplots(rows, columns, sharex=True, squeeze=False).ravel()
        for unused in grid[len(panels) :]:
            unused.remove()
        for axes, (unit, quantities) in zip(grid, panels.items(), strict=False):
            sizes = np.abs(np.array([quantity.values for quantity in quantities.values()]))
            largest = float(np.nanmax(sizes)) if np.any(np.isfinite(sizes)) else 1.0
            factor, shown = prefixed(largest, unit)
            for k, (name, quantity) in enumerate(quantities.items()):
                colour = COLOURS[k % len(COLOURS)]
                axes.plot(x, factor * quantity.values, ".-", color=colour, linewidth=1.2, markersize=3, label=name)
            if np.nanmin(sizes, initial=np.inf) > 0 and largest > _WIDE * np.nanmin(sizes, initial=np.inf):
                axes.set_yscale("log")
            axes.set_ylabel(", ".join(quantities) if shown == "1" else f"({shown})")
            axes.set_xlabel(label)
            axes.tick_params(labelbottom=True)
            axes.grid(color=GRID, linewidth=0.5)
            axes.legend(fontsize=8, ncols=2, frameon=True)
    return figure


def _by_unit(responses: Mapping[str, PathQuantity]) -> dict[str, dict[str, PathQuantity]]:
    """Return responses by unit, in the order in which they are given."""
    panels: dict[str, dict[str, PathQuantity]] = {}
    for name, quantity in responses.items():
        panels.setdefault(quantity.unit, {})[name] = quantity
    return panels
