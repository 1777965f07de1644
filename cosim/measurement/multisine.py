"""Measurement of many lines in one run: excite a multisine, wait until a window repeats, read its spectrum.

    runs = [Run(assembly, outputs, library, settings, grid, (Driven("source", 0, wave, places),), start)]
    multisine(file, plan, runs, jobs=2)

A run excites one input, or all inputs together on lines of their own. It steps whole windows of the grid; a sampler
takes the outputs at every step, as a lock-in amplifier would, and their spectrum at the excited lines, over that of the
excitation, is the response. The run has settled when no line's gain changes any more, judged for all lines at once. The
lines that are not excited show distortion and noise. Samples are dropped as soon as they are in the spectrum.
"""

import contextlib
import math
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.steady_start import SteadyStart
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.fmi.isolation.waiting import is_overdue, limited
from hfsa.cosim.fmi.step_error import check_time
from hfsa.cosim.masters.algorithms import ALGORITHMS, DEFAULT, open_master
from hfsa.cosim.masters.master import Master
from hfsa.cosim.measurement import pool
from hfsa.cosim.measurement.expectation import Expectation, relative, unsettled
from hfsa.cosim.measurement.limit_flags import ActiveLimit, active_limits, limit_signals
from hfsa.cosim.measurement.sweep import Progress
from hfsa.cosim.measurement.task import STARTS
from hfsa.cosim.measurement.told import with_warnings
from hfsa.cosim.results.files import Plan, Point, Status, SweepFile
from hfsa.cosim.signals.drift import of_lines
from hfsa.cosim.signals.excitation import ramp_time, unread_windows
from hfsa.cosim.signals.frequency_response import FEWEST_WINDOWS, LONGEST_MEMORY, NEGLIGIBLE, noise_floor
from hfsa.cosim.signals.multisine import (
    PHASES,
    Excitation,
    Grid,
    LineSettling,
    Spectrum,
    detection_lines,
    distortion,
)
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import SAMPLER

_SPELL = 20_000
"""Largest number of steps whose samples are in memory, and between two looks for a stop request."""

_OF_WHOLE = 1e-2
"""Floor of a single line, relative to the noise floor of all lines together."""

_ROUNDING = 1e-9
"""Size of a line that is rounding, relative to the largest line of all outputs."""


@dataclass(frozen=True)
class MultisineSettings:
    """Settings of a multisine sweep, attributes of `/sweep`.

    Attributes:
        algorithm, step_size: co-simulation algorithm and its step [s].
        settling_tolerance: largest remaining transient, relative to the gain of a line.
        measurement_periods: periods of the lowest frequency in a window.
        settling_time: largest simulated time [s] of a run after the ramp and the wait.
        settling_periods, settling_time_min: the wait, as of a single sine (`task.py`).
        start: one of `STARTS`.
        phases: one of `PHASES`; `seed` is that of random phases and of the lines that are left out.
        inputs: `separate`, a run for each input, or `together`.
        window, spacing: length of a window [s] and distance of neighbouring lines, excited or not [Hz].
    """

    algorithm: str = DEFAULT
    step_size: float = 1e-4
    settling_tolerance: float = 1e-3
    measurement_periods: int = 1
    settling_time: float = 60.0
    settling_periods: int = 0
    settling_time_min: float = 0.0
    start: str = STARTS[0]
    phases: str = PHASES[0]
    seed: int = 0
    inputs: str = "separate"
    window: float = 1.0
    spacing: float = 1.0
    method: str = "multisine"


@dataclass(frozen=True)
class Driven:
    """An excited input: its source component, its index in the file, its sines, and their indices in the file.

    `expected` holds what the linearised FMUs predict at the lines; it is empty where that is not known.
    """

    source: str
    input: int
    wave: Excitation
    places: tuple[int, ...]
    expected: tuple[Expectation, ...] = ()


