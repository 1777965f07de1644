"""Figure of relative sensitivities: bars of each response over the dimensions of a design.

save(sensitivity_figure("accelerometer", {"f_in": {"l": -0.5, "tm": 1.5}}), Path("sensitivity.png"))
"""

from collections.abc import Mapping

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from hfsa.cosim.figures.style import COLOURS, GRID, INK, LETTER_WIDTH, STYLE, save

__all__ = ["save", "sensitivity_figure"]

_GROUP = 0.8
"""Width of the bars of one dimension, relative to the distance of dimensions."""
_LONG = 8
"""Letters of a name above which it stands upright."""


def sensitivity_figure(title: str, found: Mapping[str, Mapping[str, float]]) -> Figure:
    """Return the figure of d ln(response) / d ln(dimension) by response and dimension, in their order."""
    names = list(next(iter(found.values())))
    places, width, longest = np.arange(len(names)), _GROUP / len(found), max(map(len, names))
    upright = longest > _LONG  # names such as `posture.position[1]` would run into each other
    height = 4.4 + (LETTER_WIDTH * longest if upright else 0.0)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(max(6.4, 1.0 + 0.8 * len(names)), height), layout="constrained", dpi=160)
        figure.suptitle(title, fontsize=12.5, fontweight="bold", wrap=True)
        axes = figure.subplots()
        for k, (response, of) in enumerate(found.items()):
            at = places + (k - (len(found) - 1) / 2) * width
            axes.bar(at, [of[name] for name in names], width, color=COLOURS[k % len(COLOURS)], label=response)
        axes.axhline(0.0, color=INK, linewidth=0.8)
        axes.set_xticks(places, names, rotation=90 if upright else 0)
        axes.set_ylabel("d ln(response) / d ln(dimension)")
        axes.grid(axis="y", color=GRID, linewidth=0.6)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
        figure.legend(loc="outside lower center", ncols=min(len(found), 4))
    return figure
