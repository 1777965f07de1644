"""Excitation of a frequency sweep: frequencies, amplitude, ramp time and measurement window.

frequency = logarithmic(1.0, 50.0, 40)            # evenly spaced on a logarithmic axis
frequency = linear(10.0, 300.0, 30)               # evenly spaced in hertz
frequency = along_response(dense, response, 40)   # evenly spaced along the curve: denser at a resonance
"""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hfsa.cosim.signals.frequency_response import resonances

FEWEST_SAMPLES = 10
"""Least number of samples in a period that resolves a third harmonic and a held input."""


def logarithmic(low: float, high: float, points: int) -> NDArray[np.float64]:
    """Return `points` frequencies [Hz] with a constant ratio of neighbours, from `low` to `high` exactly.

    A single point is `low`; where `high` equals `low`, there is one point.
    """
    _check(low, high, points)
    return np.geomspace(low, high, points) if low < high else np.array([low])


def linear(low: float, high: float, points: int) -> NDArray[np.float64]:
    """Return `points` frequencies [Hz] with a constant difference of neighbours, from `low` to `high` exactly.

    A single point is `low`; where `high` equals `low`, there is one point.
    """
    _check(low, high, points)
    return np.linspace(low, high, points) if low < high else np.array([low])


def along_response(frequency: ArrayLike, response: ArrayLike, points: int) -> NDArray[np.float64]:
    """Return `points` of the frequencies [Hz], evenly spaced along the curves of a response, with its peaks.

    `frequency`, shape (n,), is a dense ascending grid and `response`, shape (n,) or (n, ...), a complex response on it.
    The length of a curve is measured on a Bode plot where half a decade, 20 dB and 45 degrees have equal lengths; of
    several curves the longest step counts. Every local maximum of a magnitude 3 dB above its surroundings is a point,
    so that a sweep of few points contains the resonances. A single point is the lowest frequency.
    """
    f = np.asarray(frequency, dtype=float)
    _check(f[0], f[-1], points)
    if points == 1:
        return f[:1]
    curves = np.asarray(response, dtype=complex).reshape(len(f), -1)
    curves = curves[:, np.abs(curves).max(axis=0) > 0]
    if curves.shape[1] == 0:
        return logarithmic(f[0], f[-1], points)
    # an antiresonance of exactly zero would be infinitely deep
    level = np.log10(np.maximum(np.abs(curves), 1e-6 * np.abs(curves).max(axis=0)))
    turn = np.unwrap(np.angle(curves), axis=0) / (np.pi / 4)
    step = np.hypot(np.hypot(np.diff(level, axis=0), np.diff(turn, axis=0)).max(axis=1), 2 * np.diff(np.log10(f)))
    length = np.concatenate([[0.0], np.cumsum(step)])
    grid = np.interp(np.linspace(0, length[-1], points), length, f)
    peaks = sorted({int(i) for curve in level.T for i in resonances(20 * curve)})
    for peak in f[peaks]:
        inner = np.arange(1, points - 1)
        if len(inner):
            grid[inner[np.argmin(np.abs(np.log(grid[inner] / peak)))]] = peak
    grid[0], grid[-1] = f[0], f[-1]
    return np.unique(grid)


def amplitude_of(name: str, unit: str | None, amplitudes: Mapping[str, float]) -> float:
    """Return the amplitude for an input by its unit; `ValueError` names the input and the units with an amplitude."""
    if unit is None or unit not in amplitudes:
        known = ", ".join(f"{value:g} {key}" for key, value in amplitudes.items()) or "none"
        raise ValueError(f"input {name} is in {unit or 'no unit'}, for which no amplitude is given; there is {known}")
    return amplitudes[unit]


def ramp_time(frequency: float) -> float:
    """Return the time [s] in which the sine source ramps up its amplitude: two periods, at least half a second."""
    return max(2 / frequency, 0.5)


def unread_windows(ramp: float, window: float, waited: float, least: float) -> int:
    """Return the number of windows [s] that pass unread: a ramp [s] and `waited` windows, and a `least` time [s]."""
    return max(math.ceil(ramp / window - 1e-9) + math.ceil(waited - 1e-9), math.ceil(least / window - 1e-9))


def window_steps(frequency: float, step_size: float, measurement_periods: int = 1) -> int:
    """Return the number of steps in a measurement window; `ValueError` if the step is too long."""
    samples = 1 / (frequency * step_size)
    if samples < FEWEST_SAMPLES:
        raise ValueError(
            f"{frequency:g} Hz has {samples:.3g} steps of {step_size:g} s in a period, expected at least "
            f"{FEWEST_SAMPLES}: a step of {_rounded_down(1 / (FEWEST_SAMPLES * frequency)):g} s or less"
        )
    return round(measurement_periods * samples)


def _rounded_down(value: float) -> float:
    """Return a positive number rounded down to three digits."""
    near = float(f"{value:.3g}")
    return near if near <= value else float(f"{near - 10 ** (math.floor(math.log10(value)) - 2):.3g}")


def _check(low: float, high: float, points: int) -> None:
    """Raise `ValueError` for fewer than one point, and for ends [Hz] that are no band."""
    if points < 1:
        raise ValueError(f"{points} points, expected at least 1")
    if not 0 < low <= high < math.inf:
        raise ValueError(f"frequencies from {low:g} to {high:g} Hz, expected 0 < lowest <= highest")
