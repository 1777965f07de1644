"""Masters with prescribed steps: the stepping loop in Python, and the same in C."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.masters.algorithm import Algorithm
from hfsa.cosim.masters.master import Master
from hfsa.cosim.masters.native.stepping import CompiledMaster
from hfsa.cosim.systems.system import System


class SteppedMaster(Master):
    """Master with the stepping loop in Python."""

    def _take(self, steps: int) -> None:
        """Take steps; `native/stepping.py` is the same loop in C."""
        calls = {action.call.run: action.call for action in self.cycle}
        stepping = [action.call.run for action in self.cycle[: self.first_of_point]]
        at_point = [action.call.run for action in self.cycle[self.first_of_point :]]
        time, bus, zeros, is_bounded = (
            self.wiring.time,
            self.wiring.bus,
            np.zeros_like(self.wiring.bus),
            self._watch.is_bounded,
        )
        every = self._recording.every if self._recording else 0
        for count in range(self._count + 1, self._count + steps + 1):
            for run in stepping:
                status = run()
                if status:
                    self._exchange.report(calls[run], status)
            self._count = count
            time.value = self._start_time + count * self.step_size
            for run in at_point:
                status = run()
                if status:
                    self._exchange.report(calls[run], status)
            if is_bounded or bus.dot(zeros) != 0.0:  # 0 unless a value is not finite
                self._watch.check(time.value)
            if every and count % every == 0:
                self._record()


def stepped(
    instances: Mapping[str, Instance],
    system: System,
    algorithm: Algorithm,
    step_size: float,
    library: Path | None = None,
    tolerance: float = 1e-3,  # noqa: ARG001 (of algorithms that choose their steps)
) -> Master:
    """Return the master that steps in C with `library`, or in Python where that is `None`."""
    if library is None:
        return SteppedMaster(instances, system, algorithm, step_size)
    return CompiledMaster(instances, system, algorithm, step_size, library)
