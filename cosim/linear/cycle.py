"""Linear maps of the actions of a co-simulation algorithm: the exact effect of a communication step on linear FMUs.

One vector holds all values that change between communication points: continuous states, sampled states, held outputs,
inputs and their derivatives, the bus of connected outputs and its history. On linearised FMUs each action of
`Master.cycle` replaces some members of this vector by a matrix times others:

    Group           its part of the bus = output [x; v; u] of its FMU
    AlgebraicLoop   the same for all its groups, with the inner inputs solved for
    Transfer        inputs of its target = its part of the bus
    History         values at the last points, shifted by one point
    Extrapolate     [d1; d2] of its inputs = weights times values at the last points
    Stepper         [x; v; u] = step [x; v; u; d1; d2] of its FMU: inputs are held or follow their polynomials, x moves
                    by the matrix exponential, ticks within the step change v
    IteratedStep    all steps, with the d1 for which the inputs at the end equal the outputs there

A source is a sinusoid and its derivatives, at this and at the next communication point. Input lines that end at the
newest output sample it at communication points. A lock-in amplifier samples its signals; without one, outputs are
observed at the communication points.

The maps of linearised feedback are in `feedback.py`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hfsa.cosim.actions.action import Group, Stepper, Transfer
from hfsa.cosim.actions.algebraic_loop import AlgebraicLoop
from hfsa.cosim.actions.extrapolation import Extrapolate, History
from hfsa.cosim.actions.iterated import IteratedStep
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.linear.blocks import Block, block, zero_block
from hfsa.cosim.linear.sampled import grid
from hfsa.cosim.systems.errors import StructureError

SINE = {"value": 0, "rate": 1, "acceleration": 2, "jerk": 3, "sine": 0}
"""Order of derivative of each output of a sine source."""

DERIVATIVES = 5
"""Number of derivatives of the sinusoid in the vector, the value included: those of the outputs, and their rates."""


@dataclass(frozen=True)
class Source:
    """A component whose outputs are a sinusoid of amplitude 1 and its derivatives.

    `orders` holds the order of derivative of each such output; other outputs stay constant.
    """

    component: str
    orders: Mapping[str, int] = field(default_factory=lambda: SINE)

    def emission(self, outputs: Sequence[str], order: int = 0) -> np.ndarray:
        """Return the matrix from `Layout.now` to outputs, or to their derivatives, (outputs, `DERIVATIVES`)."""
        matrix = np.zeros((len(outputs), DERIVATIVES))
        for row, name in enumerate(outputs):
            if name in self.orders:
                matrix[row, self.orders[name] + order] = 1.0
        return matrix


@dataclass(frozen=True)
class Replace:
    """Replacement of the members `rows` by `matrix` times the members `columns`; `None` copies them."""

    rows: np.ndarray
    columns: np.ndarray
    matrix: np.ndarray | None


@dataclass(frozen=True)
class SampleSignals:
    """Sampling of the observed signals."""


@dataclass(frozen=True)
class Observation:
    """Observed signals: `matrix` times the members `columns`, sampled `points` points after the step began."""

    columns: np.ndarray
    matrix: np.ndarray
    points: int


Operation = Replace | SampleSignals


class Layout:
    """Layout of the vector, and the linear maps of actions on it.

    `blocks` holds the linearised FMU of each component except the source and the lock-in amplifier. The observed
    signals are those of the amplifier, or the `observed` outputs (component, variable) at communication points.

    Attributes:
        size: length of the vector.
        place: index of each value and input, by (component, name).
        now, next: indices of the source's sinusoid and its derivatives at this and the next point, (`DERIVATIVES`,)
            each, empty without a source.
    """

    def __init__(
        self,
        wiring: Wiring,
        cycle: Sequence[Any],
        blocks: Mapping[str, Block],
        source: Source | None = None,
        lock_in: str | None = None,
        observed: Sequence[tuple[str, str]] = (),
    ):
        self.wiring, self.cycle, self.blocks, self.source, self.lock_in = wiring, cycle, blocks, source, lock_in
        self.observed = tuple(observed)
        names: list[tuple[str, str]] = []
        for component, own in blocks.items():
            names += [(component, name) for name in (*own.values, *own.inputs)]
        listened = [wiring.split(c.end) for c in wiring.connections]
        names += [(component, name) for component, name in listened if component == lock_in]
        self.place = {name: i for i, name in enumerate(names)}
        self.bus: dict[int, np.ndarray] = {}
        self.size = len(names)
        for group in wiring.groups:  # they follow one another on the bus
            first = self.size
            for transfer in group.transfers:
                self.bus[id(transfer)] = np.arange(self.size, self.size + len(transfer.inputs))
                self.size += len(transfer.inputs)
            self.bus[id(group)] = np.arange(first, self.size)
        n = len(wiring.bus)
        self._bus = np.arange(self.size - n, self.size)
        self._past = np.zeros((3, 0), dtype=int)
        self.now, self.next = (self._new(DERIVATIVES if source else 0) for _ in range(2))
        self._moving: dict[str, tuple[list[str], np.ndarray]] = {}
        for action in cycle:
            if isinstance(action, History):
                self._past = self._new(3 * n).reshape(3, n)
            elif isinstance(action, Extrapolate):
                self._add_slopes(action.instance, action.places)
            elif isinstance(action, IteratedStep):
                self._guess = self._new(len(action.places))
                for line in action.lines:
                    if line.is_able:
                        self._add_slopes(line.instance, line.places)

    @property
    def bus_places(self) -> np.ndarray:
        """Places of the connected outputs, (n,)."""
        return self._bus

    @property
    def past(self) -> np.ndarray:
        """Places of the connected outputs at the last three points, (3, n), or (3, 0) without a history."""
        return self._past

    def _new(self, count: int) -> np.ndarray:
        """Append `count` members to the vector; return their indices."""
        self.size += count
        return np.arange(self.size - count, self.size)

    def _add_slopes(self, instance: str, places: np.ndarray) -> None:
        """Append members for the derivatives of inputs."""
        inputs = [self.wiring.split(self.wiring.connections[i].end)[1] for i in places]
        self._moving[instance] = inputs, self._new(2 * len(inputs)).reshape(2, -1)

    def at(self, component: str, names: Sequence[str]) -> np.ndarray:
        """Return the indices of values and inputs of a component."""
        return np.array([self.place[component, name] for name in names], dtype=int)

    def fetch(self, group: Group) -> Replace:
        """Return the linear map of fetching a group."""
        if self.source and group.instance == self.source.component:
            return Replace(self.bus[id(group)], self.now, self.source.emission(group.outputs))
        block = self.blocks[group.instance]
        rows = [block.outputs.index(name) for name in group.outputs]
        columns = self.at(group.instance, (*block.values, *block.inputs))
        return Replace(self.bus[id(group)], columns, block.output[rows])

    def observation(self) -> Observation | None:
        """Return the observed signals, `None` if there are none."""
        if self.lock_in is not None:
            count = sum(c == self.lock_in and name.startswith("signal[") for c, name in self.place)
            signals = self.at(self.lock_in, [f"signal[{i}]" for i in range(1, count + 1)])
            return Observation(signals, np.eye(count), 0)
        if not self.observed:
            return None
        rows = np.zeros((len(self.observed), self.size))
        for row, (component, name) in zip(rows, self.observed, strict=True):
            block = self.blocks[component]
            row[self.at(component, (*block.values, *block.inputs))] = block.output[block.outputs.index(name)]
        columns = np.flatnonzero(rows.any(axis=0))
        return Observation(columns, rows[:, columns], 1)

    def solve(self, loop: AlgebraicLoop) -> Operation:
        """Return the linear map of solving an algebraic loop."""
        bus = np.concatenate([self.bus[id(group)] for group in loop.groups])
        fed = np.concatenate([self.at(t.target, t.inputs) for t in loop.inner])
        feeding = np.concatenate([self.bus[id(transfer)] for transfer in loop.inner])
        whole = np.zeros((len(bus), self.size))
        for group in loop.groups:
            found = self.fetch(group)
            assert found.matrix is not None
            whole[np.ix_(np.searchsorted(bus, found.rows), found.columns)] = found.matrix
        through = np.zeros((len(bus), len(bus)))
        np.add.at(through.T, np.searchsorted(bus, feeding), whole[:, fed].T)
        whole[:, fed] = 0.0
        columns = np.flatnonzero(whole.any(axis=0))
        matrix = np.linalg.solve(np.eye(len(bus)) - through, whole[:, columns])
        inner = matrix[np.searchsorted(bus, feeding)]
        return Replace(np.concatenate([bus, fed]), columns, np.vstack([matrix, inner]))

    def hand_over(self, transfer: Transfer) -> Operation:
        """Return the linear map of setting the inputs of a transfer."""
        return Replace(self.at(transfer.target, transfer.inputs), self.bus[id(transfer)], None)

    def prepare(self, action: Any, step_size: float) -> Sequence[Operation]:
        """Return the linear maps of an action that prepares steps."""
        match action:
            case History():
                return [Replace(self._past.ravel(), np.concatenate([self._bus, *self._past[:2]]), None)]
            case Extrapolate():
                return [self.extrapolate(action, step_size)]
        raise TypeError(f"no linear map is known of {type(action).__name__}")

    def extrapolate(self, action: Extrapolate, step_size: float) -> Operation:
        """Return the linear map of setting the derivatives of an instance's inputs."""
        _, derivatives = self._moving[action.instance]
        nodes = np.vstack([self._bus[action.places], self._past[:, action.places]])
        n, columns = len(action.places), np.unique(nodes)
        matrix = np.zeros((2 * n, len(columns)))
        for order in (0, 1):
            for k in range(4):
                weights = action.weights[order, k] / step_size ** (order + 1)
                matrix[order * n + np.arange(n), np.searchsorted(columns, nodes[k])] += weights
        return Replace(derivatives.ravel(), columns, matrix)

    def set_slopes(self, action: IteratedStep, step_size: float) -> list[Operation]:
        """Return the linear maps of setting all input lines between the bus and the guess."""
        found: list[Operation] = []
        first = 0
        for line in action.lines:
            n = len(line.places)
            guess, start = self._guess[first : first + n], self._bus[line.places]
            columns, first = np.concatenate([start, guess]), first + n
            if line.is_able:
                weights = np.hstack([-np.eye(n), np.eye(n)]) / step_size
                found.append(Replace(self._moving[line.instance][1][0], columns, weights))
            else:
                inputs = [self.wiring.split(self.wiring.connections[i].end)[1] for i in line.places]
                rows, halves = self.at(line.instance, inputs), np.hstack([np.eye(n), np.eye(n)]) / 2
                found.append(Replace(rows, columns, halves))
        return found

    def guessed_step(self, action: IteratedStep, step_size: float, steps: Sequence[Operation]) -> np.ndarray:
        """Return the matrix of a step with a given guess, (size, size)."""
        whole = np.eye(self.size)
        exchange = [self.exchange(stage) for stage in action.exchange]
        for operation in (*self.set_slopes(action, step_size), *steps, *exchange):
            assert isinstance(operation, Replace)
            replaced = whole[operation.columns]
            whole[operation.rows] = replaced if operation.matrix is None else operation.matrix @ replaced
        return whole

    def interface_jacobian(self, action: IteratedStep, step_size: float, steps: Sequence[Operation]) -> np.ndarray:
        """Return the interface Jacobian dy/dw of one step: outputs at its end over the guess, at the moving inputs."""
        return self.guessed_step(action, step_size, steps)[np.ix_(self._bus[action.places], self._guess)]

    def iterated_step(self, action: IteratedStep, step_size: float, steps: Sequence[Operation]) -> Operation:
        """Return the linear map of a step whose guess equals the outputs at its end."""
        whole = self.guessed_step(action, step_size, steps)
        ends = whole[self._bus[action.places]]
        through, rest = ends[:, self._guess], np.delete(np.arange(self.size), self._guess)
        guess = np.linalg.solve(np.eye(len(self._guess)) - through, ends[:, rest])
        matrix = whole[:, rest] + whole[:, self._guess] @ guess
        rows = np.flatnonzero(np.any(whole != np.eye(self.size), axis=1))
        return Replace(rows, rest, matrix[rows])

    def exchange(self, action: Group | Transfer | AlgebraicLoop) -> Operation:
        """Return the linear map of one action of an exchange."""
        match action:
            case Group():
                return self.fetch(action)
            case Transfer():
                return self.hand_over(action)
            case AlgebraicLoop():
                return self.solve(action)

    def step(self, component: str, step_size: float, ticks: int) -> Operation:
        """Return the linear map of a component's step with evenly spaced ticks, the first at its beginning."""
        if self.source and component == self.source.component:
            return Replace(self.now, self.next, None)
        if component == self.lock_in:
            return SampleSignals()
        block = self.blocks[component]
        values, inputs = self.at(component, block.values), self.at(component, block.inputs)
        moving, derivatives = self._moving.get(component, ([], np.zeros(0, dtype=int)))
        whole = step_matrix(block, step_size, ticks, [block.inputs.index(name) for name in moving])
        if not np.isfinite(whole).all():
            raise StructureError(
                f"{component}: its states change at up to {np.abs(block.rate).max(initial=0):.3g} 1/s, and its step of "
                f"{step_size:.4g} s exceeds what a double holds; check its parameters"
            )
        if component not in self._moving:
            return Replace(values, np.concatenate([values, inputs]), whole)
        rows = np.concatenate([values, self.at(component, moving)])
        return Replace(rows, np.concatenate([values, inputs, derivatives.ravel()]), whole)


