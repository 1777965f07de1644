"""Style of all figures: colours, fonts and lines; and their output files."""

import io
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from hfsa.cosim.results.placement import write_picture
from hfsa.cosim.results.target import picture_format

COLOURS = ("#0b5fa5", "#d1495b", "#2e8b57", "#8e5ea2", "#d98200", "#4a4e57")
INK, GRID, ACCENT = "#20242c", "#c9ced6", "#b3541e"
STYLE: Any = {
    "font.family": "sans-serif",
    "font.size": 10,
    "axes.edgecolor": "#8a919c",
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "legend.frameon": False,
    "mathtext.default": "regular",
}
"""Settings of matplotlib for `mpl.rc_context`."""


LETTER_WIDTH = 0.08
"""Width of a letter of a legend or title, with some margin [inch]."""


def font_size(relative: float) -> float:
    """Return a font size [points] relative to that of the figure."""
    return relative * mpl.rcParams["font.size"]


def save(figure: Figure, path: Path) -> None:
    """Write the figure in the format of the file name ending, completely or not at all.

    An existing picture is replaced; `ResultsError` for any other existing file, or where the file cannot be written.
    """
    write_picture(path, drawn(figure, picture_format(path)))


def drawn(figure: Figure, ending: str) -> bytes:
    """Return the figure as a picture of the format of a file name ending."""
    written = io.BytesIO()
    with mpl.rc_context(STYLE):
        figure.savefig(written, format=ending)
    return written.getvalue()
