"""Frequency response of a settling system: complex gains per window, and an estimate of the transient left in them.

    settling = Settling(tolerance=1e-3, floor=1e-9)
    while not settling.settled:
        settling.add(gain)                    # complex gains of all outputs over the next window
    settling.gain, settling.remaining         # the last gain, and the transient left in it

The transient of a linear system is a sum of decaying exponentials, and so is its trace in the gains: g[k] = g_inf +
sum a_j lambda_j^k, where |lambda_j| is the decay factor of mode j per window. A small change of g is not enough: near
a lightly damped resonance |lambda| is 0.99 or more, and a change c is followed by c |lambda| / (1 - |lambda|), a
hundred times the change. Therefore the remaining transient is estimated and compared with the tolerance.

Two close modes beat, an oscillation has lambda and its conjugate, and a strong fast mode masks a weak slow one: a
single decay rate from successive changes is wrong in all these cases. The changes d[k] = g[k + 1] - g[k] are therefore
fitted by a linear prediction of higher order p, common to all outputs because they share the modes,

    d[k] = c_1 d[k - 1] + ... + c_p d[k - p],    c complex,

and its sum over all later windows gives the remaining transient in closed form; p = 1 is the rule above:

    g_inf - g[k] = (c_1 (g[k] - g[k - 1]) + ... + c_p (g[k] - g[k - p])) / (1 - c_1 - ... - c_p)

A run that has started on the predicted steady state needs no such fit while it stays there. The prediction counts as
the gain of a window before the first, and what remains is at most twice the change from one window to the next over
1 - |lambda|, lambda being that of the slowest predicted transient: a gain is the mean over a window, and a run that
leaves the prediction is at half of its way on average.

The method is Prony's; its limit is that of minimal polynomial extrapolation (Cabay and Jackson, SIAM J. Numer.
Anal. 13, 1976, 734).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

FEWEST_WINDOWS = 5
"""Least number of windows for an estimate: four changes, three equations for one decay."""

LONGEST_MEMORY = 40
"""Largest number of windows from which settling is judged."""

NEGLIGIBLE = 1e-6
"""Relative size of a response, to the largest in the same unit, below which it is zero by symmetry."""

DIMENSIONLESS = ("", "1")
"""Units of pure numbers, and of numbers whose unit is not declared."""

ROUNDING = 1e-9
"""Relative size of a response, to the largest of any unit, below which it is rounding."""

_ROUNDING_OF_NUMBERS = 1e-14
"""The same for numbers without a unit, which may be of any kind: a strain of 1e-6 beside a pressure of 1e6."""

_HIGHEST_ORDER = 8
_JUDGED_WINDOWS = 3
_RESIDUAL_WEIGHT = 4.0


class Settling:
    """Settling of one run at one frequency, from the gains of all measured outputs, window by window.

    Attributes:
        tolerance: largest remaining transient, relative to the gain.
        expected: predicted gains, (outputs,), where the run has started on the steady state.
        keeps: part of the slowest transient that a window leaves, with `expected`.
        floor: smallest scale of a gain, one number or shape (outputs,): an entry that is zero by symmetry is rounding
            noise, which never settles relative to itself.
        silent: whether a gain is noise where a response is awaited, one flag or shape (outputs,): it never settles, as
            the response may still be on its way.
        remaining: estimated magnitude of the remaining transient in the last gain, shape (outputs,); infinite before
            `FEWEST_WINDOWS` windows.
    """

    def __init__(
        self,
        tolerance: float = 1e-3,
        floor: ArrayLike = 0.0,
        expected: ArrayLike | None = None,
        keeps: float = 1.0,
    ):
        self.tolerance, self.keeps = tolerance, keeps
        self.expected = None if expected is None else np.asarray(expected, dtype=complex)
        self.floor = np.asarray(floor, dtype=float)
        self.silent: NDArray[np.bool_] = np.array(False)
        self.remaining: NDArray[np.float64] = np.array([np.inf])
        self._gains: list[NDArray[np.complex128]] = []

    def add(self, gain: ArrayLike) -> None:
        """Add the complex gains of the next window, shape (outputs,)."""
        self.judge([*self._gains, np.array(gain, dtype=complex)])

    def judge(self, gains: Sequence[NDArray[np.complex128]] | NDArray[np.complex128], doubt: ArrayLike = 0.0) -> None:
        """Judge the gains of all windows so far, (windows, outputs); the last ones have a further error `doubt`."""
        self._gains = list(gains[-LONGEST_MEMORY:])
        self.remaining = remaining_transient(np.array(self._gains), self.scale)
        if self.expected is not None and len(self._gains) < FEWEST_WINDOWS:
            before, now = np.array([self.expected, *self._gains])[-2:]
            if np.all(np.abs(np.array([before, now]) - self.expected) <= self.tolerance * self.scale):
                self.remaining = 2 * np.abs(now - before) / max(1 - self.keeps, np.finfo(float).tiny)
        self.remaining = self.remaining + np.asarray(doubt, dtype=float)

    @property
    def gain(self) -> NDArray[np.complex128]:
        """Gains of the last window, shape (outputs,)."""
        return self._gains[-1]

    @property
    def scale(self) -> NDArray[np.float64]:
        """Scale of the tolerance: |gain|, or `floor` where that is larger, shape (outputs,)."""
        return np.maximum(np.abs(self.gain), self.floor)

    @property
    def settled(self) -> bool:
        """Whether the remaining transient of every output is within tolerance, and no output is silent."""
        if not self._gains or np.any(self.silent):
            return False
        return bool(np.all(self.remaining <= self.tolerance * self.scale))


def remaining_transient(gains: ArrayLike, scale: ArrayLike = 1.0) -> NDArray[np.float64]:
    """Return the estimated magnitude of the transient left in the last gain, shape (outputs,).

    `gains` has shape (windows, outputs), successive windows of equal length; `scale`, shape (outputs,) or one number,
    weights the outputs in the fit. The estimate is the largest over the last few windows and over two orders of
    prediction, and includes a bound for the misfit of the prediction. It is infinite for too few windows, and where a
    gain is not finite.
    """
    g = np.asarray(gains, dtype=np.complex128)
    windows, outputs = g.shape
    if windows < FEWEST_WINDOWS or not np.all(np.isfinite(g)):
        return np.full(outputs, np.inf)
    scale = np.broadcast_to(np.where(np.asarray(scale) > 0, scale, 1.0), (outputs,))
    g = g / scale
    # three changes for every coefficient, so that the fit cannot merely interpolate
    order = min(_HIGHEST_ORDER, (windows - 1) // 3)
    bounds = [_bound(g, p) for p in {order, max(order - 1, 1)}]
    return np.max(bounds, axis=0) * scale


def _bound(g: np.ndarray, order: int) -> NDArray[np.float64]:
    """Return the remaining transient by linear prediction of one order, shape (outputs,)."""
    d = np.diff(g, axis=0)
    lags = np.arange(order, len(d))[:, None] - 1 - np.arange(order)
    past, present = d[lags], d[order:]  # (equations, order, outputs), (equations, outputs)
    # late changes are small but determine the slow modes: every equation has the same weight
    size = np.sqrt(np.sum(np.abs(past) ** 2, axis=(1, 2)) + np.sum(np.abs(present) ** 2, axis=1))
    weight = 1 / np.where(size > 0, size, 1.0)
    matrix = (past * weight[:, None, None]).transpose(0, 2, 1).reshape(-1, order)
    c = np.linalg.lstsq(matrix, (present * weight[:, None]).ravel(), rcond=1e-10)[0]
    # changes that do not decay have no limit: 1 - sum(c) is near 0 then, and the estimate is large
    gap = 1 - np.sum(c)
    gap = gap if abs(gap) > 1e-12 else 1e-12
    limit = g[-1] + np.tensordot(c, g[-1] - g[-2::-1][:order], axes=1) / gap
    misfit = np.abs(np.einsum("kpm,p->km", past, c) - present)[-max(order, 5) :].max(axis=0)
    return np.abs(g[-_JUDGED_WINDOWS:] - limit).max(axis=0) + _RESIDUAL_WEIGHT * misfit / abs(gap)


def phase(response: ArrayLike) -> NDArray[np.float64]:
    """Return the phase in (-pi, pi] [rad]; NaN stays NaN."""
    angle = np.angle(np.asarray(response, dtype=complex))
    return np.where(angle == -np.pi, np.pi, angle)


def harmonic_distortion(gain: ArrayLike, second: ArrayLike, third: ArrayLike) -> NDArray[np.float64]:
    """Return sqrt(second^2 + third^2) / |gain|, two harmonics' amplitudes over the fundamental; NaN where gain is 0."""
    fundamental = np.abs(np.asarray(gain, dtype=complex))
    harmonics = np.hypot(second, third)
    return np.divide(harmonics, fundamental, out=np.full(fundamental.shape, np.nan), where=fundamental > 0)


