"""Driving signals with a formula: step, ramp, sine, chirp; t = time - start.

    step    offset + amplitude,  t >= 0
    ramp    offset + amplitude t / duration,  0 <= t < duration, then offset + amplitude
    sine    offset + amplitude sin(2 pi frequency t + phase)
    chirp   offset + amplitude sin(2 pi (from t + (to - from) t^2 / (2 duration))),  0 <= t < duration

Before `start` a signal is `offset`. A logarithmic chirp has the frequency from (to / from)^(t / duration), so that each
octave takes the same time. A chirp ends at its last value.
"""

import math
from abc import abstractmethod
from dataclasses import dataclass, fields
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.signals.drive import ORDERS, Shift, Signal, Times, described


@dataclass(frozen=True)
class _Shape(Signal):
    """A signal that begins at `start` and may have an end; `ValueError` for a number that is not finite."""

    name: ClassVar[str]
    is_smooth: ClassVar[bool] = False

    amplitude: float = 1.0
    offset: float = 0.0
    start: float = 0.0

    def __post_init__(self):
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, float | int) and not math.isfinite(value):
                raise ValueError(f"{self.name}: {field.name.rstrip('_')} is {value}, expected a finite number")

    @property
    def text(self) -> str:
        """The shape in the words of the command line."""
        return described(self.name, **{field.name: getattr(self, field.name) for field in fields(self)})

    @property
    def end(self) -> float:
        """Time [s] from which on it is constant, infinite where it has none."""
        return math.inf

    def breaks(self, begin: float, end: float) -> NDArray[np.float64]:
        """Return its start and its end, as far as they are in the interval."""
        return np.array([at for at in (self.start, self.end) if begin < at < end])

    def derivatives(self, time: Times, shift: Shift = 0.0) -> NDArray[np.float64]:
        """Return the value and its derivatives, (4, n)."""
        found = np.zeros((ORDERS, len(time)))
        piece = time + shift
        is_on, is_over = (piece >= self.start) & (piece < self.end), piece >= self.end
        if np.any(is_on):
            found[:, is_on] = self._inside(time[is_on] - self.start)
        if np.any(is_over):
            found[0, is_over] = self._inside(np.array([self.end - self.start]))[0, 0]
        found[0] += self.offset
        return found

    @abstractmethod
    def _inside(self, t: Times) -> NDArray[np.float64]:
        """Return the deviation from the offset and its derivatives, (4, n), at times since the start."""

    def _check_positive(self, *names: str) -> None:
        """Raise `ValueError` unless numbers are positive."""
        for name in names:
            if not getattr(self, name) > 0:
                raise ValueError(
                    f"{self.name}: {name.rstrip('_')} is {getattr(self, name):g}, expected a positive number"
                )


@dataclass(frozen=True)
class Step(_Shape):
    """A jump by `amplitude` at `start` [s]."""

    name: ClassVar[str] = "step"

    def _inside(self, t: Times) -> NDArray[np.float64]:
        return np.vstack([np.full(len(t), self.amplitude), np.zeros((ORDERS - 1, len(t)))])


@dataclass(frozen=True)
class Ramp(_Shape):
    """A straight line by `amplitude` over `duration` [s]."""

    name: ClassVar[str] = "ramp"

    duration: float = 1.0

    def __post_init__(self):
        super().__post_init__()
        self._check_positive("duration")

    @property
    def end(self) -> float:
        """End of the line [s]."""
        return self.start + self.duration

    def _inside(self, t: Times) -> NDArray[np.float64]:
        slope = self.amplitude / self.duration
        return np.vstack([slope * t, np.full(len(t), slope), np.zeros((2, len(t)))])


@dataclass(frozen=True)
class Sine(_Shape):
    """A sine of `frequency` [Hz] and `phase` [rad] at its start."""

    name: ClassVar[str] = "sine"

    frequency: float = 1.0
    phase: float = 0.0

    def __post_init__(self):
        super().__post_init__()
        self._check_positive("frequency")

    @property
    def highest(self) -> float:
        """Its frequency [Hz]."""
        return self.frequency

    def _inside(self, t: Times) -> NDArray[np.float64]:
        omega = 2 * math.pi * self.frequency
        angle = omega * t + self.phase
        return self.amplitude * np.vstack(
            [np.sin(angle), omega * np.cos(angle), -(omega**2) * np.sin(angle), -(omega**3) * np.cos(angle)]
        )


@dataclass(frozen=True)
class Chirp(_Shape):
    """A sine whose frequency moves `from_` one `to` another [Hz] within `duration` [s]."""

    name: ClassVar[str] = "chirp"

    from_: float = 1.0
    to: float = 10.0
    duration: float = 1.0
    sweep: Literal["linear", "logarithmic"] = "linear"

    def __post_init__(self):
        super().__post_init__()
        self._check_positive("from_", "to", "duration")

    @property
    def end(self) -> float:
        """End of the chirp [s]."""
        return self.start + self.duration

    @property
    def highest(self) -> float:
        """The higher one of its ends [Hz]."""
        return max(self.from_, self.to)

    def _inside(self, t: Times) -> NDArray[np.float64]:
        p0, p1, p2, p3 = self._angle(t)
        sine, cosine = np.sin(p0), np.cos(p0)
        return self.amplitude * np.vstack(
            [
                sine,
                p1 * cosine,
                p2 * cosine - p1**2 * sine,
                (p3 - p1**3) * cosine - 3 * p1 * p2 * sine,
            ]
        )

    def _angle(self, t: Times) -> tuple[NDArray[np.float64], ...]:
        """Return the phase [rad] and its three derivatives."""
        first, ratio = 2 * math.pi * self.from_, self.to / self.from_
        if self.sweep == "linear" or ratio == 1:
            rise = first * (ratio - 1) / self.duration
            return first * t + rise * t**2 / 2, first + rise * t, np.full(len(t), rise), np.zeros(len(t))
        growth = math.log(ratio) / self.duration
        omega = first * np.exp(growth * t)
        return first * np.expm1(growth * t) / growth, omega, growth * omega, growth**2 * omega
