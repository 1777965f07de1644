"""Figure of recorded signals: over time, or over each other as loops, paths and clouds.

    figure = plot("results/stage_tracking_run.h5", ["stage.stack[1..3].force"], x="stage.stack[1..3].elongation")
    figure.savefig("force.pdf")

A panel has the signals of one unit whose names differ in their indices only. Of one file each signal has a colour, of
several files each file has one, and each signal a line style. Over an axis in their own unit, signals have equal
scales, but numbers of a table.
"""

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from hfsa.cosim.figures.style import COLOURS, GRID, INK, STYLE, save
from hfsa.cosim.measurement.limit_flags import is_limit
from hfsa.cosim.measurement.trial import thinned
from hfsa.cosim.results.recorded import CASE, ROW, TIME, Recorded, read_recorded
from hfsa.cosim.results.records import ResultsError
from hfsa.cosim.signals.prefixes import prefixed
from hfsa.cosim.systems.names import compact, expand, legible, matching_names, nearest

__all__ = ["plot", "save", "signals_figure"]

_LINES = ("-", "--", ":", "-.")
_INDEX = re.compile(r"\[\d+\]")
_MANY = 20_000
"""Points above which a curve is drawn as pixels, also in a vector picture."""


@dataclass(frozen=True)
class _Pair:
    """A signal with what it is drawn over, both names; the axis of the file where that is `None`."""

    signal: str
    over: str | None

    @property
    def panel(self) -> tuple[str, str]:
        """The panel, by both names without indices."""
        return _INDEX.sub("", self.signal), _INDEX.sub("", self.over or "")


@dataclass(frozen=True)
class _Scale:
    """Scale of an axis: `factor` from `unit` to the `shown` one."""

    name: str
    unit: str
    factor: float
    shown: str

    @property
    def label(self) -> str:
        """Name and unit."""
        return self.name if self.shown == "1" else f"{self.name} ({self.shown})"


@dataclass(frozen=True)
class _Look:
    """Look of a curve: places of its colour and line style, points instead of a line, or the signal that colours."""

    colour: int
    line: int
    dotted: bool
    shade: str | None


def plot(
    files: str | Path | Sequence[str | Path],
    signals: Sequence[str] = (),
    *,
    x: str | None = None,
    colour: str | None = None,
    points: bool | None = None,
    low: float | None = None,
    high: float | None = None,
) -> Figure:
    """Return the figure of signals in the files of runs or paths.

    Args:
        files: one results file, or several to draw over each other.
        signals: names, full or short, also with ranges (default: all that are no limit flags).
        x: signal on the horizontal axis, or one for each of `signals` by a range (default: the time, or the row).
        colour: signal that colours the points of one file.
        points: whether to draw points instead of lines (default: where rows have no time, and with `colour`).
        low: first time to draw [s], or row (default: that of the file).
        high: last time to draw [s], or row (default: that of the file).

    Raises:
        ResultsError: a file without such signals; a name that matches none or several.
    """
    several = [files] if isinstance(files, str | Path) else list(files)
    recorded = [read_recorded(file).between(low, high) for file in several]
    return signals_figure(recorded, signals, x, colour, points)


