"""One time-domain run of a system into a file: what is recorded survives whatever ends the run.

    plan = RunPlan(system, files, ("robot.platform.position[3]",), stop_time=5.0, step_size=50e-6, record=record)
    summary = run(plan, path)

Everything that is recorded is in the file; what is returned says how it went.
"""

import contextlib
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hfsa.cosim.actions.divergence import Scale
from hfsa.cosim.actions.wiring import check_sample_times
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.masters.algorithms import DEFAULT, open_master
from hfsa.cosim.masters.master import Master
from hfsa.cosim.measurement.limit_flags import ActiveLimit, active_limits, limit_signals
from hfsa.cosim.results.files import Identity, RunFile, SystemRecord
from hfsa.cosim.systems.connectors import connector
from hfsa.cosim.systems.errors import StructureError

_BLOCK = 0.1
"""Time [s] that steps at a stretch shall take: as long as an interruption may wait."""

_UNWRITTEN = 0.8
"""Time [s] after which recorded rows are written to the file, unless a single step takes longer."""

_FASTER = 10
"""Factor by which a stretch of steps may be longer than the last one."""


@dataclass(frozen=True)
class RunPlan:
    """A system ready to run from 0 to `stop_time` [s], as plain data that any process can take.

    Attributes:
        assembly: what runs.
        names: variables (full names) that are recorded at every communication point.
        record: what the results file says of the system.
        library: the stepping loop in C, `None` for Python's.
        tolerance: of the response, relative, for algorithms that choose their steps.
        scales: sizes of variables (full names) beyond a thousand times which the run stops.
    """

    assembly: Assembly
    names: Sequence[str]
    stop_time: float
    step_size: float
    record: SystemRecord
    algorithm: str = DEFAULT
    library: Path | None = None
    tolerance: float = 1e-3
    scales: Mapping[str, Scale] = field(default_factory=dict)

    @property
    def steps(self) -> int:
        """Number of steps; `StructureError` where that is none."""
        steps = round(self.stop_time / self.step_size)
        if steps < 1:
            raise StructureError(f"stop time {self.stop_time:g} s is less than a step of {self.step_size:g} s")
        return steps

    @property
    def end(self) -> float:
        """Time [s] of the last step, the multiple of a step that is nearest to the stop time."""
        return self.steps * self.step_size

    @property
    def end_sentence(self) -> str:
        """What to say of an end that is not the stop time; empty where it is, to a millionth of a step."""
        if abs(self.end - self.stop_time) <= 1e-6 * self.step_size + 1e-12 * self.stop_time:
            return ""
        return (
            f"the stop time of {self.stop_time:.9g} s is no multiple of the step of {self.step_size:.9g} s: the run "
            f"ends at {self.end:.9g} s"
        )


@dataclass(frozen=True)
class RunSummary:
    """How a run ended: the first warning of each instance by its name; the limits that acted, the earliest first.

    `file` tells its results file from another that may have got its name since.
    """

    warnings: Mapping[str, str]
    limits: Sequence[ActiveLimit]
    file: Identity


def run(plan: RunPlan, path: Path, report: Callable[[float], None] | None = None, force: bool = False) -> RunSummary:
    """Run into the file `path`, what tells of a limit (`measurement/limit_flags.py`) recorded as well.

    The file is written as the run goes on, about once a second; a `StepError` is written to it as well, with everything
    recorded before, and raised. `report` is called with the part done, 0 to 1, and may raise to end the run. `force`
    replaces a results file of that name (`results.RunFile`).
    """
    steps, system = plan.steps, plan.assembly.system
    with contextlib.ExitStack() as stack:
        master = open_master(plan.assembly, plan.algorithm, plan.step_size, plan.library, plan.tolerance)
        stack.callback(master.close)
        connectors = master.wiring.connectors
        check_sample_times(system, connectors, {}, plan.step_size)
        limits = [system.own_name(name) for name in limit_signals(connectors)]
        names = list(dict.fromkeys([*plan.names, *limits]))
        units = {name: connector(system, connectors, name).unit or "1" for name in names}
        recording = master.record(names, rows=steps + 1)
        recording.watch.limit(plan.scales)
        failed = _initialize(master, max(plan.stop_time, plan.end))
        times = np.arange(steps + 1, dtype=np.float64) * plan.step_size
        file = RunFile(path, times, units, plan.record, force)
        written, failure, is_interrupted = 0, "stopped before the end", False

        def write() -> None:
            """Write what has been recorded since."""
            nonlocal written
            file.write(written, {name: recording[name][written:] for name in names})
            written = recording.rows

        try:
            if failed is not None:
                raise failed
            last = time.monotonic()
            for done in _stretches(master, steps):
                if done == steps or time.monotonic() - last > _UNWRITTEN:
                    write()
                    last = time.monotonic()
                if report is not None:
                    report(done / steps)
            failure = ""
        except StepError as error:
            failure = str(error)
            raise
        except KeyboardInterrupt:
            is_interrupted = True
            raise
        finally:
            try:
                write()
            finally:
                if is_interrupted:
                    file.interrupt()
                else:
                    file.close(failure)
        found = active_limits(recording.time, {name: recording[name] for name in limits})
        return RunSummary(master.warnings, found, file.identity)


def _initialize(master: Master, stop_time: float) -> StepError | None:
    """Initialize a master that will go to `stop_time` [s]; return why it cannot step, `None` where it can.

    What is wrong with the request is raised: no file is made for that. A last step that rounding takes beyond the stop
    time is no step beyond what the FMUs are told.
    """
    try:
        master.initialize(stop_time=stop_time)
    except StepError as error:
        return error
    return None


def _stretches(master: Master, steps: int) -> Iterator[int]:
    """Take steps, yielding their number so far after each stretch of about `_BLOCK`, as measured by the last one."""
    done, stretch = 0, 1
    while done < steps:
        begin = time.monotonic()
        master.advance(min(stretch, steps - done))
        fitting = int(stretch * _BLOCK / max(time.monotonic() - begin, 1e-9))
        done = min(done + stretch, steps)
        yield done
        stretch = max(1, min(fitting, _FASTER * stretch))
