"""Joint differential equation of the FMUs of a system in Model Exchange.

    ode = JointOde(instances, wiring, exchange, report)
    ode.evaluate(t, x)                                 # -> der(x), with inputs equal to outputs
    ode.evaluate_open(t, x, w)                         # -> der(x), and the outputs where the inputs are w
    ode.partials()                                     # [[A, B], [C, D]] at the point of the last evaluation
    ode.jacobian()                                     # d der(x) / d x there

x are the continuous states of all instances, in the system's order; w are the connected outputs that flow between
ticks, and the inputs that they feed. The connections close the FMUs' partial derivatives:

    der(x) = A x + B w,     w = C x + D w     =>     d der(x) / d x = A + B (1 - D)^-1 C

An instance without continuous states whose connected outputs change only at ticks is at rest between them: its outputs
stay set at the inputs they feed, and it is not evaluated. An event indicator changes sign where an FMU requires an
event.
"""

from collections.abc import Callable, Container, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hfsa.cosim.actions.action import Group, Transfer
from hfsa.cosim.actions.algebraic_loop import AlgebraicLoop
from hfsa.cosim.actions.feed import Feed
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.fmi.base_instance import Call
from hfsa.cosim.fmi.handle import Handle
from hfsa.cosim.fmi.model_exchange import ModelExchangeInstance
from hfsa.cosim.masters.monolithic.pieces import Pieces
from hfsa.cosim.systems.system import Connection

_DIFFERENCE = 1e-7
"""Relative step of the finite differences that replace directional derivatives."""


@dataclass(frozen=True, eq=False)
class _Derivatives:
    """Partial derivatives of one FMU: `call` differentiates along the array of `knowns` into that of `unknowns`.

    Attributes:
        places: its rows in the matrix of [rates; w]; `rows` are the indices of the unknowns for these rows.
        columns: index of each known among [x; w].
    """

    call: Call
    knowns: Handle
    unknowns: Handle
    rows: np.ndarray
    places: np.ndarray
    columns: np.ndarray


