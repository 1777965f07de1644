"""Measurement of one input at one frequency: excite, wait for the transient to settle, read the lock-in amplifier.

A `Rig` is a system with its instruments, loaded once per thread and reused for every point.
"""

import math
import threading
import time
from dataclasses import replace

import numpy as np

from hfsa.cosim.analysis.steady_start import SteadyStart
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.fmi.isolation.waiting import is_overdue, limited
from hfsa.cosim.fmi.step_error import check_time
from hfsa.cosim.masters.algorithms import open_master
from hfsa.cosim.measurement.expectation import relative, unsettled
from hfsa.cosim.measurement.limit_flags import ActiveLimit, active_limits, limit_signals
from hfsa.cosim.measurement.newton import CONTRACTION, MOST_CORRECTIONS, SAMPLES, Orbit
from hfsa.cosim.measurement.pool import is_stopping
from hfsa.cosim.measurement.readings import Readings
from hfsa.cosim.measurement.start_state import StartState
from hfsa.cosim.measurement.task import Bench, Settings, Task
from hfsa.cosim.measurement.told import with_warnings
from hfsa.cosim.results.records import Point, Status
from hfsa.cosim.signals.excitation import ramp_time, window_steps
from hfsa.cosim.signals.frequency_response import FEWEST_WINDOWS, ROUNDING, Settling, harmonic_distortion, noise_floor
from hfsa.cosim.systems.errors import StructureError

_SPELL = 100_000
"""Largest number of steps between two looks for a stop request."""

_AWAITED = 10.0
"""Expected amplitude, relative to the noise floor, above which an output is awaited."""

_LEFT = 0.05
"""Largest error of a corrected start, relative to the settling tolerance."""

_LONGEST = 4
"""Largest number of windows after which the state is sampled."""

_OWN = 1e-2
"""Share of an output's own harmonics below which its fundamental is judged by them: zero by symmetry, or nearly."""

_WAITED = "waited for the transient:"

_RAMP = "ramp"
"""Parameter of the sine source: 0 for full amplitude from the start."""


def measure(task: Task) -> Point:
    """Measure one point; a failure becomes its status and message."""
    begin = time.perf_counter()
    try:
        with limited(task.time_limit):
            point = _rig(task.bench, task.settings).measure(task)
    except Exception as error:  # a failed point must not end the sweep
        point = Point(task.input, task.place, Status.FAILED, message=_message(error))
    return replace(point, wall_time=time.perf_counter() - begin)


def measure_on(task: Task) -> tuple[Point, SteadyStart | None]:
    """Measure one point as `measure`, and return the state at its end, `None` where it has none to go on from."""
    try:
        rig = _rig(task.bench, task.settings)
        with limited(task.time_limit):
            point = rig.measure(task)
            state = rig.closing_state(task)
        return replace(point, steps=rig.steps), state
    except Exception as error:  # as in `measure`
        return Point(task.input, task.place, Status.FAILED, message=_message(error)), None


