"""The co-simulation master: who steps when, and who is told what in between.

    master = Master(instances, system, "gauss_seidel", step_size=50e-6)
    recording = master.record(["robot.platform.position[3]"], rows=1001, every=20)
    master.initialize(start_time=0.0)
    master.advance(20_000)                      # steps; again and again
    recording.time, recording["robot.platform.position[3]"]

Communication point k is at `start_time + k * step_size`, computed and never accumulated. At each point values are
exchanged in feedthrough order, so that an output is fetched after the inputs it follows were set. Then the step:

1. Sampled instances (a parameter `sample_time`, all outputs discrete) go first, one after the other in the system's
   order. A tick at the beginning of the step uses the inputs of this point; the sampled outputs are passed on before
   any other instance steps, through direct feedthrough where there is some.
2. The others step, from the same values (`jacobi`), or one after the other in the system's order, each passing its new
   outputs on to those that wait (`gauss_seidel`).

`jacobi_plain` is what other masters do: get all outputs, set all inputs, step all instances. Inputs are held over a
step, or with `_linear` and `_quadratic` behind the name they move (`actions/extrapolation.py`). Algebraic loops are
solved at every point (`actions/algebraic_loop.py`).

After `initialize` and after `advance` the exchange at the current point has been done: what is read is consistent.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from hfsa.cosim.actions.action import Stepper, Transfer, blamed
from hfsa.cosim.actions.algebraic_loop import STALE, AlgebraicLoop
from hfsa.cosim.actions.extrapolation import Extrapolation
from hfsa.cosim.actions.iterated import Converge
from hfsa.cosim.actions.recording import Recording, Watch
from hfsa.cosim.actions.schedule import Action, Runnable, without_repetition
from hfsa.cosim.actions.wiring import Wiring, check_sample_times
from hfsa.cosim.fmi.co_simulation import Call, Instance, StepError
from hfsa.cosim.linear.cycle import coupling_gradient
from hfsa.cosim.systems.system import ALGORITHMS, EXTRAPOLATED, HELD, ORDERS, StructureError, System, connector, nearest

SETTLING_PASSES = 100
"""Exchanges in initialization mode after which the values across connections must agree."""

SETTLING_TOLERANCE = 1e-12
"""Largest change between two such exchanges, relative to the value or its nominal."""


# The algorithms -------------------------------------------------------------------------------------------------------


def exchange_plain(wiring: Wiring) -> Iterator[Action]:
    """Fetch all outputs, then set all inputs."""
    yield from wiring.stages()
    for stage in wiring.stages():
        yield from stage.transfers


def gauss_seidel(wiring: Wiring) -> Iterator[Action]:
    """Each steps with the newest outputs of those before it."""
    yield from sampled_first(wiring)
    waiting = [stepper.instance for stepper in wiring.others]
    for stepper in wiring.others:
        waiting.remove(stepper.instance)
        yield stepper
        for group in stepper.groups:
            yield group
            yield from (transfer for transfer in group.transfers if transfer.target in waiting)


def jacobi(wiring: Wiring) -> Iterator[Action]:
    """All step with the outputs of the communication point."""
    yield from sampled_first(wiring)
    yield from wiring.others


def jacobi_plain(wiring: Wiring) -> Iterator[Action]:
    """All step, sampled or not."""
    yield from wiring.sampled
    yield from wiring.others


def gauss_seidel_extrapolated(wiring: Wiring, extrapolation: Extrapolation) -> Iterator[Action]:
    """Each steps with inputs that move: to the newest outputs of those before it, with the past of those behind it."""
    yield from sampled_first(wiring)
    yield extrapolation.remember
    waiting, stepped = [stepper.instance for stepper in wiring.others], []
    for stepper in wiring.others:
        waiting.remove(stepper.instance)
        yield from extrapolation.of(stepper.instance, stepped)
        yield stepper
        stepped.append(stepper.instance)
        for group in stepper.groups:
            if any(transfer.target in waiting for transfer in group.transfers):
                yield group
                yield from (t for t in group.transfers if t.target in waiting and t.target in extrapolation.unable)


def jacobi_extrapolated(wiring: Wiring, extrapolation: Extrapolation) -> Iterator[Action]:
    """All step with inputs that go on as they have come."""
    yield from sampled_first(wiring)
    yield extrapolation.remember
    for stepper in wiring.others:
        yield from extrapolation.of(stepper.instance)
        yield stepper


def iterated(wiring: Wiring, converge: Converge) -> Iterator[Action]:
    """All step together, again and again, until their inputs end at what the outputs come to."""
    yield from sampled_first(wiring)
    yield converge


def sampled_first(wiring: Wiring) -> Iterator[Action]:
    """Sampled instances step one after the other, each passing on what its tick changed to those that wait."""
    stepped = set()
    for stepper in wiring.sampled:
        yield stepper
        stepped.add(stepper.instance)
        for action in wiring.exchange():
            if not (isinstance(action, Transfer) and action.target in stepped):
                yield action


_HELD = {"gauss_seidel": gauss_seidel, "jacobi": jacobi, "jacobi_plain": jacobi_plain}
_EXTRAPOLATED = {"gauss_seidel": gauss_seidel_extrapolated, "jacobi": jacobi_extrapolated}
_ORDERS = {"linear": 1, "quadratic": 2}


# The master -----------------------------------------------------------------------------------------------------------


class Master:
    """Steps the instances of a system together.

    `instances` holds one instance per component, by name; they stay the caller's, who closes them. `StructureError`
    where the wiring is wrong (`system.check`); nothing has run by then.

    Attributes:
        cycle: what is done from one communication point to the next, in order; `point`: a complete exchange.
        warnings: the first warning of each instance, by name.
    """

    def __init__(
        self, instances: Mapping[str, Instance], system: System, algorithm: str = ALGORITHMS[0], step_size: float = 1e-3
    ):
        if algorithm not in ALGORITHMS:
            raise StructureError(f"no algorithm is called {algorithm!r}{nearest(algorithm, ALGORITHMS)}")
        if not 0 < step_size < np.inf:
            raise StructureError(f"step_size is {step_size:g} s, expected a positive number")
        self.system, self.instances, self.algorithm, self.step_size = system, instances, algorithm, step_size
        self.wiring = Wiring(system, instances)
        self.wiring.step_size.value = step_size
        self._moving: Extrapolation | Converge | None = None
        self.point = list(exchange_plain(self.wiring) if algorithm == "jacobi_plain" else self.wiring.exchange())
        self.cycle = without_repetition([*self._step(), *self.point])
        steppers = [i for i, action in enumerate(self.cycle) if isinstance(action, Stepper | Converge)]
        self._first_of_point = steppers[-1] + 1 if steppers else 0
        self.warnings: dict[str, str] = {
            name: f"{name}: {self.instances[name].fmu.description.file.name} takes no derivatives of its inputs, which "
            "are held instead"
            for name in (self._moving.unable if self._moving else ())
        }
        starts = [connection.start for connection in self.wiring.connections]
        self._watch = Watch(starts, [self._connector(name) for name in starts], self.wiring.bus)
        self._zeros = np.zeros_like(self.wiring.bus)
        self._recording: Recording | None = None
        self._record_calls: list[Call] = []
        self._start_time = 0.0
        self._count = 0
        self._is_ready = False

    @property
    def time(self) -> float:
        """Current communication point [s]."""
        return self._start_time + self._count * self.step_size

    @property
    def order(self) -> int:
        """Order of the error in the communication step: the algorithm's of `ORDERS`, or less where inputs are held."""
        order = ORDERS[self.algorithm]
        return min(order, 1 + self._moving.degree) if isinstance(self._moving, Extrapolation) else order

    def initialize(
        self, start_time: float = 0.0, stop_time: float | None = None, starts: Mapping[str, float] | None = None
    ) -> None:
        """Bring all instances to `start_time` with values that agree across every connection, ready to step.

        `starts` holds start values by full name, which go before those of the components. `StepError` as of `settle`.
        """
        check_sample_times(self.system, self.wiring.connectors, starts or {}, self.step_size)
        self.enter(start_time, stop_time, starts)
        for component in self.system.components:
            self.instances[component.name].exit()
        self._run(self.point)
        self._watch.check(self.time)
        if self._moving is not None:
            self._moving.begin()
        self._is_ready = True
        if self._recording is not None:
            self._recording.clear()
            self._record()

    def enter(
        self, start_time: float = 0.0, stop_time: float | None = None, starts: Mapping[str, float] | None = None
    ) -> None:
        """Bring all instances into initialization mode, with values that agree: the first half of `initialize`.

        `StructureError` for a start value of a variable that does not exist, or that is no finite number.
        """
        starts = dict(starts or {})
        for name, value in starts.items():
            self._connector(name)
            if not np.isfinite(value):
                raise StructureError(f"{name} starts at {value:g}, expected a finite number")
        self._start_time, self._count, self._is_ready = start_time, 0, False
        self.wiring.time.value = start_time
        self.wiring.bus[:] = 0.0
        for loop in self.wiring.loops:
            loop.forget()
        for component in self.system.components:
            own = {self.system.split(n)[1]: v for n, v in starts.items() if self.system.split(n)[0] == component.name}
            self.instances[component.name].enter(start_time, stop_time, {**component.start, **own})
        self.settle()

    def settle(self) -> None:
        """Exchange values in initialization mode until none changes; `StepError` names a connection that still does."""
        bus, watch = self.wiring.bus, self._watch
        before, change = np.full_like(bus, np.nan), np.full_like(bus, np.inf)
        for _ in range(SETTLING_PASSES):
            self._run(self.wiring.exchange())
            watch.check(self.time, bounds=False)
            change = np.abs(bus - before) / np.maximum(np.abs(bus), watch.nominal)
            if np.all(change <= SETTLING_TOLERANCE):
                return
            before = bus.copy()
        worst = int(np.argmax(change))
        connection = self.wiring.connections[worst]
        raise StepError(
            self.system.split(connection.end)[0],
            str(connection),
            "does not settle",
            self.time,
            f"after {SETTLING_PASSES} exchanges at initialization it still changes, now to {bus[worst]:.6g}",
        )

    def advance(self, steps: int) -> None:
        """Take a number of steps.

        `StepError` where an instance fails, asks to end, or a connected or recorded value is not finite or outside
        its variable's bounds; like after Ctrl-C, what was recorded until then is kept.
        """
        if not self._is_ready:
            raise StructureError("the master is not at a communication point: initialize it first")
        self._is_ready = False  # until the last exchange is complete
        self._take(steps)
        self._is_ready = True

    def _take(self, steps: int) -> None:
        """Take steps; `stepping.CompiledMaster` does in C what this says."""
        calls = {action.call.run: action.call for action in self.cycle}
        stepping = [action.call.run for action in self.cycle[: self._first_of_point]]
        at_point = [action.call.run for action in self.cycle[self._first_of_point :]]
        time, bus, zeros, is_bounded = self.wiring.time, self.wiring.bus, self._zeros, self._watch.is_bounded
        every = self._recording.every if self._recording else 0
        for count in range(self._count + 1, self._count + steps + 1):
            for run in stepping:
                status = run()
                if status:
                    self._report(calls[run], status)
            self._count = count
            time.value = self._start_time + count * self.step_size
            for run in at_point:
                status = run()
                if status:
                    self._report(calls[run], status)
            if is_bounded or bus.dot(zeros) != 0.0:  # 0 unless a value is infinite or not a number
                self._watch.check(time.value)
            if every and count % every == 0:
                self._record()

    def record(self, names: Iterable[str], rows: int, every: int = 1) -> Recording:
        """Record variables (full names) at every `every`-th communication point from the next `initialize` on.

        Room for `rows` points is made at once. A master has one recording.
        """
        recording = Recording(tuple(names), rows, every)
        self._record_calls = []
        first = 0
        for component, variables in self._by_component(recording.names):
            handle = self.instances[component].handle(variables, recording.point[first : first + len(variables)])
            self._record_calls.append(self.instances[component].getter(handle))
            first += len(variables)
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
            component, variable = self.system.split(name)
            instance = self.instances[component]
            instance.set(instance.handle([variable]), [value])
        self._run(self.point)

    def close(self) -> None:
        """Free the instances."""
        for instance in self.instances.values():
            instance.close()

    # Frame ------------------------------------------------------------------------------------------------------------

    def _step(self) -> Iterable[Action]:
        """Return the algorithm's actions before the exchange at the next point."""
        if self.algorithm in HELD:
            return _HELD[self.algorithm](self.wiring)
        if self.algorithm in EXTRAPOLATED:
            base, _, order = self.algorithm.rpartition("_")
            self._moving = Extrapolation(self.wiring, _ORDERS[order])
            return _EXTRAPOLATED[base](self.wiring, self._moving)
        self._moving = Converge(self.wiring, self.algorithm, partial(coupling_gradient, self.wiring))
        return iterated(self.wiring, self._moving)

    def _connector(self, name: str):
        return connector(self.system, self.wiring.connectors, name)

    def _by_component(self, names: Sequence[str]) -> list[tuple[str, list[str]]]:
        """Return runs of consecutive variables of one component."""
        runs: list[tuple[str, list[str]]] = []
        for name in names:
            self._connector(name)
            component, variable = self.system.split(name)
            if not runs or runs[-1][0] != component:
                runs.append((component, []))
            runs[-1][1].append(variable)
        return runs

    def _run(self, actions: Iterable[Action]) -> None:
        """Run actions, and report what is not ok."""
        self._run_calls(action.call for action in actions)

    def _run_calls(self, calls: Iterable[Runnable]) -> None:
        """Run calls, and report what is not ok."""
        for call in calls:
            status = call.run()
            if status:
                self._report(call, status)

    def _record(self) -> None:
        """Fetch what is recorded, and keep it as a row."""
        assert self._recording is not None
        self._run_calls(self._record_calls)
        self._recording.take(self.time)

    def _report(self, call: Runnable, status: int) -> None:
        """Raise what a status says, note the first warning of an instance, or make anew what an iteration needs."""
        if status == STALE:
            assert isinstance(call, AlgebraicLoop | Converge)
            status = call.solve(self.time)
            if not status:
                return
        failing = blamed(call)
        assert failing is not None
        failing.instance.time = self.time
        failing.instance.check(failing, status)
        self.warnings.setdefault(failing.instance.name, failing.instance.warning(failing))
