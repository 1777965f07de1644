"""Linear maps of linearised feedback: one matrix for each of its actions.

The law is that of `masters/linearized_feedback.py`. With the controllers' derivatives G = du/dy, moving inputs s of a
plant and its outputs y = C x + D u,

    StorePoint   values = bus,   y0 = y,   rates of the bus in feedthrough order: C der(x) + D rates of u
    SetSlopes    s' = (bus - values) / H where the source has stepped already, else rates - G rates of y
    Stepper      der(x) = A x + B (u + G (y - y0)), where u moves with the slopes s'

so that the linear map of a plant needs no feedback ports: its block takes G (y - y0) instead.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hfsa.cosim.actions.action import Group, Stepper
from hfsa.cosim.actions.schedule import Action
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.linear.blocks import Block
from hfsa.cosim.linear.cycle import Layout, Operation, Replace, Source
from hfsa.cosim.systems.feedback_loops import FeedbackLoop


@dataclass(frozen=True, eq=False)
class StorePoint:
    """Storage of the values and rates at a communication point."""


@dataclass(frozen=True, eq=False)
class SetSlopes:
    """Slopes of an instance's inputs at `places` of the bus; `known` marks those whose source has stepped already."""

    instance: str
    places: np.ndarray
    known: np.ndarray


@dataclass(frozen=True, eq=False)
class FetchNewest:
    """Fetch of a group right after its instance has stepped, before new inputs are set."""

    group: Group


class FeedbackLayout(Layout):
    """Layout for linearised feedback through `loops`; `ticks` are the master's actions before the plants step."""

    def __init__(
        self,
        wiring: Wiring,
        ticks: Iterable[Action],
        blocks: Mapping[str, Block],
        loops: Sequence[FeedbackLoop],
        source: Source | None = None,
        lock_in: str | None = None,
        observed: Sequence[tuple[str, str]] = (),
    ):
        self._bare = blocks
        self._gains = {plant: _gains(blocks, loops, plant) for plant in dict.fromkeys(loop.plant for loop in loops)}
        fed_back = {plant: with_feedback(blocks[plant], gains) for plant, gains in self._gains.items()}
        cycle = [*ticks, *self._steps(wiring), *wiring.exchange()]
        super().__init__(wiring, cycle, {**blocks, **fed_back}, source, lock_in, observed)
        n = len(wiring.bus)
        self._values, self._rates = self._new(n), self._new(n)
        for action in cycle:
            if isinstance(action, SetSlopes):
                self._add_slopes(action.instance, action.places)

    def _steps(self, wiring: Wiring) -> Iterable[Action | StorePoint | SetSlopes | FetchNewest]:
        """Yield the actions between two communication points: plants step first."""
        yield StorePoint()
        order = sorted(wiring.continuous, key=lambda stepper: stepper.instance not in self._gains)
        waiting, stepped = [stepper.instance for stepper in order], []
        for stepper in order:
            waiting.remove(stepper.instance)
            yield from self._lines(wiring, stepper, stepped)
            yield stepper
            stepped.append(stepper.instance)
            yield from (FetchNewest(g) for g in stepper.groups if any(t.target in waiting for t in g.transfers))

    def _lines(self, wiring: Wiring, stepper: Stepper, stepped: Collection[str]) -> Iterable[SetSlopes]:
        """Yield the slopes of an instance's inputs, if its FMU accepts them; inputs from sampled outputs are held."""
        name, fed_back = stepper.instance, {u for u, _ in self._gains.get(stepper.instance, {})}
        ends = [(i, c.start, *wiring.split(c.end)) for i, c in enumerate(wiring.connections)]
        moving = [(i, start, u) for i, start, owner, u in ends if owner == name and not wiring.is_sampled(start)]
        if moving and wiring.instances[name].has_input_derivatives([u for _, _, u in moving], 1):
            known = [wiring.split(start)[0] in stepped and u not in fed_back for _, start, u in moving]
            yield SetSlopes(name, np.array([i for i, _, _ in moving]), np.array(known))

    def fetch(self, group: Group) -> Replace:
        """Return the linear map of fetching a group at a communication point, where y = y0."""
        if group.instance not in self._gains:
            return super().fetch(group)
        return self._fetched(group, self._bare[group.instance])

    def _fetched(self, group: Group, block: Block) -> Replace:
        """Return the linear map of fetching a group of a block."""
        rows = [block.outputs.index(name) for name in group.outputs]
        columns = self.at(group.instance, (*block.values, *block.inputs))
        return Replace(self.bus[id(group)], columns, block.output[rows])

    def prepare(self, action: Any, step_size: float) -> Sequence[Operation]:
        """Return the linear maps of an action that prepares steps."""
        match action:
            case StorePoint():
                return [Replace(self._values, self._bus, None), *self._store_outputs(), *self._all_rates()]
            case SetSlopes():
                return [self._slopes(action, step_size)]
            case FetchNewest(group) if group.instance in self._gains:
                return [self._fetched(group, self.blocks[group.instance])]
            case FetchNewest(group):
                return [self.fetch(group)]
        return super().prepare(action, step_size)

    def _store_outputs(self) -> list[Operation]:
        """Return the linear maps that store y0."""
        found: list[Operation] = []
        for plant, gains in self._gains.items():
            outputs = list(dict.fromkeys(y for _, y in gains))
            places = [self._place_of(plant, y) for y in outputs]
            found.append(Replace(self.at(plant, [held_output(y) for y in outputs]), self._bus[places], None))
        return found

    def _place_of(self, component: str, output: str) -> int:
        """Return an index of an output on the bus."""
        starts = [self.wiring.split(connection.start) for connection in self.wiring.connections]
        return starts.index((component, output))

    def _all_rates(self) -> list[Operation]:
        """Return the linear maps of all output rates, in feedthrough order; rates on an algebraic loop stay 0."""
        found: list[Operation] = []
        ends = {self.wiring.split(c.end): i for i, c in enumerate(self.wiring.connections)}
        for group in self.wiring.groups:
            rows = self._rates[self.wiring.places(group)]
            if self.source and group.instance == self.source.component:
                found.append(Replace(rows, self.now, self.source.emission(group.outputs, order=1)))
            elif group.loop is None and group.instance in self._bare:
                block = self._bare[group.instance]
                matrix = np.array([_moved(block, name) for name in group.outputs])
                fed = [(k, ends[group.instance, u]) for k, u in enumerate(block.inputs) if (group.instance, u) in ends]
                n, count = len(block.values), len(block.states)
                direct = matrix[:, [n + k for k, _ in fed]]
                columns = self.at(group.instance, (*block.values, *block.inputs))
                columns = np.concatenate([columns, self._rates[[i for _, i in fed]]]).astype(int)
                found.append(Replace(rows, columns, np.hstack([matrix[:, :count] @ block.rate, direct])))
        return found

    def _slopes(self, action: SetSlopes, step_size: float) -> Operation:
        """Return the linear map of setting the slopes of an instance's inputs."""
        names, derivatives = self._moving[action.instance]
        n, places = len(names), action.places
        gains = self._gains.get(action.instance, {})
        outputs = list(dict.fromkeys(y for _, y in gains))
        marks = [self._place_of(action.instance, y) for y in outputs]
        known, rest = np.diag(action.known / step_size), np.diag(1.0 - action.known)
        own = np.array([[gains.get((u, y), 0.0) for y in outputs] for u in names]).reshape(n, len(outputs))
        columns = [self._bus[places], self._values[places], self._rates[places], self._rates[marks]]
        return Replace(derivatives[0], np.concatenate(columns), np.hstack([known, -known, rest, -own]))


