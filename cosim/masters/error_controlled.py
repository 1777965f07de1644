"""Error control: iterated coupling with communication steps chosen, accepted and rejected by their error.

Each step of iterated coupling (`actions/iterated.py`) is computed as one whole step and as two half steps; the half
steps are kept. The error of each half is an eighth of that of the whole, so the error of both halves is a third of the
difference between the two results:

    e = |whole - halves| / 3,     compared over all states of the FMUs and all values that move between them

and, of an FMU of others that shows no states, over its connected and recorded outputs; each relative to the largest
value so far (Schierz, Arnold and Clauß, Co-simulation with communication step size
control in an FMI compatible master algorithm, 2012). The estimate needs no history, so a tick of a sampled instance
shortens a step only if it changes the inputs; and inputs with a small effect have a small weight.

A step is accepted where e is at most (SCALE tolerance)^(3/2). As the error of one step is of third order, the step size
is proportional to the root of the tolerance, and the error of the run to the tolerance (as in RADAU5 of Hairer and
Wanner). The next step is as long as e permits. Steps end at every tick and at every recorded point; a step shortened
there does not shorten the next one.
"""

import dataclasses
from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path

import numpy as np

from hfsa.cosim.actions.action import Stepper
from hfsa.cosim.actions.drive import Feeder
from hfsa.cosim.actions.feed import Feed, Now
from hfsa.cosim.actions.iterated import IteratedStep
from hfsa.cosim.actions.recording import Recording
from hfsa.cosim.actions.schedule import Action
from hfsa.cosim.fmi.co_simulation import Instance, State, StepError
from hfsa.cosim.fmi.description import SAMPLE_TIME
from hfsa.cosim.masters.algorithm import Algorithm
from hfsa.cosim.masters.iterated import QUASI_NEWTON
from hfsa.cosim.masters.master import Master
from hfsa.cosim.masters.native.stepping import step_in_c
from hfsa.cosim.signals.drive import Signal
from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import System

TOLERANCE = 1e-5
"""Default error of a run, relative to the largest value of each quantity."""

SCALE = 30.0
"""Factor between the tolerance and the error of a step; on a stiff loop the error of a run is twice the tolerance."""

SMALLEST = 1e-3
"""Smallest size of a value in the relative error, as a fraction of its nominal."""

UNDECLARED = 1e-6
"""Nominal of an output of an FMU of others that declares none."""

SAFETY, SHORTEN, LENGTHEN, STEADY = 0.9, 0.1, 5.0, 1.3
"""Step size control: safety factor, smallest and largest ratio of two steps, and the smallest lengthening.

A new step size needs a new interface Jacobian, so small lengthenings are not worth it.
"""

FIRST, SHORTEST = 1e-3, 1e-9
"""First and shortest step, relative to the interval between two recorded points."""

_SETTING = "solver.relative_tolerance"
_REFUSALS = ("does not converge", "discard")
"""Statuses that a shorter step may avoid."""


