"""Frequency sweep: one input and one frequency at a time, on any executor, into one results file.

    plan = plan_sweep(assembly, inputs, outputs, frequency, amplitude, settings)
    with SweepFile.create(path, plan, system_record(...)) as file:
        stepped(file, plan, benches, settings, jobs=2)          # or file.write(points_of(linear(...).response(...)))

`stepped` excites one input with a sine, waits until the response has settled and reads a lock-in amplifier (`rig.py`);
`multisine.py` excites many lines at once. FMUs are loaded once per thread or process and reused. A task is one point:
it receives plain data and returns numbers, and only the caller writes the file. A failed point is a status in the file
with its message; all others are measured. `linear` computes the response from the FMUs' directional derivatives
(`linear/linearize.py`), all points at once.
"""

import contextlib
import hashlib
import itertools
import math
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.actions.wiring import check_sample_times
from hfsa.cosim.analysis.steady_start import SteadyStart
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.description import SOLVER_STEP, SOLVER_TOLERANCE, Description
from hfsa.cosim.linear.linearize import Linearization, Orders, linearize, sinusoids
from hfsa.cosim.masters.algorithms import ALGORITHMS
from hfsa.cosim.measurement import branches, pool
from hfsa.cosim.measurement.expectation import Expectation
from hfsa.cosim.measurement.rig import close_rigs, measure
from hfsa.cosim.measurement.task import PREVIOUS, Bench, Settings, Task
from hfsa.cosim.results.files import (
    AlgorithmChoice,
    InstanceRecord,
    OrderChoice,
    Plan,
    Point,
    Signal,
    Status,
    SweepFile,
    SystemRecord,
)
from hfsa.cosim.signals.excitation import amplitude_of, ramp_time
from hfsa.cosim.signals.frequency_response import FEWEST_WINDOWS
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component

__all__ = [
    "METHODS",
    "Bench",
    "LinearSweep",
    "Progress",
    "Settings",
    "linear",
    "plan_sweep",
    "points_of",
    "stepped",
    "system_record",
]

METHODS = ("stepped", "multisine", "linear")
"""Methods of a sweep; the first is the default."""

_TYPICAL_SETTLING = 3.0
"""Simulated time [s] in which a lightly damped machine settles, for estimates of the work only."""


@dataclass(frozen=True)
class Progress:
    """Progress after a finished `point`: `done` of all `points`, and the completed fraction of the estimated `work`."""

    point: Point
    done: int
    points: int
    work: float


SMALLEST_AMPLITUDE = 1e-100
"""Smallest amplitude of a stepped sweep, in the unit of its input: squares of far smaller signals are no numbers."""


def plan_sweep(
    assembly: Assembly,
    inputs: Sequence[str],
    outputs: Sequence[str],
    frequency: NDArray[np.float64],
    amplitudes: Mapping[str, float],
    settings: Settings,
) -> Plan:
    """Return the plan of a sweep, with the units of the FMUs.

    `inputs` and `outputs` are full names, `frequency` is ascending [Hz], `amplitudes` are by the unit of the input.
    Raises `StructureError` for an unknown signal, with the nearest names, for a signal of another causality, for an
    amplitude too small to be measured, and for a sample time that the step does not fit.
    """
    if settings.method != "linear":
        check_sample_times(assembly.system, assembly.connectors, {}, settings.step_size)

    def signal(name: str, causality: str) -> Signal:
        """Return an input or output of a full name, with its unit; `StructureError` for another causality."""
        found = assembly.connector(name)
        if found.causality != causality:
            raise StructureError(f"{name} is an FMU's {found.causality}, expected an {causality}")
        unit = found.unit or "1"
        if causality == "output":
            return Signal(name, unit, math.nan)
        amplitude = amplitude_of(name, unit, amplitudes)
        if settings.method == "stepped" and not amplitude >= SMALLEST_AMPLITUDE:
            raise StructureError(
                f"the amplitude of {name} is {amplitude:g} {unit}, expected at least {SMALLEST_AMPLITUDE:g} {unit}: "
                "the lock-in amplifier squares its signals"
            )
        return Signal(name, unit, amplitude)

    return Plan(
        frequency=np.asarray(frequency, dtype=float),
        outputs=tuple(signal(name, "output") for name in outputs),
        inputs=tuple(signal(name, "input") for name in inputs),
        settings=asdict(settings) if settings.method != "linear" else {"method": settings.method},
        has_branches=settings.method == "stepped" and settings.start == PREVIOUS,
    )


