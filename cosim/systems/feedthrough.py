"""Direct feedthrough between components: the order of exchange, and the algebraic loops that have none.

    found = feedthrough(system, connectors)
    found.levels["robot.drive[1].force"]     # higher than the levels of its direct dependencies
    found.loops                              # algebraic loops, each as the connections that close it

An output depends directly on some inputs of its component, and each input equals the output connected to it. When
outputs are read level by level and passed on at once, each is read after its inputs were set. Outputs that depend on
themselves have no such order: they form an algebraic loop, which has a level of its own and is solved there
(`actions/algebraic_loop.py`).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.cycles import representatives
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Connection, System

Connectors = Mapping[str, Mapping[str, Connector]]


@dataclass(frozen=True)
class Feedthrough:
    """Order of exchange of a system.

    Attributes:
        levels: level of each connected output (full name), from 0. Outputs of one component share a level where no
            other output depends on the lower one; an algebraic loop has its level alone.
        loops: connections of each algebraic loop, lowest level first.
    """

    levels: Mapping[str, int]
    loops: tuple[tuple[Connection, ...], ...]


def feedthrough(system: System, connectors: Connectors) -> Feedthrough:
    """Return the order of exchange; `connectors` holds the variables of each component's FMU by name."""
    dependencies = _dependencies(system, connectors)
    loop_of = representatives(dependencies)
    outside = {name: {loop_of[other] for other in others} - {loop_of[name]} for name, others in dependencies.items()}
    members: dict[str, list[str]] = {}
    for name, loop in loop_of.items():
        members.setdefault(loop, []).append(name)
    before = {loop: {other for name in names for other in outside[name]} for loop, names in members.items()}
    depth: dict[str, int] = {}
    for loop in TopologicalSorter(before).static_order():
        depth[loop] = 1 + max((depth[other] for other in before[loop]), default=-1)
    closed = [loop for loop, names in members.items() if len(names) > 1 or names[0] in dependencies[names[0]]]
    levels = {name: depth[loop] for name, loop in loop_of.items()}
    _merge_levels(system, dependencies, levels, {name for loop in closed for name in members[loop]})
    places = {name: (levels[name], 1 + closed.index(loop) if loop in closed else 0) for name, loop in loop_of.items()}
    ranks = {place: rank for rank, place in enumerate(sorted(set(places.values())))}
    loops = [_connections(system, connectors, members[loop]) for loop in sorted(closed, key=depth.__getitem__)]
    return Feedthrough({name: ranks[place] for name, place in places.items()}, tuple(loops))


def refuse_loops(system: System, connectors: Connectors) -> None:
    """Raise `StructureError` with the path of an algebraic loop, if the system has one."""
    for loop in feedthrough(system, connectors).loops:
        raise StructureError(
            f"algebraic loop: {loop_path(system, connectors, loop)}; each depends on the "
            "one before it without a step between, so no order of exchange gives consistent values. Break it with a "
            "state or a sampled part, or let it be solved"
        )


def loop_path(system: System, connectors: Connectors, loop: tuple[Connection, ...]) -> str:
    """Return the path around an algebraic loop as text: `a.y -> b.u -> b.y -> a.u -> a.y`."""
    graph = {connection.end: {connection.start} for connection in loop}
    for connection in loop:
        graph[connection.start] = _inputs_of(system, connectors, connection.start) & set(graph)
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return " -> ".join(error.args[1])
    return ", ".join(map(str, loop))


def _dependencies(system: System, connectors: Connectors) -> dict[str, set[str]]:
    """Return the direct dependencies of each connected output: outputs by full name."""
    feeder = {connection.end: connection.start for connection in system.connections}
    return {
        name: {feeder[end] for end in _inputs_of(system, connectors, name) if end in feeder} for name in feeder.values()
    }


def _inputs_of(system: System, connectors: Connectors, output: str) -> set[str]:
    """Return the inputs (full names) of its component with direct feedthrough to an output."""
    component, variable = system.split(output)
    dependencies = connectors[component][variable].dependencies
    if dependencies is None:
        dependencies = tuple(name for name, found in connectors[component].items() if found.causality == "input")
    return {f"{component}.{name}" for name in dependencies}


def _merge_levels(
    system: System, dependencies: Mapping[str, set[str]], levels: dict[str, int], in_loops: set[str]
) -> None:
    """Raise outputs to the highest level of their component where no other output depends on them, in place."""
    followers: dict[str, list[str]] = {name: [] for name in dependencies}
    for name, others in dependencies.items():
        for other in others:
            followers[other].append(name)
    plain = [name for name in levels if name not in in_loops]
    highest: dict[str, int] = {}
    for name in plain:
        component = system.split(name)[0]
        highest[component] = max(highest.get(component, 0), levels[name])
    for name in plain:
        top = highest[system.split(name)[0]]
        if all(levels[follower] > top for follower in followers[name]):
            levels[name] = top


def _connections(system: System, connectors: Connectors, outputs: list[str]) -> tuple[Connection, ...]:
    """Return the connections of a loop: from its outputs to the inputs that they depend on."""
    dependencies = {end for name in outputs for end in _inputs_of(system, connectors, name)}
    return tuple(c for c in system.connections if c.start in outputs and c.end in dependencies)
