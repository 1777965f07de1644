"""Stability margins of a feedback loop, opened at a connection: loop gain, sensitivity; gain, phase and delay margins.

    loop = open_loop(system, instances, find_connection(system, "controller.axis[1].command"))
    L = loop.gain(frequency)                     # complex, the other loops closed
    loop.margins()                               # gain, phase and delay margins, sensitivity peak

The connection start -> end is opened at the operating point of the closed system. With T the response from the end to
the start, the loop gain is L = -T and the sensitivity S = 1 / (1 + L); the stability boundary is L = -1.

Where start or end belongs to a sampled FMU, T is the response between sequences at its ticks: the excitation at the end
is held like the FMU's own output, or sampled like its own input. With one sample time L is exact up to half the
sampling frequency. Between two continuous FMUs of a sampled system L is that of the fundamentals, accurate far below
it.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.linear.linearize import Linearization, linearize, upstream
from hfsa.cosim.linear.sampled import SampledSystem
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import nearest
from hfsa.cosim.systems.system import Connection, System

_POINTS_PER_DECADE = 200
# distances from a mode, in units of its half width: a resonance turns the phase by 180 degrees within a few
_AROUND = np.concatenate([-np.geomspace(30, 0.03, 40), [0.0], np.geomspace(0.03, 30, 40)])


@dataclass(frozen=True)
class Margin:
    """A crossing of the loop gain, at `frequency` [Hz].

    The `value` of a gain margin is the factor on L that reaches -1 there. The `value` of a phase margin is the
    clockwise rotation [rad] of L that reaches -1, negative where L is already beyond.
    """

    frequency: float
    value: float


@dataclass(frozen=True)
class Margins:
    """Stability margins of a loop.

    Attributes:
        is_stable: whether the closed loop is stable; the margins mean little where it is not.
        gain, phase: gain margins and phase margins, by frequency.
        delay: shortest delay [s] that brings a crossing of gain 1 to -1; infinite where there is none.
        sensitivity_peak: largest |S|, at least 1 for most loops, at `sensitivity_frequency` [Hz].
    """

    is_stable: bool
    gain: tuple[Margin, ...]
    phase: tuple[Margin, ...]
    delay: float
    sensitivity_peak: float
    sensitivity_frequency: float


class OpenedLoop:
    """A loop opened at one connection.

    Attributes:
        connection: the opened connection.
        is_stable: whether the system is stable with the loop closed.
        highest: half the sampling frequency of a sampled system [Hz], else infinity.
        operating_point: equilibrium of the closed system, by full name.
    """

    def __init__(self, connection: Connection, opened: Linearization, closed: Linearization, clock: str | None):
        """`clock` names the sampled FMU at whose ticks L is defined, `None` for a continuous L."""
        self.connection, self.operating_point = connection, opened.operating_point
        poles = closed.poles
        # a neutral mode, like rigid motion without a spring, is no instability
        self.is_stable = bool(np.all(poles.real <= 1e-9 * np.abs(poles).max(initial=1.0)))
        self._poles = np.concatenate([opened.poles, poles])
        self._opened = opened
        self._clock, self._is_held = clock, connection.start.partition(".")[0] == clock
        times = [t.sample_time for t in opened.closed.ticking if clock in (None, t.component)]
        self.highest = 0.5 / min(times) if times else math.inf
        self._system = None
        if clock is not None:
            held = opened.closed.holding(clock, connection.end) if self._is_held else opened.closed
            self._system = SampledSystem(held)

    def gain(self, frequency: ArrayLike) -> NDArray[np.complex128]:
        """Return L at frequencies [Hz], (n,)."""
        frequency = np.atleast_1d(np.asarray(frequency, dtype=float))
        if self._system is None:
            return -self._opened.response(frequency, [(0, -1, -1)])[:, 0, 0]
        assert self._clock is not None
        ones = np.ones((len(frequency), 1, 1))
        return -self._system.at_ticks(2 * np.pi * frequency, ones, self._clock, after=self._is_held)[:, 0, 0]

    def sensitivity(self, frequency: ArrayLike) -> NDArray[np.complex128]:
        """Return S = 1 / (1 + L) at frequencies [Hz], (n,)."""
        return 1 / (1 + self.gain(frequency))

    def margins(self, low: float | None = None, high: float | None = None) -> Margins:
        """Return all margins between two frequencies [Hz].

        By default `low` is a hundredth of the lowest mode; `high` is half the sampling frequency of a sampled loop, or
        a hundred times the highest mode of a continuous one. Raises `StructureError` where the connection closes no
        loop.
        """
        f = self._grid(low, high)
        L = self.gain(f)
        if not np.any(L):
            raise StructureError(f"{self.connection} closes no loop: its start does not follow its end")
        gain, phase = self._gain_margins(f, L), self._phase_margins(f, L)
        delays = [(m.value % (2 * np.pi)) / (2 * np.pi * m.frequency) for m in phase]
        peak = self._sensitivity_peak(f, L)
        return Margins(self.is_stable, gain, phase, min(delays, default=math.inf), *peak)

    def _gain_margins(self, f: np.ndarray, L: NDArray[np.complex128]) -> tuple[Margin, ...]:
        """Return the crossings of L with the negative real axis."""

        def sine(frequency: float) -> float:
            """Sine of the gain's phase, 0 where it crosses the real axis."""
            value = self.gain(frequency)[0]
            return value.imag / abs(value)

        found = []
        is_left, above = L.real < 0, L.imag > 0
        for k in np.flatnonzero((is_left[1:] | is_left[:-1]) & (above[1:] != above[:-1])):
            at = _root(sine, f[k], f[k + 1])
            value = self.gain(at)[0]
            # the gain of an undamped mode jumps over the axis: no crossing
            if value.real < 0 and abs(value.imag) < 1e-6 * abs(value):
                found.append(Margin(at, float(-1 / value.real)))
        # at half the sampling frequency the phase of a sequence is 0 or 180 degrees
        if self._system and f[-1] == self.highest and L[-1].real < 0 and not any(m.frequency > f[-2] for m in found):
            found.append(Margin(float(f[-1]), float(-1 / L[-1].real)))
        return tuple(found)

    def _phase_margins(self, f: np.ndarray, L: np.ndarray) -> tuple[Margin, ...]:
        """Return the crossings of |L| with 1."""

        def level(frequency: float) -> float:
            """Logarithm of the gain's magnitude, 0 where it is 1."""
            return float(np.log(np.abs(self.gain(frequency)[0])))

        found = []
        above = np.abs(L) > 1
        for k in np.flatnonzero(above[1:] != above[:-1]):
            at = _root(level, f[k], f[k + 1])
            found.append(Margin(at, float(np.angle(-self.gain(at)[0]))))
        return tuple(found)

    def _sensitivity_peak(self, f: np.ndarray, L: np.ndarray) -> tuple[float, float]:
        """Return the largest |S| and its frequency."""
        k = int(np.argmin(np.abs(1 + L)))
        bounds = f[max(k - 1, 0)], f[min(k + 1, len(f) - 1)]
        from scipy.optimize import minimize_scalar  # imported here, as it takes a quarter of a second

        best = minimize_scalar(lambda x: abs(1 + self.gain(x)[0]), bounds=bounds, options={"xatol": 1e-9 * f[k]})
        # the search does not find a minimum at an end of the grid
        at = min((float(f[k]), float(best.x)), key=lambda x: abs(1 + self.gain(x)[0]))  # type: ignore[attr-defined]
        return float(abs(self.sensitivity(at)[0])), at

    def _grid(self, low: float | None, high: float | None) -> np.ndarray:
        """Return frequencies [Hz] dense enough to separate all crossings, (n,)."""
        modes = np.abs(self._poles) / (2 * np.pi)
        modes = modes[modes > 1e-6 * modes.max(initial=0.0)]
        lowest, highest = modes.min(initial=min(self.highest, 1e6)), modes.max(initial=1.0)
        first = 1e-2 * lowest if low is None else low
        last = min(self.highest, high or math.inf)
        last = last if math.isfinite(last) else 100 * highest
        if not 0 < first < last:
            raise StructureError(f"margins from {first:g} to {last:g} Hz, expected 0 < lowest < highest")
        even = np.geomspace(first, last, max(2, round(_POINTS_PER_DECADE * math.log10(last / first))))
        near = (np.abs(self._poles.imag)[:, None] + np.abs(self._poles.real)[:, None] * _AROUND).ravel() / (2 * np.pi)
        f = np.unique(np.concatenate([even, near[(near > first) & (near < last)]]))
        f[-1] = last
        return f


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    """Return the zero [Hz] of a function between two frequencies with different signs."""
    from scipy.optimize import brentq  # imported here, as it takes a quarter of a second

    return float(brentq(function, low, high, xtol=1e-12 * low, rtol=1e-13))  # type: ignore[arg-type]


