"""Bode plots of sweeps: measured points on theoretical lines, magnitude in dB over phase in degrees.

    figure = bode_figure([read("results/demo.h5"), read("results/demo_linear.h5")])
    save(figure, Path("results/demo.png"))

Files overlay: the method `linear`, and the theory that a measured sweep brings along, is drawn as a line, measured
methods as points. Entries of one input whose units
agree share a pair of axes. Resonances are marked where the densest curve has its peaks; frequencies that others have
found, a scene's `marks`, by thin lines. Only here units are not SI: lengths in mm (um over an input that is neither
length nor angle), angles in deg.
"""

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from hfsa.cosim.figures.labels import Peak, label_peaks, spread_frequencies
from hfsa.cosim.figures.style import ACCENT, COLOURS, GRID, INK, STYLE, save
from hfsa.cosim.results.files import Bode
from hfsa.cosim.results.records import ResultsError, Signal, Status
from hfsa.cosim.signals.frequency_response import negligible, resonances
from hfsa.cosim.systems.names import expand, matching_names, nearest

__all__ = ["METHODS", "bode_figure", "save"]

METHODS = {"linear": "linear theory", "stepped": "stepped sine, co-simulated FMUs"}
"""Methods of a sweep as a legend says them."""

_CLOSE = 0.02
_MARKED = 4
"""Peaks of a panel that are marked at most."""
_CROWD = 12
"""Entries beyond which each has a small panel of its own."""
_PANEL, _SMALL_PANEL = (4.2, 4.8), (2.7, 2.6)
"""Width and height [inch]."""
_STEPS = (45, 90, 180, *range(360, 360_000, 360))
"""Phase between ticks [deg]."""
_LETTER = 0.08
"""Width of a letter in a legend, or in a title with some room around it [inch]."""
_DASHES = ("-", (0, (1, 1.2)), (0, (6, 1.5, 1, 1.5)), (0, (3, 1)))
"""What tells the marks of a scene apart, line by line."""


@dataclass
class _Curve:
    """One entry of one file: magnitude [dB] and phase [deg] over frequency [Hz], missing points left out."""

    bode: Bode
    output: Signal
    frequency: NDArray[np.float64]
    level: NDArray[np.float64]
    phase: NDArray[np.float64]
    status: NDArray[np.int8]
    failed: NDArray[np.float64]
    colour: str = COLOURS[0]
    label: str = ""

    @property
    def is_line(self) -> bool:
        return self.bode.settings.get("method") == "linear"


@dataclass
class _Panel:
    """A pair of axes: curves of one input whose units agree; `unit` is what 0 dB stands for.

    `title` stands above it, `peaks` are those that are marked, the highest first.
    """

    input: Signal
    unit: str
    curves: list[_Curve] = field(default_factory=list)
    title: str = ""
    peaks: list[Peak] = field(default_factory=list)

    @property
    def outputs(self) -> dict[str, list[_Curve]]:
        """Curves by output."""
        names = dict.fromkeys(curve.output.name for curve in self.curves)
        return {name: [curve for curve in self.curves if curve.output.name == name] for name in names}


class _Entry(NamedTuple):
    """One curve, the input that it follows, and what its 0 dB stands for."""

    input: Signal
    unit: str
    curve: _Curve


@dataclass(frozen=True)
class _Sheet:
    """Panels in rows, `None` where one is empty; `size` of it [inch] and of its letters, `font` [points].

    `magnitude`, `phase` and `frequency` are what axes are called, `intervals` those between ticks of phase at most.
    `above` and `beside` are headings of the columns and of the rows, if there are any.
    """

    rows: Sequence[Sequence[_Panel | None]]
    size: tuple[float, float]
    font: float = 10.0
    magnitude: str = "Magnitude ({})"
    phase: str = "Phase (deg)"
    frequency: str = "Frequency (Hz)"
    intervals: int = 6
    above: Sequence[str] = ()
    beside: Sequence[str] = ()


