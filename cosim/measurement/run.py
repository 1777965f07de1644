"""Time-domain run of a system into a results file, which keeps all recorded values however the run ends.

    plan = RunPlan(assembly, ("robot.platform.position[3]",), stop_time=5.0, step_size=50e-6, record=record)
    summary = run(plan, path)

The file contains all recorded values; the summary contains warnings and active limits. With `every` above 1 the file
has every so many points, the first and the last one reached among them (`measurement/kept_rows.py`); limits and bounds
are judged at every point.
"""

import contextlib
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.actions.divergence import Scale
from hfsa.cosim.actions.wiring import check_sample_times
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.fmi.step_error import check_time
from hfsa.cosim.masters.algorithms import DEFAULT, open_master
from hfsa.cosim.masters.master import Master
from hfsa.cosim.measurement.kept_rows import KeptRows
from hfsa.cosim.measurement.limit_flags import ActiveLimit, limit_signals
from hfsa.cosim.measurement.told import sentences
from hfsa.cosim.results.files import Identity, RunFile, SystemRecord
from hfsa.cosim.signals.drive import Signal
from hfsa.cosim.systems.connectors import connector
from hfsa.cosim.systems.errors import StructureError

_BLOCK = 0.1
"""Target duration [s] of a block of steps, which bounds the delay of an interruption."""

_UNWRITTEN = 0.8
"""Longest time [s] for which recorded rows stay unwritten, unless a single step takes longer."""

_LARGE = 100_000_000
"""Size of a file [byte] above which a run warns of it."""

_CAPACITY = 100_000
"""Number of recorded points that are written at the latest, to bound the memory of a run."""

_MOST_ROWS = 1_000_000_000
"""Largest number of rows of a file."""

_FASTER = 10
"""Largest ratio of the length of a block to that of the previous one."""


