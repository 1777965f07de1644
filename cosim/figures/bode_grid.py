"""Bode plot of many responses: small panels that share axes, named at the edges of the sheet.

Panels of one unit share the magnitudes of the sheet, those of one row their phases, and all their frequencies. Ticks
have labels where a scale begins: magnitudes also beside a panel of another unit.
"""

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from hfsa.cosim.figures.bode_axes import PHASE_TICKS, Pair, draw_panel
from hfsa.cosim.figures.labels import spread_frequencies
from hfsa.cosim.figures.sheet import Panel, Sheet
from hfsa.cosim.figures.style import LETTER_WIDTH, font_size

_HEIGHTS = (1.7, 1.0, 0.22)
"""Heights of magnitude, phase and the gap below them, relative to that of the phase."""
_HEADING = 1.2
"""Font size of a heading, relative to that of the figure."""
_LETTER = LETTER_WIDTH * 0.85
"""Width of a letter of a heading [inch]."""


def draw_grid(part: Any, sheet: Sheet) -> list[tuple[Pair, Panel]]:
    """Draw the panels of a sheet that share axes into a part of the figure; return each with its axes."""
    heights = list(_HEIGHTS) * len(sheet.rows)
    grid = part.add_gridspec(len(heights) - 1, len(sheet.rows[0]), height_ratios=heights[:-1])
    pairs: dict[tuple[int, int], Pair] = {}
    for (j, row), (i, _) in itertools.product(enumerate(sheet.rows), enumerate(sheet.rows[0])):
        if panel := row[i]:
            pairs[j, i] = (part.add_subplot(grid[3 * j, i]), part.add_subplot(grid[3 * j + 1, i]))
            draw_panel(pairs[j, i], panel, sheet)
    panels = {place: panel for place in pairs if (panel := sheet.rows[place[0]][place[1]])}
    _share(pairs, panels, sheet.intervals)
    _hide_inner_labels(pairs, panels)
    for i, heading in enumerate(sheet.above):
        top = next(pairs[place] for place in sorted(pairs) if place[1] == i)
        top[0].set_title(_broken(heading, sheet.size[0] / len(sheet.above)), fontsize=font_size(_HEADING))
    if sheet.heading:
        part.suptitle(sheet.heading, fontsize=font_size(1.4 * _HEADING))
    return [(pairs[place], panels[place]) for place in pairs]


def name_rows(figure: Figure, drawn: Sequence[tuple[Pair, Panel]], sheet: Sheet, left: float) -> None:
    """Write the headings of the rows to the left of their panels, whose places are final; `left` [figure width]."""
    to_figure = figure.transFigure.inverted()
    for row, heading in zip(sheet.rows, sheet.beside, strict=True):
        upper, lower = next(pair for pair, panel in drawn if any(panel is there for there in row))
        top, bottom = upper.get_window_extent().y1, lower.get_window_extent().y0
        words = _broken(heading, sheet.size[1] / len(sheet.rows))
        place = {"rotation": 90, "ha": "center", "va": "center", "fontsize": font_size(_HEADING)}
        figure.text(left, to_figure.transform((0.0, (top + bottom) / 2))[1], words, **place)


def _share(pairs: dict[tuple[int, int], Pair], panels: dict[tuple[int, int], Panel], intervals: int) -> None:
    """Give panels the limits that they share: frequencies, magnitudes of a unit, phases of a row."""
    _limit([lower for _, lower in pairs.values()], "x")
    for unit in {panel.unit for panel in panels.values()}:
        _limit([pairs[place][0] for place, panel in panels.items() if panel.unit == unit], "y")
    for row in {j for j, _ in pairs}:
        lowers = [pairs[place][1] for place in pairs if place[0] == row]
        low, high = _limit(lowers, "y")
        if high - low > PHASE_TICKS[0]:
            step = next(tick for tick in PHASE_TICKS if high - low <= (intervals + 1) * tick)
            for axes in lowers:
                axes.yaxis.set_major_locator(MultipleLocator(step))
    for upper, lower in pairs.values():
        spread_frequencies(lower)
        upper.set_xscale("log")
        upper.set_xlim(lower.get_xlim())
        upper.xaxis.set_major_locator(lower.xaxis.get_major_locator())
        upper.tick_params(axis="x", which="both", labelbottom=False)


def _limit(every: Sequence[Any], letter: str) -> tuple[float, float]:
    """Give axes the limits that contain those of each; return them."""
    limits = np.array([getattr(axes, f"get_{letter}lim")() for axes in every])
    low, high = float(limits[:, 0].min()), float(limits[:, 1].max())
    for axes in every:
        getattr(axes, f"set_{letter}lim")(low, high)
    return low, high


def _hide_inner_labels(pairs: dict[tuple[int, int], Pair], panels: dict[tuple[int, int], Panel]) -> None:
    """Leave labels of ticks and axes only where a scale begins."""
    for (j, i), (upper, lower) in pairs.items():
        before = [place for place in pairs if place[0] == j and place[1] < i]
        if before:
            lower.tick_params(axis="y", labelleft=False)
            lower.set_ylabel("")
            if panels[max(before)].unit == panels[j, i].unit:
                upper.tick_params(axis="y", labelleft=False)
                upper.set_ylabel("")
        if any(place[1] == i and place[0] > j for place in pairs):
            lower.tick_params(axis="x", labelbottom=False)
            lower.set_xlabel("")


def _broken(name: str, room: float) -> str:
    """Return a name, in two lines broken after the dot closest to its middle where it is wider than its room [inch]."""
    dots = [k + 1 for k, letter in enumerate(name) if letter == "."]
    if not dots or _LETTER * len(name) <= room:
        return name
    at = min(dots, key=lambda k: abs(k - len(name) / 2))
    return f"{name[:at]}\n{name[at:]}"
