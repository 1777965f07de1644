"""What an error of a response counts relative to, and at which frequencies it is looked for.

    scale = Scale(grid, np.abs(exact_on_grid))
    error = np.abs(found - exact) / scale.at(frequency, exact)

Pointwise an anti-resonance would count for infinitely much, because a zero that moves by a hair changes nothing but
itself: so valleys of |H| that are narrower than an octave are filled up to their lower edge (a morphological closing),
and there an error is measured by what surrounds it. Slopes and resonances stay as they are.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

_AROUND = np.array([-4, -2, -1, -0.5, 0, 0.5, 1, 2, 4])
"""Frequencies around a mode, in half-widths of its resonance."""


class Scale:
    """Magnitudes of a response, its notches filled.

    `grid` [Hz] is (n,) with a constant ratio of neighbours, `size` are the magnitudes there, (n, outputs, inputs).
    """

    def __init__(self, grid: NDArray[np.float64], size: NDArray[np.float64]):
        self._grid, self._filled = np.log(grid), fill_valleys(size, grid)

    def at(self, frequency: NDArray[np.float64], response: NDArray[np.complex128]) -> NDArray[np.float64]:
        """Return the scale at frequencies [Hz], of the shape of the response there, which counts where it is larger."""
        place = np.interp(np.log(frequency), self._grid, np.arange(len(self._grid)))
        below = np.minimum(place.astype(int), len(self._grid) - 2)
        part = (place - below)[:, None, None]
        between = (1 - part) * self._filled[below] + part * self._filled[below + 1]
        return np.maximum(np.maximum(np.abs(response), between), np.finfo(float).tiny)


def near_modes(poles: NDArray[np.complex128], band: tuple[float, float]) -> NDArray[np.float64]:
    """Return frequencies [Hz] within a band at and around the resonance of every mode; `poles` in 1/s."""
    poles = poles[poles.imag > 0]
    around = (poles.imag[:, None] + np.abs(poles.real)[:, None] * _AROUND).ravel() / (2 * np.pi)
    return around[(around > band[0]) & (around < band[1])]


def fill_valleys(size: NDArray[np.float64], frequency: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return magnitudes with valleys that are narrower than an octave filled up to their lower edge.

    `size` has shape (n, ...), `frequency` [Hz] is (n,) with a constant ratio of neighbours. At each frequency it is the
    least that a window of an octave which holds it can have for its largest; a window ends with the band.
    """
    n = len(frequency)
    window = min(max(round((n - 1) * np.log(2) / np.log(frequency[-1] / frequency[0])), 1), 2 * n)
    beyond = np.pad(size, [(window, window), *[(0, 0)] * (size.ndim - 1)])
    highest = maximum_filter1d(beyond, window, axis=0, mode="constant")
    lowest = minimum_filter1d(highest, window, axis=0, mode="constant", origin=-1 if window % 2 == 0 else 0)
    return lowest[window:-window]
