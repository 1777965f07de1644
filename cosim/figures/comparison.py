"""Figure of a comparison: one panel per group of outputs, one colour per run, one line style per member.

    save(comparison_figure("The 3-RRR stage", ["pd", "ctc"], [outcome, outcome]), Path("results/stage.png"))

A panel shows |value| on a logarithmic axis where the peaks of the runs differ by more than two decades. A triangle at
the top marks the time from which a limit is active in the run of that colour; a cross marks the end of a failed run,
at the edge of the axes where its value lies outside.
"""

import itertools
import math
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from hfsa.cosim.figures.style import COLOURS, GRID, INK, STYLE, save
from hfsa.cosim.measurement.trial import Outcome, OutputGroup
from hfsa.cosim.signals.prefixes import prefixed

__all__ = ["comparison_figure", "save"]

_LINES = ("-", "--", ":", "-.")
_DECADES = 100.0
"""Ratio of peaks above which the axis is logarithmic."""
_ROUNDING = 1e-12
"""Relative size of an output, to the largest in the same unit, below which it is rounding noise."""
_FAILED = "#b00020"


def comparison_figure(title: str, labels: Sequence[str], outcomes: Sequence[Outcome]) -> Figure:
    """Return the figure of runs by label; a run without numbers appears in the legend only."""
    keys = list(dict.fromkeys(group.key for outcome in outcomes for group in outcome.groups))
    clock = prefixed(max((outcome.stop_time for outcome in outcomes), default=0.0), "s")
    with mpl.rc_context(STYLE):
        figure = Figure(layout="constrained", dpi=160)
        figure.suptitle(title, fontsize=12.5, fontweight="bold")
        panels, spare = _panels(figure, len(keys))
        for axes, key in zip(panels, keys, strict=True):
            groups = [next((g for g in o.groups if g.key == key), None) for o in outcomes]
            _draw(axes, groups, outcomes, clock[0], _rounding(key[1], outcomes))
            axes.set_xlabel(f"Time ({clock[1]})" if axes in panels[-2:] else "")
        for place, outcome in enumerate(outcomes if panels else ()):
            _mark_limits(panels[0], outcome, _colour(place, len(outcomes)), clock[0])
        entries = _legend(labels, outcomes)
        if spare is None:
            width = sum(len(str(entry.get_label())) + 8 for entry in entries)
            columns = math.ceil(len(entries) / math.ceil(width / (70 if len(keys) < 2 else 140)))
            figure.legend(handles=entries, loc="outside lower center", ncols=columns, fontsize=9.5)
        else:
            spare.set_axis_off()
            spare.legend(handles=entries, loc="center", ncols=1 + (len(entries) > 7), fontsize=10)
    return figure


def _panels(figure: Figure, count: int) -> tuple[list[Any], Any]:
    """Return `count` axes, the first of three or more twice as wide; and a spare one, if the grid has one."""
    rows = math.ceil((count + 1) / 2) if count > 2 else 1
    columns = min(max(count, 1), 2)
    figure.set_size_inches(5.6 * columns + 0.4, 2.5 * rows + 1.0)
    grid = figure.add_gridspec(rows, columns)
    below = [grid[row, column] for row in range(1, rows) for column in (0, 1)]
    places = [grid[0, :], *below] if count > 2 else [grid[0, column] for column in range(columns)]
    panels = [figure.add_subplot(place) for place in places]
    return panels[:count], panels[count] if len(panels) > count > 2 else None


def _colour(place: int, count: int) -> Any:
    """Return the colour of a run; for many runs, from a colour map."""
    return COLOURS[place] if count <= len(COLOURS) else mpl.colormaps["turbo"](0.05 + 0.9 * place / (count - 1))


def _rounding(unit: str, outcomes: Sequence[Outcome]) -> float:
    """Return the size below which an output of a unit is rounding noise."""
    peaks = [g.peak for o in outcomes for g in o.groups if g.unit == unit and math.isfinite(g.peak) and not o.failure]
    return _ROUNDING * max(peaks, default=0.0)


