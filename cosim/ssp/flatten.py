"""From systems within systems to one: which variable of which FMU feeds which input, and what starts where.

A connection goes from a source to a sink, whichever its document calls start: an output of an element and an input of
the surrounding system are sources inside it. Connectors of systems and signals of dictionaries pass on what they get.
On the way a value is converted to the unit of each connector, and transformed where a connection says so.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from hfsa.cosim.fmi.description import Description, describe
from hfsa.cosim.ssp.structure import Bus, Link, Nest, Part, Port, Value
from hfsa.cosim.ssp.units import IDENTITY, Affine, Unit, conversion
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.kinds import is_number
from hfsa.cosim.systems.names import nearest
from hfsa.cosim.systems.units import known_base

Path = tuple[str, ...]
"""Names of the elements from the outermost system inwards."""
Place = tuple[Path, str]
"""A connector: path of its element, and its name. A signal of a dictionary has a path that no element has."""

_GIVING, _TAKING = ("output", "local", "calculatedParameter", "constant"), ("input", "parameter", "structuralParameter")


@dataclass(frozen=True)
class Join:
    """Output of one FMU that feeds an input of another; `map` leads from the unit of the one to that of the other."""

    start: Place
    end: Place
    map: Affine
    place: str


@dataclass
class Flat:
    """A system without systems within.

    Attributes:
        parts: components by path, in the order of the documents.
        joins: connections between them.
        starts: start values by path and variable, in the unit of the variable.
        outputs: outputs that the outermost system offers.
        unused: names of parameters that set nothing.
    """

    parts: dict[Path, Part] = field(default_factory=dict)
    joins: list[Join] = field(default_factory=list)
    starts: dict[Path, dict[str, Any]] = field(default_factory=dict)
    outputs: list[Place] = field(default_factory=list)
    unused: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class _Edge:
    """What one connection does: it leads from a place to another."""

    start: Place
    end: Place
    link: Link


def flatten(system: Nest) -> Flat:
    """Return a system without systems within; `StructureError`, with document and line, for what does not fit."""
    return _Flattening(system).flat


class _Flattening:
    """The walk through the systems, first of connections, then of parameters."""

    def __init__(self, system: Nest):
        self.flat = Flat()
        self._ports: dict[Place, Port] = {}
        self._into: dict[Place, _Edge] = {}
        self._out: dict[Place, list[_Edge]] = {}
        self._buses: dict[Path, str] = {}
        self._connect(system, (), ())
        self._check_circles()
        for end in self._into:
            if end[0] in self.flat.parts:
                self._join(end)
        self.flat.outputs = list(self._offered(system))
        self._set(system, ())

    # Connections -------------------------------------------------------------------------------------------------

    def _connect(self, system: Nest, path: Path, known: tuple[tuple[str, Path], ...]) -> None:
        """Collect the components and connections of a system and of those within."""
        known = (*known, *((name, (*path, f"dictionary {name}")) for name in system.dictionaries))
        elements = {element.name: element for element in system.elements}
        homes = {name: self._home(element, (*path, name), known) for name, element in elements.items()}
        self._ports |= {(path, name): port for name, port in system.ports.items()}
        for name, element in elements.items():
            inside = (*path, name)
            if isinstance(element, Part):
                self.flat.parts[inside] = element
                self.flat.starts[inside] = {}
            elif isinstance(element, Nest):
                self._connect(element, inside, known)
        for link in system.links:
            self._add(link, system, path, elements, homes)

    def _home(self, element: Part | Bus | Nest, path: Path, known: tuple[tuple[str, Path], ...]) -> Path:
        """Return the path of an element's connectors, which all references to one dictionary share."""
        if not isinstance(element, Bus):
            return path
        for name, home in reversed(known):
            if name == element.dictionary:
                return home
        raise StructureError(
            f"{element.place}: no signal dictionary is called {element.dictionary!r}"
            f"{nearest(element.dictionary, [name for name, _ in known])}"
        )

    def _add(
        self,
        link: Link,
        system: Nest,
        path: Path,
        elements: Mapping[str, Part | Bus | Nest],
        homes: Mapping[str, Path],
    ) -> None:
        """Add a connection of a system, from source to sink."""
        gives = [_gives(link, end, system, elements) for end in (link.start, link.end)]
        first, second = gives
        if first is not None and first is second:
            words = "give a value" if first else "take one"
            raise StructureError(f"{link.place}: {_shown(link.start)} and {_shown(link.end)} both {words}")
        is_turned = first is False or second is True
        ends = [((path if element is None else homes[element]), name) for element, name in (link.start, link.end)]
        start, end = ends[::-1] if is_turned else ends
        if end in self._into:
            raise StructureError(
                f"{link.place}: {'.'.join((*end[0], end[1]))} is fed twice, also by {self._into[end].link.place}"
            )
        edge = _Edge(start, end, link)
        self._into[end] = edge
        self._out.setdefault(start, []).append(edge)

    def _check_circles(self) -> None:
        """Raise `StructureError` where connectors of systems feed each other in a circle, without an FMU."""
        sound: set[Place] = set()
        for place in self._into:
            way: set[Place] = set()
            while place in self._into and place not in sound:
                if place in way:
                    raise StructureError(f"{self._into[place].link.place}: the connection feeds itself")
                way.add(place)
                place = self._into[place].start
                if place[0] in self.flat.parts:
                    break
            sound |= way

    def _join(self, end: Place) -> None:
        """Add the connection that feeds an input of an FMU, if it begins at an FMU."""
        edges: list[_Edge] = []
        place = end
        while place in self._into:
            edge = self._into[place]
            edges.append(edge)
            place = edge.start
            if place[0] in self.flat.parts:
                map_, _ = self._along(edges[::-1], self._unit(place))
                self.flat.joins.append(Join(place, end, map_, edges[0].link.place))
                return

    def _along(self, edges: list[_Edge], unit: Unit | None) -> tuple[Affine, Unit | None]:
        """Return the map along connections, from a value in a unit, and the unit at their end."""
        found = IDENTITY
        for edge in edges:
            own = self._unit(edge.end)
            if edge.link.is_converted:
                found = found.then(conversion(unit, own, edge.link.place))
            found = found.then(edge.link.after)
            unit = own or unit
        return found, unit

    def _unit(self, place: Place) -> Unit | None:
        """Return the unit of a connector: of an FMU's variable, else as declared."""
        path, name = place
        port = self._ports.get(place)
        if path not in self.flat.parts:
            return port.unit if port else None
        part = self.flat.parts[path]
        declared = part.ports[name].unit if name in part.ports else None
        variable = describe(part.file).variables.get(name)
        base = None if variable is None else variable.base_unit or known_base(variable.unit)
        if variable is None or base is None:
            return declared
        own = Unit(variable.unit or "", base)
        if declared is not None and not conversion(declared, own, part.place).is_identity:
            raise StructureError(
                f"{part.place}: connector {name} of {part.name} is in {declared.name}, but the variable of the FMU "
                f"{part.file.name} is in {own.name}"
            )
        return own

    def _offered(self, system: Nest) -> Iterator[Place]:
        """Yield the outputs of FMUs that feed connectors of the outermost system."""
        for name in system.ports:
            place: Place = ((), name)
            while place in self._into and place[0] not in self.flat.parts:
                place = self._into[place].start
            if place[0] in self.flat.parts:
                yield place

    # Parameters --------------------------------------------------------------------------------------------------

    def _set(self, element: Part | Bus | Nest, path: Path) -> None:
        """Set the values bound to what is within an element, then its own, which count more."""
        if isinstance(element, Bus):
            return
        if isinstance(element, Nest):
            for inside in element.elements:
                self._set(inside, (*path, inside.name))
        for value in element.values:
            if not self._apply(element, path, value.name, value):
                self.flat.unused.append(f"{'.'.join((*path, value.name))} ({value.place})")

    def _apply(self, element: Part | Bus | Nest, path: Path, name: str, value: Value) -> bool:
        """Set what a name means within an element; return whether it means something."""
        if isinstance(element, Part):
            description = describe(element.file)
            if name not in description.variables:
                return False
            self._start((path, name), value, value.after, value.unit, value.is_converted)
            return True
        if isinstance(element, Bus):
            return False
        found = False
        if name in element.ports:
            unit = element.ports[name].unit
            number = value.value
            if is_number(number):
                converted = conversion(value.unit, unit, value.place) if value.is_converted else IDENTITY
                number = converted.then(value.after).applied(number)
            self._pass_on(
                (path, name), Value(name, number, unit or value.unit, value.place), IDENTITY, unit or value.unit
            )
            found = True
        for inside in element.elements:
            if name.startswith(f"{inside.name}."):
                within = name.removeprefix(f"{inside.name}.")
                found |= self._apply(inside, (*path, inside.name), within, value)
        return found

    def _pass_on(self, place: Place, value: Value, map_: Affine, unit: Unit | None) -> None:
        """Set the start values of all inputs and parameters of FMUs that a connector of a system feeds."""
        waiting = [(place, map_, unit)]
        while waiting:
            place, map_, unit = waiting.pop()
            for edge in self._out.get(place, ()):
                further, own = self._along([edge], unit)
                if edge.end[0] in self.flat.parts:
                    self._start(edge.end, value, map_.then(further), None, False)
                else:
                    waiting.append((edge.end, map_.then(further), own))

    def _start(self, place: Place, value: Value, after: Affine, unit: Unit | None, is_converted: bool) -> None:
        """Set the start value of a variable of an FMU."""
        path, name = place
        number = value.value
        if is_number(number):
            own = conversion(unit, self._unit(place), value.place) if is_converted else IDENTITY
            number = own.then(after).applied(number)
        elif not after.is_identity:
            raise StructureError(f"{value.place}: {name} is {number!r}, expected a number, which a mapping transforms")
        self.flat.starts[path][name] = number