def with_states(loops: Iterable[FeedbackLoop], blocks: Mapping[str, Block]) -> list[FeedbackLoop]:
    """Return the loops whose plant input acts on a state; the plants of other loops have no ports."""

    def is_followed(loop: FeedbackLoop) -> bool:
        """Whether the plant input of a loop acts on a state."""
        block = blocks[loop.plant]
        return bool(np.any(block.rate[:, len(block.values) + block.inputs.index(loop.input)]))

    return [loop for loop in loops if is_followed(loop)]


def held_output(output: str) -> str:
    """Return the name of y0 among the inputs of a plant."""
    return f"feedback.at.{output}"


def with_feedback(block: Block, gains: Mapping[tuple[str, str], float]) -> Block:
    """Return a block with the feedback u + G (y - y0) on its inputs; `gains` by (u, y); y0 are further inputs."""
    outputs = list(dict.fromkeys(y for _, y in gains))
    n, size = len(block.values), block.output.shape[1]
    inside = np.eye(size, size + len(outputs))
    for (u, y), gain in gains.items():
        row = n + block.inputs.index(u)
        inside[row, :size] += gain * block.output[block.outputs.index(y)]
        inside[row, size + outputs.index(y)] -= gain
    inputs = (*block.inputs, *map(held_output, outputs))
    matrices = {name: getattr(block, name) @ inside for name in ("rate", "tick", "output")}
    return replace(block, inputs=inputs, **matrices)


def _gains(blocks: Mapping[str, Block], loops: Iterable[FeedbackLoop], plant: str) -> dict[tuple[str, str], float]:
    """Return the feedback gains of a plant by (input, output), summed over all controllers."""
    found: dict[tuple[str, str], float] = {}
    for loop in loops:
        if loop.plant == plant:
            law = blocks[loop.controller]
            column = len(law.values) + law.inputs.index(loop.measured)
            gain = law.output[law.outputs.index(loop.command), column]
            found[loop.input, loop.output] = found.get((loop.input, loop.output), 0.0) + float(gain)
    return found


def _moved(block: Block, output: str) -> np.ndarray:
    """Return the row of an output, (n,), zero where the output is held between ticks."""
    row = block.output[block.outputs.index(output)]
    return np.zeros_like(row) if output in block.held else row
