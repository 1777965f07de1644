"""A multisine: sines on lines of a uniform grid of frequencies, measured together in one window without leakage.

    grid = design_grid(frequency, step_size=50e-6)          # window and spacing for the frequencies asked for
    lines = choose_lines(grid, frequency, inputs=1)         # whole numbers of periods in a window, one array per input
    wave = excitation(grid, lines[0], peak=1e-5)            # amplitude and phases, the peak of the sum being 1e-5
    spectrum = Spectrum(grid, wanted)                       # amplitudes of recorded samples at any lines of the grid

A window is a whole number of steps, and line k makes k periods in it, at k / (points step_size) Hz. Only odd lines are
excited, and one line of every four odd ones is left out: even distortion shows at even lines, odd distortion at the odd
ones that are left out. Excited lines of several inputs are interleaved, line k of all being that of input k mod inputs.

Phases are Schroeder's (IEEE Trans. Inf. Theory 16, 1970, 85), which make the crest factor of a flat spectrum about 1.7,
or random. The distortion at detection lines as a measure of nonlinearity is that of Pintelon and Schoukens (System
Identification, 2012, chapter 4).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hfsa.cosim.signals.excitation import FEWEST_SAMPLES
from hfsa.cosim.signals.frequency_response import FEWEST_WINDOWS, Settling

PHASES = ("schroeder", "random")
"""Choices of the phases; the first is the default."""

_GROUP = 4
"""Neighbouring odd lines of which one is left out."""

_FINE = 32
"""Samples in a period of the highest line for the peak of the sum."""

_BLOCK = 4096
"""Samples that enter a spectrum together."""

_LEAST_TRUST = 1e-3
"""Part of a transient that dies in a window, at the least, where successive changes do not show its decay."""


@dataclass(frozen=True)
class Grid:
    """Lines at whole multiples of a `spacing`: a window of `points` steps [s].

    `periods` is the number of periods of the lowest frequency asked for in a window, `seed` that of random choices.
    """

    points: int
    step_size: float
    periods: int
    low: float
    high: float
    seed: int = 0

    @property
    def window(self) -> float:
        """Length of a window [s]."""
        return self.points * self.step_size

    @property
    def spacing(self) -> float:
        """Distance of neighbouring lines, excited or not [Hz]."""
        return 1 / self.window

    def frequency(self, lines: ArrayLike) -> NDArray[np.float64]:
        """Return the frequencies [Hz] of lines."""
        return np.asarray(lines, dtype=float) / self.window

    @property
    def excitable(self) -> NDArray[np.int64]:
        """Odd lines in the band, to half a spacing, without those that are left out, ascending."""
        first = max(math.ceil(self.low * self.window - 0.5), 1)
        last = min(math.floor(self.high * self.window + 0.5), self.points // FEWEST_SAMPLES)
        odd = np.arange(first + (first % 2 == 0), last + 1, 2)
        groups = -(-len(odd) // _GROUP)
        # never the first of a group, so that the lowest line is excited
        left_out = _GROUP * np.arange(groups) + np.random.default_rng(self.seed).integers(1, _GROUP, groups)
        return np.delete(odd, left_out[left_out < len(odd)]) if len(odd) > _GROUP else odd


def design_grid(
    frequency: NDArray[np.float64],
    step_size: float,
    *,
    inputs: int = 1,
    ticks: int = 1,
    periods: int | None = None,
    seed: int = 0,
) -> Grid:
    """Return the grid for frequencies [Hz], ascending, at a step [s]; the pattern of ticks repeats after `ticks` steps.

    A window has `periods` periods of the lowest frequency. By default that is the least odd number which gives each
    frequency a line of its own at each of the `inputs` together, but not more than makes the window as long as one
    period of each frequency: a stepped sweep that starts on the steady state takes that long. Raises `ValueError` for
    fewer than two frequencies, for a step that does not resolve the highest, and where fewer than two lines are in the
    band.
    """
    f = np.asarray(frequency, dtype=float)
    if len(f) < 2:
        raise ValueError(f"a multisine has two lines or more, found one frequency, {f[0]:g} Hz: measure it stepped")

    grid = partial(_grid, f, step_size, ticks, seed)
    if periods is None:
        longest = (int(f[0] * np.sum(1 / f)) + 1) // 2 * 2 - 1
        found = next((g for g in map(grid, range(1, longest + 1, 2)) if _separates(g, f, inputs)), grid(longest))
    else:
        found = grid(periods)
    if f[-1] * step_size * FEWEST_SAMPLES > 1 + 1e-9:
        raise ValueError(
            f"{f[-1]:g} Hz has {1 / (f[-1] * step_size):.3g} steps of {step_size:g} s in a period, expected at least "
            f"{FEWEST_SAMPLES}: a step of {1 / (FEWEST_SAMPLES * f[-1]):.3g} s or less, or a lower end of the band"
        )
    if len(found.excitable) < 2:
        least = math.ceil(4 * f[0] / (f[-1] - f[0])) | 1
        raise ValueError(
            f"there is no room for two lines from {f[0]:g} to {f[-1]:g} Hz: they are {2 * found.spacing:.3g} Hz apart "
            f"in a window of {found.window:.4g} s; --measurement-periods {least} makes it {least / f[0]:.3g} s"
        )
    return found


def _grid(f: NDArray[np.float64], step_size: float, ticks: int, seed: int, periods: int) -> Grid:
    """Return the grid with a number of periods of the lowest of the frequencies f in a window."""
    points = ticks * max(round(periods / (f[0] * step_size * ticks)), 1)
    return Grid(points, step_size, periods, float(f[0]), float(f[-1]), seed)


def _separates(grid: Grid, f: NDArray[np.float64], inputs: int) -> bool:
    """Whether each of the frequencies f has a line of its own at each input."""
    return len(grid.excitable) >= inputs and min(map(len, choose_lines(grid, f, inputs))) == len(f)


def choose_lines(grid: Grid, frequency: NDArray[np.float64], inputs: int = 1) -> list[NDArray[np.int64]]:
    """Return the excited lines of each input, those next to the frequencies [Hz], each once and ascending.

    With several `inputs`, they take turns along the grid. Raises `ValueError` where an input is without a line.
    """
    lines = [grid.excitable[i::inputs] for i in range(inputs)]
    if not all(map(len, lines)):
        raise ValueError(
            f"there is no room for {inputs} inputs together: {len(grid.excitable)} lines from {grid.low:g} to "
            f"{grid.high:g} Hz can be excited; a larger --measurement-periods makes more"
        )
    return [np.unique(_nearest(own, np.asarray(frequency) * grid.window)) for own in lines]


def _nearest(lines: NDArray[np.int64], places: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the line next to each place."""
    above = np.clip(np.searchsorted(lines, places), 1, max(len(lines) - 1, 1))
    pair = np.array([lines[above - 1], lines[np.minimum(above, len(lines) - 1)]])
    return np.where(np.abs(pair[0] - places) <= np.abs(pair[1] - places), pair[0], pair[1])