def operations(layout: Layout, step_size: float) -> list[list[Operation]]:
    """Return the operations of each communication step, in order, until the pattern of ticks repeats.

    Raises `StructureError` where a sample time is neither a multiple nor a whole part of the step.
    """
    times = {name: b.sample_time for name, b in layout.blocks.items() if b.sample_time is not None and len(b.tick)}
    intervals = {name: _ratio(sample_time, step_size) for name, sample_time in times.items()}
    longest = [max(1, interval) for interval in intervals.values()]
    period = int(np.lcm.reduce(longest)) if longest else 1
    known: dict[tuple[str, bool], Operation] = {}

    def step(component: str, k: int) -> Operation:
        """Return the linear map of a component in step k of a period, computed once for equal numbers of ticks."""
        interval = intervals.get(component)
        ticks = 0 if interval is None or (interval > 0 and k % interval) else max(1, -interval)
        key = component, ticks > 0
        if key not in known:
            known[key] = layout.step(component, step_size, ticks)
        return known[key]

    def maps(action: Any, k: int) -> Sequence[Operation]:
        """Return the linear maps of an action in step k."""
        match action:
            case Stepper():
                return [step(action.instance, k)]
            case IteratedStep():
                steps = [step(stepper.instance, k) for stepper in layout.wiring.continuous]
                return [layout.iterated_step(action, step_size, steps)]
            case Group() | Transfer() | AlgebraicLoop():
                return [layout.exchange(action)]
            case _:
                return layout.prepare(action, step_size)

    ends = [SampleSignals()] if layout.observed else []
    return [[operation for action in layout.cycle for operation in maps(action, k)] + ends for k in range(period)]