def signals_figure(
    recorded: Sequence[Recorded],
    signals: Sequence[str] = (),
    x: str | None = None,
    colour: str | None = None,
    points: bool | None = None,
) -> Figure:
    """Return the figure of recorded signals; arguments and errors are those of `plot`."""
    pairs = _pairs(recorded, signals, x)
    shade = _full_names(recorded, [colour])[0] if colour is not None else None
    if shade is not None and len(recorded) > 1:
        raise ResultsError(f"the colour {shade} is for the points of one file; there are {len(recorded)}")
    panels: dict[tuple[tuple[str, str], str], list[_Pair]] = {}
    for pair in pairs:  # elements of a vector, such as a pose, may have several units
        panels.setdefault((pair.panel, _unit(recorded, pair.signal)), []).append(pair)
    columns = min(len(panels), 2)
    rows = -(-len(panels) // columns)
    tall = 4.4 if x is not None else 2.7
    with mpl.rc_context({**STYLE, "agg.path.chunksize": _MANY}):
        figure = Figure(figsize=(5.6 * columns + 0.4, tall * rows + 0.9), layout="constrained", dpi=160)
        titles = dict.fromkeys(found.title for found in recorded)
        figure.suptitle(", ".join(titles), fontsize=11, fontweight="bold", wrap=True)
        grid = figure.subplots(rows, columns, squeeze=False).ravel()
        for unused in grid[len(panels) :]:
            unused.remove()
        for axes, members in zip(grid, panels.values(), strict=False):
            _draw(axes, recorded, members, shade, points)
        if len(recorded) > 1:
            entries = [
                Line2D([], [], color=_colour(i), linewidth=2.2, label=legible(found.path.stem))
                for i, found in enumerate(recorded)
            ]
            figure.legend(handles=entries, loc="outside lower center", ncols=min(len(entries), 4), fontsize=9.5)
    return figure


def _pairs(recorded: Sequence[Recorded], signals: Sequence[str], x: str | None) -> list[_Pair]:
    """Return the signals with what each is drawn over; `ResultsError` where their numbers do not fit."""
    over = [] if x is None else _full_names(recorded, [x])
    known = dict.fromkeys(name for found in recorded for name in found.values if not is_limit(name))
    names = _full_names(recorded, signals) if signals else [name for name in known if name not in over]
    if len(over) > 1 and len(over) != len(names):
        raise ResultsError(
            f"{len(names)} signals cannot be drawn over the {len(over)} of {x}; expected one, or one for each signal"
        )
    if not names:
        raise ResultsError(f"{recorded[0].path} has no signal to draw{'' if x is None else f' over {x}'}")
    each = over if len(over) > 1 else itertools.repeat(over[0] if over else None)
    return [_Pair(name, other) for name, other in zip(names, each, strict=False)]


def _full_names(recorded: Sequence[Recorded], wanted: Sequence[str]) -> list[str]:
    """Return the full names of signals as typed; `ResultsError` for a name that matches none or several."""
    known = list(dict.fromkeys(name for found in recorded for name in found.values))
    names = []
    for word in (member for item in wanted for member in expand(item)):
        fitting = matching_names(word, known)
        if len(fitting) != 1:
            files = ", ".join(str(found.path) for found in recorded)
            raise ResultsError(
                f"{word} fits several signals of {files}: {', '.join(fitting)}; expected one of them"
                if fitting
                else f"{files}: no signal is called {word!r}{nearest(word, known)}"
            )
        names += fitting
    return names


def _draw(
    axes: Any, recorded: Sequence[Recorded], members: Sequence[_Pair], shade: str | None, points: bool | None
) -> None:
    """Draw the signals of one panel."""
    across, up = _scales(recorded, members)
    for i, found in enumerate(recorded):
        dotted = (found.axis == ROW or shade is not None) if points is None else points
        for k, pair in enumerate(members):
            if pair.signal in found.values and (pair.over is None or pair.over in found.values):
                values = found.values[pair.signal]
                at = found.at if pair.over is None else found.values[pair.over]
                if pair.over is None and not dotted:
                    at, values = thinned(at, values)
                place = i if len(recorded) > 1 else k
                _curve(axes, across.factor * at, up.factor * values, _Look(place, k, dotted, shade), found)
    axes.set_xlabel(across.label)
    if members[0].over is None:
        axes.set_title(up.name, fontsize=9, loc="left")
        axes.set_ylabel(up.shown if up.shown != "1" else "")
    else:
        axes.set_ylabel(up.label)
        if across.unit == up.unit and recorded[0].axis != CASE:
            axes.set_aspect("equal", adjustable="datalim")
    if 1 < len(members) <= len(COLOURS) and shade is None:
        _name_members(axes, members, len(recorded) > 1)
    axes.grid(which="major", color=GRID, linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _scales(recorded: Sequence[Recorded], members: Sequence[_Pair]) -> tuple[_Scale, _Scale]:
    """Return the horizontal and the vertical scale of a panel, equal where the units are."""
    signals, over = [pair.signal for pair in members], [pair.over for pair in members if pair.over is not None]
    up = _scale(_name(signals), _size(recorded, signals), _unit(recorded, signals[0]))
    if not over:
        largest = max(float(np.abs(found.at).max(initial=0.0)) for found in recorded)
        axis = recorded[0].axis
        return _scale(axis.title(), largest, "s" if axis == TIME else "1"), up
    unit = _unit(recorded, over[0])
    if unit != up.unit:
        return _scale(_name(over), _size(recorded, over), unit), up
    size = _size(recorded, [*over, *signals])
    return _scale(_name(over), size, unit), _scale(up.name, size, unit)


def _scale(name: str, size: float, unit: str) -> _Scale:
    """Return the scale of values of a size."""
    return _Scale(name, unit, *prefixed(size, unit))


def _name_members(axes: Any, members: Sequence[_Pair], by_line: bool) -> None:
    """Add a legend of the indices of the signals, by line style or by colour."""
    handles = [
        Line2D(
            [],
            [],
            linestyle=_LINES[k % len(_LINES)],
            color=INK if by_line else _colour(k),
            label="".join(_INDEX.findall(pair.signal)),
        )
        for k, pair in enumerate(members)
    ]
    axes.legend(handles=handles, fontsize=8, ncols=3)


def _curve(axes: Any, x: NDArray[np.float64], y: NDArray[np.float64], look: _Look, found: Recorded) -> None:
    """Draw one curve, or its points, coloured by a signal if one is given."""
    is_many = len(x) > _MANY
    if look.shade is not None:
        scale = _scale(look.shade, _size([found], [look.shade]), found.units[look.shade])
        drawn = axes.scatter(x, y, c=scale.factor * found.values[look.shade], s=5, cmap="viridis", rasterized=is_many)
        bar = axes.figure.colorbar(drawn, ax=axes, pad=0.02)
        bar.outline.set_visible(False)
        bar.set_label(scale.label, fontsize=9)
    elif look.dotted:
        axes.plot(x, y, ".", color=_colour(look.colour), markersize=3, rasterized=is_many)
    else:
        line = _LINES[look.line % len(_LINES)]
        axes.plot(x, y, color=_colour(look.colour), linestyle=line, linewidth=1.3, rasterized=is_many)


def _colour(place: int) -> str:
    """Return a colour by its place."""
    return COLOURS[place % len(COLOURS)]


def _unit(recorded: Sequence[Recorded], name: str) -> str:
    """Return the unit of a signal; `ResultsError` where files differ in it."""
    units = dict.fromkeys(found.units[name] for found in recorded if name in found.values)
    if len(units) > 1:
        raise ResultsError(f"{name} is in {' and '.join(units)}; expected files with one unit of it")
    return next(iter(units))


def _size(recorded: Sequence[Recorded], names: Sequence[str]) -> float:
    """Return the largest finite size of signals, 0 for none."""
    every = (found.values[name] for found in recorded for name in names if name in found.values)
    return max((float(np.abs(v[np.isfinite(v)]).max(initial=0.0)) for v in every), default=0.0)


def _name(names: Sequence[str]) -> str:
    """Return the common name of the members of a panel, `stage.stack[1..3].force`."""
    return ", ".join(compact(dict.fromkeys(names)))
