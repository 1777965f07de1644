"""Thinning of recorded signals to what a page can show, with what it leaves out as a number."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray


def kept_rows(rows: int, most: int) -> NDArray[np.int64]:
    """Return `most` rows spread evenly over a recording, first and last among them, or all where there are fewer."""
    return np.unique(np.linspace(0, rows - 1, min(rows, most)).round().astype(int))


def lost_motion(at: NDArray[np.float64], signals: Sequence[NDArray[np.float64]], kept: NDArray[np.int64]) -> float:
    """Return the largest error of straight lines between kept rows, relative to the range of its signal."""
    errors = [0.0]
    for values in signals:
        size = float(np.ptp(values))
        if size > 0:
            errors.append(float(np.abs(np.interp(at, at[kept], values[kept]) - values).max()) / size)
    return max(errors)


def envelope(values: NDArray[np.float64], most: int) -> NDArray[np.int64]:
    """Return rows that draw the same curve: least and largest value of each of `most` / 2 stretches, or all rows."""
    if len(values) <= most:
        return np.arange(len(values))
    edges = np.linspace(0, len(values), most // 2 + 1).astype(int)
    kept = [0, len(values) - 1]
    for first, last in pairwise(edges):
        stretch = values[first:last]
        if np.any(np.isfinite(stretch)):
            kept += [first + int(np.nanargmin(stretch)), first + int(np.nanargmax(stretch))]
    return np.unique(kept)