def _draw(
    axes: Any, groups: Sequence[OutputGroup | None], outcomes: Sequence[Outcome], clock: float, rounding: float
) -> None:
    """Draw one group of outputs of all runs; `clock` is the factor of time, `rounding` the size of rounding noise."""
    drawn = [group for group in groups if group is not None]
    # a diverging run must not determine the axes
    judged = [g for g, o in zip(groups, outcomes, strict=True) if g is not None and not o.failure] or drawn
    peaks = [group.peak for group in judged if rounding < group.peak < math.inf]
    is_logarithmic = len(peaks) > 1 and max(peaks) > _DECADES * min(peaks)
    factor, unit = prefixed(max([*peaks, rounding]), drawn[0].unit)
    ends: list[tuple[float, float]] = []
    for place, (group, outcome) in enumerate(zip(groups, outcomes, strict=True)):
        if group is not None:
            # each thinner than the one before, so that coinciding curves are all visible
            look = {"color": _colour(place, len(outcomes)), "linewidth": max(3.6 * 0.68**place, 0.9)}
            for curve, line in zip(group.curves, itertools.cycle(_LINES)):
                values = factor * (_sizes(curve.values) if is_logarithmic else curve.values)
                axes.plot(clock * curve.time, values, linestyle=line, **look)
                if outcome.failure:
                    ends.append((clock * curve.time[-1], values[-1]))
    _scale(axes, judged, factor, factor * rounding, is_logarithmic)
    for time, value in ends:  # at the edge for values outside the axes
        place = np.clip(np.nan_to_num(value, nan=-np.inf), *axes.get_ylim())
        axes.plot([time], [place], "x", color=_FAILED, markersize=7, clip_on=False, zorder=6)
    label = max(drawn, key=lambda group: len(group.curves)).label
    axes.set_title(f"|{label}|" if is_logarithmic else label, fontsize=9, loc="left")
    axes.set_ylabel("" if unit == "1" else unit)
    axes.grid(which="major", color=GRID, linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _sizes(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return |values|, NaN for 0, which a logarithmic axis cannot show."""
    size = np.abs(values)
    return np.where(size > 0, size, np.nan)


def _limit_times(outcome: Outcome) -> list[float]:
    """Return when limits that spoil a response begin to act, and when they do so to the end."""
    spoiling = [found for found in outcome.limits if found.limit.spoils_response]
    times = [time for found in spoiling for time in (found.first_time, found.lasting_since) if time is not None]
    return sorted(set(times))


def _mark_limits(axes: Any, outcome: Outcome, colour: Any, clock: float) -> None:
    """Put a triangle at the top of the axes whenever a limit begins to act."""
    for time in _limit_times(outcome):
        place = axes.get_xaxis_transform()
        axes.plot([clock * time], [1.0], "v", color=colour, markersize=6, transform=place, clip_on=False, zorder=6)


def _scale(axes: Any, groups: Sequence[OutputGroup], factor: float, rounding: float, is_logarithmic: bool) -> None:
    """Give the axis the reach of what is judged; of a logarithmic one, three decades below the smallest peak."""
    values = factor * np.concatenate([curve.values for group in groups for curve in group.curves])
    values = values[np.isfinite(values)]
    low, high = values.min(), values.max()
    if is_logarithmic:
        peaks = [factor * group.peak for group in groups]
        axes.set_yscale("log")
        axes.set_ylim(1e-3 * min(peak for peak in peaks if peak > rounding), 2.5 * max(peaks))
    elif max(abs(low), abs(high)) <= rounding:
        axes.set_ylim(-10 * rounding or -1, 10 * rounding or 1)
        axes.set_yticks([0.0])
    elif high > low:
        margin = 0.07 * (high - low)
        axes.set_ylim(low - margin, high + margin)


def _legend(labels: Sequence[str], outcomes: Sequence[Outcome]) -> list[Line2D]:
    """Return a legend entry for each run, each line style of members, and each kind of mark drawn."""
    entries = [
        Line2D([], [], color=_colour(i, len(labels)), linewidth=2.2, label=f"{label}, failed" if o.failure else label)
        for i, (label, o) in enumerate(zip(labels, outcomes, strict=True))
    ]
    most = max((len(group.curves) for outcome in outcomes for group in outcome.groups), default=1)
    if 1 < most <= len(_LINES):
        entries += [Line2D([], [], color=INK, linestyle=_LINES[i], label=f"[{i + 1}]") for i in range(most)]
    if any(_limit_times(outcome) for outcome in outcomes):
        entries.append(_mark("v", INK, "a limit becomes active"))
    if any(outcome.failure and outcome.groups for outcome in outcomes):
        entries.append(_mark("x", _FAILED, "end of a run that failed"))
    return entries


def _mark(marker: str, colour: str, label: str) -> Line2D:
    """Return the legend entry of a mark."""
    return Line2D([], [], marker=marker, color=colour, linestyle="none", markersize=6, label=label)
