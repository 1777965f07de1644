"""Iterated coupling whose communication step follows the error it makes; what is not good enough is taken back.

Over a step of h the inputs follow straight lines between values u0 and u1 (`actions/iterated.py`). With the value um
before, hm earlier, the line misses the curve by at most

    e = h^2 / 4 |((u1 - u0) / h - (u0 - um) / hm) / (h + hm)|

A step is taken where e is at most the tolerance, of the largest value so far, for every input; otherwise the instances
go back, and a shorter step is tried. The next step is as long as e lets it, h sqrt(tolerance / e) with some safety.

Steps end at every tick of a sampled instance and wherever values are recorded. Behind a tick the past tells nothing of
the curve: the first step is no longer than the last one, and has no error of its own; the second tells of it. Inputs
that follow a sampled output directly jump at ticks and have no part in the error.
"""

from collections.abc import Mapping

import numpy as np

from hfsa.cosim._fmi.description import SAMPLE_TIME
from hfsa.cosim.actions.iterated import Converge
from hfsa.cosim.instance import Instance, State, StepError
from hfsa.cosim.master import Master
from hfsa.cosim.system import StructureError, System

TOLERANCE = 1e-5
"""Default error of an input on its line, relative to the largest value it had."""

SMALLEST = 1e-3
"""Of its nominal, an input's value that counts even where it is smaller."""

SAFETY, SHORTEN, LENGTHEN = 0.9, 0.2, 3.0
"""Factors by which the step that the error asks for is kept smaller; at least, and at most, by which a step changes."""

FIRST, SHORTEST = 1e-3, 1e-9
"""Of the interval between two records, the first step, and the shortest that is tried."""

_SETTING = "solver.relative_tolerance"


