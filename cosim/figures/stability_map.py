"""Writes a stability map in HDF5, and draws it.

/         title created tool tool_version git_commit command python platform format_version status
/system   the scene, as words
/map      the axes: dimension scales; growth [1/s], stable (true or false), verified (1 a simulation agrees, 0 it does
          not, -1 none) over them; algorithm step_size [s] (attributes)
"""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from hfsa.cosim.experiments.stability_map import GEOMETRIC, Axis, StabilityMap
from hfsa.cosim.figures.style import ACCENT, COLOURS, INK, STYLE
from hfsa.cosim.results.files import hdf5
from hfsa.cosim.results.hdf5 import Node
from hfsa.cosim.results.records import SystemRecord


def write_map(path: Path, found: StabilityMap, title: str, force: bool = False) -> None:
    """Write a map, complete or not at all, with `force` in place of a results file; `ResultsError` where that fails."""
    words = ", ".join([found.scene, *(axis.name for axis in found.axes)])
    store = hdf5.Store.create(path, SystemRecord(title, words), lambda file: _fill(file, found), force)
    hdf5.set_status(store.file, hdf5.COMPLETE)
    store.close()


def _fill(file: Node, found: StabilityMap) -> None:
    """Write a map's axes, growths and verdicts."""
    group = file.create_group("map")
    names = [axis.name for axis in found.axes]
    for axis in found.axes:
        hdf5.scale(group, axis.name, axis.values)
    hdf5.filled(group, "growth", names, np.nan, float, "1/s")[...] = found.growth
    stable = hdf5.filled(group, "stable", names, 0, np.int8)
    stable[...] = found.stable
    stable.attrs["dtype"] = "bool"  # so xarray reads it as what it is
    hdf5.filled(group, "verified", names, -1, np.int8)[...] = found.verified
    group.attrs["algorithm"], group.attrs["step_size"] = found.algorithm, found.step_size


def map_figure(found: StabilityMap, title: str) -> Figure:
    """Return the figure of a map: growth over one axis, or stable and unstable over two, simulated points marked."""
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
    """Space an axis of the figure, `x` or `y`, as its points are."""
    low, high = axis.values[[0, -1]]
    if low > 0 and high / low >= GEOMETRIC:
        getattr(axes, f"set_{which}scale")("log")
        shown = getattr(axes, f"{which}axis")
        shown.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        shown.set_major_formatter("{x:g}")
        shown.set_minor_formatter(NullFormatter())
