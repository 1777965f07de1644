"""Monolithic integration: all FMUs as one differential equation, the reference for co-simulation.

    instances = open_instances(files, ModelExchangeInstance)
    master = make_master(instances, system, "monolithic", 1e-3)    # step: time between two recorded points
    recording = master.record(["robot.platform.position[3]"], rows=1001)
    master.initialize()
    master.advance(1000)

All FMUs run in Model Exchange: their continuous states are one vector, and SUNDIALS integrates it with the FMUs' own
derivatives, `monolithic` by CVODE, `monolithic_dae` by IDA with the coupling values among the unknowns. There is no
communication step: inputs equal outputs at every instant. The values recorded at a point are interpolated by the
solver.

The solver stops exactly at each event of an FMU and at each tick of a sampled one, and restarts after it. Ticks at one
instant are in the order of co-simulation: sampled instances first, in the system's order, each with the newest outputs
of those before it. A tick at a point belongs to the step that begins there, so the recorded values are those before it.

A state event occurs where an event indicator of an FMU changes its sign. The solver finds that instant to rounding;
then all FMUs with indicators are updated until their outputs no longer change. Where such events accumulate without
time between them (a ball that bounces to rest, a switch that chatters), the run ends with an error.
"""

import math
from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hfsa.cosim.actions.drive import Feeder
from hfsa.cosim.actions.feed import Now
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.fmi.model_exchange import MOST_UPDATES, ModelExchangeInstance
from hfsa.cosim.fmi.step_error import StepError
from hfsa.cosim.masters.algorithm import Algorithm, Scheme
from hfsa.cosim.masters.master import Master
from hfsa.cosim.masters.monolithic.cvode import Cvode
from hfsa.cosim.masters.monolithic.ida import Ida
from hfsa.cosim.masters.monolithic.integrator import Integrator
from hfsa.cosim.masters.monolithic.joint_ode import JointOde
from hfsa.cosim.masters.monolithic.pieces import Pieces
from hfsa.cosim.signals.drive import Signal
from hfsa.cosim.systems.system import System

_SAME = 1e-9
"""Fraction of a step within which an event and a point are the same instant."""

MOST_EVENTS = 100
"""Largest number of successive state events, each within `_SAME` of the last."""


