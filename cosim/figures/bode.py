"""Bode plots of sweeps: measured points and theoretical lines, magnitude in dB over phase in degrees.

    figure = bode_figure([read("results/demo.h5"), read("results/demo_linear.h5")])
    save(figure, Path("results/demo.png"))

Files overlay: the method `linear`, and the theory within a measured sweep, are drawn as lines, measured methods as
points. Entries of one input with a common unit share a pair of axes; many have a small pair each, on a grid of inputs
and outputs. Peaks of the densest curve are labelled, on a grid the highest; published frequencies, the `marks` of a
scene, are thin vertical lines. Where branches were followed, the downward sweep has points of its own, and arrows mark
jumps. Only here units are not SI: lengths in mm (um over an input that is neither length nor angle), angles in deg.
"""

from collections.abc import Iterable, Sequence

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from hfsa.cosim.figures.bode_axes import Pair, add_legend, add_legends, draw_panel
from hfsa.cosim.figures.bode_grid import draw_grid, name_rows
from hfsa.cosim.figures.curves import METHODS, downward_sweep, select_entries, theory_sweep
from hfsa.cosim.figures.labels import label_peaks
from hfsa.cosim.figures.sheet import Panel, Sheet, sheet_of
from hfsa.cosim.figures.style import ACCENT, STYLE, font_size, save
from hfsa.cosim.results.files import Bode
from hfsa.cosim.results.records import ResultsError
from hfsa.cosim.systems.names import expand, matching_names, nearest

__all__ = ["METHODS", "bode_figure", "save"]

_ROOM = 0.42
"""Room for the headings of rows [inch]."""


def bode_figure(sweeps: Sequence[Bode], outputs: Iterable[str] = (), inputs: Iterable[str] = ()) -> Figure:
    """Return the Bode plot of one or more sweeps, of all entries or of the given outputs and inputs.

    A name may have a range and may omit the component. `ResultsError` where there is nothing to draw, or where no sweep
    has a given signal.
    """
    sweeps = [drawn for bode in sweeps for drawn in (*theory_sweep(bode), bode, *downward_sweep(bode))]
    entries = select_entries(sweeps, _full_names(sweeps, "output", outputs), _full_names(sweeps, "input", inputs))
    sheet = sheet_of(sweeps, entries)
    with mpl.rc_context({**STYLE, "font.size": sheet.font}):
        figure = Figure(figsize=sheet.size, dpi=160, layout="constrained")
        FigureCanvasAgg(figure)  # one renderer for all text extents, instead of one each
        titles = dict.fromkeys(str(bode.attributes["title"]) for bode in sweeps)
        figure.suptitle(", ".join(titles), fontsize=12.5, fontweight="bold")
        drawn = _small_panels(figure, sheet) if sheet.is_shared else _panels(figure, sheet)
        for (upper, _), panel in drawn:
            label_peaks(upper, panel.peaks, color=ACCENT, fontweight="bold", fontsize=font_size(0.9))
    return figure


def _panels(figure: Figure, sheet: Sheet) -> list[tuple[Pair, Panel]]:
    """Draw each panel into a part of the figure of its own, and freeze the layout; return panels with their axes."""
    parts = figure.subfigures(len(sheet.rows), len(sheet.rows[0]), squeeze=False)
    placed = [(parts[j][i], panel) for j, row in enumerate(sheet.rows) for i, panel in enumerate(row) if panel]
    drawn = []
    for part, panel in placed:
        pair = tuple(part.subplots(2, 1, sharex=True, height_ratios=[1.55, 1]))
        draw_panel(pair, panel, sheet)
        drawn.append((pair, panel))
    add_legends(figure, [part for part, _ in placed])
    _freeze(figure)
    return drawn


def _small_panels(figure: Figure, sheet: Sheet) -> list[tuple[Pair, Panel]]:
    """Draw panels that share axes, and freeze the layout; return panels with their axes."""
    (part,) = figure.subfigures(1, 1, squeeze=False).ravel()
    drawn = draw_grid(part, sheet)
    add_legend(figure, [pair for pair, _ in drawn])
    beside = _ROOM / sheet.size[0] if sheet.beside else 0.0
    layout = ConstrainedLayoutEngine(rect=(beside, 0.0, 1.0 - beside, 1.0), h_pad=0.02, w_pad=0.04)
    figure.set_layout_engine(layout)
    _freeze(figure)
    if sheet.beside:
        name_rows(figure, drawn, sheet, beside / 2)
    return drawn


def _freeze(figure: Figure) -> None:
    """Fix the layout, so that places are final."""
    figure.draw_without_rendering()
    figure.set_layout_engine("none")


def _full_names(sweeps: Sequence[Bode], side: str, wanted: Iterable[str]) -> list[str]:
    """Return the full names of outputs or inputs as typed; `ResultsError` for a name that matches none."""
    known = list(dict.fromkeys(s.name for bode in sweeps for s in getattr(bode, f"{side}s")))
    found = []
    for name in (member for word in wanted for member in expand(word)):
        if not (fitting := matching_names(name, known)):
            raise ResultsError(f"no file has an {side} {name!r}{nearest(name, known)}")
        found += fitting
    return found
