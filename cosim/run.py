"""One time-domain run of a system into a file: what is recorded survives whatever ends the run.

run(path, system, files, ["robot.platform.position[3]"], stop_time=5.0, step_size=50e-6, record=record)
"""

import contextlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hfsa.cosim._wiring import check_sample_times
from hfsa.cosim.instance import StepError, open_instances
from hfsa.cosim.limits import Acting, acting, limit_signals
from hfsa.cosim.results import RunFile, SystemRecord
from hfsa.cosim.stepping import make_master
from hfsa.cosim.system import ALGORITHMS, StructureError, System, connector

_BLOCK = 10_000
"""Steps between two writes to the file."""


@dataclass(frozen=True)
class Ended:
    """How a run ended: the first warning of each instance by its name; the limits that acted, the earliest first."""

    warnings: Mapping[str, str]
    limits: Sequence[Acting]


def run(
    path: Path,
    system: System,
    files: Mapping[str, Path],
    names: Sequence[str],
    *,
    stop_time: float,
    step_size: float,
    record: SystemRecord,
    algorithm: str = ALGORITHMS[0],
    library: Path | None = None,
    report: Callable[[float], None] | None = None,
) -> Ended:
    """Run from 0 to `stop_time` [s] and record variables (full names) at every communication point.

    What tells of a limit (`limits.py`) is recorded as well. The file is written as the run goes on; a `StepError` is
    written to it as well, with everything recorded before, and raised. `library` is the stepping loop in C, `None` for
    Python's; `report` is called with the part done, 0 to 1, and may raise to end the run.
    """
    steps = steps_of(stop_time, step_size)
    with contextlib.ExitStack() as stack:
        instances = open_instances(files)
        for instance in instances.values():
            stack.callback(instance.close)
        master = make_master(instances, system, algorithm, step_size, library)
        check_sample_times(system, master.wiring.connectors, {}, step_size)
        limits = limit_signals(master.wiring.connectors)
        names = list(dict.fromkeys([*names, *limits]))
        units = {name: connector(system, master.wiring.connectors, name).unit or "1" for name in names}
        recording = master.record(names, rows=steps + 1)
        file = RunFile(path, np.arange(steps + 1, dtype=np.float64) * step_size, units, record)
        written, failure = 0, "stopped before the end"

        def write() -> None:
            nonlocal written
            file.write(written, {name: recording[name][written:] for name in names})
            written = recording.rows

        try:
            master.initialize(stop_time=stop_time)
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


def steps_of(stop_time: float, step_size: float) -> int:
    """Return the number of steps of a run, both in s; `StructureError` where that is none."""
    steps = round(stop_time / step_size)
    if steps < 1:
        raise StructureError(f"stop time {stop_time:g} s is less than a step of {step_size:g} s")
    return steps