def bode_figure(sweeps: Sequence[Bode], outputs: Iterable[str] = (), inputs: Iterable[str] = ()) -> Figure:
    """Return the Bode plot of one or more sweeps, of all entries or of those of the given outputs and inputs.

    A given name may have a range, and may leave out the component. `ResultsError` where there is nothing to draw, or no
    sweep has a given signal.
    """
    sweeps = [drawn for bode in sweeps for drawn in (*_theory(bode), bode)]
    entries = _entries(sweeps, _named(sweeps, "output", outputs), _named(sweeps, "input", inputs))
    is_crowded = len({(curve.output.name, source.name) for source, _, curve in entries}) > _CROWD
    sheet = _by_entry(sweeps, entries) if is_crowded else _by_unit(sweeps, entries)
    with mpl.rc_context({**STYLE, "font.size": sheet.font}):
        figure = Figure(figsize=sheet.size, dpi=160, layout="constrained")
        FigureCanvasAgg(figure)  # letters are measured by one renderer, not by one each
        parts = figure.subfigures(len(sheet.rows), len(sheet.rows[0]), squeeze=False)
        drawn = [(parts[j][i], panel) for j, row in enumerate(sheet.rows) for i, panel in enumerate(row) if panel]
        for part, panel in drawn:
            _draw(part, panel, sheet)
        for part, heading in zip(parts[0], sheet.above, strict=False):
            part.suptitle(heading, fontsize=_type(1.2))
        for part, heading in zip(parts[:, 0], sheet.beside, strict=False):
            part.supylabel(heading, fontsize=_type(1.2))
        titles = dict.fromkeys(str(bode.attributes["title"]) for bode in sweeps)
        figure.suptitle(", ".join(titles), fontsize=12.5, fontweight="bold")
        _legends(figure, [part for part, _ in drawn])
        figure.draw_without_rendering()
        figure.set_layout_engine("none")  # what is placed now stays there
        for part, panel in drawn:
            label_peaks(part.axes[0], panel.peaks, color=ACCENT, fontweight="bold", fontsize=_type(0.9))
    return figure


# What is drawn --------------------------------------------------------------------------------------------------------


def _theory(bode: Bode) -> list[Bode]:
    """Return the theory that a file holds beside its measurement as a sweep of its own, to be drawn as a line."""
    if bode.theory is None:
        return []
    points = len(bode.theory.frequency), len(bode.inputs)
    settings = {**bode.settings, "method": "linear"}
    status = np.full(points, Status.DONE, dtype=np.int8)
    return [replace(bode, **vars(bode.theory), status=status, settings=settings, theory=None)]


def _named(sweeps: Sequence[Bode], side: str, wanted: Iterable[str]) -> list[str]:
    """Return the full names of the outputs or inputs that names mean; `ResultsError` for one that means none."""
    known = list(dict.fromkeys(s.name for bode in sweeps for s in getattr(bode, f"{side}s")))
    found = []
    for name in (member for word in wanted for member in expand(word)):
        if not (fitting := matching_names(name, known)):
            raise ResultsError(f"no file has an {side} {name!r}{nearest(name, known)}")
        found += fitting
    return found


def _entries(sweeps: Sequence[Bode], outputs: list[str], inputs: list[str]) -> list[_Entry]:
    """Return what there is to draw, without entries that are zero by symmetry; `ResultsError` where that is nothing."""
    entries = []
    for bode in sweeps:
        units, amplitudes = [s.unit for s in bode.outputs], [s.amplitude for s in bode.inputs]
        left_out = negligible(bode.response, units, amplitudes)
        for (o, output), (i, source) in itertools.product(enumerate(bode.outputs), enumerate(bode.inputs)):
            wanted = (not outputs or output.name in outputs) and (not inputs or source.name in inputs)
            if wanted and not left_out[o, i]:
                unit, factor = _display(output.unit, source.unit)
                entries.append(_Entry(source, unit, _curve(bode, output, source, factor)))
    entries = [entry for entry in entries if len(entry.curve.frequency)]
    if not entries:
        raise ResultsError(f"{', '.join(str(bode.path) for bode in sweeps)}: no finished points to draw")
    return entries


