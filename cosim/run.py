"""One time-domain run of a system into a file: what is recorded survives whatever ends the run.

run(path, system, files, ["robot.platform.position[3]"], stop_time=5.0, step_size=50e-6, record=record)
"""

import contextlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from hfsa.cosim._wiring import check_sample_times
from hfsa.cosim.instance import StepError, open_instances
from hfsa.cosim.results import RunFile, SystemRecord
from hfsa.cosim.stepping import make_master
from hfsa.cosim.system import ALGORITHMS, StructureError, System, connector, limit_message, limit_signals

_BLOCK = 10_000
"""Steps between two writes to the file."""


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
) -> dict[str, str]:
    """Run from 0 to `stop_time` [s] and record variables (full names) at every communication point.

    What tells of a limit that acts (`limit_signals`) is recorded as well. Returns warnings: the first of each instance,
    by its name, and of each limit that acted, by its signal's. The file is written as the run goes on; a `StepError`
    is written to it as well, with everything recorded before, and raised. `library` is the stepping loop in C, `None`
    for Python's; `report` is called with the part done, 0 to 1.
    """
    steps = round(stop_time / step_size)
    if steps < 1:
        raise StructureError(f"stop time {stop_time:g} s is less than a step of {step_size:g} s")
    with contextlib.ExitStack() as stack:
        instances = open_instances(files)
        for instance in instances.values():
            stack.callback(instance.close)
        master = make_master(instances, system, algorithm, step_size, library)
        check_sample_times(system, master.wiring.connectors, {}, step_size)
        limits = [name for name in limit_signals(master.wiring.connectors) if name not in names]
        names = [*names, *limits]
        units = {name: connector(system, master.wiring.connectors, name).unit or "1" for name in names}
        recording = master.record(list(names), rows=steps + 1)
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
        acting = [recording[name] != 0 for name in limits]
        said = {
            name: limit_message(name, recording.time[np.argmax(rows)])
            for name, rows in zip(limits, acting, strict=True)
            if rows.any()
        }
        return {**master.warnings, **said}