@dataclass(frozen=True)
class Excitation:
    """Sum of sines at one input: their `lines`, equal amplitudes `amplitude`, and phases [rad], (lines,).

    `crest_factor` is the peak of the sum over its root mean square.
    """

    lines: NDArray[np.int64]
    amplitude: NDArray[np.float64]
    phase: NDArray[np.float64]
    crest_factor: float

    @property
    def gain(self) -> NDArray[np.complex128]:
        """Complex amplitudes, relative to sines of phase 0."""
        return np.asarray(self.amplitude * np.exp(1j * self.phase), dtype=complex)


def excitation(lines: NDArray[np.int64], peak: float, phases: str = PHASES[0], seed: int = 0) -> Excitation:
    """Return the sum of sines of equal amplitude on lines whose largest value is `peak`."""
    n = len(lines)
    phase = np.random.default_rng(seed).uniform(-np.pi, np.pi, n) if phases == "random" else schroeder(n)
    highest = _peak(lines, phase)
    amplitude = peak / highest
    return Excitation(lines, np.full(n, amplitude), phase, highest / math.sqrt(n / 2))


def schroeder(n: int) -> NDArray[np.float64]:
    """Return Schroeder's phases [rad] of n lines with equal amplitudes, (n,)."""
    k = np.arange(1, n + 1)
    return np.asarray(np.remainder(-np.pi * k * (k - 1) / n, 2 * np.pi), dtype=float)


