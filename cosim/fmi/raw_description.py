"""What a modelDescription.xml says, as it stands there: one pass over a document of any length.

    raw = read_raw(stream, "Box.fmu: modelDescription.xml")
    raw.attributes["modelName"], raw.variables[0].name

References are not resolved and rules of the standards not applied; `soundness.py` and `description.py` do that.
"""

from dataclasses import dataclass, field
from typing import IO

from hfsa.cosim.archives.limits import MOST_VARIABLES
from hfsa.cosim.archives.xml_stream import read_elements
from hfsa.cosim.systems.connectors import NUMBERS
from hfsa.cosim.systems.errors import StructureError

INTERFACES = ("CoSimulation", "ModelExchange", "ScheduledExecution")
TYPES = {2: ("Real", "Integer", "Boolean", "String", "Enumeration"), 3: ()}
TYPES[3] = tuple(name for name in (*NUMBERS, "String", "Binary", "Clock") if name not in ("Real", "Integer"))
"""Types of variables of each version."""

_KEPT = ("Outputs", "Derivatives", "Output", "ContinuousStateDerivative", "EventIndicator")
"""Lists of ModelStructure that a run needs: those of FMI 2, and the elements of FMI 3."""


@dataclass(slots=True)
class RawVariable:
    """A variable: attributes as text, `None` where they are missing.

    `type` is the name of its element, `None` for one of FMI 2 without, `dimensions` are (attribute, text) each.
    """

    line: int
    name: str | None = None
    reference: str | None = None
    causality: str | None = None
    variability: str | None = None
    initial: str | None = None
    type: str | None = None
    unit: str | None = None
    declared: str | None = None
    start: str | None = None
    nominal: str | None = None
    min: str | None = None
    max: str | None = None
    relative: str | None = None
    derivative: str | None = None
    aliases: tuple[str, ...] = ()
    dimensions: tuple[tuple[str, str], ...] = ()


_SHARED = {
    **{word: word for word in ("causality", "variability", "initial", "unit", "start", "nominal", "min", "max")},
    "declaredType": "declared",
    "relativeQuantity": "relative",
    "derivative": "derivative",
}
"""Attributes that many variables have alike, by the name of the standards."""


@dataclass(frozen=True, slots=True)
class RawUnknown:
    """An unknown of ModelStructure: the list, its reference, and its dependencies, `None` where it states none."""

    line: int
    kind: str
    reference: str | None
    dependencies: str | None


@dataclass
class RawDescription:
    """A model description: attributes of its elements by the names of the standards."""

    attributes: dict[str, str] = field(default_factory=dict)
    interfaces: dict[str, dict[str, str]] = field(default_factory=dict)
    experiment: dict[str, str] = field(default_factory=dict)
    categories: list[str] = field(default_factory=list)
    units: dict[str, dict[str, str] | None] = field(default_factory=dict)
    types: dict[str, dict[str, str]] = field(default_factory=dict)
    variables: list[RawVariable] = field(default_factory=list)
    unknowns: list[RawUnknown] = field(default_factory=list)

    @property
    def version(self) -> int:
        """Version of FMI: 2 or 3."""
        return int(self.attributes["fmiVersion"][0])


def read_raw(stream: IO[bytes], where: str) -> RawDescription:
    """Return what a model description says; `StructureError`, with its line, where it is none of FMI 2 or 3."""
    reader = _Reader(where)
    read_elements(stream, where, reader.element)
    return reader.found


class _Reader:
    """Takes the elements of a description, in their order."""

    def __init__(self, where: str):
        self.where = where
        self.found = RawDescription()
        self._most = MOST_VARIABLES.value
        self._texts: dict[str, str] = {}
        self._groups = {
            "ModelVariables": self._variable,
            "ModelStructure": self._unknown,
            "UnitDefinitions": self._unit,
            "TypeDefinitions": self._type,
            "LogCategories": self._category,
        }
        self._name, self._version = "", 0

    def element(self, path: list[str], attributes: dict[str, str], line: int) -> None:
        """Take an element."""
        depth = len(path)
        if depth > 2:
            if (take := self._groups.get(path[1])) is not None:
                take(path, attributes, line)
        elif depth == 1:
            self._root(path[0], attributes)
        else:
            if path[1] in INTERFACES:
                self.found.interfaces[path[1]] = attributes
            elif path[1] == "DefaultExperiment":
                self.found.experiment = attributes

    def _root(self, name: str, attributes: dict[str, str]) -> None:
        version = attributes.get("fmiVersion")
        if name != "fmiModelDescription" or version is None or not version.startswith(("2.", "3.")):
            raise StructureError(f"{self.where} is of FMI version {version}; expected 2.0 or 3.0")
        self.found.attributes = attributes
        self._version = self.found.version

    def _variable(self, path: list[str], attributes: dict[str, str], line: int) -> None:
        depth, name = len(path), path[-1]
        if depth == 3:
            self._new_variable(name, attributes, line)
        elif depth == 4 and self._version == 2:
            if name in TYPES[2] or (name != "Annotations" and self.found.variables[-1].type is None):
                self._value(name, attributes)
        elif depth == 4:
            variable = self.found.variables[-1]
            if name == "Dimension":
                variable.dimensions += tuple(attributes.items())[:1]
            elif name == "Alias":
                variable.aliases += (attributes.get("name", ""),)
            elif name == "Start":
                variable.start = attributes.get("value")

    def _new_variable(self, name: str, attributes: dict[str, str], line: int) -> None:
        if len(self.found.variables) == self._most:
            raise StructureError(
                f"{self.where}, line {line}: there are more than {self._most} variables; {MOST_VARIABLES.advice}"
            )
        self.found.variables.append(RawVariable(line, attributes.get("name"), attributes.get("valueReference")))
        self._value(name if self._version == 3 else None, attributes)

    def _value(self, kind: str | None, attributes: dict[str, str]) -> None:
        """Take the type of the last variable, and the attributes that many variables have alike, as one object."""
        variable = self.found.variables[-1]
        variable.type = kind
        for word, text in attributes.items():
            if word in _SHARED:
                setattr(variable, _SHARED[word], self._texts.setdefault(text, text))

    def _unknown(self, path: list[str], attributes: dict[str, str], line: int) -> None:
        kind, word = path[2], "index" if self._version == 2 else "valueReference"
        if kind in _KEPT and len(path) == (4 if word == "index" else 3):
            get = attributes.get
            self.found.unknowns.append(RawUnknown(line, kind, get(word), get("dependencies")))

    def _unit(self, path: list[str], attributes: dict[str, str], _line: int) -> None:
        if len(path) == 3:
            self._name = attributes.get("name", "")
            self.found.units[self._name] = None
        elif path[3] == "BaseUnit" and len(path) == 4:
            self.found.units[self._name] = attributes

    def _type(self, path: list[str], attributes: dict[str, str], _line: int) -> None:
        if len(path) == 3:
            self._name = attributes.get("name", "")
            self.found.types[self._name] = attributes
        elif len(path) == 4 and path[3] in TYPES[2] and self._version == 2:
            self.found.types[self._name] = attributes

    def _category(self, path: list[str], attributes: dict[str, str], _line: int) -> None:
        if len(path) == 3:
            self.found.categories.append(attributes.get("name", ""))
