"""How the instances of a system are joined: prepared calls between arrays that an output and the inputs it feeds share.

All connected outputs lie in one array, the bus. A `Group` fetches outputs of one instance into its part of the bus, a
`Transfer` sets inputs of one instance from part of a group, and a `Stepper` steps one instance: nothing else happens
between instances, so that an algorithm is an order of these three.
"""

from collections.abc import Iterable, Mapping
from ctypes import c_double
from dataclasses import dataclass, field
from itertools import groupby

import numpy as np

from hfsa.cosim._description import SAMPLE_TIME
from hfsa.cosim.instance import Call, Instance
from hfsa.cosim.system import Connection, Connector, StructureError, System, check, feedthrough_levels


@dataclass(eq=False)
class Group:
    """Connected outputs of one instance at one feedthrough level, fetched by one call."""

    instance: str
    outputs: list[str]
    call: Call
    transfers: list["Transfer"] = field(default_factory=list)


@dataclass(eq=False)
class Transfer:
    """Inputs of instance `target` that one group feeds, set by one call; `affected` groups follow them directly."""

    target: str
    inputs: list[str]
    call: Call
    affected: list[Group] = field(default_factory=list)


@dataclass(eq=False)
class Stepper:
    """One step of one instance; afterwards all its `groups` may have changed."""

    instance: str
    call: Call
    groups: list[Group]


class Wiring:
    """Groups, transfers and steppers of a checked system; `time` and `step_size` are what the steppers read.

    Attributes:
        bus: values of the connected outputs, (n,); `connections` says which, in that order (an output that feeds two
            inputs is there twice).
        groups: all groups, lowest feedthrough level first.
        sampled, others: steppers of the sampled instances and of the others, each in the system's order.
    """

    def __init__(self, system: System, instances: Mapping[str, Instance]):
        self.connectors = {component.name: instances[component.name].fmu.variables for component in system.components}
        check(system, self.connectors)
        self.time, self.step_size = c_double(), c_double()
        levels = feedthrough_levels(system, self.connectors)
        order = {component.name: i for i, component in enumerate(system.components)}

        def place(connection: Connection) -> tuple[int, int, int]:
            source, target = (system.split(end)[0] for end in (connection.start, connection.end))
            return levels[connection.start], order[source], order[target]

        self.connections = sorted(system.connections, key=place)
        self.bus = np.zeros(len(self.connections))
        self.groups: list[Group] = []
        for (_, source), members in groupby(self.connections, lambda c: place(c)[:2]):
            self.groups.append(self._group(system, instances, system.components[source].name, list(members)))
        for group in self.groups:
            for transfer in group.transfers:
                transfer.affected = [other for other in self.groups if self._follows(other, transfer)]
        self.sampled: list[Stepper] = []
        self.others: list[Stepper] = []
        for name in order:
            call = instances[name].stepper(self.time, self.step_size)
            stepper = Stepper(name, call, [group for group in self.groups if group.instance == name])
            (self.sampled if instances[name].fmu.description.is_sampled else self.others).append(stepper)

    def _group(self, system, instances, source: str, connections: list[Connection]) -> Group:
        """Return the group of connections that follow one another on the bus, with one transfer per target."""
        first = self.connections.index(connections[0])

        def handle(instance: str, variables: list[str]):
            return instances[instance].handle(variables, self.bus[first : first + len(variables)])

        outputs = [system.split(connection.start)[1] for connection in connections]
        group = Group(source, outputs, instances[source].getter(handle(source, outputs)))
        for target, members in groupby(connections, lambda c: system.split(c.end)[0]):
            inputs = [system.split(connection.end)[1] for connection in members]
            group.transfers.append(Transfer(target, inputs, instances[target].setter(handle(target, inputs))))
            first += len(inputs)
        return group

    def _follows(self, group: Group, transfer: Transfer) -> bool:
        """Whether an output of the group follows an input of the transfer without a step between."""
        if group.instance != transfer.target:
            return False
        followed = (self.connectors[group.instance][name].dependencies for name in group.outputs)
        return any(names is None or set(names) & set(transfer.inputs) for names in followed)


def without_repetition(cycle: Iterable[Group | Transfer | Stepper]) -> list[Group | Transfer | Stepper]:
    """Leave out fetching what cannot have changed since it was fetched, and setting what has not been fetched anew.

    The cycle begins after a complete exchange and ends with one, so what is left out is the same in every cycle.
    """
    stale_groups: set[Group] = set()
    stale_transfers: set[Transfer] = set()
    kept = []
    for action in cycle:
        if isinstance(action, Stepper):
            stale_groups.update(action.groups)
        elif isinstance(action, Group):
            if action not in stale_groups:
                continue
            stale_groups.discard(action)
            stale_transfers.update(action.transfers)
        else:
            if action not in stale_transfers:
                continue
            stale_transfers.discard(action)
            stale_groups.update(action.affected)
        kept.append(action)
    return kept


def check_sample_times(
    system: System, connectors: Mapping[str, Mapping[str, Connector]], starts: Mapping[str, float], step_size: float
) -> None:
    """Raise `StructureError` unless each sample time divides the step or is a multiple of it (to 1e-9 of it).

    `starts` holds start values by full name; a sample time that is not there is the component's or the FMU's own.
    """
    for component in system.components:
        sampled = connectors[component.name].get(SAMPLE_TIME)
        if sampled is None or sampled.causality != "parameter":
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