def _peak(lines: NDArray[np.int64], phase: NDArray[np.float64]) -> float:
    """Return the largest magnitude of a sum of sines of amplitude 1 on lines, at most 0.5 % too small."""
    size = 1 << math.ceil(math.log2(_FINE * (int(lines.max()) + 1)))
    spectrum = np.zeros(size // 2 + 1, complex)
    spectrum[lines] = np.exp(1j * phase) / 2j * size
    return float(np.abs(np.fft.irfft(spectrum, size)).max())


class Spectrum:
    """Complex amplitudes of sampled signals at lines of a grid, relative to sines of phase 0 at the first sample.

    Samples enter in order, in blocks of any length, and none is kept: memory does not grow with the window.
    """

    def __init__(self, grid: Grid, lines: NDArray[np.int64], signals: int):
        self._points, self._lines = grid.points, np.asarray(lines, dtype=np.int64)
        size = min(_BLOCK, grid.points)
        angle = self._angle(np.arange(size))
        self._waves = np.concatenate([np.cos(angle), -np.sin(angle)])
        self._sum = np.zeros((len(self._lines), signals), complex)
        self._first: NDArray[np.float64] | None = None
        self._total = np.zeros(signals)
        self._count = 0

    def _angle(self, samples: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the phases of the lines at samples, (lines, samples), reduced as whole numbers."""
        turned = (self._lines[:, None] * samples) % self._points
        return np.asarray(2 * np.pi / self._points * turned, dtype=float)

    def add(self, values: NDArray[np.float64]) -> None:
        """Add the next samples, (samples, signals)."""
        mean = self._first = values[0].copy() if self._first is None else self._first
        n, size = len(self._lines), self._waves.shape[1]
        for first in range(0, len(values), size):
            block = values[first : first + size] - mean  # a large mean costs no digits
            parts = self._waves[:, : len(block)] @ block
            turn = np.exp(-1j * self._angle(np.array([self._count])))
            self._total += block.sum(axis=0)
            self._sum += turn * (parts[:n] + 1j * parts[n:])
            self._count += len(block)

    @property
    def mean(self) -> NDArray[np.float64]:
        """Means of the samples of one window, (signals,)."""
        assert self._first is not None
        return self._first + self._total / self._points

    @property
    def gain(self) -> NDArray[np.complex128]:
        """Complex amplitudes over the samples of one window, (lines, signals)."""
        assert self._count == self._points, f"{self._count} of {self._points} samples"
        return np.asarray(2j / self._points * self._sum, dtype=complex)


def detection_lines(excited: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the odd and the even lines next to excited odd ones that are not excited, each ascending."""
    odd = set()
    taken = set(excited.tolist())
    for line in excited.tolist():
        for way in (-2, 2):
            other = line + way
            while other in taken:
                other += way
            if other > 0:
                odd.add(other)
    even = {line + way for line in excited.tolist() for way in (-1, 1)} - {0}
    return np.array(sorted(odd), dtype=np.int64), np.array(sorted(even), dtype=np.int64)


def distortion(excited: NDArray[np.int64], gains: Mapping[int, NDArray[np.complex128]]) -> NDArray[np.float64]:
    """Return the amplitude of distortion and noise at each excited line, (lines, signals).

    `gains` holds the complex amplitudes, (signals,), at all excited and detection lines. The mean squares at the odd
    and at the even detection lines are each interpolated, and added.
    """
    total = np.zeros((len(excited), len(gains[int(excited[0])])))
    for lines in detection_lines(excited):
        power = np.abs(np.array([gains[int(line)] for line in lines])) ** 2
        total += np.array([np.interp(excited, lines, column) for column in power.T]).T
    return np.sqrt(total)


class LineSettling(Settling):
    """Settling of the gains of all lines and outputs of a run, (lines times outputs,).

    A window is long beside most transients. Two windows that agree are enough where the slowest decay is known
    (`keeps`), three where it shows in the changes; five are judged as for a single sine. A prediction that has failed
    does not count.
    """

    def judge(self, gains: Sequence[NDArray[np.complex128]] | NDArray[np.complex128], doubt: ArrayLike = 0.0) -> None:
        """Judge the gains of all windows so far, as `Settling.judge`."""
        super().judge(gains, doubt)
        if self.settled or not 2 <= len(self._gains) < FEWEST_WINDOWS:
            return
        changes = np.abs(np.diff(np.array(self._gains), axis=0))
        is_known = self.expected is None and self.keeps < 1
        keeps = self.keeps if is_known else _decay(changes, self.scale)
        if keeps is not None:
            self.remaining = 2 * changes[-1] / max(1 - keeps, np.finfo(float).tiny) + np.asarray(doubt, dtype=float)


def _decay(changes: NDArray[np.float64], scale: NDArray[np.float64]) -> float | None:
    """Return the factor of successive changes, (windows, gains), from one window to the next; `None` where unknown."""
    if len(changes) < 2:
        return None
    sizes = np.max(changes / np.where(scale > 0, scale, 1.0), axis=1)
    ratio = sizes[-1] / sizes[-2] if sizes[-2] > 0 else 0.0
    return ratio if ratio < 0.5 else 1 - _LEAST_TRUST


def collapsed(frequency: NDArray[np.float64], lines: NDArray[np.int64], grid: Grid, inputs: int = 1) -> str:
    """Return a sentence on frequencies [Hz] that share a line of an input; empty where each has its own."""
    if len(lines) >= len(frequency):
        return ""
    odd = range(grid.periods | 1, 100 * grid.periods, 2)
    finer = (_grid(frequency, grid.step_size, 1, grid.seed, periods) for periods in odd)
    needed = next((g.periods for g in finer if _separates(g, frequency, inputs)), None)
    remedy = "" if needed is None else f"; --measurement-periods {needed} separates them"
    return (
        f"{len(frequency)} frequencies lie on {len(lines)} lines: the lines of an input are "
        f"{2 * inputs * grid.spacing:.3g} Hz apart in a window of {grid.window:.4g} s, {grid.periods} periods of "
        f"{frequency[0]:g} Hz{remedy}"
    )