@dataclass(frozen=True)
class RunPlan:
    """Plan of a run from 0 to `stop_time` [s], as plain data that every process can load.

    Attributes:
        assembly: the system with its FMUs.
        names: variables (full names) to record.
        record: description of the system for the results file.
        library: the stepping loop in C, `None` for Python's.
        tolerance: relative tolerance of the response, for algorithms that choose their steps.
        scales: scales of variables (full names); the run ends beyond a thousand times one.
        every: communication points from one row of the file to the next.
        drive: signals by the full name of the unconnected input that each feeds.
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
    every: int = 1
    drive: Mapping[str, Signal] = field(default_factory=dict)

    def open(self, step_size: float) -> Master:
        """Load the FMUs and return the master with steps of `step_size` [s], inputs driven; as `open_master`."""
        master = open_master(self.assembly, self.algorithm, step_size, self.library, self.tolerance)
        try:
            if self.drive:
                master.drive(self.drive)
        except BaseException:
            master.close()
            raise
        return master

    @property
    def steps(self) -> int:
        """Number of steps; `StructureError` where it is 0."""
        steps = round(self.stop_time / self.step_size)
        if steps < 1:
            raise StructureError(f"stop time {self.stop_time:g} s is less than a step of {self.step_size:g} s")
        return steps

    @property
    def kept(self) -> NDArray[np.int64]:
        """Numbers of the points in the file, from 0, (rows,): every so many, and the last.

        `StructureError` for more rows than a file can have.
        """
        if self.steps / self.every > _MOST_ROWS:
            raise StructureError(
                f"a stop time of {self.stop_time:g} s at steps of {self.step_size:g} s is {self.steps:.3g} points, of "
                f"which a file keeps {_MOST_ROWS:.0e} at most; expected a sooner end, or --every "
                f"{math.ceil(self.steps / _MOST_ROWS)}"
            )
        regular = np.arange(0, self.steps + 1, self.every)
        return regular if regular[-1] == self.steps else np.append(regular, self.steps)

    @property
    def times(self) -> NDArray[np.float64]:
        """Times of the points in the file, (rows,) [s]."""
        return self.kept.astype(np.float64) * self.step_size

    @property
    def end(self) -> float:
        """Time [s] of the last communication point, the multiple of the step nearest to the stop time."""
        return self.steps * self.step_size

    @property
    def end_sentence(self) -> str:
        """Warning about an end that differs from the stop time by more than a millionth of a step; else empty."""
        if abs(self.end - self.stop_time) <= 1e-6 * self.step_size + 1e-12 * self.stop_time:
            return ""
        return (
            f"the stop time of {self.stop_time:.9g} s is no multiple of the step of {self.step_size:.9g} s: the run "
            f"ends at {self.end:.9g} s"
        )

    @property
    def limits(self) -> list[str]:
        """Full names of the limit flags."""
        return [self.assembly.system.own_name(name) for name in limit_signals(self.assembly.connectors)]

    @property
    def size_sentence(self) -> str:
        """Warning about the size of a file above `_LARGE`; else empty."""
        rows, count = math.ceil(self.steps / self.every) + 1, len({*self.names, *self.limits})
        size = 8 * (count + 1) * rows
        if size <= _LARGE:
            return ""
        every = self.every * 10 ** math.ceil(math.log10(size / _LARGE))
        return (
            f"the file will have {size / 1e6:.0f} MB, {count} variables at {rows} points; --every "
            f"{every} makes it {size * self.every / every / 1e6:.0f} MB"
        )


@dataclass(frozen=True)
class RunSummary:
    """Summary of a run.

    Attributes:
        warnings: first warning of each instance with their number, by a key.
        limits: limits that were active, the earliest first.
        file: identity of the results file, which a later file of the same name does not share.
    """

    warnings: Mapping[str, str]
    limits: Sequence[ActiveLimit]
    file: Identity


def run(plan: RunPlan, path: Path, report: Callable[[float], None] | None = None, force: bool = False) -> RunSummary:
    """Run a plan into the file `path`; limit flags (`measurement/limit_flags.py`) are recorded as well.

    The file is written during the run, about once a second. A `StepError` is written to it after all values recorded
    until then, and raised. `report` receives the completed fraction, 0 to 1, and may raise to end the run. `force`
    replaces a results file of that name (`results.RunFile`).
    """
    steps, system = plan.steps, plan.assembly.system
    with contextlib.ExitStack() as stack:
        master = plan.open(plan.step_size)
        stack.callback(master.close)
        connectors = master.wiring.connectors
        check_sample_times(system, connectors, {}, plan.step_size)
        limits = plan.limits
        names = list(dict.fromkeys([*plan.names, *limits]))
        units = {name: connector(system, connectors, name).unit or "1" for name in names}
        recording = master.record(names, rows=min(steps + 1, _CAPACITY))
        recording.watch.limit(plan.scales)
        failed = _initialize(master, max(plan.stop_time, plan.end))
        rows = KeptRows(recording, plan.kept, limits)
        file = RunFile(path, plan.times, units, plan.record, force, plan.step_size, limits)
        failure, is_interrupted = "stopped before the end", False

        def write() -> None:
            """Write the rows recorded since the last call."""
            file.write(rows.written, rows.take())

        try:
            if failed is not None:
                raise failed
            last = time.monotonic()
            for done in _blocks(master, steps):
                if done == steps or time.monotonic() - last > _UNWRITTEN or recording.rows > _CAPACITY:
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
                file.tell(sentences(master.told).values())
                write()
                if rows.is_behind:
                    file.write(rows.written, rows.last(), recording.time[-1])
            finally:
                if is_interrupted:
                    file.interrupt()
                else:
                    file.close(failure)
        return RunSummary(sentences(master.told), rows.limits.active, file.identity)


def _initialize(master: Master, stop_time: float) -> StepError | None:
    """Initialize a master for a run to `stop_time` [s]; return the `StepError` of an instance, `None` on success.

    A `StructureError` is raised, because a wrong request creates no file.
    """
    try:
        master.initialize(stop_time=stop_time)
    except StepError as error:
        return error
    return None


def _blocks(master: Master, steps: int) -> Iterator[int]:
    """Take steps in blocks of about `_BLOCK` [s]; yield the number of steps so far after each."""
    done, block = 0, 1
    while done < steps:
        begin = time.monotonic()
        check_time("the run", master.time)
        master.advance(min(block, steps - done))
        fitting = int(block * _BLOCK / max(time.monotonic() - begin, 1e-9))
        done = min(done + block, steps)
        yield done
        block = max(1, min(fitting, _FASTER * block))