class Monolithic(Master):
    """Master that integrates the instances of a system together; `step_size` [s] is the time between two points.

    `integrator` solves the joint equation. Raises `StructureError` as `Master`, or where SUNDIALS is not installed;
    `StepError` where an FMU or the solver fails.
    """

    def __init__(
        self,
        instances: Mapping[str, ModelExchangeInstance],
        system: System,
        algorithm: Algorithm,
        step_size: float,
        integrator: type[Integrator],
    ):
        super().__init__(instances, system, algorithm, step_size)
        members = {component.name: instances[component.name] for component in system.components}
        self._ordered = [members[stepper.instance] for stepper in (*self.wiring.discrete, *self.wiring.continuous)]
        self._clocks = [instance.time_setter(self.wiring.time) for instance in self._ordered]
        self._ode = JointOde(members, self.wiring, self.point, self._exchange.report)
        self._integrator = integrator(self._ode)
        self._hybrid = [instance for instance in self._ordered if instance.indicators]
        self._pieces = Pieces(None, step_size)
        self._is_in_event, self._is_new = True, True
        self._stop_time, self._last_event, self._crowd = math.inf, -math.inf, 0

    @property
    def time(self) -> float:
        """Time [s] last set in the instances: between two calls, the current point."""
        return self.wiring.time.value

    def initialize(
        self, start_time: float = 0.0, stop_time: float | None = None, starts: Mapping[str, float] | None = None
    ) -> None:
        """Initialize all instances at `start_time`, as `Master.initialize`; ticks there belong to the first step."""
        self._stop_time = math.inf if stop_time is None else stop_time
        self._is_in_event, self._is_new = True, True
        self._last_event, self._crowd = -math.inf, 0
        for instance in self._ordered:
            instance.next_event = math.inf
        self._pieces.begin(start_time)
        super().initialize(start_time, stop_time, starts)

    def drive(self, signals: Mapping[str, Signal]) -> None:
        """Drive inputs as `Master.drive`; every jump of a signal is an event."""
        super().drive(signals)
        self._pieces = Pieces(self._drive, self.step_size)
        self._ode.feed_by(self._feeds, self._pieces)

    @property
    def _feeder(self) -> Feeder:
        """Function that returns the action which feeds the present values; the rows are those of the piece in force."""
        return lambda _, array, calls: Now(lambda time: self._pieces.rows(time), array, calls, self.wiring.time)

    def set(self, values: Mapping[str, float]) -> None:
        """Set tunable parameters or unconnected inputs at the current point, which is an event."""
        self._enter_event(self.time)
        super().set(values)
        self._is_new = True

    def _take(self, steps: int) -> None:
        every = self._recording.every if self._recording else 0
        for count in range(self._count + 1, self._count + steps + 1):
            self._move(self._start_time + count * self.step_size)
            self._count = count
            self._watch.check(self.time)
            if every and count % every == 0:
                self._record()

    # Events -----------------------------------------------------------------------------------------------------------

    @property
    def _next_event(self) -> float:
        """Time of the next time event [s], infinite if there is none."""
        return min((self._pieces.next, *(instance.next_event for instance in self._ordered)))

    @property
    def _horizon(self) -> float:
        """Time [s] beyond which no FMU may be evaluated, infinite if there is none."""
        return min(self._next_event, self._stop_time)

    def _move(self, to: float) -> None:
        """Integrate to a point [s], through all events before it."""
        same = _SAME * self.step_size + 8 * np.spacing(to)
        while True:
            if self._next_event <= self.time + same:
                self._enter_event(max(self.time, self._next_event))
            if self._is_in_event:
                self._pass_event()
            event = self._next_event
            reach = to if event >= to - same else event
            stop = max(reach, self._horizon) if self._ode.looks_ahead else reach
            x = self._integrator.advance(reach, stop)
            if self._integrator.wants_event:
                reach = self._integrator.time if self._integrator.time < to - same else to
            self._arrive(reach, x)
            if self._integrator.wants_event:
                self._watch_crowd(reach, same)
                self._enter_event(reach)
            if reach == to:
                return

    def _arrive(self, time: float, x: np.ndarray) -> None:
        """Set all instances, those at rest as well, to a time [s] with values that agree."""
        self._ode.evaluate(time, x)
        self._exchange.run_calls(self._clocks)
        self._exchange.run(self.point)

    def _enter_event(self, time: float) -> None:
        """Set all instances to event mode at a time [s]."""
        if self._is_in_event:
            return
        self.wiring.time.value = time
        self._exchange.run_calls(self._clocks)
        for instance in self._ordered:
            instance.time = time
            instance.event_mode()
        self._is_in_event = True
        if self._pieces.passes(time):
            self._exchange.run(self.point)

    def _watch_crowd(self, time: float, same: float) -> None:
        """Raise `StepError` where state events come without a time `same` [s] between them."""
        if self._integrator.deciding is None:
            return
        self._crowd = self._crowd + 1 if time - self._last_event <= same else 0
        self._last_event = time
        if self._crowd >= MOST_EVENTS:
            raise StepError(
                self._integrator.deciding,
                "event indicators",
                "does not settle",
                time,
                f"{MOST_EVENTS} state events, each within {same:.2g} s of the last: it chatters, or comes to rest in "
                "ever shorter intervals; a model with a hysteresis or a smallest speed avoids this",
            )

    def _pass_event(self) -> None:
        """Update all instances at an event, one after the other, until outputs settle; then restart the integrator."""
        self._update(self._ordered)
        for _ in range(MOST_UPDATES):
            before = self.wiring.bus.copy()
            self._update(self._hybrid)
            if np.array_equal(before, self.wiring.bus):
                break
        else:
            message = f"after {MOST_UPDATES} updates in turn, outputs of FMUs with state events still change"
            raise StepError(self._hybrid[0].name, "event", "does not settle", self.time, message)
        for instance in self._ordered:
            if instance.next_event <= self.time:
                message = f"after an event it requires another at {instance.next_event:.9g} s, which is in the past"
                raise StepError(instance.name, "event", "does not settle", self.time, message)
            instance.continuous_time_mode()
        self._is_in_event = False
        if self._is_new:
            self._integrator.begin(self.time, self._ode.gather(), self.step_size, self._horizon)
        else:
            self._integrator.restart(self.time, self._ode.gather(), self._horizon)
        self._is_new = False

    def _update(self, instances: Iterable[ModelExchangeInstance]) -> None:
        """Update instances one after the other, each with the newest outputs of those before it."""
        for instance in instances:
            instance.update()
            self._exchange.run(self.point)


def scheme(instances: Mapping[str, Any], system: System) -> Scheme:
    """Return the scheme on one system: an exchange without steps."""
    wiring = Wiring(system, instances)
    return Scheme(wiring, [], list(wiring.exchange()))


def make(
    integrator: type[Integrator],
    instances: Mapping[str, ModelExchangeInstance],
    system: System,
    algorithm: Algorithm,
    step_size: float,
    library: Path | None = None,  # noqa: ARG001 (the stepping loop in C, of algorithms that step)
    tolerance: float = 1e-3,  # noqa: ARG001 (of algorithms that choose communication steps)
) -> Monolithic:
    """Return the master that integrates with CVODE or IDA."""
    return Monolithic(instances, system, algorithm, step_size, integrator)


ALGORITHMS = (
    Algorithm(
        "monolithic",
        "all FMUs in Model Exchange as one differential equation, integrated by CVODE",
        rank=120,
        inputs="exact",
        order=None,
        scheme=scheme,
        make=partial(make, Cvode),
        is_model_exchange=True,
    ),
    Algorithm(
        "monolithic_dae",
        "the same with the values between the FMUs among the unknowns, integrated by IDA",
        rank=130,
        inputs="exact",
        order=None,
        scheme=scheme,
        make=partial(make, Ida),
        is_model_exchange=True,
    ),
)