def resonances(decibels: ArrayLike, height: float = 3.0) -> NDArray[np.int64]:
    """Return the indices of maxima at least `height` dB above their surroundings, shape (resonances,).

    The surroundings of a maximum extend on each side to where the curve is higher, or to its end.
    """
    level = np.asarray(decibels, dtype=float)
    found = []
    for i in 1 + np.flatnonzero((level[1:-1] > level[:-2]) & (level[1:-1] >= level[2:])):
        higher = np.flatnonzero(level > level[i])
        left, right = higher[higher < i].max(initial=0), higher[higher > i].min(initial=len(level) - 1)
        if level[i] - max(level[left:i].min(), level[i + 1 : right + 1].min()) >= height:
            found.append(i)
    return np.array(found, dtype=np.int64)


def noise_floor(gain: ArrayLike, units: Sequence[str], nominal: ArrayLike) -> NDArray[np.float64]:
    """Return the noise floor of each output in one run, shape (outputs,): smaller gains are rounding noise.

    `gain` are the complex amplitudes of the outputs in their units, `nominal` the nominal values of their FMUs, 0 where
    none is declared. The floor is 1e-6 of the largest gain in the same unit, and at least the smaller of 1e-6 of the
    nominal value and 1e-9 of the largest gain of all. Numbers without a unit are of any kind, and are not compared.
    """
    size = np.abs(np.asarray(gain, dtype=complex))
    least = np.minimum(NEGLIGIBLE * np.abs(nominal), ROUNDING * size.max())
    return np.maximum(NEGLIGIBLE * largest_of_unit(size, units), least)


def negligible(response: ArrayLike, units: Sequence[str], amplitude: ArrayLike) -> NDArray[np.bool_]:
    """Return whether each entry of a sweep is zero by symmetry, shape (outputs, inputs): noise at all frequencies.

    `response` has shape (frequencies, outputs, inputs), NaN where it is missing; `units` are the units of the outputs;
    `amplitude`, shape (inputs,), makes the inputs comparable. The floor is that of `noise_floor` over the whole sweep.
    """
    size = np.nan_to_num(np.abs(response)).max(axis=0) * np.nan_to_num(amplitude, nan=1.0)
    largest = largest_of_unit(size.max(axis=1), units)
    of_all = np.array([_ROUNDING_OF_NUMBERS if unit in DIMENSIONLESS else ROUNDING for unit in units])
    return size <= np.maximum(NEGLIGIBLE * largest, of_all * size.max())[:, None]


def largest_of_unit(size: NDArray[np.float64], units: Sequence[str]) -> NDArray[np.float64]:
    """Return the largest size in the same unit, for each entry; 0 for numbers without a unit."""
    return np.array(
        [
            max(s for s, u in zip(size, units, strict=True) if u == unit) if unit not in DIMENSIONLESS else 0.0
            for unit in units
        ]
    )
