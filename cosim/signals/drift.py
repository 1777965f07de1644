"""Drift of a measured signal: a polynomial of time, known from the means of windows, and removed from their amplitudes.

    drift = of_sine(samples=1000, turn=2 * np.pi * 1e-3)         # or of_lines(points, lines)
    amplitudes, doubt = drift.removed(means, amplitudes)         # of all windows so far

A signal y = D(t) + p(t) is a drift D and a periodic signal p with any harmonics. A straight line in the basis of a fit
would take part of the higher harmonics for a drift, and so change the amplitudes of a signal that does not drift. The
means of successive windows depend on p alike, their differences not at all. A polynomial D of degree d follows from
d + 1 means, and what it adds to the amplitudes of a window from its projection on their basis, which is known: a signal
that does not drift stays as it is, and one that drifts along the polynomial is measured without error.

A drift of degree 2 is removed: a parabola is what a double integrator makes of a constant. The change by one degree
more is the doubt. It is constant where the drift is a cubic, so such a signal does not settle.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import comb

import numpy as np
from numpy.typing import NDArray

DEGREE = 2
"""Degree of the drift that is removed, where there are windows enough."""

_BLOCK = 4096
"""Samples that enter a projection together."""


@dataclass(frozen=True, eq=False)
class Drift:
    """Projections of the powers of time, 1 to `DEGREE` + 1, on the basis of a window.

    Time is in windows, from the middle of the window.

    Attributes:
        mean: mean that each power contributes, (powers,).
        amplitude: complex amplitudes that each contributes, (powers, amplitudes), of phase 0 at the first sample of the
            window.
        turn: phase of each amplitude at the first sample of a window after that of the window before [rad],
            (amplitudes,).
    """

    mean: NDArray[np.float64]
    amplitude: NDArray[np.complex128]
    turn: NDArray[np.float64]
    _weights: dict[tuple[int, int], NDArray[np.complex128]] = field(default_factory=dict)

    def removed(
        self, means: NDArray[np.float64], amplitudes: NDArray[np.complex128], first: int = 0
    ) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
        """Return the amplitudes without a drift, (windows, amplitudes, signals), and the doubt about the last window's.

        `means` has shape (windows, signals), `amplitudes` is relative to phase 0 at the begin of window 0, and `first`
        is the number of the first window. The doubt has shape (amplitudes, signals); it is 0 for a single window,
        which shows no drift.
        """
        windows = len(means)
        degree = max(min(DEGREE, windows - 2), 0)
        turned = np.exp(-1j * self.turn * (first + np.arange(windows))[:, None])[:, :, None]
        contributed = np.array([self._contributed(means, k, degree) for k in range(windows)])
        doubt = np.zeros(amplitudes.shape[1:])
        if windows > 1:
            doubt = np.abs(self._contributed(means, windows - 1, degree + 1) - contributed[-1])
        return amplitudes - turned * contributed, doubt

    def _contributed(self, means: NDArray[np.float64], window: int, degree: int) -> NDArray[np.complex128]:
        """Return what a drift of a degree contributes to the amplitudes of a window, (amplitudes, signals)."""
        begin = max(window - degree, 0)
        own = means[begin : begin + degree + 1]
        # differences of large means keep their digits
        return self._weights_of(degree, window - begin) @ (own - own[0])

    def _weights_of(self, degree: int, place: int) -> NDArray[np.complex128]:
        """Return the weights of degree + 1 means in the amplitudes of the window at a place among them."""
        key = degree, place
        if key not in self._weights:
            found = np.zeros((self.amplitude.shape[1], degree + 1), complex)
            if degree:
                inverse = np.linalg.inv(self._means_of_powers(degree, place))
                found = self.amplitude[:degree].T @ inverse[1:]
            self._weights[key] = found
        return self._weights[key]

    def _means_of_powers(self, degree: int, place: int) -> NDArray[np.float64]:
        """Return the means of windows, (windows, powers), of powers 0 to `degree` of the time since one of them."""
        of_powers = np.concatenate([[1.0], self.mean])
        rows = [
            [sum(comb(q, j) * float(k) ** (q - j) * of_powers[j] for j in range(q + 1)) for q in range(degree + 1)]
            for k in range(-place, degree + 1 - place)
        ]
        return np.array(rows)


def of_sine(samples: int, turn: float, harmonics: int = 3) -> Drift:
    """Return the drift of a least-squares fit of a mean, a fundamental and harmonics, as a lock-in amplifier does.

    `samples` is the number of samples in a window, `turn` the phase of the fundamental per sample [rad].
    """
    order = np.arange(1, harmonics + 1)
    size = 1 + 2 * harmonics
    gram, moment = np.zeros((size, size)), np.zeros((size, DEGREE + 1))
    for number in _blocks(samples):
        phase = turn * number[:, None] * order
        basis = np.concatenate([np.ones((len(number), 1)), np.sin(phase), np.cos(phase)], axis=1)
        gram += basis.T @ basis
        moment += basis.T @ _powers(number, samples)
    fit = np.linalg.solve(gram, moment)
    amplitude = fit[1 : harmonics + 1] + 1j * fit[harmonics + 1 :]
    return Drift(fit[0], amplitude.T, np.asarray(turn * samples * order, dtype=float))


def of_lines(points: int, lines: NDArray[np.int64]) -> Drift:
    """Return the drift of a discrete Fourier transform at lines, whole numbers of periods in a window of points."""
    mean, amplitude = np.zeros(DEGREE + 1), np.zeros((len(lines), DEGREE + 1), complex)
    for number in _blocks(points):
        powers = _powers(number, points)
        # whole numbers keep the phase exact
        phase = 2 * np.pi / points * ((lines[:, None] * number) % points)
        mean += powers.sum(axis=0) / points
        amplitude += 2j / points * np.exp(-1j * phase) @ powers
    return Drift(mean, amplitude.T, np.zeros(len(lines)))


def _blocks(samples: int) -> Iterator[NDArray[np.int64]]:
    """Yield the numbers of samples in blocks, so that memory does not grow with the window."""
    for first in range(0, samples, _BLOCK):
        yield np.arange(first, min(first + _BLOCK, samples))


def _powers(number: NDArray[np.int64], samples: int) -> NDArray[np.float64]:
    """Return the powers of time at samples of a window, (numbers, powers)."""
    time = (number - (samples - 1) / 2) / samples
    return time[:, None] ** np.arange(1, DEGREE + 2)