def open_loop(
    system: System,
    instances: Mapping[str, Instance],
    connection: Connection,
    starts: Mapping[str, float] | None = None,
) -> OpenedLoop:
    """Return the loop through a connection, opened there.

    Raises as `linearize`, and `StructureError` for a connection that closes no loop.
    """
    before = [component.name for component in upstream(system, [connection.start]).components]
    if system.split(connection.end)[0] not in before:
        raise StructureError(f"{connection} closes no loop: its start does not follow its end")
    opened = linearize(system, instances, [], [], starts, opened=connection)
    closed = linearize(system, instances, [], [connection.start], starts)
    ends = (name.partition(".")[0] for name in (connection.start, connection.end))
    clock = next((name for name in ends if instances[name].fmu.description.is_sampled), None)
    return OpenedLoop(connection, opened, closed, clock)


def find_connection(system: System, name: str) -> Connection:
    """Return the connection with the name `start -> end`, or with one end of that name if it is unique.

    Raises `StructureError` with the nearest names, or with all connections that fit.
    """
    start, arrow, end = (part.strip() for part in name.partition("->"))
    if arrow:
        fitting = [c for c in system.connections if (c.start, c.end) == (start, end)]
    else:
        fitting = [c for c in system.connections if start in (c.start, c.end)]
    if not fitting:
        known = map(str, system.connections) if arrow else [n for c in system.connections for n in (c.start, c.end)]
        wanted = f"{start} -> {end}" if arrow else start
        raise StructureError(f"no connection is called {wanted!r}{nearest(wanted, dict.fromkeys(known))}")
    if len(fitting) > 1:
        raise StructureError(f"{name} fits several connections: {', '.join(map(str, fitting))}; say which")
    return fitting[0]
