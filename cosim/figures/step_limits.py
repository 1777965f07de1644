"""Figure of the longest stable step of every algorithm, beside the step of the scene.

    figure = step_limits_figure("The robot", 1e-4, {"jacobi": 2e-3, "monolithic": math.inf})

An algorithm that is stable at every step evaluated has an arrow, one that is at none a cross.
"""

import math
from collections.abc import Mapping

import matplotlib as mpl
from matplotlib.figure import Figure

from hfsa.cosim.figures.style import ACCENT, COLOURS, GRID, STYLE, save

__all__ = ["save", "step_limits_figure"]

_ROOM = 10.0
"""Room beyond the steps, as a factor, for arrows and crosses."""


def step_limits_figure(title: str, step_size: float, longest: Mapping[str, float]) -> Figure:
    """Return the figure of the longest stable steps [s] by algorithm: infinite without a limit, 0 without a step."""
    finite = [step_size, *(step for step in longest.values() if 0 < step < math.inf)]
    low, high = min(finite) / _ROOM, max(finite) * _ROOM
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.6, 1.6 + 0.3 * len(longest)), layout="constrained", dpi=160)
        figure.suptitle(title, fontsize=12.5, fontweight="bold")
        axes = figure.subplots()
        for place, step in enumerate(longest.values()):
            look = {"color": COLOURS[0], "markersize": 7}
            if step == math.inf:
                axes.plot([low, high], [place, place], color=COLOURS[0], linewidth=2)
                axes.plot(high, place, ">", clip_on=False, **look)
            elif step > 0:
                axes.plot([low, step], [place, place], color=COLOURS[0], linewidth=2)
                axes.plot(step, place, "o", **look)
            else:
                axes.plot(low, place, "x", clip_on=False, **look)
        axes.axvline(step_size, color=ACCENT, linestyle=(0, (4, 3)), label=f"step of the scene, {step_size:.4g} s")
        axes.set_xscale("log")
        axes.set_xlim(low, high)
        axes.set_ylim(len(longest) - 0.5, -0.5)
        axes.set_yticks(range(len(longest)), list(longest))
        axes.set_xlabel("Longest stable communication step (s)")
        axes.grid(axis="x", color=GRID, linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
        figure.legend(loc="outside lower center")
    return figure
