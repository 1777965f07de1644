"""Bode plots of sweeps: measured points and theoretical lines, magnitude in dB over phase in degrees.

    figure = bode_figure([read("results/demo.h5"), read("results/demo_linear.h5")])
    save(figure, Path("results/demo.png"))

Files overlay: the method `linear`, and the theory within a measured sweep, are drawn as lines, measured methods as
points. Entries of one input with a common unit share a pair of axes. Peaks of the densest curve are labelled; published
frequencies, the `marks` of a scene, are thin vertical lines. Where branches were followed, the downward sweep has
points of its own, and arrows mark jumps. Only here units are not SI: lengths in mm (um over an input that is neither
length nor angle), angles in deg.
"""

from collections.abc import Iterable, Sequence

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from hfsa.cosim.figures.bode_axes import add_legends, draw_panel
from hfsa.cosim.figures.curves import METHODS, downward_sweep, select_entries, theory_sweep
from hfsa.cosim.figures.labels import label_peaks
from hfsa.cosim.figures.sheet import sheet_of
from hfsa.cosim.figures.style import ACCENT, STYLE, font_size, save
from hfsa.cosim.results.files import Bode
from hfsa.cosim.results.records import ResultsError
from hfsa.cosim.systems.names import expand, matching_names, nearest

__all__ = ["METHODS", "bode_figure", "save"]


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
        parts = figure.subfigures(len(sheet.rows), len(sheet.rows[0]), squeeze=False)
        drawn = [(parts[j][i], panel) for j, row in enumerate(sheet.rows) for i, panel in enumerate(row) if panel]
        for part, panel in drawn:
            draw_panel(part, panel, sheet)
        for part, heading in zip(parts[0], sheet.above, strict=False):
            part.suptitle(heading, fontsize=font_size(1.2))
        for part, heading in zip(parts[:, 0], sheet.beside, strict=False):
            part.supylabel(heading, fontsize=font_size(1.2))
        titles = dict.fromkeys(str(bode.attributes["title"]) for bode in sweeps)
        figure.suptitle(", ".join(titles), fontsize=12.5, fontweight="bold")
        add_legends(figure, [part for part, _ in drawn])
        figure.draw_without_rendering()
        figure.set_layout_engine("none")  # freeze the layout before placing the labels
        for part, panel in drawn:
            label_peaks(part.axes[0], panel.peaks, color=ACCENT, fontweight="bold", fontsize=font_size(0.9))
    return figure


def _full_names(sweeps: Sequence[Bode], side: str, wanted: Iterable[str]) -> list[str]:
    """Return the full names of outputs or inputs as typed; `ResultsError` for a name that matches none."""
    known = list(dict.fromkeys(s.name for bode in sweeps for s in getattr(bode, f"{side}s")))
    found = []
    for name in (member for word in wanted for member in expand(word)):
        if not (fitting := matching_names(name, known)):
            raise ResultsError(f"no file has an {side} {name!r}{nearest(name, known)}")
        found += fitting
    return found