def _by_unit(sweeps: Sequence[Bode], entries: Sequence[_Entry]) -> _Sheet:
    """Return a column for each input; in it a panel for each unit, that of the input first."""
    panels = _panels(sweeps, entries, key=lambda entry: (entry.input.name, entry.unit))
    order = list(dict.fromkeys(source.name for bode in sweeps for source in bode.inputs))
    panels.sort(key=lambda panel: (order.index(panel.input.name), panel.unit != ""))
    columns = [list(column) for _, column in itertools.groupby(panels, lambda panel: panel.input.name)]
    rows = [list(row) for row in itertools.zip_longest(*columns)]
    for panel in panels:
        outputs = list(panel.outputs)
        target = f"\N{RIGHTWARDS ARROW}  {outputs[0]}" if len(outputs) == 1 else ""
        fits = _LETTER * (len(panel.input.name) + len(target)) < _PANEL[0]
        panel.title = f"{panel.input.name}{'  ' if fits else chr(10)}{target}".rstrip()
    size = (8.6, 6.2) if len(panels) == 1 else (max(8.0, _PANEL[0] * len(columns)), 0.8 + _PANEL[1] * len(rows))
    return _Sheet(rows, size)


def _by_entry(sweeps: Sequence[Bode], entries: Sequence[_Entry]) -> _Sheet:
    """Return a column for each input and a row for each output: many small panels, their names at the sheet's edges."""
    panels = _panels(sweeps, entries, key=lambda entry: (entry.input.name, entry.curve.output.name))
    there = {(panel.input.name, name): panel for panel in panels for name in panel.outputs}
    inputs, outputs = ({name: None for names in there for name in names[side : side + 1]} for side in (0, 1))
    above = [name for name in dict.fromkeys(s.name for bode in sweeps for s in bode.inputs) if name in inputs]
    beside = [name for name in dict.fromkeys(s.name for bode in sweeps for s in bode.outputs) if name in outputs]
    rows = [[there.get((source, output)) for source in above] for output in beside]
    size = (0.6 + _SMALL_PANEL[0] * len(above), 1.0 + _SMALL_PANEL[1] * len(beside))
    return _Sheet(rows, size, 7.0, "{}", "deg", "Hz", 3, above, beside)


def _panels(
    sweeps: Sequence[Bode], entries: Sequence[_Entry], key: Callable[[_Entry], tuple[str, str]]
) -> list[_Panel]:
    """Return panels of the entries that have a key in common, their curves named and their phases aligned."""
    panels: dict[tuple[str, str], _Panel] = {}
    for entry in entries:
        panels.setdefault(key(entry), _Panel(entry.input, entry.unit)).curves.append(entry.curve)
    for panel in panels.values():
        _name_curves(panel, sweeps)
        _align_phases(panel)
        panel.peaks = _peaks(panel)
    return list(panels.values())


def _curve(bode: Bode, output: Signal, source: Signal, factor: float) -> _Curve:
    """Return the curve of one output by one input, its values by a factor."""
    response = factor * bode.entry(output.name, source.name)
    status = bode.status[:, [s.name for s in bode.inputs].index(source.name)]
    there = np.isfinite(response) & (np.abs(response) > 0)
    phase = np.degrees(np.unwrap(np.angle(response[there])))
    level = 20 * np.log10(np.abs(response[there]))
    failed = bode.frequency[status == Status.FAILED]
    return _Curve(bode, output, bode.frequency[there], level, phase, status[there], failed)


def _name_curves(panel: _Panel, sweeps: Sequence[Bode]) -> None:
    """Give each curve a colour and a label that tell it from the others: by output, by method, by file."""
    outputs = list(panel.outputs)
    methods = [bode.settings.get("method") for bode in sweeps]
    for curve in panel.curves:
        method = str(curve.bode.settings.get("method", ""))
        label = METHODS.get(method, method)
        if methods.count(method) > 1:
            label += f", {curve.bode.path.stem}"
        if len(outputs) > 1:
            label = f"{curve.output.name}: {label}"
        curve.label = label
        # a line gives way to the points upon it; more outputs or more files need colours of their own
        sibling = [bode for bode in sweeps if bode.settings.get("method") == method].index(curve.bode)
        curve.colour = COLOURS[(outputs.index(curve.output.name) + sibling) % len(COLOURS)]


