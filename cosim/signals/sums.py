"""Driving signals that are sums of sines: a multisine of some lines, and noise of all lines up to a bandwidth.

    u(t) = offset + sum_k a_k cos(2 pi f_k t + p_k),      p_k random, by the seed

A multisine has `lines` sines of equal amplitude, from one frequency to another at equal ratios. Noise has a line at
each multiple of 1 / period up to `bandwidth`, of equal amplitude, so that its spectrum is flat up to there and nothing
beyond; it repeats after its period. It is the periodic spline through 64 points per period of its bandwidth,
which deviates from the sum by 2e-6 of the amplitude of each line at most.
"""

import math
from dataclasses import dataclass, fields
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.signals.drive import ORDERS, Shift, Signal, Times, described

_POINTS = 64
"""Points of noise in a period of its bandwidth."""

_MOST_POINTS = 2**27
"""Largest number of points of noise."""


@dataclass(frozen=True)
class Multisine(Signal):
    """Sum of `lines` sines of `amplitude` each, `from_` one frequency `to` another [Hz] at equal ratios."""

    name: ClassVar[str] = "multisine"

    amplitude: float = 1.0
    offset: float = 0.0
    from_: float = 1.0
    to: float = 100.0
    lines: int = 20
    seed: int = 1

    def __post_init__(self):
        _check_finite(self)
        if not 0 < self.from_ < self.to:
            raise ValueError(f"multisine: from={self.from_:g} to={self.to:g} Hz, expected two rising frequencies")
        if self.lines < 2:
            raise ValueError(f"multisine: lines is {self.lines}, expected 2 or more")

    @property
    def text(self) -> str:
        """The sum in the words of the command line."""
        return described(self.name, **{field.name: getattr(self, field.name) for field in fields(self)})

    @property
    def highest(self) -> float:
        """The highest line [Hz]."""
        return self.to

    @cached_property
    def omega(self) -> NDArray[np.float64]:
        """Angular frequencies of the lines [rad/s]."""
        return 2 * math.pi * np.geomspace(self.from_, self.to, self.lines)

    @cached_property
    def phase(self) -> NDArray[np.float64]:
        """Phases of the lines at time 0 [rad]."""
        return np.random.default_rng(self.seed).uniform(0, 2 * math.pi, self.lines)

    def derivatives(self, time: Times, shift: Shift = 0.0) -> NDArray[np.float64]:  # noqa: ARG002
        """Return the value and its derivatives, (4, n)."""
        found = np.zeros((ORDERS, len(time)))
        for omega, phase in zip(self.omega.tolist(), self.phase.tolist(), strict=True):
            angle = omega * time + phase
            cosine, sine = np.cos(angle), np.sin(angle)
            found += [cosine, -omega * sine, -(omega**2) * cosine, omega**3 * sine]
        found *= self.amplitude
        found[0] += self.offset
        return found


@dataclass(frozen=True)
class Noise(Signal):
    """Noise with a flat spectrum up to `bandwidth` [Hz], of a root mean square `rms`, that repeats after `period` [s].

    `ValueError` for a period of less than one cycle of the bandwidth, or of too many.
    """

    name: ClassVar[str] = "noise"

    rms: float = 1.0
    offset: float = 0.0
    bandwidth: float = 100.0
    period: float = 10.0
    seed: int = 1

    def __post_init__(self):
        _check_finite(self)
        if not (self.bandwidth > 0 and self.period > 0 and self.rms >= 0):
            raise ValueError(
                f"noise: bandwidth={self.bandwidth:g} Hz, period={self.period:g} s, rms={self.rms:g}, expected "
                "positive numbers"
            )
        if self._lines < 1:
            raise ValueError(f"noise: a period of {self.period:g} s has no line up to {self.bandwidth:g} Hz")
        if self._count > _MOST_POINTS:
            raise ValueError(f"noise: {self._lines} lines in a period, expected {_MOST_POINTS // _POINTS} at most")

    @property
    def text(self) -> str:
        """The noise in the words of the command line."""
        return described(self.name, **{field.name: getattr(self, field.name) for field in fields(self)})

    @property
    def highest(self) -> float:
        """Its bandwidth [Hz]."""
        return self.bandwidth

    @property
    def _lines(self) -> int:
        """Number of lines."""
        return math.floor(self.bandwidth * self.period * (1 + 1e-12))

    @property
    def _count(self) -> int:
        """Number of points in a period."""
        return _POINTS * max(self._lines, 2)

    @cached_property
    def _spline(self):
        """Splines through one period."""
        # scipy is slow to import
        from scipy.interpolate import CubicSpline

        phase = np.random.default_rng(self.seed).uniform(0, 2 * math.pi, self._lines)
        spectrum = np.zeros(self._count // 2 + 1, dtype=complex)
        spectrum[1 : self._lines + 1] = np.exp(1j * phase) * self.rms * math.sqrt(2 / self._lines) / 2
        values = np.fft.irfft(spectrum * self._count, self._count)
        time = np.linspace(0, self.period, self._count + 1)
        return CubicSpline(time, np.append(values, values[0]), bc_type="periodic")

    def derivatives(self, time: Times, shift: Shift = 0.0) -> NDArray[np.float64]:  # noqa: ARG002
        """Return the value and its derivatives, (4, n)."""
        at = np.mod(time, self.period)
        found = np.array([self._spline(at, order) for order in range(ORDERS)])
        found[0] += self.offset
        return found

    def remarks(self, begin: float, end: float) -> list[str]:
        """Return the sentence on noise that repeats within the run."""
        if end - begin <= self.period * (1 + 1e-9):
            return []
        return [f"the noise repeats after {self.period:g} s; period={end - begin:g} makes it as long as the run"]


def _check_finite(signal: Multisine | Noise) -> None:
    """Raise `ValueError` for a number that is not finite."""
    for field in fields(signal):
        if not math.isfinite(getattr(signal, field.name)):
            raise ValueError(f"{signal.name}: {field.name.rstrip('_')} is not finite, expected a finite number")
