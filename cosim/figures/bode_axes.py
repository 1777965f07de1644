"""Axes of a Bode plot: magnitude and phase of a panel, its marks and legends."""

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from hfsa.cosim.figures.curves import Curve
from hfsa.cosim.figures.labels import spread_frequencies
from hfsa.cosim.figures.sheet import Panel, Sheet
from hfsa.cosim.figures.style import ACCENT, GRID, INK, LETTER_WIDTH, font_size
from hfsa.cosim.results.records import Status

PHASE_TICKS = (45, 90, 180, *range(360, 360_000, 360))
"""Intervals between phase ticks [deg]."""
Pair = tuple[Any, Any]
"""Axes of magnitude and of phase."""
_DASHES = ("-", (0, (1, 1.2)), (0, (6, 1.5, 1, 1.5)), (0, (3, 1)))
"""Line styles of the published frequencies of a scene."""

_HOLLOW = (
    (Status.NOT_SETTLED, "not settled", "o"),
    (Status.LIMITED, "at a limit", "s"),
    (Status.DISAGREES, "off the linear response", "D"),
)
"""Statuses of measured points that are not plain ones, in words, with their markers."""


def draw_panel(axes: Pair, panel: Panel, sheet: Sheet) -> None:
    """Draw magnitude and phase of a panel into its axes."""
    upper, lower = axes
    for curve in sorted(panel.curves, key=lambda curve: (not curve.is_faint, not curve.is_line)):
        _draw_curve(upper, curve, curve.level)
        _draw_curve(lower, curve, curve.phase)
    _scale_axes(upper, lower, panel, sheet.intervals)
    for peak in panel.peaks:
        for each in (upper, lower):
            each.axvline(peak.x, color=ACCENT, linewidth=0.9, linestyle=(0, (4, 3)), alpha=0.7, zorder=1)
    _mark_published(upper, lower, panel)
    _mark_failures(lower, panel)
    upper.set_ylabel(sheet.magnitude.format(f"dB re 1 {panel.unit}" if panel.unit else "dB"))
    lower.set_ylabel(sheet.phase)
    lower.set_xlabel(sheet.frequency)
    upper.set_title(panel.title, fontsize=font_size(0.85))
    spread_frequencies(lower)


def _draw_curve(axes: Any, curve: Curve, values: NDArray[np.float64]) -> None:
    """Draw a theoretical response as a line, a measured one as points."""
    if curve.is_line:
        look = {"linewidth": 1.0, "zorder": 1.2} if curve.is_faint else {"linewidth": 1.6, "alpha": 0.75, "zorder": 2}
        axes.plot(curve.frequency, values, color=curve.colour, label=curve.label, **look)
        return
    settled = curve.status == Status.DONE
    look = {"markersize": 3.0 if curve.is_faint else 5.2, "linestyle": "none", "zorder": 1.2 if curve.is_faint else 4}
    axes.plot(
        curve.frequency[settled],
        values[settled],
        **look,
        marker="v" if curve.is_downward else "o",
        color=curve.colour,
        markeredgecolor="white",
        markeredgewidth=0.8,
        label=curve.label,
    )
    for before, after in curve.jumps:
        ends = [(curve.frequency[k], values[k]) for k in (before, after)]
        arrow = {"arrowstyle": "->", "color": curve.colour, "linestyle": (0, (3, 2)), "shrinkA": 4, "shrinkB": 4}
        axes.annotate("", xytext=ends[0], xy=ends[1], arrowprops=arrow, zorder=3)
    hollow = {"color": "white", "markeredgecolor": curve.colour, "markeredgewidth": 1.2}
    for status, words, marker in _HOLLOW:
        here = curve.status == status
        if here.any():
            label = f"{curve.label}, {words}"
            axes.plot(curve.frequency[here], values[here], **look, **hollow, marker=marker, label=label)