def _align_phases(panel: _Panel) -> None:
    """Put the phases of one output on the branch of its densest curve, which begins in (-180, 180]."""
    for curves in panel.outputs.values():
        dense = max(curves, key=lambda curve: len(curve.frequency))
        for curve in curves:
            if curve is not dense:
                near = np.interp(np.log(curve.frequency), np.log(dense.frequency), dense.phase)
                curve.phase = curve.phase + 360 * np.round((near - curve.phase) / 360)


def _peaks(panel: _Panel) -> list[Peak]:
    """Return the peaks to mark, the highest first: 3 dB above their surroundings, and of close ones the highest."""
    dense = [max(curves, key=lambda curve: len(curve.frequency)) for curves in panel.outputs.values()]
    summits = [_summit(curve, i) for curve in dense for i in resonances(curve.level)]
    peaks: list[Peak] = []
    for f, level in sorted(summits, key=lambda summit: -summit[1]):
        if all(abs(math.log(f / other.x)) > _CLOSE for other in peaks):
            peaks.append(Peak(f, level, f"{f:.4g} Hz, {level:.1f} dB"))
    return peaks[:_MARKED]


def _display(output: str, source: str) -> tuple[str, float]:
    """Return the unit that 0 dB stands for, empty for equal units, and the factor from SI."""
    if output == source:
        return "", 1.0
    lengths = {"m": ("mm", 1e3), "rad": ("deg", 180 / math.pi)}
    micro = source not in lengths and output == "m"
    above, up = ("um", 1e6) if micro else lengths.get(output, (output, 1.0))
    below, down = lengths.get(source, (source, 1.0))
    return f"{above}/{below}" if below.isalnum() else f"{above}/({below})", up / down


def _type(relative: float) -> float:
    """Return the size of letters relative to the figure's own [points]."""
    return relative * mpl.rcParams["font.size"]


# How it is drawn ------------------------------------------------------------------------------------------------------


def _draw(part: Any, panel: _Panel, sheet: _Sheet) -> None:
    """Draw magnitude and phase of a panel."""
    upper, lower = part.subplots(2, 1, sharex=True, height_ratios=[1.55, 1])
    for curve in sorted(panel.curves, key=lambda curve: not curve.is_line):
        _draw_curve(upper, curve, curve.level)
        _draw_curve(lower, curve, curve.phase)
    _scale_axes(upper, lower, panel, sheet.intervals)
    for peak in panel.peaks:
        for axes in (upper, lower):
            axes.axvline(peak.x, color=ACCENT, linewidth=0.9, linestyle=(0, (4, 3)), alpha=0.7, zorder=1)
    _mark_published(upper, lower, panel)
    _mark_failures(lower, panel)
    upper.set_ylabel(sheet.magnitude.format(f"dB re 1 {panel.unit}" if panel.unit else "dB"))
    lower.set_ylabel(sheet.phase)
    lower.set_xlabel(sheet.frequency)
    upper.set_title(panel.title, fontsize=_type(0.85))
    spread_frequencies(lower)


def _legends(figure: Figure, parts: Sequence[Any]) -> None:
    """Put what is drawn below the figure where it is the same in all its parts, else below each of them."""
    found = [_entries_of_legend(part) for part in parts]
    same = all(entries.keys() == found[0].keys() for entries in found)
    for owner, entries in [(figure, found[0])] if same else zip(parts, found, strict=True):
        width = owner.bbox.width / figure.dpi
        fitting = max(int(width / (0.6 + _LETTER * max(map(len, entries)))), 1)
        place = {"loc": "outside lower center", "ncols": min(len(entries), fitting)}
        owner.legend(list(entries.values()), list(entries), **place, fontsize=10 if same else 8.5)


def _entries_of_legend(part: Any) -> dict[str, Any]:
    """Return what is drawn in a part, by label."""
    drawn = (zip(*axes.get_legend_handles_labels(), strict=True) for axes in part.axes)
    return {label: handle for pairs in reversed(list(drawn)) for handle, label in pairs}


