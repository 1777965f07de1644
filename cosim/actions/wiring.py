"""Wiring of a system: prepared FMI calls that share one array of output values, the bus.

A `Group` fetches outputs of one instance into its part of the bus, a `Transfer` sets inputs of one instance from part
of a group, and a `Stepper` steps one instance. An `AlgebraicLoop` replaces the groups whose outputs depend on each
other through direct feedthrough.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import groupby

import numpy as np

from hfsa.cosim.actions.action import Group, Stepper, Transfer
from hfsa.cosim.actions.algebraic_loop import AlgebraicLoop
from hfsa.cosim.fmi.co_simulation import Instance, Number
from hfsa.cosim.fmi.description import SAMPLE_TIME
from hfsa.cosim.systems.check import check
from hfsa.cosim.systems.connectors import Connector, connector
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.feedthrough import feedthrough, loop_path
from hfsa.cosim.systems.system import Component, Connection, System
from hfsa.cosim.systems.transformations import transformation


class Wiring:
    """Groups, transfers and steppers of a checked system; the steppers read `time` and `step_size` [s].

    Attributes:
        bus: values of the connected outputs, (n,), in the order of `connections` (an output that feeds two inputs is
            there twice).
        groups: all groups, lowest feedthrough level first; `loops` are the algebraic loops among them.
        discrete: steppers of the sampled instances; `continuous`: all other steppers; each in the order of the system.
    """

    def __init__(self, system: System, instances: Mapping[str, Instance]):
        self.system, self.instances = system, instances
        self.connectors = {c.name: _variables(c, instances[c.name].fmu.variables) for c in system.components}
        check(system, self.connectors)
        self._refuse_transformations()
        self.time, self.step_size = Number(), Number()
        found = feedthrough(system, self.connectors)
        order = {component.name: i for i, component in enumerate(system.components)}

        def place(connection: Connection) -> tuple[int, int, int]:
            """Sort key of a connection on the bus: feedthrough level, source, target."""
            source, target = (system.split(end)[0] for end in (connection.start, connection.end))
            return found.levels[connection.start], order[source], order[target]

        self.connections = sorted(system.connections, key=place)
        self.bus = np.zeros(len(self.connections))
        self.groups: list[Group] = []
        for (_, source), members in groupby(self.connections, lambda c: place(c)[:2]):
            self.groups.append(self._group(system, instances, system.components[source].name, list(members)))
        for group in self.groups:
            for transfer in group.transfers:
                transfer.affected = self.following({f"{transfer.target}.{name}" for name in transfer.inputs})
        self.loops = [self._loop(number, loop) for number, loop in enumerate(found.loops)]
        self.discrete: list[Stepper] = []
        self.continuous: list[Stepper] = []
        for name in order:
            call = instances[name].stepper(self.time, self.step_size)
            stepper = Stepper(name, call, [group for group in self.groups if group.instance == name])
            (self.discrete if instances[name].fmu.description.is_sampled else self.continuous).append(stepper)

    def _refuse_transformations(self) -> None:
        """Raise `StructureError` for a connection that is not plain (`assembly/transformations.py`)."""
        for connection in self.system.connections:
            ends = (connector(self.system, self.connectors, name) for name in (connection.start, connection.end))
            if found := transformation(connection, *ends):
                raise StructureError(
                    f"connection {connection} has factor {found.factor:g} and offset {found.offset:g}, which no FMU "
                    "applies; expected a system from build()"
                )

    def stages(self) -> Iterator[Group | AlgebraicLoop]:
        """Yield all groups in feedthrough order; an algebraic loop replaces the groups on it."""
        entered = set()
        for group in self.groups:
            if group.loop is None:
                yield group
            elif group.loop not in entered:
                entered.add(group.loop)
                yield self.loops[group.loop]

    def exchange(self) -> Iterator[Group | Transfer | AlgebraicLoop]:
        """Yield one exchange in feedthrough order: fetch groups and solve loops, then set the inputs that they feed.

        Inputs are set as late as the next group allows, so that no output is fetched after an input of its instance
        but where it follows that input at once.
        """
        waiting: list[Transfer] = []
        for stage in self.stages():
            groups = stage.groups if isinstance(stage, AlgebraicLoop) else [stage]
            if any(group in transfer.affected for transfer in waiting for group in groups):
                yield from waiting
                waiting = []
            yield stage
            waiting += stage.transfers
        yield from waiting

    def places(self, group: Group) -> list[int]:
        """Return the indices of a group on the bus."""
        before = 0
        for other in self.groups:
            if other is group:
                break
            before += len(other.outputs)
        return list(range(before, before + len(group.outputs)))

    def following(self, ends: Collection[str]) -> list[Group]:
        """Return the groups with direct feedthrough from some inputs (full names)."""
        return [g for g in self.groups if any(self._has_feedthrough(g, name, ends) for name in g.outputs)]

    def split(self, name: str) -> tuple[str, str]:
        """Return (component, variable) of a full name."""
        return self.system.split(name)

    def is_sampled(self, output: str) -> bool:
        """Whether an output (full name) changes only at ticks."""
        component, variable = self.split(output)
        return self.connectors[component][variable].changes_at_events

    def jumping(self) -> set[str]:
        """Return the connected outputs (full names) that jump at ticks: sampled ones, and those they feed through."""
        found = {connection.start for connection in self.connections if self.is_sampled(connection.start)}
        before = -1
        while len(found) > before:
            before = len(found)
            fed = [connection.end for connection in self.connections if connection.start in found]
            found |= {
                f"{g.instance}.{name}" for g in self.groups for name in g.outputs if self._has_feedthrough(g, name, fed)
            }
        return found

    def _has_feedthrough(self, group: Group, output: str, ends: Iterable[str]) -> bool:
        """Whether an output has direct feedthrough from one of the inputs (full names)."""
        followed = self.connectors[group.instance][output].dependencies
        own = [variable for component, variable in map(self.split, ends) if component == group.instance]
        return any(followed is None or name in followed for name in own)

    def _loop(self, number: int, connections: tuple[Connection, ...]) -> AlgebraicLoop:
        """Return the action that solves an algebraic loop, and assign its groups to it."""
        starts, ends = {c.start for c in connections}, {c.end for c in connections}
        groups = [g for g in self.groups if any(f"{g.instance}.{name}" in starts for name in g.outputs)]
        for group in groups:
            group.loop = number
        transfers = [transfer for group in groups for transfer in group.transfers]
        inner = [t for t in transfers if any(f"{t.target}.{name}" in ends for name in t.inputs)]
        places = [i for i, connection in enumerate(self.connections) if connection in connections]
        own = [self.connections[i] for i in places]
        variables = [(self.split(c.start), self.split(c.end)) for c in own]
        return AlgebraicLoop(
            number,
            groups,
            inner,
            [transfer for transfer in transfers if transfer not in inner],
            np.array(places),
            [(*start, *end) for start, end in variables],
            self.bus,
            np.array([abs(self.connectors[component][name].nominal) for (component, name), _ in variables]),
            loop_path(self.system, self.connectors, connections),
            dict(self.instances),
        )

    def _group(self, system, instances, source: str, connections: list[Connection]) -> Group:
        """Return the group of consecutive connections on the bus, with one transfer per target."""
        first = self.connections.index(connections[0])

        def handle(instance: str, variables: list[str]):
            """Return the handle of variables whose values lie in the group's part of the bus."""
            return instances[instance].handle(variables, self.bus[first : first + len(variables)])

        outputs = [system.split(connection.start)[1] for connection in connections]
        group = Group(source, outputs, instances[source].getter(handle(source, outputs)))
        for target, members in groupby(connections, lambda c: system.split(c.end)[0]):
            inputs = [system.split(connection.end)[1] for connection in members]
            group.transfers.append(Transfer(target, inputs, instances[target].setter(handle(target, inputs))))
            first += len(inputs)
        return group


