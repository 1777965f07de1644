"""A system structure as plain data: systems within systems, components, connectors, connections, parameter values."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hfsa.cosim.ssp.units import IDENTITY, Affine, Unit


@dataclass(frozen=True)
class Port:
    """Connector of an element; its kind and unit are `None` where the document leaves them to the FMU."""

    name: str
    kind: str | None
    unit: Unit | None


@dataclass(frozen=True)
class Value:
    """Value of a parameter, by its name as seen from the element that it is bound to.

    `is_converted` is whether it is converted to the unit of what it sets; `after` is applied after that.
    """

    name: str
    value: Any
    unit: Unit | None
    place: str
    is_converted: bool = True
    after: Affine = IDENTITY


@dataclass(frozen=True)
class Link:
    """Connection between two connectors of a system or its elements; an element `None` is the system itself."""

    start: tuple[str | None, str]
    end: tuple[str | None, str]
    place: str
    is_converted: bool = True
    after: Affine = IDENTITY


@dataclass(frozen=True)
class Part:
    """Component with an FMU."""

    name: str
    file: Path
    place: str
    ports: Mapping[str, Port] = field(default_factory=dict)
    values: tuple[Value, ...] = ()


@dataclass(frozen=True)
class Bus:
    """Reference to a signal dictionary; all references to one dictionary share its signals.

    Attributes:
        dictionary: name of the dictionary, looked up from the system of the reference outwards.
    """

    name: str
    dictionary: str
    place: str
    ports: Mapping[str, Port] = field(default_factory=dict)


@dataclass(frozen=True)
class Nest:
    """System within a package; `dictionaries` are the names of its signal dictionaries."""

    name: str
    place: str
    elements: "tuple[Part | Bus | Nest, ...]" = ()
    links: tuple[Link, ...] = ()
    ports: Mapping[str, Port] = field(default_factory=dict)
    values: tuple[Value, ...] = ()
    dictionaries: tuple[str, ...] = ()


@dataclass(frozen=True)
class Experiment:
    """What a package says of its simulation: times [s], and a step [s] from the annotations of tools."""

    start_time: float = 0.0
    stop_time: float | None = None
    step_size: float | None = None
    ours: str | None = None
    foreign: tuple[str, ...] = ()


@dataclass(frozen=True)
class Structure:
    """A package: its system, and its experiment. `annotations` of foreign tools are named in `Experiment.foreign`."""

    system: Nest
    experiment: Experiment