class JointOde:
    """der(x) = f(t, x) of instances in continuous-time mode; `report` handles a status that is not ok.

    Attributes:
        states: full names of x.
        x, rates: arrays that the instances read and write, (n,).
        places: indices of w on the bus, (m,).
        indicators: indicators of state events, (k,), of the last `indicate`; `deciding` names the instance of each.
        looks_ahead: whether an integrator may evaluate beyond its target: no FMU requires a call after each of its
            steps, and none has state events.
    """

    def __init__(
        self,
        instances: Mapping[str, ModelExchangeInstance],
        wiring: Wiring,
        exchange: Iterable[Any],
        report: Callable[[Any, int], None],
    ):
        self._instances, self._wiring, self._report = instances, wiring, report
        self.states = [f"{name}.{state}" for name, i in instances.items() for state, _ in i.fmu.description.states]
        self.x, self.rates = np.zeros(len(self.states)), np.zeros(len(self.states))
        moving = {name: instance for name, instance in instances.items() if not self._rests(name)}
        self._places: dict[str, slice] = {}
        first = 0
        for name, instance in instances.items():
            self._places[name] = slice(first, first + instance.size)
            first += instance.size
        before, after = [], []
        for name, instance in moving.items():
            before.append(instance.time_setter(wiring.time))
            if instance.size:
                before.append(instance.state_setter(self.x[self._places[name]]))
                after.append(instance.rate_getter(self.rates[self._places[name]]))
        flowing = self._flowing(exchange, set(moving))
        self._before, self._flow, self._after = before, flowing, after
        self._pieces: Pieces | None = None
        self._calls, self._open_calls = self._evaluations(())
        self.places = np.array([i for i, c in enumerate(wiring.connections) if self._flows(c, set(moving))], dtype=int)
        has_derivatives = all(instance.fmu.description.has_derivatives for instance in moving.values())
        self._derivatives = self._prepared(moving) if has_derivatives else None
        self._waiting = [i for i in instances.values() if i.fmu.description.needs_completed_steps]
        self.deciding = [name for name, instance in instances.items() for _ in range(instance.indicators)]
        self.indicators = np.zeros(len(self.deciding))
        self._indicator_calls, first = [], 0
        for instance in filter(lambda it: it.indicators, instances.values()):
            part = self.indicators[first : first + instance.indicators]
            self._indicator_calls.append(instance.indicator_getter(part))
            first += instance.indicators
        self.looks_ahead = not self._waiting and not self.deciding

    @property
    def carried(self) -> list[str]:
        """Full names of the outputs w, (m,)."""
        return [self._wiring.connections[i].start for i in self.places]

    @property
    def values(self) -> np.ndarray:
        """The outputs w of the last evaluation, (m,)."""
        return self._wiring.bus[self.places]

    @property
    def value_nominals(self) -> np.ndarray:
        """Nominals of w, (m,)."""
        starts = [self._wiring.split(self._wiring.connections[i].start) for i in self.places]
        return np.array([abs(self._wiring.connectors[component][name].nominal) for component, name in starts])

    def feed_by(self, feeds: Iterable[Feed], pieces: Pieces) -> None:
        """Make every evaluation feed driven inputs first, by the pieces of their signals."""
        self._pieces = pieces
        self._calls, self._open_calls = self._evaluations(feeds)

    def _evaluations(self, feeds: Iterable[Feed]) -> tuple[list[Any], list[Any]]:
        """Return the calls of `evaluate` and of `evaluate_open`."""
        before = [*self._before, *feeds]
        closed = [*before, *(action.call for action in self._flow), *self._after]
        return closed, [*before, *_opened(self._flow), *self._after]

    def driven_rates(self, time: float, x: np.ndarray, ahead: float) -> np.ndarray:
        """Return der(x), (n,), with driven inputs as they are `ahead` [s]; zeros where no input is driven."""
        if self._pieces is None:
            return np.zeros(len(x))
        self._pieces.lead = ahead
        try:
            return self.evaluate(time, x).copy()
        finally:
            self._pieces.lead = 0.0
            self.evaluate(time, x)

    def evaluate(self, time: float, x: np.ndarray) -> np.ndarray:
        """Return der(x), (n,), the same array at every call; `StepError` where an FMU fails."""
        self._wiring.time.value = time
        self.x[:] = x
        self._run(self._calls)
        return self.rates

    def evaluate_open(self, time: float, x: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return der(x), the same array at every call, and the outputs, (m,), where the inputs are w."""
        self._wiring.bus[self.places] = w
        self._wiring.time.value = time
        self.x[:] = x
        self._run(self._open_calls)
        return self.rates, self.values

    def partials(self) -> np.ndarray:
        """Return [[A, B], [C, D]], (n + m, n + m), at the last evaluation.

        Finite differences replace all derivatives where an FMU has no directional derivatives.
        """
        if self._derivatives is None:
            return self._differences()
        joint = np.zeros((len(self.x) + len(self.places),) * 2)
        for part in self._derivatives:
            seed, column = part.knowns.values, part.unknowns.values
            own = np.zeros((len(column), len(seed)))
            for j in range(len(seed)):
                seed[:] = 0.0
                seed[j] = 1.0
                self._run([part.call])
                own[:, j] = column
            joint[np.ix_(part.places, part.columns)] = own[part.rows]
        return joint

    def jacobian(self) -> np.ndarray:
        """Return d der(x) / d x, (n, n), at the point of the last evaluation."""
        joint, n = self.partials(), len(self.x)
        through = np.linalg.solve(np.eye(len(self.places)) - joint[n:, n:], joint[n:, :n])
        return joint[:n, :n] + joint[:n, n:] @ through

    def indicate(self) -> np.ndarray:
        """Return the event indicators at the last evaluation, (k,), the same array at every call."""
        self._run(self._indicator_calls)
        return self.indicators

    def complete_step(self, time: float, x: np.ndarray) -> bool:
        """Report a completed integrator step to the FMUs that require it; return whether one requires an event now."""
        if not self._waiting:
            return False
        self.evaluate(time, x)
        requests = [instance.complete_step() for instance in self._waiting]  # a list: every FMU must be called
        return any(requests)

    def gather(self) -> np.ndarray:
        """Return the states x of the instances, (n,), after initialization or an event."""
        return np.concatenate([np.zeros(0), *(instance.states() for instance in self._instances.values())])

    def nominals(self) -> np.ndarray:
        """Return the nominals of x, (n,), 1 for a state without one."""
        found = np.concatenate([np.zeros(0), *(instance.nominals() for instance in self._instances.values())])
        return np.where(found > 0, found, 1.0)

    def _run(self, calls: Iterable[Any]) -> None:
        for call in calls:
            status = call.run()
            if status:
                self._report(call, status)

    def _differences(self) -> np.ndarray:
        """Return the matrix of `partials`, by finite differences."""
        time, n = self._wiring.time.value, len(self.x)
        start, sizes = np.concatenate([self.x, self.values]), np.concatenate([self.nominals(), self.value_nominals])
        before = np.concatenate(self.evaluate_open(time, start[:n], start[n:]))
        result = np.zeros((len(start), len(start)))
        for j, step in enumerate(_DIFFERENCE * np.maximum(np.abs(start), sizes)):
            moved = start.copy()
            moved[j] += step
            after = np.concatenate(self.evaluate_open(time, moved[:n], moved[n:]))
            result[:, j] = (after - before) / (moved[j] - start[j])
        self.evaluate(time, start[:n])
        return result

    def _is_held(self, output: str) -> bool:
        """Whether a connected output (full name) changes at ticks only."""
        component, _, variable = output.partition(".")
        description = self._instances[component].fmu.description
        return description.has_sample_time and description.variables[variable].variability == "discrete"

    def _flows(self, connection: Connection, moving: Container[str]) -> bool:
        """Whether the value of a connection changes between ticks and feeds an instance that is not at rest."""
        return connection.end.partition(".")[0] in moving and not self._is_held(connection.start)

    def _rests(self, name: str) -> bool:
        connected = [c.start for c in self._wiring.connections if c.start.partition(".")[0] == name]
        instance = self._instances[name]
        return instance.size == 0 and not instance.indicators and all(map(self._is_held, connected))

    def _flowing(self, exchange: Iterable[Any], moving: set[str]) -> list[Any]:
        """Return the actions of an exchange that have an effect between ticks."""
        held = {
            id(transfer)
            for group in self._wiring.groups
            for transfer in group.transfers
            if transfer.target not in moving or all(self._is_held(f"{group.instance}.{name}") for name in group.outputs)
        }
        kept = []
        for action in exchange:
            if isinstance(action, Transfer) and id(action) in held:
                continue
            if isinstance(action, Group) and all(id(transfer) in held for transfer in action.transfers):
                continue
            kept.append(action)
        return kept

    def _prepared(self, moving: Mapping[str, ModelExchangeInstance]) -> list[_Derivatives]:
        """Return the partial derivatives of each FMU with respect to its states and flowing inputs."""
        n, flowing = len(self.x), [self._wiring.connections[i] for i in self.places]
        ends = [(n + i, c.start.partition("."), c.end.partition(".")) for i, c in enumerate(flowing)]
        found = []
        for name, instance in moving.items():
            own = range(n)[self._places[name]]
            outputs = [(place, variable) for place, (source, _, variable), _ in ends if source == name]
            inputs = [(place, variable) for place, _, (target, _, variable) in ends if target == name]
            distinct = list(dict.fromkeys(variable for _, variable in outputs))
            states = instance.fmu.description.states
            unknowns = instance.handle([*(rate for _, rate in states), *distinct])
            knowns = instance.handle([*(state for state, _ in states), *(variable for _, variable in inputs)])
            if not knowns.names or not unknowns.names:
                continue
            rows = [*range(len(states)), *(len(states) + distinct.index(variable) for _, variable in outputs)]
            found.append(
                _Derivatives(
                    instance.directional(unknowns, knowns),
                    knowns,
                    unknowns,
                    np.array(rows),
                    np.array([*own, *(place for place, _ in outputs)]),
                    np.array([*own, *(place for place, _ in inputs)]),
                )
            )
        return found


def _opened(flowing: Iterable[Any]) -> list[Call]:
    """Return an exchange opened at every connection: all inputs are set before any output is fetched."""
    groups: list[Group] = []
    transfers: list[Transfer] = []
    for action in flowing:
        if isinstance(action, AlgebraicLoop):
            groups += action.groups
            transfers += action.inner
        elif isinstance(action, Group):
            groups.append(action)
        else:
            transfers.append(action)
    return [action.call for action in (*transfers, *groups)]
