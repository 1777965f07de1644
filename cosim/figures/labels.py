"""Texts that keep clear: frequencies along an axis of each other, labels of peaks of each other and of curves.

    spread_frequencies(axes)
    figure.draw_without_rendering()               # the layout: only then is known where what stands
    label_peaks(axes, [Peak(24.5, 34.0, "24.5 Hz, 34.0 dB")], fontsize=9.5)

What finds no room is left out.
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullFormatter
from matplotlib.transforms import Bbox

_MANTISSAS = ((1, 2, 5), (1, 3), (1,))
_FEWEST = 3
"""Frequencies along an axis below which it has ticks between 1, 2 and 5."""
_APART = 0.5
"""Room between two frequencies along an axis, relative to the size of their letters."""
_GAP = 4.0
"""Room between a label and what it keeps clear of [points]."""


@dataclass(frozen=True)
class Peak:
    """A peak of a curve at data coordinates x, y, and what is to be said of it."""

    x: float
    y: float
    label: str


def spread_frequencies(axes: Any) -> None:
    """Put ticks on a logarithmic axis of frequencies, as many as have room for their numbers."""
    low, high = axes.get_xlim()
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    ticks: list[float] = []
    for ticks in _frequencies(low, high):
        axes.xaxis.set_major_locator(FixedLocator(ticks))
        if _are_apart(axes):
            return


def _frequencies(low: float, high: float) -> Iterator[list[float]]:
    """Yield the ticks between two frequencies, the most first."""
    decades = np.arange(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    rows = [[float(m * 10.0**n) for n in decades for m in mantissas] for mantissas in _MANTISSAS]
    rows = [[tick for tick in row if low <= tick <= high] for row in rows]
    if len(rows[0]) < _FEWEST:
        for most in (6, 5, 4, 3, 2, 1):
            found = MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
            yield [float(tick) for tick in found if low <= tick <= high]
    yield from rows
    for every in range(2, len(decades) + 1):
        yield rows[-1][::every]


def _are_apart(axes: Any) -> bool:
    """Whether the numbers along the axis of frequencies leave room between each other."""
    boxes = [text.get_window_extent() for text in axes.get_xticklabels() if text.get_text()]
    boxes = sorted((box for box in boxes if box.width > 0), key=lambda box: box.x0)
    return all(left.x1 + _APART * left.height <= right.x0 for left, right in itertools.pairwise(boxes))


def label_peaks(axes: Any, peaks: Sequence[Peak], **look: Any) -> None:
    """Write labels beside peaks, the first of them first, each where it touches no curve, no point and no other label.

    In one line or in two, and where that helps upon vertical lines, which mark frequencies. `look` is of the texts.
    """
    point = axes.get_figure(root=True).dpi / 72
    upright = [line for line in axes.lines if len(line.get_xdata()) > 1 and np.ptp(line.get_xdata()) == 0]
    curves = [line for line in axes.lines if line not in upright]
    taken: list[Bbox] = []
    for peak in peaks:
        for lines, label in itertools.product(((*curves, *upright), curves), (peak.label, _in_two_lines(peak.label))):
            text = _label(axes, peak, label, look)
            at, own = axes.transData.transform((peak.x, peak.y)), text.get_window_extent()
            boxes = _boxes(at, own, axes.get_window_extent(), _GAP * point)
            free = (box for box in boxes if not any(box.overlaps(other) for other in taken))
            if box := next((box for box in free if not any(_touches(line, box, point) for line in lines)), None):
                taken.append(box.padded(point))
                text.set_position(((box.x0 - own.x0) / point, (box.y0 - own.y0) / point))
                break
            text.remove()


def _label(axes: Any, peak: Peak, label: str, look: Mapping[str, Any]) -> Any:
    """Write a label whose lower left corner is at its peak, hiding the vertical lines behind it."""
    behind = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
    place = {"xytext": (0, 0), "textcoords": "offset points", "ha": "left", "va": "bottom", "annotation_clip": False}
    return axes.annotate(label, (peak.x, peak.y), **place, zorder=5, bbox=behind, in_layout=False, **look)


def _in_two_lines(label: str) -> str:
    """Return a label broken at its comma."""
    return label.replace(", ", "\n")


def _boxes(at: Sequence[float], own: Bbox, inside: Bbox, gap: float) -> Iterator[Bbox]:
    """Yield where a label may be [pixels]: beside its peak's frequency, close to the peak first."""
    lowest, highest = inside.y0 + gap, inside.y1 - own.height
    heights = [at[1] + gap, highest, *np.arange(min(at[1], highest), lowest, -own.height / 2)]
    for y, x in itertools.product(heights, (at[0] - gap - own.width, at[0] + gap)):
        if inside.x0 + gap <= x and x + own.width <= inside.x1 and lowest <= y <= highest:
            yield Bbox.from_bounds(x, y, own.width, own.height)


def _touches(line: Any, box: Bbox, point: float) -> bool:
    """Whether a line, or one of its markers, comes into a box."""
    path = line.get_transform().transform_path(line.get_path())
    if line.get_linestyle() != "None":
        return bool(path.intersects_bbox(box, filled=False))
    around = box.padded(line.get_markersize() * point / 2)
    x, y = np.asarray(path.vertices).T
    return bool(np.any((x > around.x0) & (x < around.x1) & (y > around.y0) & (y < around.y1)))