class ErrorControlled(Master):
    """A master that chooses its communication steps between points `step_size` apart.

    Attributes:
        tolerance: of the inputs.
        taken, rejected: communication steps since the start.
    """

    def __init__(
        self, instances: Mapping[str, Instance], system: System, step_size: float, tolerance: float = TOLERANCE
    ):
        super().__init__(instances, system, "quasi_newton", step_size)
        assert isinstance(self._moving, Converge)
        self.algorithm, self.tolerance = "error_controlled", tolerance
        self._converge = self._moving
        self._ticks = self.cycle[: self.cycle.index(self._converge)]
        self._after = self.cycle[self.cycle.index(self._converge) + 1 :]
        jumping = self.wiring.jumping()
        smooth = [i for i in self._converge.places if self.wiring.connections[i].start not in jumping]
        self._smooth = np.array(smooth, dtype=int)
        self._sampled = [instances[stepper.instance] for stepper in self.wiring.sampled]
        self._states: list[State] = []

    def initialize(
        self, start_time: float = 0.0, stop_time: float | None = None, starts: Mapping[str, float] | None = None
    ) -> None:
        """Initialize as `Master.initialize`; `StructureError` where an FMU's solver is coarser than the tolerance."""
        super().initialize(start_time, stop_time, starts)
        self._check_solvers()
        self.taken = self.rejected = 0
        self._next = FIRST * self.step_size
        self._largest = SMALLEST * self._nominal()
        self._sample_times = [float(it.get(it.handle([SAMPLE_TIME]))[0]) for it in self._sampled]

    def _take(self, steps: int) -> None:
        """Take steps of the error's choice to each of the next points."""
        for count in range(self._count + 1, self._count + steps + 1):
            self._go_to(self._start_time + count * self.step_size)
            self._count = count
            self._watch.check(self.time)
            if self._recording is not None and count % self._recording.every == 0:
                self._record()

    def _go_to(self, end: float) -> None:
        """Step to a time [s]."""
        shortest = SHORTEST * self.step_size
        while (time := self.wiring.time.value) < end:
            stop, is_tick = self._stop(time, end)
            left = stop - time
            parts = np.ceil(left / self._next * (1 - 1e-9))
            h = left if parts <= 1 else left / parts
            error = self._try(h)
            factor = np.clip(SAFETY * np.sqrt(self.tolerance / max(error, 1e-300)), SHORTEN, LENGTHEN)
            if error > self.tolerance:
                self.rejected += 1
                self._next = h * factor
                if self._next < shortest:
                    raise self._failure(time, error)
                continue
            self.taken += 1
            # a step cut short by a stop says nothing against longer ones
            self._next = max(self._next, h * factor) if parts <= 1 else h * factor
            self.wiring.time.value = stop if h == left else time + h
            self._run(self._after)
            if is_tick and h == left:
                self._converge.past.clear()

    def _stop(self, time: float, end: float) -> tuple[float, bool]:
        """Return the next time [s] at which a step must end, and whether that is a tick."""
        stop, is_tick = end, False
        for sample_time in self._sample_times:
            passed = np.floor((time - self._start_time) / sample_time + 1e-6)
            tick = self._start_time + (passed + 1) * sample_time
            if tick <= stop + 1e-9 * sample_time:
                stop, is_tick = (stop if abs(tick - stop) <= 1e-9 * sample_time else tick), True
        return stop, is_tick

    def _try(self, step_size: float) -> float:
        """Try a step; return its relative error, after going back where that is too large."""
        wiring, converge = self.wiring, self._converge
        wiring.step_size.value = step_size
        bus, past = wiring.bus.copy(), list(converge.past)
        if not self._states:
            self._states = [it.save() for it in self._sampled]
            self._savers = [it.saver(state) for it, state in zip(self._sampled, self._states, strict=True)]
        for call in self._savers:
            call.instance.check(call, call.run())
        self._run(self._ticks)
        try:
            converge.run()
            error = self._error(step_size)
        except StepError as failure:
            if failure.status != "does not converge" or step_size <= SHORTEST * self.step_size:
                raise
            error = np.inf
        if error > self.tolerance:
            converge.go_back()
            for it, state in zip(self._sampled, self._states, strict=True):
                it.restore(state)
            wiring.bus[:], converge.past = bus, past
        return error

    def _error(self, step_size: float) -> float:
        """Return the largest relative error of an input on its line, 0 where the past does not tell."""
        now, past = self.wiring.bus[self._smooth], self._converge.past
        self._largest = np.maximum(self._largest, np.abs(now))
        if len(past) < 2 or not len(now):
            return 0.0
        (t0, u0), (tm, um) = past[:2]
        u0, um, before = u0[self._smooth], um[self._smooth], t0 - tm
        bend = np.abs((now - u0) / step_size - (u0 - um) / before) / (step_size + before)
        return float(np.max(bend * step_size**2 / 4 / self._largest))

    def _nominal(self) -> np.ndarray:
        starts = [self.wiring.split(self.wiring.connections[i].start) for i in self._smooth]
        return np.array([abs(self.wiring.connectors[component][name].nominal) for component, name in starts])

    def _check_solvers(self) -> None:
        for name, instance in self.instances.items():
            if _SETTING in instance.fmu.variables:
                own = float(instance.get(instance.handle([_SETTING]))[0])
                if self.tolerance < own:
                    raise StructureError(
                        f"the tolerance is {self.tolerance:g}, but {name} ({instance.fmu.description.file.name}) "
                        f"solves its own equations to {own:g} only; expected a larger tolerance, or a smaller "
                        f"{name}.{_SETTING}"
                    )

    def _failure(self, time: float, error: float) -> StepError:
        wiring = self.wiring
        worst = wiring.connections[self._smooth[int(np.argmax(np.abs(wiring.bus[self._smooth]) / self._largest))]]
        component, output = wiring.split(worst.start)
        return StepError(
            component,
            output,
            "step too short",
            time,
            f"with steps of {self._next:.3g} s the error over {worst} is still {error:.3g}, expected at most "
            f"{self.tolerance:g}; where values jump without a tick no step is short enough",
        )
