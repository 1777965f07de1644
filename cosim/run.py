"""One time-domain run of a system into a file: what is recorded survives whatever ends the run.

    ready = Ready(system, files, ("robot.platform.position[3]",), stop_time=5.0, step_size=50e-6, record=record)
    ended = run(ready, path)

Everything that is recorded is in the file; what is returned says how it went.
"""

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hfsa.cosim.actions.wiring import check_sample_times
from hfsa.cosim.algorithms import open_master
from hfsa.cosim.divergence import Scale
from hfsa.cosim.instance import StepError
from hfsa.cosim.limits import Acting, acting, limit_signals
from hfsa.cosim.results import RunFile, SystemRecord
from hfsa.cosim.system import ALGORITHMS, StructureError, System, connector

_BLOCK = 10_000
"""Steps between two writes to the file."""


@dataclass(frozen=True)
class Ready:
    """A system ready to run from 0 to `stop_time` [s], as plain data that any process can take.

    Attributes:
        system: what runs; `files` are its FMUs by component.
        names: variables (full names) that are recorded at every communication point.
        record: what the results file says of the system.
        library: the stepping loop in C, `None` for Python's.
        tolerance: of the response, relative, for algorithms that choose their steps.
        scales: sizes of variables (full names) beyond a thousand times which the run stops.
    """

    system: System
    files: Mapping[str, Path]
    names: Sequence[str]
    stop_time: float
    step_size: float
    record: SystemRecord
    algorithm: str = ALGORITHMS[0]
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
class Ended:
    """How a run ended: the first warning of each instance by its name; the limits that acted, the earliest first."""

    warnings: Mapping[str, str]
    limits: Sequence[Acting]


def run(ready: Ready, path: Path, report: Callable[[float], None] | None = None) -> Ended:
    """Run into the file `path`, what tells of a limit (`limits.py`) recorded as well.

    The file is written as the run goes on; a `StepError` is written to it as well, with everything recorded before, and
    raised. `report` is called with the part done, 0 to 1, and may raise to end the run.
    """
    steps, system = ready.steps, ready.system
    with contextlib.ExitStack() as stack:
        master = open_master(ready.files, system, ready.algorithm, ready.step_size, ready.library, ready.tolerance)
        stack.callback(master.close)
        connectors = master.wiring.connectors
        check_sample_times(system, connectors, {}, ready.step_size)
        limits = [system.own_name(name) for name in limit_signals(connectors)]
        names = list(dict.fromkeys([*ready.names, *limits]))
        units = {name: connector(system, connectors, name).unit or "1" for name in names}
        recording = master.record(names, rows=steps + 1)
        recording.watch.limit(ready.scales)
        file = RunFile(path, np.arange(steps + 1, dtype=np.float64) * ready.step_size, units, ready.record)
        written, failure = 0, "stopped before the end"

        def write() -> None:
            """Write what has been recorded since."""
            nonlocal written
            file.write(written, {name: recording[name][written:] for name in names})
            written = recording.rows

        try:
            # A last step that rounding takes beyond the stop time is no step beyond what the FMUs are told.
            master.initialize(stop_time=max(ready.stop_time, ready.end))
            for done in range(0, steps, _BLOCK):
                master.advance(min(_BLOCK, steps - done))
                write()
                if report is not None:
                    report(min(done + _BLOCK, steps) / steps)
            failure = ""
        except StepError as error:
            failure = str(error)
            raise
        finally:
            try:
                write()
            finally:
                file.close(failure)
        return Ended(master.warnings, acting(recording.time, {name: recording[name] for name in limits}))
