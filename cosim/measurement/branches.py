"""Branches of a nonlinear response: each point starts on the settled state of the point before.

The frequencies of one input are measured upwards, then downwards. A run goes on from the state that the run before had
at phase 0 of the source, at the next frequency, and so stays on its branch while there is one. A point that fails
breaks the branch: the next one starts on the predicted steady state, as its message says.
"""

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

from hfsa.cosim.measurement.rig import measure_on
from hfsa.cosim.measurement.task import Task
from hfsa.cosim.results.records import Point
from hfsa.cosim.systems.errors import StructureError


def check(tasks: Sequence[Task]) -> None:
    """Raise `StructureError` where a branch cannot be followed."""
    for task in tasks:
        if task.start is None or task.start.map is None:
            raise StructureError(
                f"a branch cannot be followed with the algorithm {task.settings.algorithm}: it has memory beyond the "
                "states of the FMUs and the values of the last points, which another run cannot start with"
            )
        if task.bench.assembly.is_foreign:
            raise StructureError("a branch is followed in threads of one process, which FMUs of other makers may end")


def follow(tasks: Sequence[Task]) -> Iterator[Point]:
    """Yield the points of one input, the tasks in order of frequency: upwards, then downwards."""
    state, broken = None, ""
    for is_downward in (False, True):
        for task in reversed(tasks) if is_downward else tasks:
            begin = time.perf_counter()
            assert task.start is not None
            before = state
            start = task.start
            if before is not None:
                start = replace(start, values=before.values, earlier=before.earlier, gain=None)
            point, state = measure_on(replace(task, start=start))
            message = "; ".join(filter(None, (broken, point.message)))
            broken = "" if state is not None else "does not start on the point before, which has no state to go on from"
            wall_time = time.perf_counter() - begin
            yield replace(point, is_downward=is_downward, message=message, wall_time=wall_time)
