"""From the XML of a package to its structure: documents are found, parsed, and put into plain data.

Components that are systems themselves, a description or a package, stand there as systems. Their own units and paths
count from their own document.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath

from hfsa.cosim.archives.archive import Archive, resolved
from hfsa.cosim.archives.limits import MOST_ENTRIES
from hfsa.cosim.archives.xml import Node, at, attribute, children, flag, is_of, local, parse
from hfsa.cosim.ssp.experiment import read_experiment
from hfsa.cosim.ssp.parameters import bound_values, transformation
from hfsa.cosim.ssp.structure import Bus, Link, Nest, Part, Port, Structure
from hfsa.cosim.ssp.units import Unit, read_units, unit_named
from hfsa.cosim.ssp.vocabulary import FMU_TYPE, MAIN, PACKAGE_TYPE, SSC, SSD, STRUCTURE_TYPE
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import repeated

Keep = Callable[[str, bytes], Path]
"""Function that keeps an FMU, a name and its content, and returns its file."""

_DEEPEST, _DEEPEST_SYSTEMS = 20, 100
"""Most packages and descriptions within each other, and most systems."""


def read_structure(content: bytes, where: str, keep: Keep) -> Structure:
    """Return the structure of a package; `where` names it in messages.

    `StructureError`, with document and line, for what is no SSP that can be simulated.
    """
    archive = Archive(content, where)
    document = _Document(archive, MAIN, keep, _Total(where), 0, 0, where)
    return Structure(document.system(), read_experiment(document.root, document.where))


@dataclass
class _Total:
    """What a package and those in it hold: each is read once, but its elements count as often as it is used."""

    where: str
    count: int = 0
    _archives: dict[tuple[Archive, str], Archive] = field(default_factory=dict)
    _roots: dict[tuple[Archive, str], Node] = field(default_factory=dict)

    def archive(self, outer: Archive, entry: str, place: str) -> Archive:
        """Return the package in an entry of another."""
        if (outer, entry) not in self._archives:
            self._archives[outer, entry] = Archive(outer.read(entry, place), f"{outer.where}: {entry}")
        return self._archives[outer, entry]

    def root(self, archive: Archive, entry: str, place: str) -> Node:
        """Return the root of a document."""
        if (archive, entry) not in self._roots:
            self._roots[archive, entry] = parse(archive.read(entry, place), f"{archive.where}: {entry}")
        return self._roots[archive, entry]

    def add(self) -> None:
        """Count an element; `StructureError` for one too many."""
        self.count += 1
        if self.count > MOST_ENTRIES.value:
            raise StructureError(
                f"{self.where} has more than {MOST_ENTRIES.value} elements, those of a description counted as often as "
                f"it is used; {MOST_ENTRIES.advice}"
            )


@dataclass
class _Document:
    """A system structure description in an archive, with `depth` documents and `systems` systems around it."""

    archive: Archive
    name: str
    keep: Keep
    total: _Total
    depth: int
    systems: int
    place: str

    def __post_init__(self):
        self.where = f"{self.archive.where}: {self.name}"
        self._fmus: dict[str, Path] = {}
        if self.depth > _DEEPEST:
            raise StructureError(f"{self.where} lies {self.depth} descriptions deep, expected at most {_DEEPEST}")
        self.root = self.total.root(self.archive, self.name, self.place)
        if not is_of(self.root, SSD, "SystemStructureDescription"):
            raise StructureError(f"{self.where}: the document is {self.root.tag}, expected one of {SSD}")
        version = attribute(self.root, "version", self.where)
        if not version.startswith(("1.", "2.")):
            raise StructureError(f"{self.where} is of SSP version {version}, expected 1.0 or 2.0")
        self._units = read_units(self.root.findall(f"{{{SSD}}}Units"), self.where)

    def system(self) -> Nest:
        """Return the system of the document."""
        node = self.root.find(f"{{{SSD}}}System")
        if node is None:
            raise StructureError(f"{self.where} has no System")
        return self._nest(node, self.systems)

    def _nest(self, node: Node, around: int) -> Nest:
        """Return a system with a number of systems around it."""
        place = at(self.where, node)
        if around >= _DEEPEST_SYSTEMS:
            raise StructureError(f"{place}: more than {_DEEPEST_SYSTEMS} systems lie within each other")
        elements = tuple(self._elements(node, around + 1))
        if (twice := repeated(element.name for element in elements)) is not None:
            raise StructureError(f"{place}: two elements are called {twice}, expected names of their own")
        known = [
            attribute(d, "name", self.where) for d in children(node, SSD, "SignalDictionaries", "SignalDictionary")
        ]
        links = tuple(self._link(child) for child in children(node, SSD, "Connections", "Connection"))
        name, values = node.get("name") or "system", bound_values(node, self.where, self._document_of)
        return Nest(name, place, elements, links, self._ports(node), values, tuple(known))

    def _elements(self, node: Node, around: int) -> Iterator[Part | Bus | Nest]:
        """Yield the elements of a system, in their order, with a number of systems around them."""
        for group in node.findall(f"{{{SSD}}}Elements"):
            for child in group:
                self.total.add()
                name, place = attribute(child, "name", self.where), at(self.where, child)
                if is_of(child, SSD, "System"):
                    yield self._nest(child, around)
                elif is_of(child, SSD, "Component"):
                    yield self._component(child, name, around)
                elif is_of(child, SSD, "SignalDictionaryReference"):
                    dictionary = attribute(child, "dictionary", self.where)
                    yield Bus(name, dictionary, place, self._ports(child))
                else:
                    raise StructureError(f"{place}: an element is {child.tag}, expected a Component or a System")

    def _component(self, node: Node, name: str, around: int) -> Part | Nest:
        """Return a component: that of an FMU, or the system of another document; with a number of systems around."""
        place = at(self.where, node)
        source = attribute(node, "source", self.where)
        kind = node.get("type") or {".ssd": STRUCTURE_TYPE, ".ssp": PACKAGE_TYPE}.get(
            PurePosixPath(source).suffix, FMU_TYPE
        )
        if kind not in (FMU_TYPE, STRUCTURE_TYPE, PACKAGE_TYPE):
            raise StructureError(f"{place}: component {name} is of type {kind}, expected {FMU_TYPE}")
        entry = resolved(source, self.name, place)
        values = bound_values(node, self.where, self._document_of)
        if kind == FMU_TYPE:
            return Part(name, self._fmu(entry, place), place, self._ports(node), values)
        archive, main = self.archive, entry
        if kind == PACKAGE_TYPE:
            archive, main = self.total.archive(self.archive, entry, place), MAIN
        inside = _Document(archive, main, self.keep, self.total, self.depth + 1, around, place).system()
        return replace(inside, name=name, ports={**inside.ports, **self._ports(node)}, values=inside.values + values)

    def _fmu(self, entry: str, place: str) -> Path:
        """Return the file of an FMU, kept once for all components of it in the document."""
        if entry not in self._fmus:
            stem = PurePosixPath(entry).name
            self._fmus[entry] = self.keep(
                stem if stem.endswith(".fmu") else f"{stem}.fmu", self.archive.read(entry, place)
            )
        return self._fmus[entry]

    def _ports(self, node: Node) -> dict[str, Port]:
        """Return the connectors of an element by name."""
        ports = {}
        for child in children(node, SSD, "Connectors", "Connector"):
            name = attribute(child, "name", self.where)
            typed = next((inside for inside in child if inside.tag.startswith(f"{{{SSC}}}")), None)
            ports[name] = Port(name, child.get("kind"), self._unit(typed))
        return ports

    def _unit(self, typed: Node | None) -> Unit | None:
        """Return the unit of a type, if it has one."""
        return None if typed is None else unit_named(typed.get("unit"), self._units)

    def _link(self, node: Node) -> Link:
        """Return a connection."""
        ends = [
            (node.get(f"{side}Element") or None, attribute(node, f"{side}Connector", self.where))
            for side in ("start", "end")
        ]
        for side in ("start", "end"):
            if node.get(f"{side}Indices"):
                raise StructureError(f"{at(self.where, node)}: {local(node)} joins members of arrays, expected scalars")
        is_converted = not flag(node, "suppressUnitConversion", self.where)
        return Link(ends[0], ends[1], at(self.where, node), is_converted, transformation(node, self.where))

    def _document_of(self, node: Node, where: str, place: str) -> tuple[Node, str]:
        """Return the document that the source of a parameter binding or mapping names, and what it is called."""
        base = node.get("sourceBase") or "SSD"
        if base not in ("SSD", "component"):
            raise StructureError(f"{place}: sourceBase is {base!r}, expected SSD or component")
        source = attribute(node, "source", where)
        if base == "component":
            raise StructureError(f"{place}: source {source!r} lies in the component, expected one beside the SSD")
        entry = resolved(source, self.name, place)
        document = f"{self.archive.where}: {entry}"
        return self.total.root(self.archive, entry, place), document