@dataclass(frozen=True)
class LinearSweep:
    """Linearised system with the inputs and outputs of a plan."""

    found: Linearization
    orders: Orders

    def response(self, frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Return the responses, output per input, at frequencies [Hz], (frequencies, outputs, inputs)."""
        return self.found.response(frequency, self.orders)

    @property
    def operating_point(self) -> dict[str, float]:
        """States at the equilibrium by full name."""
        return dict(self.found.operating_point)

    @property
    def growth(self) -> float:
        """Growth rate [1/s] of the fastest growing mode; 0 where no mode grows by more than rounding."""
        return self.found.growth.rate


def linear(assembly: Assembly, plan: Plan) -> LinearSweep:
    """Linearise the FMUs for a plan.

    Raises `StructureError` where an FMU has no derivatives, sample times have no common grid, or there is no
    equilibrium.
    """
    inputs, outputs = [signal.name for signal in plan.inputs], [signal.name for signal in plan.outputs]
    with assembly.open() as instances:
        columns, orders = sinusoids(assembly.system, instances, inputs)
        return LinearSweep(linearize(assembly.system, instances, columns, outputs), orders)


def points_of(response: NDArray[np.complex128]) -> list[Point]:
    """Return a computed response, (frequencies, outputs, inputs), as finished sweep points."""
    frequencies, _, inputs = response.shape
    return [Point(i, k, Status.DONE, response[k, :, i]) for k in range(frequencies) for i in range(inputs)]


def system_record(
    title: str,
    scene: str,
    *assemblies: Assembly,
    operating_point: Mapping[str, float] = {},
    order: OrderChoice | None = None,
    algorithm: AlgorithmChoice | None = None,
    left_out: str = "",
) -> SystemRecord:
    """Return the description of the measured system for the results file: the text of the scene, and all FMUs.

    Where a component is a different FMU in another assembly (a source in another unit), its name gets a number,
    `source[2]`. `left_out` is the sentence on what was pruned.
    """
    files: dict[str, list[Path]] = {}
    instances = []
    for assembly in assemblies:
        for component in assembly.system.components:
            file, earlier = assembly.files[component.name], files.setdefault(component.name, [])
            if file not in earlier:
                earlier.append(file)
                name = component.name if len(earlier) == 1 else f"{component.name}[{len(earlier)}]"
                instances.append(_instance_record(name, component, assembly.descriptions[component.name]))
    return SystemRecord(title, scene, instances, operating_point, order, algorithm, left_out)


def _instance_record(name: str, component: Component, description: Description) -> InstanceRecord:
    """Return the description of an instance for the results file."""
    file = description.file
    return InstanceRecord(
        instance=name,
        name=description.name,
        file=file.name,
        sha256=hashlib.sha256(file.read_bytes()).hexdigest(),
        fmi_version=description.version,
        level=component.level or "",
        solver="" if component.is_foreign else _solver(description),
        start=component.start,
        is_foreign=component.is_foreign,
        sample_time=description.sample_time(component.start),
    )


def stepped(
    file: SweepFile,
    plan: Plan,
    benches: Mapping[str, Bench],
    settings: Settings,
    *,
    starts: Mapping[str, Sequence[SteadyStart]] = {},
    expected: Mapping[str, Sequence[Expectation]] = {},
    jobs: int = 1,
    executor: Executor | None = None,
    time_limit: float | None = None,
    report: Callable[[Progress], None] | None = None,
) -> None:
    """Measure all unfinished points of the file, and write each when it is finished.

    `benches` holds the bench of each input by name, `starts` the known steady states at the frequencies of the plan,
    `expected` the known responses there. Points run on `executor`, else in `jobs` threads or processes, with 1 in this
    process; where each starts on the one before, the inputs run in `jobs` threads, and an unfinished input is measured
    as a whole. A point that takes longer than `time_limit` [s] has failed. Raises `StructureError` for wrong wiring,
    before a run, and `ResultsError` where the file cannot be written.
    """
    for bench in benches.values():
        bench.assembly.check()
    unfinished, is_following = file.unfinished(), settings.start == PREVIOUS
    if is_following:  # a branch begins at its first point
        unfinished = [(i, k) for i in sorted({i for i, _ in unfinished}) for k in range(len(plan.frequency))]
    tasks = [
        Task(
            i,
            k,
            benches[plan.inputs[i].name],
            settings,
            float(plan.frequency[k]),
            plan.inputs[i].amplitude,
            starts[plan.inputs[i].name][k] if plan.inputs[i].name in starts else None,
            expected[plan.inputs[i].name][k] if plan.inputs[i].name in expected else None,
            time_limit,
        )
        for i, k in unfinished
    ]
    if is_following:
        branches.check(tasks)
    # longest first, so that all workers end at about the same time
    if not is_following:
        tasks.sort(key=_work, reverse=True)
    sweeps = 2 if is_following else 1
    total, finished = sweeps * sum(map(_work, tasks)), 0.0
    points = sweeps * len(plan.frequency) * len(plan.inputs)
    measured = _branch_points(tasks, jobs) if is_following else _points(tasks, jobs, executor)
    with _rigs_closed(), contextlib.closing(measured) as results:
        for n, (task, point) in enumerate(results, points - sweeps * len(tasks) + 1):
            if point is None:
                message = "the process ended without a result: an FMU must have crashed"
                point = Point(task.input, task.place, Status.FAILED, message=message)
            file.write([point])
            finished += _work(task)
            if report is not None:
                report(Progress(point, n, points, finished / total))


def _points(tasks: Sequence[Task], jobs: int, executor: Executor | None) -> Generator[tuple[Task, Point | None]]:
    """Yield each task with its point as it is measured."""
    # a foreign FMU may crash, which must not end this process
    is_foreign = any(task.bench.assembly.is_foreign for task in tasks)
    is_stepped = all(
        task.bench.library is not None and ALGORITHMS[task.settings.algorithm].is_limited for task in tasks
    )
    suits_threads = is_stepped and not is_foreign
    if executor is not None:  # whose processes may have several threads
        work = measure if suits_threads else partial(pool.one_at_a_time, measure)
        return pool.results(work, tasks, executor=executor)
    if suits_threads:
        return pool.in_threads(measure, tasks, jobs)
    return pool.results(measure, tasks, jobs, apart=is_foreign)


def _branch_points(tasks: Sequence[Task], jobs: int) -> Generator[tuple[Task, Point | None]]:
    """Yield each task with its points as they are measured, upwards and downwards; inputs run in parallel."""
    by_input = [tuple(own) for _, own in itertools.groupby(tasks, lambda task: task.input)]
    for own, point in pool.streamed(branches.follow, by_input, jobs):
        yield own[point.frequency], point


@contextlib.contextmanager
def _rigs_closed() -> Iterator[None]:
    """Context that frees the rigs of this process at its end."""
    try:
        yield
    finally:
        close_rigs()


def _solver(description: Description) -> str:
    """Return the solver of an FMU of ours, recognised by its settings; empty for an FMU without states."""
    if not description.states:
        return ""
    if "solver.maximum_order" in description.variables:
        return "cvode"
    if SOLVER_TOLERANCE in description.variables:
        return "rosenbrock"
    return "rk4" if SOLVER_STEP in description.variables else "exact"


def _work(task: Task) -> float:
    """Return the estimated simulated time [s] of a point."""
    window = task.settings.measurement_periods / task.frequency
    unread = window * task.settings.unread_windows(0.0 if task.start else ramp_time(task.frequency), window)
    if task.start is not None:
        return unread + window
    return unread + max(FEWEST_WINDOWS * window, _TYPICAL_SETTLING)
