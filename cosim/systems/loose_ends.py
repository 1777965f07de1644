"""Loose ends of a system: inputs that nothing feeds, and components that nothing connects.

    loose_ends(system, connectors, used=["plant.u", "plant.y"])     # sentences

`used` are the excited inputs and the observed variables. An input without a connection keeps its start value, which may
be meant; the sentence says so, with the value, and with an output of the same name that nothing reads, as that is often
the connection which was forgotten.
"""

from collections.abc import Collection, Iterator, Mapping

from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.names import compact, companions
from hfsa.cosim.systems.system import Component, System

_MOST = 6
"""Number of inputs that a sentence names."""

Connectors = Mapping[str, Mapping[str, Connector]]


def loose_ends(system: System, connectors: Connectors, used: Collection[str]) -> list[str]:
    """Return a sentence on unconnected inputs, and one on each component without a connection; none if all is joined.

    `connectors` holds the variables of each component's FMU by name.
    """
    ends = {name for connection in system.connections for name in (connection.start, connection.end)}
    sentences = []
    for component in system.components:
        if len(system.components) > 1 and not any(system.split(name)[0] == component.name for name in (*ends, *used)):
            sentences.append(f"nothing connects or observes the component {component.name}")
    free = [
        f"{component.name}.{name}"
        for component in system.components
        for name in _inputs(component, connectors[component.name])
        if f"{component.name}.{name}" not in ends and f"{component.name}.{name}" not in used
    ]
    if free:
        sentences.append(_sentence(system, connectors, free, {*ends, *used}))
    return sentences


def _inputs(component: Component, variables: Mapping[str, Connector]) -> Iterator[str]:
    """Yield the inputs of a component; those of a part of hfsa without the derivatives of other inputs."""
    names = [name for name, variable in variables.items() if variable.causality == "input"]
    derived = {companion for name in names for companion in companions(name)}
    is_foreign = component.is_foreign
    yield from (name for name in names if is_foreign or name not in derived)


def _sentence(system: System, connectors: Connectors, free: list[str], used: Collection[str]) -> str:
    """Return the sentence on unconnected inputs."""
    alike: dict[str, list[str]] = {}
    for name in free:
        component, variable = system.split(name)
        found = connectors[component][variable]
        start = system[component].start.get(variable, found.start)
        unit = f" {found.unit}" if found.unit not in (None, "1") else ""
        alike.setdefault("no start value" if start is None else f"{start:g}{unit}", []).append(name)
    words = [f"{name} ({start})" for start, names in alike.items() for name in compact(names)]
    more = f" and {len(words) - _MOST} more" if len(words) > _MOST else ""
    unread = [hint for name in free if (hint := _unread(system, connectors, name, used))]
    hints = f"; nothing reads {', '.join(compact(dict.fromkeys(unread)))}, of the same name" if unread else ""
    rest = "it keeps its start value" if len(free) == 1 else "they keep their start values"
    return f"nothing feeds {', '.join(words[:_MOST])}{more}: {rest}{hints}"


def _unread(system: System, connectors: Connectors, name: str, used: Collection[str]) -> str:
    """Return an output of another component with the name of an input, which nothing reads; empty if there is none."""
    component, variable = system.split(name)
    for other in system.components:
        found = connectors[other.name].get(variable)
        full = f"{other.name}.{variable}"
        if other.name != component and found is not None and found.causality == "output" and full not in used:
            return full
    return ""
