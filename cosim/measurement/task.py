"""Task of a sweep: one input at one frequency, plain data for any thread or process."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from hfsa.cosim.analysis.steady_start import SteadyStart
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.masters.algorithms import DEFAULT
from hfsa.cosim.measurement.expectation import Expectation
from hfsa.cosim.signals.excitation import unread_windows
from hfsa.cosim.systems.scene import LOCK_IN

STARTS = STEADY, REST, PREVIOUS = "steady", "rest", "previous"
"""States in which a measurement starts: the predicted steady state, where there is one, rest, or the point before."""


@dataclass(frozen=True)
class Settings:
    """Settings of a sweep.

    Attributes:
        method: `stepped` or `linear`.
        algorithm, step_size: co-simulation algorithm and its step [s].
        settling_tolerance: largest remaining transient, relative to the gain.
        measurement_periods: periods in a measurement window.
        settling_time: largest simulated time [s] of a point after the ramp and the wait.
        settling_periods, settling_time_min: least number of periods after the ramp, and least simulated time [s] from
            the start, before the windows that are judged: the wait.
        start: one of `STARTS`.
    """

    method: str = "stepped"
    algorithm: str = DEFAULT
    step_size: float = 1e-4
    settling_tolerance: float = 1e-3
    measurement_periods: int = 1
    settling_time: float = 60.0
    start: str = STARTS[0]
    settling_periods: int = 0
    settling_time_min: float = 0.0

    def unread_windows(self, ramp: float, window: float) -> int:
        """Return the number of windows [s] of a ramp [s] and of the wait, which are not judged."""
        periods = self.settling_periods / self.measurement_periods
        return unread_windows(ramp, window, periods, self.settling_time_min)


@dataclass(frozen=True, eq=False)
class Bench:
    """A system with its instruments for one input: a sine source feeds it, a lock-in amplifier measures the outputs.

    Attributes:
        assembly: the system, both instruments included.
        outputs: full names; signal i + 1 of the amplifier is `outputs[i]`.
        source, lock_in: names of the instruments.
        library: the stepping loop in C; `None` for the one in Python.
    """

    assembly: Assembly
    outputs: tuple[str, ...]
    source: str = "source"
    lock_in: str = LOCK_IN
    library: Path | None = None

    @cached_property
    def key(self) -> str:
        """Text that identifies the bench in every process."""
        return repr((self.assembly.system, sorted(self.assembly.files.items()), self.outputs, self.library))


@dataclass(frozen=True)
class Task:
    """One point of a sweep: its indices in the file (input, frequency), its measurement, and what is predicted.

    `start` is the steady state, `expected` the response; `None` where they are not known.
    `time_limit` is the longest time [s] that it may take, `None` for any.
    """

    input: int
    place: int
    bench: Bench
    settings: Settings
    frequency: float
    amplitude: float
    start: SteadyStart | None = None
    expected: Expectation | None = None
    time_limit: float | None = None