class Rig:
    """The loaded instances of a bench and the master that steps them.

    Attributes:
        steps: communication steps since the begin of the present point.
    """

    def __init__(self, bench: Bench, settings: Settings):
        self.bench = bench
        self.master = open_master(bench.assembly, settings.algorithm, settings.step_size, bench.library)
        outputs = [bench.assembly.connector(name) for name in bench.outputs]
        self.units = [output.unit or "" for output in outputs]
        self.nominal = np.array([output.typical for output in outputs])
        self._readings = Readings(self.master.instances[bench.lock_in], len(outputs))
        limits = [bench.assembly.system.own_name(name) for name in limit_signals(self.master.wiring.connectors)]
        self._limits = self.master.record(limits, rows=1000) if limits else None
        self.steps = 0

    def measure(self, task: Task) -> Point:
        """Measure one point; raises as the master.

        Where the system does not run from its start, it starts at rest, and the message says why.
        """
        self.steps = 0
        self.master.forget_warnings()
        try:
            point = self._measure(task)
        except (StepError, StructureError) as error:
            if task.start is None or is_overdue():
                raise
            point = self._measure(replace(task, start=None))
            point = replace(point, message=point.message or f"started at rest: {error}")
        return with_warnings(replace(point, steps=self.steps), self.master)

    def closing_state(self, task: Task) -> SteadyStart | None:
        """Run the measured system on to phase 0 of the source, and return its state there as the start of another run.

        `None` where the samples near phase 0 do not determine it, or no linear map is known.
        """
        start = task.start
        if start is None or start.map is None:
            return None
        turn, pattern, done = _turn(task), start.map.steps, self.master.statistics["steps"]
        period = 2 * math.pi / turn
        middle = math.ceil(done / period + SAMPLES * pattern / period) * period
        first = (round(middle / pattern) - SAMPLES // 2) * pattern
        state = StartState(self.master, start.map.values)
        orbit = Orbit(start.map, state.nominal, turn, first)
        if not orbit.is_known:
            return None
        return state.start(start, orbit.closed(self._sampled(orbit, state)))

    def _measure(self, task: Task) -> Point:
        """Measure one point from its start, or from rest without one; raises as the master."""
        steps = window_steps(task.frequency, task.settings.step_size, task.settings.measurement_periods)
        window, tolerance, start = steps * task.settings.step_size, task.settings.settling_tolerance, task.start
        self._initialize(task, steps)
        ramp = ramp_time(task.frequency) if start is None else 0.0
        unread = task.settings.unread_windows(ramp, window)
        if start is None:
            return self._settled(task, steps, Settling(tolerance), unread)
        settling = Settling(tolerance, expected=start.gain, keeps=math.exp(start.growth * window))
        if unread:
            return self._settled(task, steps, settling, unread)
        self._take_window(task, steps, settling, 1)
        if settling.settled or start.map is None:
            return self._settled(task, steps, settling, done=1)
        corrected, reason = self._corrected(task, steps, settling)
        if corrected is not None:
            return self._settled(task, steps, corrected, done=1)
        self._initialize(task, steps)
        point = self._settled(task, steps, Settling(tolerance, expected=start.gain, keeps=settling.keeps))
        # a branch is followed by waiting wherever it is far from linear
        return replace(point, message=point.message or reason) if start.gain is not None else point

    def _settled(self, task: Task, steps: int, settling: Settling, unread: int = 0, done: int = 0) -> Point:
        """Measure windows after the `done` ones until the gains have settled; the first ones may stay unread."""
        window = steps * task.settings.step_size
        most = max(math.ceil(task.settings.settling_time / window), FEWEST_WINDOWS)
        k = done
        while k < unread + most and not settling.settled:
            k += 1
            self._take_window(task, steps, settling if k > unread else None, k)
        return self._point(task, settling, k * window)

    def _take_window(self, task: Task, steps: int, settling: Settling | None, k: int) -> None:
        """Run to the end of window `k`, and judge the settling of the gains with its own."""
        if self._limits is not None:
            self._limits.clear()
        self._advance(k * steps - self.master.statistics["steps"])
        if settling is not None:
            readings = self._readings
            readings.take(k)
            gain = readings.gains[-1]
            floor = self._floor(task, gain)
            settling.floor = np.maximum(floor, _OWN * np.hypot(*readings.harmonics))
            settling.silent = (np.abs(gain) <= floor) & ~self._may_be_silent(task, floor)
            settling.judge(readings.gains, readings.doubt)

    def _floor(self, task: Task, gain: np.ndarray) -> np.ndarray:
        """Return the amplitude of each output below which it is noise, (outputs,)."""
        floor = noise_floor(gain, self.units, self.nominal)
        if task.expected is None:
            return floor
        # an output that is expected to rest has the rounding of all
        return np.where(task.expected.rests, np.maximum(floor, ROUNDING * np.abs(gain).max()), floor)

    def _may_be_silent(self, task: Task, floor: np.ndarray) -> np.ndarray:
        """Return whether outputs may be noise: zero is expected, or no FMU of another maker may have a dead time."""
        if task.expected is None:
            return np.full(len(floor), not self.bench.assembly.is_foreign)
        return np.abs(task.expected.response) * task.amplitude <= _AWAITED * floor

    def _corrected(self, task: Task, steps: int, settling: Settling) -> tuple[Settling | None, str]:
        """Correct the start by Newton's method (`newton.py`), after the first window of a run from it.

        Returns the settling of a run from the corrected start, to continue after its first window, or `None` and the
        reason.
        """
        start = task.start
        assert start is not None
        assert start.map is not None
        state = StartState(self.master, start.map.values)
        orbit = Orbit(start.map, state.nominal, _turn(task), steps)
        if not orbit.is_known or orbit.samples[-1] > _LONGEST * steps:
            return None, f"{_WAITED} ticks repeat too rarely for Newton's method"
        z, gains, changes = state.vector(start), [settling.gain], [math.inf]
        for k in range(1, MOST_CORRECTIONS + 1):
            try:
                z = z + orbit.correction(z, self._sampled(orbit, state))
                self._initialize(replace(task, start=state.start(start, z)), steps)
                found = Settling(settling.tolerance)
                self._take_window(task, steps, found, 1)
            except StepError as error:
                return None, f"{_WAITED} Newton's method leads to a state that does not run: {error}"
            gains.append(found.gain)
            changes.append(float(np.max(np.abs(gains[-1] - gains[-2]) / found.scale)))
            factor = changes[-1] / changes[-2] if k > 1 else CONTRACTION if start.gain is not None else math.nan
            if changes[-1] * factor <= _LEFT * settling.tolerance and factor <= CONTRACTION:
                # the true map keeps at most as much more of a transient as the method leaves of an error
                keeps = 1 - (1 - settling.keeps) * (1 - factor)
                return Settling(settling.tolerance, found.floor, expected=found.gain, keeps=keeps), ""
            if k > 1 and not factor <= CONTRACTION:
                break
        return None, f"{_WAITED} Newton's method does not converge, the last change is {changes[-1]:.2g} of the gain"

    def _sampled(self, orbit: Orbit, state: StartState) -> list[np.ndarray]:
        """Return the states at the samples of an orbit, in the present run."""
        found = []
        for count in orbit.samples:
            self._advance(count - self.master.statistics["steps"])
            found.append(state.read())
        return found

    def _advance(self, steps: int) -> None:
        """Take steps; `KeyboardInterrupt` where the point is no longer needed."""
        for first in range(0, steps, _SPELL):
            if is_stopping():
                raise KeyboardInterrupt
            check_time("the point", self.master.time)
            spell = min(_SPELL, steps - first)
            self.master.advance(spell)
            self.steps += spell

    def _initialize(self, task: Task, steps: int) -> None:
        """Bring the system to the start of a point, windows of a number of steps; raises as the master."""
        source = self.bench.source
        self._readings.begin(steps, _turn(task))
        starts = {
            f"{source}.frequency": task.frequency,
            f"{source}.amplitude": task.amplitude,
            f"{self.bench.lock_in}.window": steps * task.settings.step_size,
        }
        if task.start is None:
            self.master.initialize(starts=starts)
        else:
            self.master.initialize(starts={**starts, **task.start.values, f"{source}.{_RAMP}": 0.0})
            self.master.remember(task.start.earlier)

    def _point(self, task: Task, settling: Settling, simulated: float) -> Point:
        """Return the measured point after a simulated time [s]."""
        readings, gain = self._readings, settling.gain
        second, third = readings.harmonics
        floor = self._floor(task, gain)
        distortion = np.where(np.abs(gain) <= floor, np.nan, harmonic_distortion(gain, second, third))
        remaining = relative(settling.remaining, settling.scale)
        response = gain / task.amplitude
        status, message = self._status(task, settling, remaining, distortion, simulated)
        return Point(
            task.input,
            task.place,
            status,
            response=response,
            harmonic_distortion=distortion,
            harmonics=np.array([readings.mean, np.abs(gain), second, third]) / task.amplitude,
            remaining_transient=remaining,
            message=message,
        )

    def _status(
        self, task: Task, settling: Settling, remaining: np.ndarray, distortion: np.ndarray, simulated: float
    ) -> tuple[Status, str]:
        """Return the status of a point and its message: of a limit, of settling, or of a disagreement."""
        limits = self._active_limits()[:1]
        told = "".join(found.response_message for found in limits)
        if any(found.limit.spoils_response for found in limits):
            return Status.LIMITED, told
        if not settling.settled:
            silent = np.broadcast_to(settling.silent, remaining.shape)
            return Status.NOT_SETTLED, unsettled(self.bench.outputs, remaining, silent, settling.tolerance, simulated)
        if task.expected is not None:
            gain, largest = settling.gain, float(np.nanmax(distortion, initial=0.0))
            floor = self._floor(task, gain)
            sentence = task.expected.sentence(
                self.bench.outputs, gain / task.amplitude, floor / task.amplitude, largest
            )
            if sentence:
                return Status.DISAGREES, sentence
        return Status.DONE, told

    def _active_limits(self) -> list[ActiveLimit]:
        """Return the limits that were active in the last window, those that spoil the response first."""
        if self._limits is None:
            return []
        found = active_limits(self._limits.time, {name: self._limits[name] for name in self._limits.names})
        return sorted(found, key=lambda limit: not limit.limit.spoils_response)

    def close(self) -> None:
        """Free the instances."""
        self.master.close()


_rigs: dict[tuple[int, str], Rig] = {}


def _rig(bench: Bench, settings: Settings) -> Rig:
    """Return the rig of this thread for a bench; it is created at the first point."""
    key = threading.get_ident(), repr((bench.key, settings))
    if key not in _rigs:
        _rigs[key] = Rig(bench, settings)
    return _rigs[key]


def close_oldest(most: int = 64) -> None:
    """Free the rigs of this thread but for a number of the newest, in a process that serves one sweep after another."""
    own = [key for key in list(_rigs) if key[0] == threading.get_ident()]
    for key in own[: max(len(own) - most, 0)]:
        _rigs.pop(key).close()


def close_rigs() -> None:
    """Free the instances of all rigs of this process."""
    while _rigs:
        _rigs.popitem()[1].close()


def _turn(task: Task) -> float:
    """Return the phase of the source per step [rad]."""
    return 2 * math.pi * task.frequency * task.settings.step_size


def _message(error: Exception) -> str:
    """Return the message of an error, with its type for errors that are not ours."""
    ours = isinstance(error, StepError | StructureError | ValueError)
    return str(error) if ours else f"{type(error).__name__}: {error}"