def _gives(
    link: Link, end: tuple[str | None, str], system: Nest, elements: Mapping[str, Part | Bus | Nest]
) -> bool | None:
    """Return whether an end of a connection gives a value inside the system, `None` where it may do either."""
    element, name = end
    if element is None:
        if name not in system.ports:
            raise StructureError(
                f"{link.place}: the system {system.name} has no connector {name!r}{nearest(name, system.ports)}"
            )
        kind = system.ports[name].kind
        return None if kind not in (*_GIVING, *_TAKING) else kind in _TAKING
    if element not in elements:
        raise StructureError(f"{link.place}: no element is called {element!r}{nearest(element, elements)}")
    found = elements[element]
    kind = found.ports[name].kind if name in found.ports else None
    if isinstance(found, Part):
        kind = _causality(describe(found.file), found, name, link)
    elif name not in found.ports:
        raise StructureError(f"{link.place}: {element} has no connector {name!r}{nearest(name, found.ports)}")
    return None if kind not in (*_GIVING, *_TAKING) else kind in _GIVING


def _causality(description: Description, part: Part, name: str, link: Link) -> str:
    """Return the causality of a variable of an FMU."""
    if name not in description.variables:
        raise StructureError(
            f"{link.place}: {part.name} ({part.file.name}) has no variable {name!r}"
            f"{nearest(name, description.variables)}"
        )
    return description.variables[name].causality


def _shown(end: tuple[str | None, str]) -> str:
    """Return an end of a connection as one reads it."""
    element, name = end
    return name if element is None else f"{element}.{name}"
