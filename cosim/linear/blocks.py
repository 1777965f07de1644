"""Linearised FMUs of a system: one block each, and the closed system that the connections make of them.

Each FMU provides its directional derivatives at an operating point. With continuous states x, sampled values v (sampled
states, and sampled outputs, held between ticks), inputs u and outputs y, all as deviations,

    der(x) = rate [x; v; u]         v after a tick = tick [x; v; u]         y = output [x; v; u]

and the connections u = L y + e, with excitations e, close them: the same three equations with e in place of u.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.fmi.description import NEXT, SAMPLE_TIME
from hfsa.cosim.linear.balance import balance
from hfsa.cosim.systems.connectors import connector
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Connection, System


@dataclass(frozen=True)
class Block:
    """One linearised FMU, restricted to some of its inputs and outputs.

    Attributes:
        states: names of the continuous states x.
        sampled, held: names of the sampled states and the sampled outputs, together v.
        inputs, outputs: names; an output may be among `held`.
        sample_time: [s], `None` for an FMU without ticks.
        rate, tick, output: (x, n), (v, n), (y, n) with n columns [states, sampled, held, inputs].
    """

    states: tuple[str, ...]
    sampled: tuple[str, ...]
    held: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    sample_time: float | None
    rate: np.ndarray
    tick: np.ndarray
    output: np.ndarray

    @property
    def values(self) -> tuple[str, ...]:
        """Names of x and v."""
        return (*self.states, *self.sampled, *self.held)


def block(instance: Instance, inputs: Iterable[str], outputs: Iterable[str]) -> Block:
    """Return an FMU linearised at its present values, from inputs to outputs (names).

    Raises `StructureError` where it has no directional derivatives.
    """
    description = instance.fmu.description
    inputs, outputs = tuple(dict.fromkeys(inputs)), tuple(dict.fromkeys(outputs))
    states, sampled, held = _values(instance, outputs)
    rates = [rate for _, rate in description.states]
    smooth = [name for name in outputs if name not in held]
    following = [*(f"{NEXT}{name}" for name in sampled), *held]
    jacobian = instance.jacobian([*rates, *following, *smooth], [*states, *sampled, *inputs])
    # a held output acts through connections only: columns of zeros
    jacobian = np.insert(jacobian, [len(states) + len(sampled)] * len(held), 0.0, axis=1)
    n, v = len(states), len(following)
    output = np.zeros((len(outputs), jacobian.shape[1]))
    for row, name in enumerate(outputs):
        if name in held:
            output[row, n + len(sampled) + held.index(name)] = 1.0
        else:
            output[row] = jacobian[n + v + smooth.index(name)]
    sample_time = float(instance.get(instance.handle([SAMPLE_TIME]))[0]) if description.has_sample_time else None
    return Block(states, sampled, held, inputs, outputs, sample_time, jacobian[:n], jacobian[n : n + v], output)


def zero_block(_: Instance, inputs: Iterable[str], outputs: Iterable[str]) -> Block:
    """Return a block with zero gain, for an FMU without directional derivatives."""
    inputs, outputs = tuple(dict.fromkeys(inputs)), tuple(dict.fromkeys(outputs))
    nothing = np.zeros((0, len(inputs)))
    return Block((), (), (), inputs, outputs, None, nothing, nothing, np.zeros((len(outputs), len(inputs))))


@dataclass(frozen=True)
class Ticking:
    """One FMU with ticks: its rows of `ClosedSystem.tick`, and its sample time [s]."""

    component: str
    rows: np.ndarray
    sample_time: float


@dataclass(frozen=True)
class ClosedSystem:
    """Connected linearised FMUs, from excitations to outputs.

    Attributes:
        states, sampled: full names of x and of v.
        inputs, outputs: full names.
        rate, tick, output: (x, n), (v, n), (y, n) with n columns [states, sampled, inputs].
        ticking: FMUs with ticks, in the order of simultaneous ticks: each uses the newest outputs of those before it.
    """

    states: tuple[str, ...]
    sampled: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    rate: np.ndarray
    tick: np.ndarray
    output: np.ndarray
    ticking: tuple[Ticking, ...]

    def balanced(self) -> "ClosedSystem":
        """Return the same system in units of [x; v] that balance the rows and columns of its matrix."""
        n = len(self.states) + len(self.sampled)
        square = np.vstack([self.rate, self.tick])[:, :n]
        scale = balance(square)
        columns = np.concatenate([scale, np.ones(len(self.inputs))])  # powers of two: nothing is rounded
        x = len(self.states)
        rate, tick = self.rate * columns / scale[:x, None], self.tick * columns / scale[x:, None]
        return ClosedSystem(
            self.states, self.sampled, self.inputs, self.outputs, rate, tick, self.output * columns, self.ticking
        )

    def holding(self, component: str, name: str) -> "ClosedSystem":
        """Return the system whose input `name` is held between the ticks of a component, and sampled right after them.

        The held input becomes one more sampled value.
        """
        at, n = self.inputs.index(name), len(self.states) + len(self.sampled)
        row = np.zeros((1, self.rate.shape[1] + 1))
        row[0, n + 1 + at] = 1.0

        def moved(matrix: np.ndarray) -> np.ndarray:
            """Return a matrix with the input's column moved to its held value."""
            held = matrix[:, [n + at]]
            matrix = np.insert(matrix, [n], held, axis=1)
            matrix[:, n + 1 + at] = 0.0
            return matrix

        (index,) = [i for i, ticking in enumerate(self.ticking) if ticking.component == component]
        sample_time = self.ticking[index].sample_time
        holder = Ticking(f"{name} held", np.array([len(self.sampled)]), sample_time)
        return ClosedSystem(
            self.states,
            (*self.sampled, f"{name} held"),
            self.inputs,
            self.outputs,
            moved(self.rate),
            np.vstack([moved(self.tick), row]),
            moved(self.output),
            (*self.ticking[: index + 1], holder, *self.ticking[index + 1 :]),
        )