class ErrorControlled(Master):
    """Master that chooses its communication steps between recorded points `step_size` [s] apart.

    With a `library` the iterated steps run in C.

    Attributes:
        tolerance: tolerance of a run.
        taken: communication steps since the start; `tried` includes rejected steps.
    """

    def __init__(
        self,
        instances: Mapping[str, Instance],
        system: System,
        algorithm: Algorithm,
        step_size: float,
        tolerance: float = TOLERANCE,
        library: Path | None = None,
    ):
        for name, instance in instances.items():
            instance.fmu.description.demands.refuse_variable_steps(name)
        super().__init__(instances, system, algorithm, step_size)
        assert isinstance(self._scheme.moving, IteratedStep)
        self.tolerance = tolerance
        self._half = self._scheme.moving
        self._whole = self._half.duplicate()  # each keeps the interface Jacobian of its step size
        if library is not None:
            for iterated in (self._half, self._whole):
                step_in_c(iterated, library)
        self._lay_out()
        self._clocked = [instances[stepper.instance] for stepper in self.wiring.discrete]
        self._stepped = [instances[stepper.instance] for stepper in (*self.wiring.discrete, *self.wiring.continuous)]
        self._saved: list[State] = []
        self._observe(())

    def drive(self, signals: Mapping[str, Signal]) -> None:
        """Drive inputs as `Master.drive`; steps end at every jump of a signal."""
        super().drive(signals)
        self._lay_out()

    @property
    def _feeder(self) -> Feeder:
        """Function that returns the action which feeds the row of the present time."""
        return partial(Now, time=self.wiring.time)

    def _lay_out(self) -> None:
        """Divide the cycle: what each part of a step begins with, and what follows an accepted step."""
        place = self.cycle.index(self._half)
        self._after = self.cycle[place + 1 :]
        # the second half of a step begins at other values
        values = [action for action in self.point if isinstance(action, Feed)]
        self._ticks = [*values, *(self._revocable(action) for action in self.cycle[:place])]

    def record(self, names: Iterable[str], rows: int, every: int = 1) -> Recording:
        """Record as `Master.record`; what is recorded of an FMU without visible states determines the steps as well."""
        recording = super().record(names, rows, every)
        self._observe(recording.names)
        return recording

    def initialize(
        self, start_time: float = 0.0, stop_time: float | None = None, starts: Mapping[str, float] | None = None
    ) -> None:
        """Initialize as `Master.initialize`.

        `StructureError` where an FMU's solver is coarser than the tolerance, or shows nothing of its error.
        """
        self._check_visible()
        self._whole.begin()
        super().initialize(start_time, stop_time, starts)
        self._check_solvers()
        self.taken = self.tried = 0
        self._next = FIRST * self.step_size
        self._largest = np.maximum(SMALLEST * self._nominal, np.abs(self._values()))
        self._sample_times = [float(it.get(it.handle([SAMPLE_TIME]))[0]) for it in self._clocked]

    @property
    def _allowed(self) -> float:
        """Largest relative error of one step."""
        return (SCALE * self.tolerance) ** 1.5

    def _take(self, steps: int) -> None:
        """Take error-controlled steps to each of the next points."""
        for count in range(self._count + 1, self._count + steps + 1):
            self._go_to(self._start_time + count * self.step_size)
            self._count = count
            self._watch.check(self.time)
            if self._recording is not None and count % self._recording.every == 0:
                self._record()

    def _go_to(self, end: float) -> None:
        """Step to the time `end` [s]."""
        while (time := self.wiring.time.value) < end:
            stop, is_tick = self._stop(time, end)
            left = stop - time
            length = left / max(1, np.ceil(left / self._next * (1 - 1e-9)))
            errors = self._try(length)
            error = float(np.max(errors, initial=0.0)) / self._allowed
            factor = float(np.clip(SAFETY * max(error, 1e-30) ** (-1 / 3), SHORTEN, LENGTHEN))
            if error > 1:
                self._next = length * factor
                if self._next < SHORTEST * self.step_size:
                    raise self._failure(time, errors)
                continue
            # a shortened step does not shorten the next one, unless its error limits that
            wanted = length * (1.0 if 1.0 <= factor < STEADY else factor)
            self._next = max(self._next, wanted) if factor == LENGTHEN else wanted
            self.taken += 2
            self.wiring.time.value = stop if length == left else time + length
            self._exchange.run(self._after)
            if is_tick and length == left:
                self._half.past.clear()

    def _revocable(self, action: Action) -> Action:
        """Return an action; the step of an instance becomes one that may be rejected."""
        if not isinstance(action, Stepper):
            return action
        wiring = self.wiring
        call = self.instances[action.instance].stepper(wiring.time, wiring.step_size, is_final=False)
        return dataclasses.replace(action, call=call)

    def _stop(self, time: float, end: float) -> tuple[float, bool]:
        """Return the next time [s] at which a step must end, and whether that is a tick."""
        stop, is_tick = end, False
        if self._drive is not None:
            stop = min(stop, self._drive.next_break(time))
        for sample_time in self._sample_times:
            passed = np.floor((time - self._start_time) / sample_time + 1e-6)
            tick = self._start_time + (passed + 1) * sample_time
            if tick <= stop + 1e-9 * sample_time:
                stop, is_tick = (stop if abs(tick - stop) <= 1e-9 * sample_time else tick), True
        return stop, is_tick

    def _try(self, length: float) -> np.ndarray:
        """Try a step; return the relative error of each quantity, (n,), and restore the instances if it is rejected."""
        wiring = self.wiring
        time, bus, past = wiring.time.value, wiring.bus.copy(), list(self._half.past)
        self._save()
        try:
            self._whole.past = list(past)
            self._proceed(self._whole, length)
            whole = self._values()
            self._go_back(time, bus)
            self._proceed(self._half, length / 2)
            wiring.time.value = time + length / 2
            self._proceed(self._half, length / 2)
            errors = self._errors(whole, self._values())
        except StepError as failure:
            if failure.status not in _REFUSALS or length <= SHORTEST * self.step_size:
                raise
            errors = np.full(len(self._nominal), np.inf)
        if not np.all(errors <= self._allowed):
            self._go_back(time, bus)
            self._half.past = past
        return errors

    def _proceed(self, iterated: IteratedStep, step_size: float) -> None:
        """Step all instances from the present time by `step_size` [s]."""
        self.wiring.step_size.value = step_size
        self.tried += 1
        self._exchange.run(self._ticks)
        iterated.run()

    def _errors(self, whole: np.ndarray, halves: np.ndarray) -> np.ndarray:
        """Return the relative errors of two halves, (n,), and update the largest values if the step is accepted."""
        largest = np.maximum(self._largest, np.abs(halves))
        errors = np.nan_to_num(np.abs(whole - halves) / 3 / largest, nan=np.inf)
        if np.all(errors <= self._allowed):
            self._largest = largest
        return errors

    # Observed values --------------------------------------------------------------------------------------------------

    def _observe(self, recorded: Iterable[str]) -> None:
        """Prepare the calls that fetch visible states, or outputs in their place, into one array.

        `recorded` are full names.
        """
        shown = [*(c.start for c in self.wiring.connections), *recorded]
        variables: list[tuple[str, Connector]] = []
        for i in self._half.places:
            component, name = self.wiring.split(self.wiring.connections[i].start)
            variables.append((component, self.wiring.connectors[component][name]))
        found = {}
        for stepper in self.wiring.continuous:
            own = self.wiring.connectors[stepper.instance]
            states = [state for state, _ in self.instances[stepper.instance].fmu.description.states]
            visible = [name for name in states if name in own and own[name].is_real]
            if not visible and not self.instances[stepper.instance].fmu.description.is_ours:
                ends = dict.fromkeys(self.wiring.split(name) for name in shown)
                names = [name for component, name in ends if component == stepper.instance]
                visible = [name for name in names if own[name].causality == "output" and own[name].is_real]
            found[stepper.instance] = visible
            variables += [(stepper.instance, own[name]) for name in visible]
        self._blind = [name for name, seen in found.items() if not seen]
        self._names = [(component, variable.name) for component, variable in variables]
        self._nominal = np.array([self._size(component, variable) for component, variable in variables])
        self._states = np.zeros(sum(map(len, found.values())))
        self._state_calls, first = [], 0
        for component, names in found.items():
            if names:
                handle = self.instances[component].handle(names, self._states[first : first + len(names)])
                self._state_calls.append(self.instances[component].getter(handle))
                first += len(names)

    def _size(self, component: str, variable: Connector) -> float:
        """Return the nominal of a variable, `UNDECLARED` for an FMU of others that declares none."""
        is_ours = self.instances[component].fmu.description.is_ours
        return abs(variable.nominal) if is_ours or variable.has_nominal else UNDECLARED

    def _values(self) -> np.ndarray:
        """Return the coupling values and the visible states of the FMUs, (n,)."""
        for call in self._state_calls:
            call.instance.check(call, call.run())
        return np.concatenate([self.wiring.bus[self._half.places], self._states])

    # Rejected steps ---------------------------------------------------------------------------------------------------

    def _save(self) -> None:
        """Save the states of all instances."""
        if not self._saved:
            self._saved = [it.save() for it in self._stepped]
            self._savers = [it.saver(state) for it, state in zip(self._stepped, self._saved, strict=True)]
        for call in self._savers:
            call.instance.check(call, call.run())

    def _go_back(self, time: float, bus: np.ndarray) -> None:
        """Restore all instances to their saved states."""
        for it, state in zip(self._stepped, self._saved, strict=True):
            it.restore(state)
        self.wiring.time.value, self.wiring.bus[:] = time, bus

    # Errors -----------------------------------------------------------------------------------------------------------

    def _check_visible(self) -> None:
        """Raise `StructureError` for an FMU of others of which neither a state nor an output is observed."""
        for name in self._blind:
            description = self.instances[name].fmu.description
            if not description.is_ours:
                raise StructureError(
                    f"{name}: {description.file.name} shows no states, and none of its outputs is connected or "
                    "recorded: the error of its steps cannot be seen; expected a recorded output, or another algorithm"
                )

    def _check_solvers(self) -> None:
        """Raise `StructureError` for the FMU with the coarsest solver, where its tolerance exceeds that of a step."""
        own = {
            name: float(instance.get(instance.handle([_SETTING]))[0])
            for name, instance in self.instances.items()
            if _SETTING in instance.fmu.variables
        }
        coarsest = max(own, key=own.__getitem__, default=None)
        if coarsest is None or own[coarsest] <= self._allowed:
            return
        raise StructureError(
            f"in a run exact to {self.tolerance:.3g} a communication step may err by {self._allowed:.2g}, but "
            f"{coarsest} ({self.instances[coarsest].fmu.description.file.name}) solves its own equations to "
            f"{own[coarsest]:g} only; expected a tolerance at least "
            f"{own[coarsest] ** (2 / 3) / (SCALE * self.tolerance):.3g} times as large, or a smaller "
            f"{coarsest}.{_SETTING}"
        )

    def _failure(self, time: float, errors: np.ndarray) -> StepError:
        """Return the error for a step below the shortest one."""
        component, variable = self._names[int(np.argmax(errors))]
        return StepError(
            component,
            variable,
            "step too short",
            time,
            f"over {self._next / SHORTEN:.3g} s its error is still {np.max(errors):.3g} of its largest value, "
            f"expected at most {self._allowed:.3g}; where values jump without a tick no step is short enough, and "
            "none makes up for the error of an FMU's own solver",
        )


COUPLING = 1e-2
"""Share of the tolerance of a response for the error of the communication steps."""


def make(
    instances: Mapping[str, Instance],
    system: System,
    algorithm: Algorithm,
    step_size: float,
    library: Path | None = None,
    tolerance: float = 1e-3,
) -> ErrorControlled:
    """Return the master that keeps the error of a response within a tolerance."""
    return ErrorControlled(instances, system, algorithm, step_size, COUPLING * tolerance, library)


ALGORITHMS = (
    Algorithm(
        "error_controlled",
        "as quasi_newton, with steps as long as the error they make lets them be",
        rank=100,
        inputs="iterated",
        order=None,
        scheme=QUASI_NEWTON.scheme,
        make=make,
    ),
)