def _variables(component: Component, variables: Mapping[str, Connector]) -> Mapping[str, Connector]:
    """Return the variables of a component, without direct feedthrough where it keeps to the strict order of calls."""
    if component.calls != "strict":
        return variables
    return {name: replace(variable, dependencies=()) for name, variable in variables.items()}


def check_sample_times(
    system: System, connectors: Mapping[str, Mapping[str, Connector]], starts: Mapping[str, float], step_size: float
) -> None:
    """Raise `StructureError` unless each sample time divides the step or is a multiple of it (to 1e-9 of it).

    `starts` holds start values by full name, which override the sample times of components and FMUs.
    """
    for component in system.components:
        sampled = connectors[component.name].get(SAMPLE_TIME)
        if sampled is None or not sampled.is_conventional or sampled.causality != "parameter":
            continue
        name = f"{component.name}.{SAMPLE_TIME}"
        sample_time = starts.get(name, component.start.get(SAMPLE_TIME, sampled.start))
        if not sample_time or sample_time <= 0:
            raise StructureError(f"{name} is {sample_time} s, expected a positive time")
        ratio = max(sample_time / step_size, step_size / sample_time)
        if abs(ratio - round(ratio)) > 1e-9 * ratio:
            n = round(ratio)
            fitting = sample_time / n if sample_time > step_size else sample_time * n
            raise StructureError(
                f"{name} is {sample_time:.9g} s and the step {step_size:.9g} s: one must be a multiple of the other, "
                f"so that ticks fall on communication points; the nearest step that fits is {fitting:.9g} s"
            )