def step_matrix(block: Block, step_size: float, ticks: int, moving: Sequence[int] = ()) -> np.ndarray:
    """Return the matrix from [x; v; u; d1; d2] to [x; v; moving inputs] after a step with evenly spaced ticks.

    The first tick is at the beginning of the step. `moving` are indices among the inputs u of those with first and
    second derivatives d1, d2.
    """
    x, v, u, m = len(block.states), len(block.values) - len(block.states), len(block.inputs), len(moving)
    inputs = x + v + np.array(moving, dtype=int)
    first, second = (x + v + u + k * m + np.arange(m) for k in (0, 1))
    size = x + v + u + 2 * m
    now = np.eye(size)
    tick = now.copy()
    tick[x : x + v, : x + v + u] = block.tick
    generator = np.zeros((size, size))
    generator[:x, : x + v + u] = block.rate
    generator[inputs, first] = generator[first, second] = 1.0
    generator *= step_size / max(ticks, 1)
    move = _exponential(generator) if x or m else np.eye(size)
    for _ in range(max(ticks, 1)):
        now = move @ (tick @ now if ticks else now)
    return now[np.concatenate([np.arange(x + v), inputs])]


def _exponential(generator: np.ndarray) -> np.ndarray:
    """Return the exponential of a matrix, balanced first because its states have very different units.

    It is NaN for entries whose squares overflow, or that are not finite.
    """
    import scipy.linalg  # imported here, as it takes a fifth of a second

    if not np.abs(generator).max() < np.sqrt(np.finfo(float).max):
        return np.full_like(generator, np.nan)
    balanced, (scale, _) = scipy.linalg.matrix_balance(generator, permute=False, separate=True)
    return scipy.linalg.expm(balanced) * scale[:, None] / scale


