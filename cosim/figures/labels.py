"""Placement of tick labels and peak labels without overlaps.

    spread_frequencies(axes)
    figure.draw_without_rendering()               # fixes the layout, from which positions are known
    label_peaks(axes, [Peak(24.5, 34.0, "24.5 Hz, 34.0 dB")], fontsize=9.5)

A label without a free place is left out.
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator, NullFormatter
from matplotlib.transforms import Bbox

_MANTISSAS = ((1, 2, 5), (1, 3), (1,))
_FEWEST = 3
"""Number of ticks at 1, 2 and 5 below which the axis has ticks between them."""
_APART = 0.5
"""Least gap between two tick labels, relative to their font size."""
_GAP = 4.0
"""Gap between a label and other objects [points]."""


@dataclass(frozen=True)
class Peak:
    """Peak of a curve at data coordinates x, y, and its label."""

    x: float
    y: float
    label: str


@dataclass(frozen=True)
class Text:
    """Text beside a point at data coordinates x, y."""

    x: float
    y: float
    words: str


def spread_frequencies(axes: Any) -> None:
    """Set the ticks of a logarithmic horizontal axis of frequencies or costs, as many as their labels have room for."""
    low, high = axes.get_xlim()
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    ticks: list[float] = []
    for ticks in _frequencies(low, high):
        axes.xaxis.set_major_locator(FixedLocator(ticks))
        if _are_apart(axes):
            return


def _frequencies(low: float, high: float) -> Iterator[list[float]]:
    """Yield sets of ticks between two frequencies, the largest first."""
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
    """Whether the tick labels of the frequency axis keep their least gap."""
    boxes = [text.get_window_extent() for text in axes.get_xticklabels() if text.get_text()]
    boxes = sorted((box for box in boxes if box.width > 0), key=lambda box: box.x0)
    return all(left.x1 + _APART * left.height <= right.x0 for left, right in itertools.pairwise(boxes))


def label_peaks(axes: Any, peaks: Sequence[Peak], **look: Any) -> None:
    """Add labels beside peaks, in their order, each where it touches no curve, point or other label.

    A label has one line or two, and may cover vertical lines, which mark frequencies, where no other place is free.
    `look` holds properties of the texts.
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


def place_texts(axes: Any, texts: Sequence[Text], **look: Any) -> None:
    """Add texts beside their points, each where it lies on no other, within the axes, and if possible on no line.

    `look` holds properties of the texts.
    """
    point = axes.get_figure(root=True).dpi / 72
    inside = axes.get_window_extent()
    lines = [
        drawn.get_transform().transform_path(path)
        for drawn in axes.collections
        if isinstance(drawn, LineCollection)
        for path in drawn.get_paths()
    ]
    taken: list[Bbox] = []
    for text in texts:
        place = {"xytext": (0, 0), "textcoords": "offset points", "ha": "left", "va": "bottom", "in_layout": False}
        drawn = axes.annotate(text.words, (text.x, text.y), annotation_clip=False, **place, **look)
        at, own = axes.transData.transform((text.x, text.y)), drawn.get_window_extent()
        boxes = list(_beside(at, own, _GAP * point))
        free = [box for box in boxes if not any(box.overlaps(other) for other in taken)]
        within = [box for box in free if _is_within(box, inside)]
        clear = [box for box in within if not any(path.intersects_bbox(box, filled=False) for path in lines)]
        box = (clear or within or free or boxes)[0]
        taken.append(box)
        drawn.set_position(((box.x0 - own.x0) / point, (box.y0 - own.y0) / point))


def _beside(at: Sequence[float], own: Bbox, gap: float) -> Iterator[Bbox]:
    """Yield boxes of a text [pixels] around its point, the best first: to its right, to its left, above and below."""
    right, left, center = gap, -own.width - gap, -own.width / 2
    middle, above, below = -own.height / 2, gap, -own.height - gap
    beside = [(x, y) for y in (middle, above, below) for x in (right, left)]
    for times in (1.0, 2.5):
        for x, y in [*beside, (center, above), (center, below)]:
            yield Bbox.from_bounds(
                at[0] + x, at[1] + y + (times - 1) * own.height * np.sign(y + own.height / 2), *own.size
            )


def _is_within(box: Bbox, around: Bbox) -> bool:
    """Whether a box lies within another."""
    return around.x0 <= box.x0 and box.x1 <= around.x1 and around.y0 <= box.y0 and box.y1 <= around.y1


def _label(axes: Any, peak: Peak, label: str, look: Mapping[str, Any]) -> Any:
    """Add a label with its lower left corner at the peak and a background that hides lines behind it."""
    behind = {"facecolor": "white", "edgecolor": "none", "pad": 0.5}
    place = {"xytext": (0, 0), "textcoords": "offset points", "ha": "left", "va": "bottom", "annotation_clip": False}
    return axes.annotate(label, (peak.x, peak.y), **place, zorder=5, bbox=behind, in_layout=False, **look)


def _in_two_lines(label: str) -> str:
    """Return a label broken at its comma."""
    return label.replace(", ", "\n")


def _boxes(at: Sequence[float], own: Bbox, inside: Bbox, gap: float) -> Iterator[Bbox]:
    """Yield possible boxes of a label [pixels] on either side of the peak frequency, the closest first."""
    lowest, highest = inside.y0 + gap, inside.y1 - own.height
    heights = [at[1] + gap, highest, *np.arange(min(at[1], highest), lowest, -own.height / 2)]
    for y, x in itertools.product(heights, (at[0] - gap - own.width, at[0] + gap)):
        if inside.x0 + gap <= x and x + own.width <= inside.x1 and lowest <= y <= highest:
            yield Bbox.from_bounds(x, y, own.width, own.height)


def _touches(line: Any, box: Bbox, point: float) -> bool:
    """Whether a line, or one of its markers, intersects a box."""
    path = line.get_transform().transform_path(line.get_path())
    if line.get_linestyle() != "None":
        return bool(path.intersects_bbox(box, filled=False))
    around = box.padded(line.get_markersize() * point / 2)
    x, y = np.asarray(path.vertices).T
    return bool(np.any((x > around.x0) & (x < around.x1) & (y > around.y0) & (y < around.y1)))
