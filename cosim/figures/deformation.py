"""Figure of a deformed body: its mesh, its deformation, magnified, and the von Mises stress in it, twice.

    save(deformation_figure(title, points, triangles, displacement, stress), Path("results/stage.png"))

Colours of the stress end at its largest value, which is marked, and about which
the last panel is. Triangles of six nodes are drawn with straight edges.
"""

from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hfsa.cosim.figures.style import ACCENT, COLOURS, INK, STYLE, save
from hfsa.cosim.signals.prefixes import readable

__all__ = ["deformation_figure", "save"]

_COLOURS = LinearSegmentedColormap.from_list("stress", ["#eef2f7", COLOURS[0], COLOURS[1]])
_SHOWN = 0.05
"""Largest displacement as it is drawn, by the size of the body."""
_WINDOW = 0.08
"""Width of the panel about the largest stress, by the size of the body."""
_PARTS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
"""Straight triangles that stand for one of six nodes."""

Reals = NDArray[np.float64]


def deformation_figure(
    title: str, points: Reals, triangles: NDArray[np.int_], displacement: Reals, stress: Reals
) -> Figure:
    """Return the figure of a body; shapes of the arrays are (n, 2) [m], (m, 6), (n, 2) [m] and (m, 3) [Pa]."""
    largest = float(np.linalg.norm(displacement, axis=1).max())
    factor = _SHOWN * float(np.ptp(points, axis=0).max()) / largest if largest else 1.0
    moved = points + factor * displacement
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(19, 5.2), layout="constrained", dpi=160)
        figure.suptitle(title, fontsize=12.5, fontweight="bold")
        mesh, shape, colours, close = figure.subplots(1, 4)
        _edges(mesh, points, triangles, INK, 0.25)
        mesh.set_title(f"{len(triangles)} triangles", fontsize=9.5, loc="left")
        _edges(shape, points, triangles, "#b8bfc9", 0.2)
        _edges(shape, moved, triangles, COLOURS[0], 0.2)
        shape.set_title(f"Displacement up to {readable(largest, 'm')}, times {factor:.3g}", fontsize=9.5, loc="left")
        triangle, corner = np.unravel_index(np.argmax(stress), stress.shape)
        peak, window = points[triangles[triangle, corner]], _WINDOW * np.ptp(points, axis=0).max() / 2
        drawn = _stress(colours, points, triangles, stress)
        colours.plot(*(1e3 * peak), "o", color=ACCENT, markerfacecolor="none", markersize=9)
        colours.set_title(f"Von Mises stress, largest {readable(float(stress.max()), 'Pa')}", fontsize=9.5, loc="left")
        near = np.abs(points[triangles[:, :3]] - peak).max(axis=(1, 2)) < 2 * window
        _stress(close, points, triangles[near], stress[near])
        close.set_title("Von Mises stress about its largest value", fontsize=9.5, loc="left")
        close.set_xlim(*(1e3 * (peak[0] + window * np.array([-1, 1]))))
        close.set_ylim(*(1e3 * (peak[1] + window * np.array([-1, 1]))))
        bar = figure.colorbar(drawn, ax=close, pad=0.02)
        bar.outline.set_visible(False)  # pyright: ignore[reportCallIssue]
        bar.ax.set_title("MPa", fontsize=9)
        for axes in (mesh, shape, colours, close):
            axes.set_aspect("equal")
            axes.set_xlabel("x (mm)")
        mesh.set_ylabel("y (mm)")
    return figure


def _edges(axes: Any, points: Reals, triangles: NDArray[np.int_], colour: str, width: float) -> None:
    """Draw the edges of triangles."""
    x, y = 1e3 * points.T
    axes.triplot(x, y, triangles[:, :3], color=colour, linewidth=width)


def _stress(axes: Any, points: Reals, triangles: NDArray[np.int_], stress: Reals) -> Any:
    """Draw the stress over triangles, linear between the corners of each; return what a colour bar takes."""
    nodal = np.concatenate([stress, (stress + np.roll(stress, -1, axis=1)) / 2], axis=1)
    x, y = (1e3 * points[triangles.ravel(), axis] for axis in (0, 1))
    own = 6 * np.arange(len(triangles))[:, None, None] + _PARTS
    drawn = (x, y, own.reshape(-1, 3), 1e-6 * nodal.ravel())
    return axes.tripcolor(*drawn, shading="gouraud", cmap=_COLOURS, vmin=0, vmax=1e-6 * stress.max())
