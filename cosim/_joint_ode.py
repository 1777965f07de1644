"""The FMUs of a system in Model Exchange, joined into one ordinary differential equation.

    ode = JointOde(instances, wiring, exchange, report)
    ode.evaluate(t, x)                                 # -> der(x); inputs then agree with outputs
    ode.jacobian()                                     # d der(x) / d x at the point of the last evaluation

x are the continuous states of all instances, in the system's order. The FMUs' own derivatives are closed by the
connections: with u, the connected outputs and the inputs they feed,

    der(x) = A x + B u,     u = C x + D u     =>     d der(x) / d x = A + B (1 - D)^-1 C

An instance without continuous states whose connected outputs change at ticks only is at rest in between: its outputs
are set where they go, and it is left alone.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hfsa.cosim._fmi.instance import Call, Handle
from hfsa.cosim.actions.action import Group, Transfer
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.model_exchange import ModelExchangeInstance

_DIFFERENCE = 1e-7
"""Relative size of the differences that stand in for directional derivatives."""


@dataclass(frozen=True, eq=False)
class _Derivatives:
    """One FMU's partial derivatives: `call` differentiates along the array of `knowns` into that of `unknowns`.

    Attributes:
        rows: for each of its rows in the matrix of [rates; u], from which unknown; `places` are those rows.
        columns: place of each known among [x; u].
    """

    call: Call
    knowns: Handle
    unknowns: Handle
    rows: np.ndarray
    places: np.ndarray
    columns: np.ndarray


class JointOde:
    """der(x) = f(t, x) of instances in continuous-time mode; `report` raises or notes what a status says of a call.

    Attributes:
        states: full names of x.
        x, rates: the arrays that the instances read and write, (n,).
        awaits_steps: whether an FMU wants to be told of each step of the integrator.
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
        between = [action.call for action in self._flowing(exchange, set(moving))]
        self._calls = [(call.run, call) for call in (*before, *between, *after)]
        has_derivatives = all(instance.fmu.description.has_derivatives for instance in moving.values())
        self._derivatives = self._prepared(moving) if has_derivatives else None
        self._waiting = [i for i in instances.values() if i.fmu.description.awaits_steps]
        self.awaits_steps = bool(self._waiting)

    def evaluate(self, time: float, x: np.ndarray) -> np.ndarray:
        """Return der(x), the same array at every call; `StepError` where an FMU has none."""
        self._wiring.time.value = time
        self.x[:] = x
        for run, call in self._calls:
            status = run()
            if status:
                self._report(call, status)
        return self.rates

    def jacobian(self) -> np.ndarray:
        """Return d der(x) / d x, (n, n), at the point of the last evaluation, by differences where an FMU has none."""
        if self._derivatives is None:
            return self._differences()
        n = len(self.x)
        size = n + len(self._wiring.bus)
        joint = np.zeros((size, size))
        for part in self._derivatives:
            seed, answer, run = part.knowns.values, part.unknowns.values, part.call.run
            own = np.zeros((len(answer), len(seed)))
            for j in range(len(seed)):
                seed[:] = 0.0
                seed[j] = 1.0
                status = run()
                if status:
                    self._report(part.call, status)
                own[:, j] = answer
            joint[np.ix_(part.places, part.columns)] = own[part.rows]
        through = np.linalg.solve(np.eye(size - n) - joint[n:, n:], joint[n:, :n])
        return joint[:n, :n] + joint[:n, n:] @ through

    def complete_step(self, time: float, x: np.ndarray) -> bool:
        """Tell the FMUs that want to know of a completed step of the integrator; whether one wants an event now."""
        if not self._waiting:
            return False
        self.evaluate(time, x)
        answers = [instance.complete_step() for instance in self._waiting]  # all are to be told
        return any(answers)

    def gather(self) -> np.ndarray:
        """Return x as the instances have it, (n,): after initialization, or an event."""
        return np.concatenate([np.zeros(0), *(instance.states() for instance in self._instances.values())])

    def nominals(self) -> np.ndarray:
        """Return the sizes of x as the instances state them, (n,), 1 for a state without one."""
        found = np.concatenate([np.zeros(0), *(instance.nominals() for instance in self._instances.values())])
        return np.where(found > 0, found, 1.0)

    def _differences(self) -> np.ndarray:
        time, x, rates = self._wiring.time.value, self.x.copy(), self.rates.copy()
        steps = _DIFFERENCE * np.maximum(np.abs(x), self.nominals())
        result = np.zeros((len(x), len(x)))
        for j, step in enumerate(steps):
            moved = x.copy()
            moved[j] += step
            result[:, j] = (self.evaluate(time, moved) - rates) / (moved[j] - x[j])
        self.evaluate(time, x)
        return result

    def _is_held(self, output: str) -> bool:
        """Whether a connected output (full name) changes at ticks only."""
        component, _, variable = output.partition(".")
        description = self._instances[component].fmu.description
        return description.has_sample_time and description.variables[variable].variability == "discrete"

    def _rests(self, name: str) -> bool:
        connected = [c.start for c in self._wiring.connections if c.start.partition(".")[0] == name]
        return self._instances[name].size == 0 and all(map(self._is_held, connected))

    def _flowing(self, exchange: Iterable[Any], moving: set[str]) -> list[Any]:
        """Return the actions of an exchange that matter between ticks."""
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
        """Return what differentiates each FMU between the connections that flow."""
        n = len(self.x)
        ends = [
            (n + i, connection.start.partition("."), connection.end.partition("."))
            for i, connection in enumerate(self._wiring.connections)
            if not self._is_held(connection.start)
        ]
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
