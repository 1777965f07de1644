"""A co-simulation algorithm run on linear maps instead of values: what one cycle of its actions does, exactly.

All that moves between communication points is one vector: continuous states, sampled states, held outputs, inputs and
the bus of connected outputs. In the linearised system each action of `Master.cycle` replaces some of its members by a
matrix times others:

    Group       its part of the bus = output [x; v; u] of its FMU
    Transfer    inputs of its target = its part of the bus
    Stepper     [x; v] = step [x; v; u] of its FMU: the inputs are held, x moves by the matrix exponential, ticks that
                fall into the step change v

A sine source is an oscillator that its own step turns, and puts out value, rate and acceleration when it is fetched; a
lock-in amplifier only listens.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from hfsa.cosim._blocks import Block
from hfsa.cosim._sampled import grid
from hfsa.cosim._wiring import Group, Transfer
from hfsa.cosim.master import Action, Master
from hfsa.cosim.system import StructureError

ORDERS = {"value": 0, "rate": 1, "acceleration": 2, "sine": 0}
"""Outputs of a sine source by the derivative that they are; what else it puts out has no part in a response."""


@dataclass(frozen=True)
class Replace:
    """Members `rows` become `matrix` times the members `columns`; `None` copies them."""

    rows: np.ndarray
    columns: np.ndarray
    matrix: np.ndarray | None


@dataclass(frozen=True)
class Emit:
    """Members `rows` become derivatives of the source's sinusoid, of the given orders; -1 for 0."""

    rows: np.ndarray
    orders: np.ndarray


@dataclass(frozen=True)
class Turn:
    """The source steps."""


@dataclass(frozen=True)
class Listen:
    """The amplifier takes a sample."""


Operation = Replace | Emit | Turn | Listen


class Layout:
    """Where everything is in the vector.

    `blocks` holds the linearised FMU of each component but the source and the lock-in amplifier.
    """

    def __init__(self, master: Master, blocks: Mapping[str, Block], source: str | None, lock_in: str | None):
        self.master, self.blocks, self.source, self.lock_in = master, blocks, source, lock_in
        names: list[tuple[str, str]] = []
        for component, block in blocks.items():
            names += [(component, name) for name in (*block.values, *block.inputs)]
        listened = [master.system.split(c.end) for c in master.system.connections]
        names += [(component, name) for component, name in listened if component == lock_in]
        self.place = {name: i for i, name in enumerate(names)}
        self.bus: dict[int, np.ndarray] = {}
        self.size = len(names)
        for group in master.wiring.groups:  # they follow one another on the bus
            first = self.size
            for transfer in group.transfers:
                self.bus[id(transfer)] = np.arange(self.size, self.size + len(transfer.inputs))
                self.size += len(transfer.inputs)
            self.bus[id(group)] = np.arange(first, self.size)

    def at(self, component: str, names: Sequence[str]) -> np.ndarray:
        """Return the places of some members of a component."""
        return np.array([self.place[component, name] for name in names], dtype=int)

    def fetch(self, group: Group) -> Operation:
        """Return what fetching a group does."""
        if group.instance == self.source:
            return Emit(self.bus[id(group)], np.array([ORDERS.get(name, -1) for name in group.outputs]))
        block = self.blocks[group.instance]
        rows = [block.outputs.index(name) for name in group.outputs]
        columns = self.at(group.instance, (*block.values, *block.inputs))
        return Replace(self.bus[id(group)], columns, block.output[rows])

    def hand_over(self, transfer: Transfer) -> Operation:
        """Return what setting the inputs of a transfer does."""
        return Replace(self.at(transfer.target, transfer.inputs), self.bus[id(transfer)], None)


def operations(layout: Layout, step_size: float) -> list[list[Operation]]:
    """Return the operations of each communication step, in order, until the pattern of ticks repeats.

    `StructureError` where a sample time is neither a multiple nor a whole part of the step.
    """
    times = {name: b.sample_time for name, b in layout.blocks.items() if b.sample_time is not None and len(b.tick)}
    intervals = {name: _ratio(sample_time, step_size) for name, sample_time in times.items()}
    longest = [max(1, interval) for interval in intervals.values()]
    steps = int(np.lcm.reduce(longest)) if longest else 1
    known: dict[tuple[str, bool], Replace] = {}

    def step(component: str, k: int) -> Operation:
        """What a component does in step k of a period; the same matrix for all steps with as many ticks."""
        if component == layout.source:
            return Turn()
        if component == layout.lock_in:
            return Listen()
        block, interval = layout.blocks[component], intervals.get(component)
        ticks = 0 if interval is None or (interval > 0 and k % interval) else max(1, -interval)
        key = component, ticks > 0
        if key not in known:
            matrix = step_matrix(block, step_size, ticks)
            rows = layout.at(component, block.values)
            known[key] = Replace(rows, layout.at(component, (*block.values, *block.inputs)), matrix)
        return known[key]

    def operation(action: Action, k: int) -> Operation:
        """An action of the master, in step k, on matrices."""
        if isinstance(action, Group):
            return layout.fetch(action)
        if isinstance(action, Transfer):
            return layout.hand_over(action)
        return step(action.instance, k)

    return [[operation(action, k) for action in layout.master.cycle] for k in range(steps)]


def step_matrix(block: Block, step_size: float, ticks: int) -> np.ndarray:
    """Return [x; v] after a step from [x; v; u], (x + v, x + v + u), with evenly spaced ticks, the first at once."""
    x, v = len(block.states), len(block.values) - len(block.states)
    now = np.eye(block.rate.shape[1])
    tick = now.copy()
    tick[x : x + v] = block.tick
    generator = np.zeros_like(now)
    generator[:x] = block.rate * (step_size / max(ticks, 1))
    move = _exponential(generator) if x else np.eye(len(now))
    for _ in range(max(ticks, 1)):
        now = move @ (tick @ now if ticks else now)
    return now[: x + v]


def _exponential(generator: np.ndarray) -> np.ndarray:
    """Return the matrix exponential, balanced first: states of very different units share it."""
    balanced, (scale, _) = scipy.linalg.matrix_balance(generator, permute=False, separate=True)
    return scipy.linalg.expm(balanced) * scale[:, None] / scale


def _ratio(sample_time: float, step_size: float) -> int:
    """Return the steps between two ticks; negative, the ticks within a step."""
    try:
        _, ratios = grid([sample_time, step_size])
    except StructureError:
        raise StructureError(
            f"sample time {sample_time:.9g} s and step {step_size:.9g} s: one must be a multiple of the other"
        ) from None
    return ratios[0] if ratios[1] == 1 else -ratios[1]