@dataclass(frozen=True)
class Run:
    """One run of a multisine sweep, plain data for any thread or process.

    `assembly` is the system with a source at each of the `driven` inputs and a sampler at the `outputs` (full names);
    `library` is the stepping loop in C, `None` for the one in Python; `start` is the predicted steady state,
    `time_limit` the longest time [s] that the run may take.
    """

    assembly: Assembly
    outputs: tuple[str, ...]
    library: Path | None
    settings: MultisineSettings
    grid: Grid
    driven: tuple[Driven, ...]
    start: SteadyStart | None = None
    time_limit: float | None = None

    @property
    def lines(self) -> NDArray[np.int64]:
        """Lines of all inputs, in the order of the inputs."""
        return np.concatenate([one.wave.lines for one in self.driven])


def measure(run: Run) -> list[Point]:
    """Measure one run within its time limit as `_points`."""
    with limited(run.time_limit):
        return _points(run)


def _points(run: Run) -> list[Point]:
    """Measure one run; a failure becomes the status and message of its points.

    The `wall_time` of a point is its share of the run, as are its `steps`, whole numbers whose sum is that of the run.
    Where the system does not run from the predicted steady state, it starts at rest, and the messages say why.
    """
    begin = time.perf_counter()
    try:
        try:
            points = _measured(run)
        except (StepError, StructureError) as error:
            if run.start is None or is_overdue():
                raise
            points = _measured(replace(run, start=None))
            points = [replace(p, message=p.message or f"started at rest: {error}") for p in points]
    except Exception as error:  # a failed run must not end the sweep
        ours = isinstance(error, StepError | StructureError | ValueError)
        message = str(error) if ours else f"{type(error).__name__}: {error}"
        points = [Point(i, k, Status.FAILED, message=message) for i, k in _places(run)]
    share = (time.perf_counter() - begin) / len(points)
    return [replace(point, wall_time=share) for point in points]


def _measured(run: Run) -> list[Point]:
    """Return the points of a run from its steady state, or from rest without one; raises as the master."""
    settings = run.settings
    master = open_master(run.assembly, settings.algorithm, settings.step_size, run.library)
    with contextlib.closing(master):
        return [with_warnings(point, master) for point in _Measurement(run, master).points()]


