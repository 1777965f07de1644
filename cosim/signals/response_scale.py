"""Scale of the relative error of a response, and the frequencies at which the error is evaluated.

    scale = Scale(grid, np.abs(exact_on_grid))
    error = np.abs(found - exact) / scale.at(frequency, exact)

A pointwise relative error is infinite at an antiresonance, although a small shift of a zero is harmless. Therefore
valleys of |H| narrower than an octave are filled up to their lower edge (a morphological closing), so that an error
there is relative to the surroundings. Slopes and resonances are unchanged.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

_AROUND = np.array([-4, -2, -1, -0.5, 0, 0.5, 1, 2, 4])
"""Frequencies about a mode, in half-widths of its resonance."""


class Scale:
    """Magnitudes of a response with its valleys filled.

    `grid` [Hz] is (n,) with a constant ratio of neighbours, `size` the magnitudes there, (n, outputs, inputs).
    """

    def __init__(self, grid: NDArray[np.float64], size: NDArray[np.float64]):
        self._grid, self._filled = np.log(grid), fill_valleys(size, grid)

    def at(self, frequency: NDArray[np.float64], response: NDArray[np.complex128]) -> NDArray[np.float64]:
        """Return the larger of scale and |response| at frequencies [Hz], in the shape of the response there."""
        place = np.interp(np.log(frequency), self._grid, np.arange(len(self._grid)))
        below = np.minimum(place.astype(int), len(self._grid) - 2)
        part = (place - below)[:, None, None]
        between = (1 - part) * self._filled[below] + part * self._filled[below + 1]
        return np.maximum(np.maximum(np.abs(response), between), np.finfo(float).tiny)


def near_modes(poles: NDArray[np.complex128], band: tuple[float, float]) -> NDArray[np.float64]:
    """Return frequencies [Hz] within a band at and about the resonance of every mode; `poles` in 1/s."""
    poles = poles[poles.imag > 0]
    around = (poles.imag[:, None] + np.abs(poles.real)[:, None] * _AROUND).ravel() / (2 * np.pi)
    return around[(around > band[0]) & (around < band[1])]


def fill_valleys(size: NDArray[np.float64], frequency: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return magnitudes with valleys narrower than an octave filled up to their lower edge.

    `size` has shape (n, ...), `frequency` [Hz] is (n,) with a constant ratio of neighbours. At a frequency the result
    is the smallest of the maxima over all octave-wide windows that contain it; windows end with the band.
    """
    n = len(frequency)
    window = min(max(round((n - 1) * np.log(2) / np.log(frequency[-1] / frequency[0])), 1), 2 * n)
    beyond = np.pad(size, [(window, window), *[(0, 0)] * (size.ndim - 1)])
    return _of_neighbours(np.minimum, _of_neighbours(np.maximum, beyond, window), window)[1 : n + 1]


def _of_neighbours(extreme: Callable[..., Any], values: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return the extreme of each `count` neighbours of n along the first axis, (n - count + 1, ...)."""
    width = 1
    while 2 * width <= count:
        values, width = extreme(values[:-width], values[width:]), 2 * width
    rest = count - width
    return extreme(values[:-rest], values[rest:]) if rest else values