class Blocks:
    """Linearised FMUs of a system, not yet connected: connected inputs and outputs come first.

    Raises `StructureError` for excited inputs and wanted outputs (full names) of another causality or with a
    connection, and for an FMU with undeclared dynamics, whose directional derivatives are incomplete.

    Attributes:
        instances: instances by component.
        states, sampled: full names of x and v; `nominal` are their sizes.
    """

    def __init__(
        self, system: System, instances: Mapping[str, Instance], inputs: Sequence[str], outputs: Sequence[str]
    ):
        self.instances = {component.name: instances[component.name] for component in system.components}
        variables = {name: instance.fmu.variables for name, instance in self.instances.items()}
        self.connections = system.connections
        feeder = {connection.end: connection.start for connection in system.connections}
        inputs, outputs = ([".".join(system.split(name)) for name in names] for names in (inputs, outputs))
        for full_names, causality in ((inputs, "input"), (outputs, "output")):
            for name in full_names:
                found = connector(system, variables, name).causality
                if found != causality:
                    raise StructureError(f"{name} is an FMU's {found}, expected an {causality}")
                if name in feeder:
                    raise StructureError(f"{name} is fed by {feeder[name]} and cannot be excited as well")
        self.inputs, self.outputs = [*feeder, *inputs], [*feeder.values(), *outputs]
        for name, instance in self.instances.items():
            description = instance.fmu.description
            if description.has_derivatives and (sign := description.undeclared(_of(name, self.outputs))):
                raise StructureError(
                    f"{name} ({description.file.name}): {sign}. It has undeclared dynamics, which its directional "
                    "derivatives do not contain: there is no linear response, but a stepped sweep measures one"
                )
        values = {name: _values(i, _of(name, self.outputs)) for name, i in self.instances.items()}
        self.states = tuple(f"{name}.{x}" for name, (states, _, _) in values.items() for x in states)
        self.sampled = tuple(f"{name}.{v}" for name, (_, *rest) in values.items() for part in rest for v in part)
        nominal = [variables[name][value].nominal for name, _, value in map(_split, [*self.states, *self.sampled])]
        self.nominal = np.abs([*nominal])

    @property
    def is_free(self) -> bool:
        """Whether some motion is free: whether the closed system has an eigenvalue 0, or 1 with ticks.

        The matrix is scaled by nominals and by its rows. A control weaker than rounding, about 1e-14 of the stiffest,
        counts as none.
        """
        closed, x = self.close(), len(self.states)
        change = np.vstack([closed.rate, closed.tick])[:, : len(self.nominal)]
        change[x:, x:] -= np.eye(len(self.sampled))
        change = change * self.nominal
        change /= np.maximum(np.abs(change).max(axis=1, initial=0.0), 1e-300)[:, None]
        return bool(np.linalg.matrix_rank(change) < len(change)) if len(change) else False

    def close(self, opened: Connection | None = None) -> ClosedSystem:
        """Return the connected system, linearised at the instances' present values.

        The end of an `opened` connection becomes the last input, its start the last output.
        """
        blocks = {
            name: block(instance, _of(name, self.inputs), _of(name, self.outputs))
            for name, instance in self.instances.items()
        }
        rate, tick, output = self._stacked(blocks)
        n, k = len(self.states) + len(self.sampled), len(self.connections)
        fed = [i for i in range(k) if self.connections[i] != opened]
        ends = [i for i in range(k) if self.connections[i] == opened]
        free = [*range(n), *range(n + k, n + len(self.inputs)), *(n + i for i in ends)]
        wanted = [*range(k, len(self.outputs)), *ends]
        loops = [n + i for i in fed]
        # connected input i equals connected output i
        through = np.linalg.solve(np.eye(len(fed)) - output[np.ix_(fed, loops)], output[np.ix_(fed, free)])
        rate, tick, output = (m[:, free] + m[:, loops] @ through for m in (rate, tick, output[wanted]))
        return ClosedSystem(
            self.states,
            self.sampled,
            (*self.inputs[k:], *(self.inputs[i] for i in ends)),
            tuple(self.outputs[i] for i in wanted),
            rate,
            tick,
            output,
            self._ticking(blocks),
        )

    def _stacked(self, blocks: Mapping[str, Block]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return rate, tick and output of all FMUs, not yet connected."""
        columns = {name: i for i, name in enumerate([*self.states, *self.sampled, *self.inputs])}
        rows = {name: i for i, name in enumerate([*self.states, *self.sampled])}
        n, x = len(columns), len(self.states)
        both, output = np.zeros((len(rows), n)), np.zeros((len(self.outputs), n))
        for component, b in blocks.items():
            own = [columns[f"{component}.{name}"] for name in (*b.values, *b.inputs)]
            both[np.ix_([rows[f"{component}.{name}"] for name in b.values], own)] = np.vstack([b.rate, b.tick])
            for row, name in enumerate(self.outputs):
                owner, _, variable = _split(name)
                if owner == component:
                    output[row, own] = b.output[b.outputs.index(variable)]
        return both[:x], both[x:], output

    def _ticking(self, blocks: Mapping[str, Block]) -> tuple[Ticking, ...]:
        """Return the FMUs with ticks: purely sampled ones first, as a master steps them."""
        found = []
        for is_sampled in (True, False):
            for component, b in blocks.items():
                own = [i for i, name in enumerate(self.sampled) if _split(name)[0] == component]
                if own and self.instances[component].fmu.description.is_sampled == is_sampled:
                    assert b.sample_time is not None
                    found.append(Ticking(component, np.array(own), b.sample_time))
        return tuple(found)


def _values(instance: Instance, outputs: Iterable[str]) -> tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]:
    """Return the names of an FMU's continuous states, its sampled states, and its held outputs among `outputs`."""
    description, variables = instance.fmu.description, instance.fmu.variables
    states = tuple(state for state, _ in description.states)
    if not description.has_sample_time:
        return states, (), ()
    held = (name for name in dict.fromkeys(outputs) if variables[name].variability == "discrete")
    return states, description.sampled_states, tuple(held)


def _split(name: str) -> tuple[str, str, str]:
    return name.partition(".")


def _of(component: str, names: Iterable[str]) -> list[str]:
    """Return the variables of a component among full names."""
    return [variable for owner, _, variable in map(_split, names) if owner == component]
