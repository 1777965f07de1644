"""The co-simulation master: the order of steps, and the exchange of values between them.

    master = make_master(instances, system, "gauss_seidel", step_size=50e-6)
    recording = master.record(["robot.platform.position[3]"], rows=1001, every=20)
    master.initialize(start_time=0.0)
    master.advance(20_000)                      # steps; may be called repeatedly
    recording.time, recording["robot.platform.position[3]"]

Communication point k is at `start_time + k * step_size`, computed and never accumulated. At each point values are
exchanged in feedthrough order, so that an output is fetched after the inputs it follows were set. Then the step:

1. Sampled instances (a parameter `sample_time`, all outputs discrete) step first, one after the other in the system's
   order. A tick at the beginning of the step uses the inputs of this point; the sampled outputs are passed on, through
   direct feedthrough as well, before any other instance steps.
2. The continuous instances step in the order of the algorithm: `gauss_seidel.py`, `jacobi.py`, ... Algebraic loops are
   solved at every point (`actions/algebraic_loop.py`).

`initialize` and `advance` end with the exchange at the current point, so that all values are consistent. `drive` feeds
inputs by signals of the user's own: their values at each point, and their derivatives for the step from it.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from hfsa.cosim.actions.action import Group
from hfsa.cosim.actions.drive import Drive, Feeder
from hfsa.cosim.actions.exchange import Exchange
from hfsa.cosim.actions.extrapolation import Extrapolation
from hfsa.cosim.actions.feed import Ahead, Clock, Feed
from hfsa.cosim.actions.iterated import IteratedStep
from hfsa.cosim.actions.recorded_calls import recorded_calls, with_early
from hfsa.cosim.actions.recording import Recording, Watch
from hfsa.cosim.actions.wiring import check_sample_times
from hfsa.cosim.fmi.co_simulation import Call
from hfsa.cosim.fmi.solver_counts import solver_counts, total
from hfsa.cosim.masters.algorithm import Algorithm, Scheme
from hfsa.cosim.signals.drive import Signal
from hfsa.cosim.systems.connectors import Connector, connector
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import System


class Master(ABC):
    """Runs the instances of a system together; subclasses take the steps.

    `instances` holds one instance per component, by name; the caller owns and closes them. Raises `StructureError`
    where the wiring is wrong (`check.check`), before any instance runs.

    Attributes:
        algorithm: the algorithm.
        cycle: actions from one communication point to the next, in order; `point`: a complete exchange.
        warnings: first warning of each instance, by name.
        told: number and first sentence of the warnings of each instance, as in `Exchange`.
    """

    def __init__(self, instances: Mapping[str, Any], system: System, algorithm: Algorithm, step_size: float):
        if not 0 < step_size < np.inf:
            raise StructureError(f"step_size is {step_size:g} s, expected a positive number")
        self.instances, self.algorithm, self.step_size = instances, algorithm, step_size
        self._scheme = scheme = algorithm.scheme(instances, system)
        self.wiring, self.system = scheme.wiring, scheme.wiring.system
        self.wiring.step_size.value = step_size
        self.point, self.cycle = list(scheme.point), scheme.cycle
        self._drive: Drive | None = None
        self._clock = Clock(0.0, step_size, 0)
        self._exchange = Exchange(self.wiring, scheme.warnings)
        self.warnings, self.told = self._exchange.warnings, self._exchange.told
        self._watch = self._exchange.watch
        self._recording: Recording | None = None
        self._record_calls: list[Call] = []
        self._early: dict[str, Group] = {}
        self._start_time = 0.0
        self._count = 0
        self._is_ready = False

    @property
    def time(self) -> float:
        """Current communication point [s]."""
        return self._start_time + self._count * self.step_size

    @property
    def first_of_point(self) -> int:
        """Index of the first action of `cycle` after all instances have stepped."""
        return self._scheme.first_of_point + len(self._early)

    @property
    def order(self) -> int | None:
        """Order of the error in the communication step: that of the algorithm, less where inputs are held or jump."""
        order, moving = self.algorithm.order, self._scheme.moving
        end = self._start_time + self._clock.last * self.step_size
        if order and self._drive is not None and self._drive.is_rough(self._start_time, end):
            return 1
        return min(order, 1 + moving.degree) if order and isinstance(moving, Extrapolation) else order

    @property
    def statistics(self) -> dict[str, int]:
        """Counts since the start: communication `steps`, and the `passes` of iterated steps.

        Where FMUs count the work of their solvers, also the sums `solver_steps`, `solver_evaluations` and so on.
        """
        moving = self._scheme.moving
        passes = {"passes": moving.passes} if isinstance(moving, IteratedStep) else {}
        solvers = {f"solver_{name}": count for name, count in total(self.solver_counts).items()}
        return {"steps": self._count, **passes, **solvers}

    @property
    def solver_counts(self) -> dict[str, dict[str, int]]:
        """Counts of the solver inside each instance that has them, since the start, by component and name."""
        return solver_counts(self.instances)

    def initialize(
        self, start_time: float = 0.0, stop_time: float | None = None, starts: Mapping[str, float] | None = None
    ) -> None:
        """Initialize all instances at `start_time` [s], with values that agree across every connection.

        `starts` holds start values by full name, which override those of the components. Raises as `Exchange.enter`.
        """
        check_sample_times(self.system, self.wiring.connectors, starts or {}, self.step_size)
        for name, instance in self.instances.items():
            instance.fmu.description.demands.check_step(name, self.step_size)
        self._start_time, self._count, self._is_ready = start_time, 0, False
        self._begin_feeds(stop_time)
        fed = {} if self._drive is None else self._drive.starts(start_time)
        self._exchange.enter(start_time, stop_time, {**fed, **(starts or {})})
        self._exchange.leave()
        self._exchange.run([*self._early.values(), *self.point])
        self._exchange.hear()
        self._watch.check(self.time)
        if self._scheme.moving is not None:
            self._give_slopes()
            self._scheme.moving.begin()
        self._is_ready = True
        if self._recording is not None:
            self._recording.clear()
            self._record()

    def forget_warnings(self) -> None:
        """Forget the warnings of the instances, before another run."""
        self._exchange.forget_warnings()

    def remember(self, earlier: np.ndarray) -> None:
        """Take values of the connected outputs at the two points before the start, for inputs that are extrapolated.

        `earlier` are deviations from the present values, (2, n), or (2, 0) where there is nothing to take.
        """
        moving = self._scheme.moving
        if isinstance(moving, Extrapolation) and earlier.size:
            moving.history.points[:2] = self.wiring.bus + earlier

    @property
    def earlier(self) -> np.ndarray:
        """Values of the connected outputs at the two points before this one, in the form that `remember` takes."""
        moving = self._scheme.moving
        return moving.history.points[:2] - self.wiring.bus if isinstance(moving, Extrapolation) else np.zeros((2, 0))

    def advance(self, steps: int) -> None:
        """Take a number of steps.

        Raises `StepError` where an instance fails or requests the end, or a connected or recorded value is not finite
        or outside the bounds of its variable. All values recorded until then are kept, as after Ctrl-C.
        """
        if not self._is_ready:
            raise StructureError("the master is not at a communication point: initialize it first")
        self._is_ready = False  # until the last exchange is complete
        try:
            self._take(steps)
        finally:
            self._exchange.hear()
        self._is_ready = True

    @abstractmethod
    def _take(self, steps: int) -> None:
        """Take steps to the next communication points, and record values there."""

    def record(self, names: Iterable[str], rows: int, every: int = 1) -> Recording:
        """Record variables (full names) at every `every`-th communication point from the next `initialize` on.

        Storage for `rows` points is allocated at once. A master has one recording.
        """
        recording = Recording(tuple(names), rows, every)
        fetched = [
            (self.instances[component], variables, values)
            for component, variables, values in self._by_component(recording)
        ]
        held = {} if self._drive is None else {name: self._drive.present(name) for name in self._drive.names}
        self._early, self._record_calls = recorded_calls(self.wiring, self._scheme.cycle, fetched, held)
        self.cycle = with_early(self._scheme.cycle, self._early)
        recording.watch = Watch(recording.names, [self._connector(n) for n in recording.names], recording.point)
        self._recording = recording
        return recording

    def read(self, names: Sequence[str]) -> np.ndarray:
        """Return values of variables (full names) at the current point, (n,)."""
        values = []
        for name in names:
            component, variable = self.system.split(name)
            instance = self.instances[component]
            values.append(instance.get(instance.handle([variable]))[0])
        return np.array(values)

    def set(self, values: Mapping[str, float]) -> None:
        """Set tunable parameters or unconnected inputs (full names) at the current point, and exchange again."""
        fed = {connection.end for connection in self.wiring.connections}
        for name, value in values.items():
            self._connector(name)
            if name in fed:
                raise StructureError(f"{name} is fed by a connection and cannot be set")
            if self._drive is not None and name in self._drive.names:
                raise StructureError(f"{name} is driven by a signal and cannot be set")
            component, variable = self.system.split(name)
            instance = self.instances[component]
            instance.set(instance.handle([variable]), [value])
        self._exchange.run(action for action in self.point if not isinstance(action, Feed))

    def close(self) -> None:
        """Free the instances."""
        for instance in self.instances.values():
            instance.close()

    # Driven inputs ----------------------------------------------------------------------------------------------------

    def drive(self, signals: Mapping[str, Signal]) -> None:
        """Feed unconnected inputs (full names) by signals from the next `initialize` on; call it before `record`.

        Raises `StructureError` for a name that is no input, or is fed by a connection.
        """
        scheme, self._drive = self._scheme, Drive(self.wiring, signals)
        slopes = [] if self.algorithm.inputs in ("held", "exact") else self._drive.slopes(self._feeder)
        point = [self._drive.values(self._feeder), *scheme.point]
        warnings = {**scheme.warnings, **self._drive.warnings}
        step = [*slopes, *self._drive.with_rates(scheme.step, self._feeder)]
        self._scheme = Scheme(self.wiring, step, point, scheme.moving, warnings)
        self.point, self.cycle = point, self._scheme.cycle
        self._exchange.give_notice(warnings)

    @property
    def driven(self) -> Drive | None:
        """The driven inputs, `None` where there are none."""
        return self._drive

    @property
    def _feeder(self) -> Feeder:
        """Function that returns the action which feeds rows at the communication points."""
        return partial(Ahead, clock=self._clock)

    @property
    def _feeds(self) -> list[Feed]:
        """Actions that feed inputs."""
        return [action for action in (*self._scheme.step, *self.point) if isinstance(action, Feed)]

    def _begin_feeds(self, stop_time: float | None) -> None:
        """Prepare what feeds inputs, before a start."""
        self._clock.start = self._start_time
        duration = np.inf if stop_time is None else stop_time - self._start_time
        self._clock.last = int(min(np.ceil(duration / self.step_size + 1e-6), 2.0**53))
        for feed in self._feeds:
            feed.begin()

    def _give_slopes(self) -> None:
        """Give the driven inputs their slopes at the start, on which the rates of outputs depend."""
        slopes = [action for action in self._scheme.step if isinstance(action, Feed)]
        self._exchange.run(slopes)
        for slope in slopes:
            slope.begin()

    # Recording --------------------------------------------------------------------------------------------------------

    def _connector(self, name: str) -> Connector:
        """Return the variable of a full name."""
        return connector(self.system, self.wiring.connectors, name)

    def _by_component(self, recording: Recording) -> list[tuple[str, list[str], np.ndarray]]:
        """Return groups of consecutive variables of one component, each with its part of the recorded point."""
        runs: list[tuple[str, list[str]]] = []
        for name in recording.names:
            self._connector(name)
            component, variable = self.system.split(name)
            if not runs or runs[-1][0] != component:
                runs.append((component, []))
            runs[-1][1].append(variable)
        ends = np.cumsum([len(variables) for _, variables in runs])
        return [
            (component, variables, recording.point[end - len(variables) : end])
            for (component, variables), end in zip(runs, ends, strict=True)
        ]

    def _record(self) -> None:
        """Fetch the recorded variables, and append them as a row."""
        assert self._recording is not None
        self._exchange.run_calls(self._record_calls)
        self._recording.take(self.time)