def _scale_axes(upper: Any, lower: Any, panel: Panel, intervals: int) -> None:
    """Set limits and ticks of the axes, with at most `intervals` intervals between phase ticks."""
    frequency = np.concatenate([curve.frequency for curve in panel.curves])
    lower.set_xscale("log")
    lower.set_xlim(frequency.min() / 1.04, frequency.max() * 1.04)
    levels = np.concatenate([curve.level for curve in panel.curves])
    # margin above the peaks for their labels; values 120 dB below the largest are not shown
    bottom, top = max(levels.min(), levels.max() - 120), levels.max()
    margin = max(0.06 * (top - bottom), 1.0)
    upper.set_ylim(bottom - margin, top + 2.6 * margin)
    phases = np.concatenate([curve.phase for curve in panel.curves])
    span = phases.max() - phases.min()
    if span > 30:
        lower.yaxis.set_major_locator(MultipleLocator(next(s for s in PHASE_TICKS if span <= intervals * s)))
    lower.set_ylim(phases.min() - max(0.07 * span, 5), phases.max() + max(0.07 * span, 5))
    for axes in (upper, lower):
        axes.grid(which="major", color=GRID, linewidth=0.7)
        axes.grid(which="minor", axis="x", color=GRID, linewidth=0.35)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)


def _mark_published(upper: Any, lower: Any, panel: Panel) -> None:
    """Draw the published frequencies; the legend has their labels, as close lines leave no room for text."""
    marks = {label: frequency for curve in panel.curves for label, frequency in curve.bode.marks.items()}
    low, high = upper.get_xlim()
    there = [(label, frequency) for label, frequency in marks.items() if low < frequency < high]
    for (label, frequency), dashes in zip(there, itertools.cycle(_DASHES), strict=False):
        look = {"color": INK, "linewidth": 0.8, "linestyle": dashes, "zorder": 1.5}
        upper.axvline(frequency, **look, label=f"{label}, {frequency:g} Hz")
        lower.axvline(frequency, **look)


def _mark_failures(axes: Any, panel: Panel) -> None:
    """Mark the frequencies of failed points with crosses."""
    failed = np.unique(np.concatenate([curve.failed for curve in panel.curves]))
    if len(failed):
        bottom = np.full(len(failed), 0.03)
        transform = axes.get_xaxis_transform()
        axes.plot(failed, bottom, "x", color="#b00020", transform=transform, clip_on=False, label="failed", zorder=6)


def add_legend(figure: Figure, pairs: Sequence[Pair]) -> None:
    """Add one legend below the figure, with each entry of any panel once."""
    _add_legend(figure, {label: handle for pair in pairs for label, handle in _legend_entries(pair).items()}, 10)


def add_legends(figure: Figure, parts: Sequence[Any]) -> None:
    """Add one legend below the figure where all parts have the same entries, else one below each part."""
    found = [_legend_entries(part.axes) for part in parts]
    same = all(entries.keys() == found[0].keys() for entries in found)
    for owner, entries in [(figure, found[0])] if same else zip(parts, found, strict=True):
        _add_legend(owner, entries, 10 if same else 8.5)


def _add_legend(owner: Any, entries: dict[str, Any], size: float) -> None:
    """Add a legend below a figure or a part of it, with as many columns as fit."""
    width = owner.bbox.width / owner.get_figure(root=True).dpi
    fitting = max(int(width / (0.6 + LETTER_WIDTH * max(map(len, entries)))), 1)
    place = {"loc": "outside lower center", "ncols": min(len(entries), fitting)}
    owner.legend(list(entries.values()), list(entries), **place, fontsize=size)


def _legend_entries(every: Sequence[Any]) -> dict[str, Any]:
    """Return the legend entries of axes by label."""
    drawn = (zip(*axes.get_legend_handles_labels(), strict=True) for axes in every)
    return {label: handle for pairs in reversed(list(drawn)) for handle, label in pairs}