def _draw_curve(axes: Any, curve: _Curve, values: NDArray[np.float64]) -> None:
    """Draw a line where a response is known everywhere, else its points as they were measured."""
    if curve.is_line:
        axes.plot(curve.frequency, values, color=curve.colour, linewidth=1.6, alpha=0.75, label=curve.label, zorder=2)
        return
    settled = curve.status == Status.DONE
    look = {"markersize": 5.2, "linestyle": "none", "zorder": 4}
    axes.plot(
        curve.frequency[settled],
        values[settled],
        **look,
        marker="o",
        color=curve.colour,
        markeredgecolor="white",
        markeredgewidth=0.8,
        label=curve.label,
    )
    hollow = {"color": "white", "markeredgecolor": curve.colour, "markeredgewidth": 1.2}
    for status, words, marker in ((Status.NOT_SETTLED, "not settled", "o"), (Status.LIMITED, "at a limit", "s")):
        here = curve.status == status
        if here.any():
            label = f"{curve.label}, {words}"
            axes.plot(curve.frequency[here], values[here], **look, **hollow, marker=marker, label=label)


def _scale_axes(upper: Any, lower: Any, panel: _Panel, intervals: int) -> None:
    """Set the ends and the ticks of the axes, so many intervals of phase between ticks at most."""
    frequency = np.concatenate([curve.frequency for curve in panel.curves])
    lower.set_xscale("log")
    lower.set_xlim(frequency.min() / 1.04, frequency.max() * 1.04)
    levels = np.concatenate([curve.level for curve in panel.curves])
    # room above the peaks for what marks them; a curve's depths below 120 dB say nothing
    bottom, top = max(levels.min(), levels.max() - 120), levels.max()
    margin = max(0.06 * (top - bottom), 1.0)
    upper.set_ylim(bottom - margin, top + 2.6 * margin)
    phases = np.concatenate([curve.phase for curve in panel.curves])
    span = phases.max() - phases.min()
    if span > 30:
        lower.yaxis.set_major_locator(MultipleLocator(next(s for s in _STEPS if span <= intervals * s)))
    lower.set_ylim(phases.min() - max(0.07 * span, 5), phases.max() + max(0.07 * span, 5))
    for axes in (upper, lower):
        axes.grid(which="major", color=GRID, linewidth=0.7)
        axes.grid(which="minor", axis="x", color=GRID, linewidth=0.35)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)


def _mark_published(upper: Any, lower: Any, panel: _Panel) -> None:
    """Draw the frequencies that others have found, named by the legend: close ones leave no room beside them."""
    marks = {label: frequency for curve in panel.curves for label, frequency in curve.bode.marks.items()}
    low, high = upper.get_xlim()
    there = [(label, frequency) for label, frequency in marks.items() if low < frequency < high]
    for (label, frequency), dashes in zip(there, itertools.cycle(_DASHES), strict=False):
        look = {"color": INK, "linewidth": 0.8, "linestyle": dashes, "zorder": 1.5}
        upper.axvline(frequency, **look, label=f"{label}, {frequency:g} Hz")
        lower.axvline(frequency, **look)


def _summit(curve: _Curve, peak: int) -> tuple[float, float]:
    """Return frequency [Hz] and level [dB] of a curve's peak; of a smooth line, between the points of its grid.

    Near a resonance 1 / |response|^2 is a parabola over the squared frequency, which three points give.
    """
    if not curve.is_line:
        return curve.frequency[peak], curve.level[peak]
    near = slice(peak - 1, peak + 2)
    square = curve.frequency[peak] ** 2
    offset, inverse = curve.frequency[near] ** 2 - square, 10 ** (-curve.level[near] / 10)
    a, b, c = np.polyfit(offset, inverse, 2)
    least = c - b**2 / (4 * a) if a > 0 else 0.0
    if least <= 0:  # no parabola that stays above 0: the grid is too coarse to tell
        return curve.frequency[peak], curve.level[peak]
    return math.sqrt(square - b / (2 * a)), -10 * math.log10(least)


def _mark_failures(axes: Any, panel: _Panel) -> None:
    """Mark the frequencies of failed points."""
    failed = np.unique(np.concatenate([curve.failed for curve in panel.curves]))
    if len(failed):
        bottom = np.full(len(failed), 0.03)
        transform = axes.get_xaxis_transform()
        axes.plot(failed, bottom, "x", color="#b00020", transform=transform, clip_on=False, label="failed", zorder=6)
