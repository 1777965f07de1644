"""Linear transformations of connections, made components of the system that is built.

    system = with_transformations(assembly)

A connection that transforms its value (`systems/transformations.py`) is replaced by a component `linear_transformation`
between its ends, one for all such connections between two components. It has no state and follows at once, and it
steps right behind its source, so that every algorithm, the linear maps and the monolithic reference take it as they
take any part.
"""

from itertools import count

from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.systems.scene import LINEAR_TRANSFORMATION
from hfsa.cosim.systems.system import Component, Connection, System
from hfsa.cosim.systems.transformations import Transformation, transformation


def with_transformations(assembly: Assembly) -> System:
    """Return the system of an assembly with a component for what its connections transform; itself where none does.

    Raises as `systems.transformations.transformation`.
    """
    system = assembly.system
    found: dict[Connection, Transformation] = {}
    for connection in system.connections:
        ends = assembly.connector(connection.start), assembly.connector(connection.end)
        if (transformed := transformation(connection, *ends)) is not None:
            found[connection] = transformed
    if not found:
        return system
    pairs: dict[tuple[str, str], list[Connection]] = {}
    for connection in found:
        source, target = (system.split(name)[0] for name in (connection.start, connection.end))
        pairs.setdefault((source, target), []).append(connection)
    names = _free_names(system)
    made = {pair: next(names) for pair in pairs}
    components = []
    for component in system.components:
        own = [pair for pair in pairs if pair[0] == component.name]
        components += [component, *(_component(made[pair], [found[c] for c in pairs[pair]]) for pair in own)]
    connections = [c for c in system.connections if c not in found]
    for pair, members in pairs.items():
        for i, connection in enumerate(members, 1):
            connections.append(Connection(connection.start, f"{made[pair]}.signal[{i}]"))
            connections.append(Connection(f"{made[pair]}.value[{i}]", connection.end))
    return System(components, connections)


def _component(name: str, of: list[Transformation]) -> Component:
    """Return the component of some transformations."""
    start = {f"factor[{i}]": t.factor for i, t in enumerate(of, 1)} | {
        f"offset[{i}]": t.offset for i, t in enumerate(of, 1)
    }
    units, results = ([t.units[end] for t in of] for end in (0, 1))
    return Component(name, LINEAR_TRANSFORMATION, None, {"units": units, "results": results}, start)


def _free_names(system: System):
    """Yield names of components that the system does not have."""
    known = {component.name for component in system.components}
    return (name for i in count(1) if (name := f"transformation[{i}]") not in known)
