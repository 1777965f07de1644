"""Sampled systems: the exact periodic response of continuous and sampled parts in a closed loop.

Ticks fall on a grid of spacing h, the shortest sample time, and repeat after N spacings. Between ticks x moves by the
matrix exponential with the sampled values v held; at a tick v changes, FMU after FMU. A sinusoid e = E exp(j w t) at an
input of the continuous part is not held: x = X_p exp(j w t) + xi with

    (j w - A) X_p = B E,        der(xi) = A xi + A_v v,

and a sinusoid at an input of a sampled part is sampled at its ticks. In a frame that rotates with the sinusoid, [xi; v]
is periodic: the fixed point of the affine map of one period.

The response is the fundamental: the Fourier component at w of the outputs in continuous time, intersample ripple
included. A lock-in amplifier measures it in the limit of short steps. A held value v_k contributes
(1 - exp(-j w h)) / (j w h) v_k to its fundamental V, and x has the fundamental (j w - A) X = A_v V.
"""

import math
from collections.abc import Iterator

import numpy as np

from hfsa.cosim.linear.blocks import ClosedSystem, Ticking
from hfsa.cosim.systems.errors import StructureError

LONGEST_PATTERN = 10_000
"""Longest pattern of ticks, in spacings of the shortest sample time."""


class SampledSystem:
    """A closed system with ticks.

    Attributes:
        closed: balanced matrices.
        spacing: time between ticks [s], the shortest sample time; `period` [s] is that of their pattern.
        transition: matrix of [x; v] over one period without excitation, from right before the ticks.
    """

    def __init__(self, closed: ClosedSystem):
        from scipy.linalg import expm  # imported here, as it takes a fifth of a second

        self.closed = closed = closed.balanced()
        self.spacing, ratios = grid([ticking.sample_time for ticking in closed.ticking])
        self.period = self.spacing * math.lcm(*ratios)
        self._due = [
            [t for t, ratio in zip(closed.ticking, ratios, strict=True) if k % ratio == 0]
            for k in range(math.lcm(*ratios))
        ]
        self._x, self._n = len(closed.states), len(closed.states) + len(closed.sampled)
        generator = np.zeros((self._n, self._n))
        generator[: self._x] = closed.rate[:, : self._n] * self.spacing
        self._between = expm(generator)
        w = np.eye(self._n)[None]
        none = np.zeros((1, self._n + len(closed.inputs), self._n))
        for _ in self._pass(w, none, np.ones((1, 1, 1))):
            pass
        self.transition = w[0]

    def response(self, omega: np.ndarray, enters: np.ndarray) -> np.ndarray:
        """Return the fundamental of the outputs, (f, outputs, m).

        To excitations (f, inputs, m) at frequencies omega [rad/s], (f,).
        """
        forced, w, turn = self._steady(omega, enters)
        held = np.zeros((len(omega), self._n - self._x, enters.shape[2]), complex)
        for ticking, _, after in self._pass(w, forced, turn):
            if ticking is None:
                held += after[:, self._x : self._n]
        angle = omega[:, None, None] * self.spacing
        held *= (1 - np.exp(-1j * angle)) / (1j * angle) / len(self._due)
        fundamental = forced.copy()
        fundamental[:, : self._x] += self._answer(omega, self.closed.rate[:, self._x : self._n] @ held)
        fundamental[:, self._x : self._n] += held
        return self.closed.output @ fundamental

    def at_ticks(self, omega: np.ndarray, enters: np.ndarray, component: str, *, after: bool) -> np.ndarray:
        """Return the component at omega of the outputs' samples at one FMU's ticks, right before or after them.

        Shape (f, outputs, m), to excitations (f, inputs, m) at frequencies omega [rad/s], (f,).
        """
        forced, w, turn = self._steady(omega, enters)
        found = [
            self.closed.output @ (now if after else before)
            for ticking, before, now in self._pass(w, forced, turn)
            if ticking is not None and ticking.component == component
        ]
        return np.mean(found, axis=0)

    def _steady(self, omega: np.ndarray, enters: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return [X_p; 0; E], the periodic [xi; v] at the period's beginning, and the frame's turn per spacing.

        The turn is of shape (f, 1, 1).
        """
        count, inputs, m = enters.shape
        forced = np.zeros((count, self._n + inputs, m), complex)
        forced[:, : self._x] = self._answer(omega, self.closed.rate[:, self._n :] @ enters)
        forced[:, self._n :] = enters
        turn = np.exp(-1j * omega * self.spacing)[:, None, None]
        w = np.zeros((count, self._n, m), complex)
        for _ in self._pass(w, forced, turn):
            pass
        unit = np.eye(self._n)
        return forced, np.linalg.solve(unit - turn ** len(self._due) * self.transition, w), turn

    def _answer(self, omega: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Return X of (j omega - A) X = rate, (f, x, m)."""
        return np.linalg.solve(1j * omega[:, None, None] * np.eye(self._x) - self.closed.rate[:, : self._x], rate)

    def _pass(
        self, w: np.ndarray, forced: np.ndarray, turn: np.ndarray
    ) -> Iterator[tuple[Ticking | None, np.ndarray, np.ndarray]]:
        """Advance `w` = [xi; v], (f, n, m), by one period, in place.

        Yields [x; v; e] before and after the tick of each FMU, then once with `None` after all ticks of one instant.
        """
        after = forced.copy()
        for due in self._due:
            after[:, : self._n] = forced[:, : self._n] + w
            for ticking in due:
                before = after.copy()
                rows = self._x + ticking.rows
                w[:, rows] = self.closed.tick[ticking.rows] @ before
                after[:, rows] = w[:, rows]
                yield ticking, before, after
            yield None, after, after
            w[:] = turn * (self._between @ w)


def grid(sample_times: list[float]) -> tuple[float, list[int]]:
    """Return the shortest sample time [s], and each sample time as a whole multiple of it.

    Raises `StructureError` where one is no multiple (to 1e-9), or where the pattern of ticks is too long.
    """
    spacing = min(sample_times)
    ratios = [round(t / spacing) for t in sample_times]
    for sample_time, ratio in zip(sample_times, ratios, strict=True):
        if abs(sample_time / spacing - ratio) > 1e-9 * ratio:
            raise StructureError(
                f"sample times of {spacing:.9g} s and {sample_time:.9g} s have no common grid: the linear method needs "
                f"whole multiples of the shortest; the nearest is {ratio * spacing:.9g} s"
            )
    if math.lcm(*ratios) > LONGEST_PATTERN:
        raise StructureError(
            f"the ticks repeat only after {math.lcm(*ratios)} times the shortest sample time, {spacing:.9g} s; "
            f"expected at most {LONGEST_PATTERN}"
        )
    return spacing, ratios
