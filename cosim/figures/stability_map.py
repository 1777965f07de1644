"""Figure of a stability map: growth over one axis, or stable and unstable regions over two."""

import matplotlib as mpl
import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from hfsa.cosim.figures.style import ACCENT, COLOURS, INK, STYLE
from hfsa.cosim.results.stability_map import GEOMETRIC, Axis, StabilityMap


def stability_map_figure(found: StabilityMap, title: str) -> Figure:
    """Return the figure of a map, with the simulated points marked."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.4, 4.6), layout="constrained", dpi=160)
        figure.suptitle(f"{title}\n{found.algorithm}", fontsize=11.5, fontweight="bold")
        axes = figure.subplots()
        x = found.axes[0]
        axes.set_xlabel(x.name)
        _spread(axes, "x", x)
        if len(found.axes) == 1:
            axes.plot(x.values, found.growth, color=COLOURS[0])
            axes.axhline(0, color=INK, linewidth=0.7)
            axes.set_ylabel("growth of the fastest mode (1/s)")
            axes.set_yscale("symlog", linthresh=1.0)
            for is_stable, marker in ((True, "o"), (False, "x")):
                chosen = found.built & (found.stable == is_stable)
                words = "stable" if is_stable else "unstable"
                axes.plot(x.values[chosen], found.growth[chosen], marker, color=COLOURS[0], markersize=7, label=words)
            _mark(axes, found, x.values, found.growth)
            return figure
        y = found.axes[1]
        axes.set_ylabel(y.name)
        _spread(axes, "y", y)
        shown = np.ma.masked_array(~found.stable.T, mask=~found.built.T)
        axes.pcolormesh(x.values, y.values, shown, cmap=ListedColormap(["#dbe7f3", "#f6dcd2"]), vmin=0, vmax=1)
        axes.plot([], [], "s", color="#dbe7f3", label="stable")
        axes.plot([], [], "s", color="#f6dcd2", label="unstable")
        grid = np.meshgrid(x.values, y.values, indexing="ij")
        _mark(axes, found, *grid)
        return figure


def _mark(axes, found: StabilityMap, x: np.ndarray, y: np.ndarray) -> None:
    """Mark the points that were simulated."""
    for value, colour, words in ((1, INK, "simulation agrees"), (0, ACCENT, "simulation differs")):
        chosen = found.verified == value
        if chosen.any():
            axes.plot(x[chosen], y[chosen], ".", color=colour, markersize=4, label=words)
    axes.figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize=8.5)


def _spread(axes, which: str, axis: Axis) -> None:
    """Set the scale of an axis of the figure, `x` or `y`: logarithmic where its points are spaced geometrically."""
    low, high = axis.values[[0, -1]]
    if low > 0 and high / low >= GEOMETRIC:
        getattr(axes, f"set_{which}scale")("log")
        shown = getattr(axes, f"{which}axis")
        shown.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        shown.set_major_formatter("{x:g}")
        shown.set_minor_formatter(NullFormatter())