class _Measurement:
    """A run on loaded instances."""

    def __init__(self, run: Run, master: Master):
        self.run, self.master = run, master
        system, connectors = run.assembly.system, run.assembly.connectors
        held = [f"{SAMPLER}.held[{i}]" for i in range(1, len(run.outputs) + 1)]
        self._limits = [system.own_name(name) for name in limit_signals(connectors)]
        rows = min(run.grid.points, _SPELL) + 1
        self._recording = master.record([*held, *self._limits], rows=rows)
        outputs = [run.assembly.connector(name) for name in run.outputs]
        self._units = [output.unit or "" for output in outputs]
        self._nominal = np.array([output.typical for output in outputs])
        lines = run.lines
        odd, even = detection_lines(np.sort(lines))
        self._lines = np.concatenate([lines, odd, even])
        self._excited = len(lines)
        self._drift = of_lines(run.grid.points, self._lines)
        self._active: dict[str, ActiveLimit] = {}

    def points(self) -> list[Point]:
        """Return the points after the window in which the run has settled, or the last one."""
        run = self.run
        settings, start, window = run.settings, run.start, run.grid.window
        if start is None or start.gain is None:
            ramp = math.ceil(ramp_time(float(run.grid.frequency(run.lines).min())) / window - 1e-9)
            settling = LineSettling(settings.settling_tolerance)
        else:
            ramp, keeps = 0, math.exp(start.growth * window)
            settling = LineSettling(settings.settling_tolerance, expected=start.gain.ravel(), keeps=keeps)
        self._initialize(ramp * window)
        periods = settings.settling_periods / settings.measurement_periods
        unread = unread_windows(ramp * window, window, periods, settings.settling_time_min)
        most = max(math.ceil(settings.settling_time / window), FEWEST_WINDOWS)
        simulated = unread * window
        for _ in range(unread):
            self._window(None)
        means, all_gains = np.zeros((0, len(run.outputs))), np.zeros((0, len(self._lines), len(run.outputs)), complex)
        gains, n = all_gains, self._excited
        for _ in range(most):
            spectrum = Spectrum(run.grid, self._lines, len(run.outputs))
            self._window(spectrum)
            simulated += window
            means = np.array([*means, spectrum.mean])[-LONGEST_MEMORY:]
            all_gains = np.array([*all_gains, spectrum.gain])[-LONGEST_MEMORY:]
            gains, doubt = self._drift.removed(means, all_gains)
            floor = self._floor(gains[-1])
            settling.floor = floor.ravel()
            settling.silent = self._silent(gains[-1, :n], floor).ravel()
            settling.judge(gains[:, :n].reshape(len(gains), -1), doubt[:n].ravel())
            if settling.settled:
                break
        return self._points(gains[-1], settling, simulated)

    def _silent(self, gains: NDArray[np.complex128], floor: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return whether outputs are noise at all lines of an input where they are awaited, (lines, outputs)."""
        run, found = self.run, np.zeros(gains.shape, dtype=bool)
        if not run.assembly.is_foreign:
            return found
        first = 0
        for one in run.driven:
            own = slice(first, first := first + len(one.wave.lines))
            heard = np.any(np.abs(gains[own]) > floor[own], axis=0)
            rests = [line.rests for line in one.expected]
            found[own] = ~heard & ~np.all(rests, axis=0) if rests else ~heard
        return found

    def _initialize(self, ramp: float) -> None:
        """Bring the system to the start of the run, with a ramp [s]; raises as the master."""
        run, starts = self.run, {}
        for one in run.driven:
            of = f"{one.source}."
            starts |= {f"{of}step": run.grid.step_size, f"{of}points": float(run.grid.points), f"{of}ramp": ramp}
            for i, (line, amplitude, phase) in enumerate(
                zip(one.wave.lines, one.wave.amplitude, one.wave.phase, strict=True), 1
            ):
                starts |= {
                    f"{of}order[{i}]": float(line),
                    f"{of}amplitude[{i}]": float(amplitude),
                    f"{of}phase[{i}]": float(phase),
                }
        if run.start is None:
            self.master.initialize(starts=starts)
        else:
            self.master.initialize(starts={**starts, **run.start.values})
            self.master.remember(run.start.earlier)

    def _window(self, spectrum: Spectrum | None) -> None:
        """Take the steps of a window, its samples into a spectrum; `KeyboardInterrupt` where it is no longer needed."""
        outputs, points = len(self.run.outputs), self.run.grid.points
        self._active.clear()
        for first in range(0, points, _SPELL):
            if pool.is_stopping():
                raise KeyboardInterrupt
            check_time("the run", self.master.time)
            self._recording.clear()
            self.master.advance(min(_SPELL, points - first))
            if spectrum is None:
                continue
            values = self._recording.values
            spectrum.add(values[:, :outputs])
            if self._limits:
                flags = {name: self._recording[name] for name in self._limits}
                for found in active_limits(self._recording.time, flags):
                    self._active.setdefault(found.signal, found)

    def _floor(self, gains: NDArray[np.complex128]) -> NDArray[np.float64]:
        """Return the amplitude below which an excited line is rounding, (lines, outputs)."""
        excited = gains[: self._excited]
        of_lines = np.array([noise_floor(line, self._units, self._nominal) for line in excited])
        # the rounding in a line is that of the whole signal
        largest = np.abs(excited).max(axis=0)
        whole = noise_floor(largest, self._units, self._nominal)
        least = np.minimum(NEGLIGIBLE * np.abs(self._nominal), _ROUNDING * largest.max())
        return np.maximum(of_lines, np.maximum(_OF_WHOLE * whole, least))

    def _points(self, gains: NDArray[np.complex128], settling: LineSettling, simulated: float) -> list[Point]:
        """Return the points of all lines after a simulated time [s]."""
        run, n = self.run, self._excited
        shape = n, len(run.outputs)
        gain, floor = gains[:n], settling.floor.reshape(shape)
        remaining = relative(np.broadcast_to(settling.remaining, n * shape[1]), settling.scale).reshape(shape)
        silent = np.broadcast_to(settling.silent, n * shape[1]).reshape(shape)
        order = np.argsort(run.lines)
        by_line = dict(zip(self._lines.tolist(), gains, strict=True))
        level = np.zeros(shape)
        level[order] = distortion(run.lines[order], by_line)
        distorted = np.full(shape, np.nan)
        np.divide(level, np.abs(gain), out=distorted, where=np.abs(gain) > floor)
        amplitude = np.concatenate([one.wave.gain for one in run.driven])
        spoilt = sorted(self._active.values(), key=lambda found: (not found.limit.spoils_response, found.first_time))
        steps = np.diff(np.linspace(0, self.master.statistics["steps"], n + 1).astype(int)).tolist()
        points = []
        expected = [line for one in run.driven for line in one.expected]
        for row, (i, k) in enumerate(_places(run)):
            status, message = Status.DONE, ""
            response, own = gain[row] / amplitude[row], floor[row] / abs(amplitude[row])
            if np.any(silent[row]) or not np.all(remaining[row] <= settling.tolerance):
                status = Status.NOT_SETTLED
                message = unsettled(run.outputs, remaining[row], silent[row], settling.tolerance, simulated)
            elif expected:
                largest = float(np.nanmax(distorted[row], initial=0.0))
                message = expected[row].sentence(run.outputs, response, own, largest)
                status = Status.DISAGREES if message else status
            if spoilt and spoilt[0].limit.spoils_response:
                status, message = Status.LIMITED, spoilt[0].response_message
            elif spoilt and status is Status.DONE:
                message = spoilt[0].response_message
            points.append(
                Point(i, k, status, response, distorted[row], remaining[row], message=message, steps=steps[row])
            )
        return points


def _places(run: Run) -> list[tuple[int, int]]:
    """Return the indices (input, frequency) in the file of the lines of a run."""
    return [(one.input, k) for one in run.driven for k in one.places]


def multisine(
    file: SweepFile,
    plan: Plan,
    runs: Sequence[Run],
    *,
    jobs: int = 1,
    executor: Executor | None = None,
    report: Callable[[Progress], None] | None = None,
) -> None:
    """Measure the runs of which a point of the file is unfinished, and write all points of each when it has ended.

    Runs take place on `executor`, else in `jobs` threads or processes, with 1 in this process. Points at lines of other
    inputs get the status `NOT_EXCITED`. Raises `StructureError` for wrong wiring, before a run, and `ResultsError`
    where the file cannot be written.
    """
    for run in runs:
        run.assembly.check()
    unfinished = set(file.unfinished())
    own = {place for run in runs for place in _places(run)}
    file.write(Point(i, k, Status.NOT_EXCITED) for i, k in sorted(unfinished - own))
    tasks = [run for run in runs if unfinished.intersection(_places(run))]
    points = len(plan.frequency) * len(plan.inputs)
    done, finished = points - sum(len(_places(run)) for run in tasks), 0
    with contextlib.closing(_results(tasks, jobs, executor)) as results:
        for run, found in results:
            if found is None:
                message = "the process ended without a result: an FMU must have crashed"
                found = [Point(i, k, Status.FAILED, message=message) for i, k in _places(run)]
            file.write(found)
            done, finished = done + len(found), finished + 1
            if report is not None:
                report(Progress(found[-1], done, points, finished / len(tasks)))


def _results(tasks: Sequence[Run], jobs: int, executor: Executor | None) -> Generator[tuple[Run, list[Point] | None]]:
    """Yield each run with its points as it ends."""
    # a foreign FMU may crash, which must not end this process
    is_foreign = any(run.assembly.is_foreign for run in tasks)
    is_stepped = all(run.library is not None and ALGORITHMS[run.settings.algorithm].is_limited for run in tasks)
    if executor is None and is_stepped and not is_foreign:
        return pool.in_threads(measure, tasks, jobs)
    return pool.results(measure, tasks, jobs, executor, apart=is_foreign)