def _ratio(sample_time: float, step_size: float) -> int:
    """Return the number of steps between two ticks; where negative, the number of ticks within a step."""
    try:
        _, ratios = grid([sample_time, step_size])
    except StructureError:
        raise StructureError(
            f"sample time {sample_time:.9g} s and step {step_size:.9g} s: one must be a multiple of the other"
        ) from None
    return ratios[0] if ratios[1] == 1 else -ratios[1]


def interface_jacobian(wiring: Wiring, action: IteratedStep, step_size: float) -> np.ndarray:
    """Return the interface Jacobian dy/dw of one step, (places, places).

    It is the derivative of the outputs y at the end of the step with respect to the guess w. The FMUs are linearised at
    their present values; an FMU without directional derivatives contributes zeros.
    """
    blocks = {}
    for name, instance in wiring.instances.items():
        inputs = [variable for owner, variable in (wiring.split(c.end) for c in wiring.connections) if owner == name]
        outputs = [variable for owner, variable in (wiring.split(c.start) for c in wiring.connections) if owner == name]
        make = block if instance.fmu.description.has_derivatives else zero_block
        blocks[name] = make(instance, inputs, outputs)
    layout = Layout(wiring, [action], blocks)
    steps = [layout.step(stepper.instance, step_size, 0) for stepper in wiring.continuous]
    return layout.interface_jacobian(action, step_size, steps)
