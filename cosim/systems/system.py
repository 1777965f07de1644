"""System of FMU components and connections, in the terms of SSP (System Structure and Parameterization).

    system = System(
        components=[Component("reference", "sdelta_reference"), Component("robot", "sdelta", "cartesian")],
        connections=[Connection("reference.drive[1..3].slide", "robot.drive[1..3].slide")],
    )

All classes are frozen. A connection between two ranges joins their members pairwise. The order of the components is
the order in which a co-simulation algorithm steps them.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.kinds import instances, is_number, refuse, table, text
from hfsa.cosim.systems.names import expand, nearest, reorder, repeated

_COMPONENT = re.compile(r"^[A-Za-z_]\w*(\[[1-9]\d*\])?\Z")

CONVENTIONS = "hfsa"
"""Conventions of names that a scene may declare of an FMU of another maker."""

_KEY = re.compile(r"^[^\[\]]+(\[[1-9]\d*(\.\.[1-9]\d*)?\])?$")


@dataclass(frozen=True)
class Analysis:
    """Start value computed by the analysis of a part: `Analysis("sdelta_tuning", "motor_angles[3..4]")`.

    `key` is a result of the analysis, a number or, with a range, members of an array counted from 1; `arguments` are
    arguments of the analysis. `assembly.load_scene` replaces it by the numbers.
    """

    part: str
    key: str
    arguments: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self):
        text("the part of an analysis", self.part, "the name or path of a part")
        if not _KEY.match(text("the key of an analysis", self.key, "the name of a result")):
            refuse("the key of an analysis", self.key, "the name of a result, such as angle or angles[3..4]")
        table("the arguments of an analysis", self.arguments, "a table of arguments")


@dataclass(frozen=True)
class Component:
    """FMU of a system: `part` is the name or path of a part, or the path of a foreign `.fmu` file.

    `arguments` are structural (they select the FMU), `start` are start values of its variables in their units. A name
    with a range has one value for all members, or a list, or an `Analysis`; `computed` holds the analyses that gave
    start values, by name.

    `conventions` is `hfsa` for an FMU of another maker whose names mean what ours mean: an input `x_rate` is the
    derivative of `x`, an output `saturated` a limit flag, a parameter `sample_time` the time between ticks.

    With `calls="strict"` no output is fetched after an input was set without a step between, FMI 2's order: all outputs
    are those of the end of the step, also where the FMU does not declare that they follow no input at once.

    A pruned component (`assembly/prune.py`) has an FMU with the inputs, states and outputs named in `kept` alone.

    An FMU fused from several parts (`assembly/fuse.py`) has `members` and `connections` between them; its variables
    are named `member.variable`, and `part` is a description only.
    """

    name: str
    part: str
    level: str | None = None
    arguments: Mapping[str, Any] = field(default_factory=dict)
    start: Mapping[str, Any] = field(default_factory=dict)
    members: Sequence["Component"] = ()
    connections: Sequence["Connection"] = ()
    computed: Mapping[str, Analysis] = field(default_factory=dict, compare=False)
    kept: tuple[str, ...] | None = None
    conventions: str | None = None
    calls: str | None = None

    @property
    def is_foreign(self) -> bool:
        """Whether the part is an FMU file."""
        return self.part.endswith(".fmu")

    def __post_init__(self):
        if not (isinstance(self.name, str) and _COMPONENT.match(self.name)):
            raise StructureError(f"component name {self.name!r} is not an identifier, such as robot or drive[1]")
        label = f"component {self.name}"
        text(f"{label}: part", self.part, "the name or path of a part")
        if self.level is not None:
            text(f"{label}: level", self.level, "the name of a level")
        if self.conventions not in (None, CONVENTIONS):
            raise StructureError(f"{label}: conventions are {self.conventions!r}, expected {CONVENTIONS!r} or none")
        if self.calls not in (None, "strict"):
            refuse(f"{label}: calls", self.calls, '"strict" or nothing')
        arguments = table(f"{label}: arguments", self.arguments, "a table of arguments")
        arguments = {name: tuple(v) if isinstance(v, list) else v for name, v in arguments.items()}
        object.__setattr__(self, "arguments", arguments)
        start = table(f"{label}: start", self.start, "a table of start values")
        object.__setattr__(self, "start", _members(self.name, start, self.is_foreign))
        object.__setattr__(self, "members", instances(f"{label}: members", self.members, Component))
        object.__setattr__(self, "connections", instances(f"{label}: connections", self.connections, Connection))
        table(f"{label}: computed", self.computed, "a table of analyses")

    def variable(self, member: str, name: str) -> str:
        """Return the name of a member's variable in the fused FMU; all members share sample time and solver."""
        return name if name == "sample_time" or name.startswith("solver.") else f"{member}.{name}"


@dataclass(frozen=True)
class Connection:
    """Connection of the output `start` to the input `end`, both full names.

    The input is factor * output + offset, the linear transformation of SSP (`transformations.py`); without one it is
    the output, converted where the units differ.
    """

    start: str
    end: str
    factor: float = 1.0
    offset: float = 0.0

    def __post_init__(self):
        text("start of a connection", self.start, "the full name of an output")
        text(f"end of the connection from {self.start}", self.end, "the full name of an input")
        for label in ("factor", "offset"):
            value = getattr(self, label)
            if not (is_number(value) and math.isfinite(value)):
                refuse(f"the {label} of connection {self}", value, "a finite number")
            object.__setattr__(self, label, float(value))

    @property
    def is_transformed(self) -> bool:
        """Whether it has a factor or an offset."""
        return (self.factor, self.offset) != (1.0, 0.0)

    def __str__(self) -> str:
        return f"{self.start} -> {self.end}"


@dataclass(frozen=True)
class System:
    """Components and connections; ranges in connections are expanded."""

    components: Sequence[Component]
    connections: Sequence[Connection] = ()

    def __post_init__(self):
        connections = instances("connections", self.connections, Connection)
        pairs = [pair for connection in connections for pair in _pairwise(connection)]
        object.__setattr__(self, "components", instances("components", self.components, Component))
        object.__setattr__(self, "connections", tuple(pairs))
        if (twice := repeated(component.name for component in self.components)) is not None:
            raise StructureError(f"two components are called {twice}; every component needs a name of its own")
        fed: dict[str, Connection] = {}
        for connection in pairs:
            for end in (connection.start, connection.end):
                self.split(end)
            if connection.end in fed:
                other = fed[connection.end]
                raise StructureError(f"input {connection.end} is fed twice: by {other.start} and by {connection.start}")
            fed[connection.end] = connection

    def __getitem__(self, name: str) -> Component:
        """Return the component with a name; `StructureError` with the nearest names if there is none."""
        if name not in self._named:
            raise StructureError(f"no component is called {name!r}{nearest(name, self._named)}")
        return self._named[name]

    @cached_property
    def _named(self) -> dict[str, Component]:
        """Components by name."""
        return {component.name: component for component in self.components}

    @cached_property
    def _wholes(self) -> dict[str, Component]:
        """Fused components by the name of each member."""
        return {member.name: whole for whole in self.components for member in whole.members}

    def split(self, name: str) -> tuple[str, str]:
        """Return (component, variable) of a full name; `StructureError` if there is no such component.

        `member.variable` is a full name as well: that of a variable of the fused component.
        """
        component, dot, variable = text("a full name", name).partition(".")
        if not dot:
            raise StructureError(f"{name!r} is not a full name; expected component.variable")
        if component in self._wholes:
            return self._wholes[component].name, self._wholes[component].variable(component, variable)
        return self[component].name, variable

    @property
    def unfused(self) -> "System":
        """The system with every fused component replaced by its members."""
        inside = [connection for whole in self.components for connection in whole.connections]
        between = [replace(c, start=self.own_name(c.start), end=self.own_name(c.end)) for c in self.connections]
        return System([part for whole in self.components for part in whole.members or (whole,)], [*inside, *between])

    def own_name(self, name: str) -> str:
        """Return a full name as in the system before fusing: `fused.robot.angle` -> `robot.angle`."""
        component, variable = self.split(name)
        is_of_member = any(variable.startswith(f"{member.name}.") for member in self[component].members)
        return variable if is_of_member else name


def in_order(system: System, names: Sequence[str]) -> System:
    """Return the system with its components in another order; `names` and errors as of `reorder`."""
    order = reorder([component.name for component in system.components], names)
    return System([system[name] for name in order], system.connections)


def _members(component: str, start: Mapping[str, Any], is_foreign: bool) -> dict[str, Any]:
    """Return start values by member; an `Analysis` keeps its name with the range.

    Variables of a foreign FMU may be texts and Booleans.
    """
    members: dict[str, Any] = {}
    for name, value in start.items():
        if isinstance(value, Analysis | Mapping):
            members[name] = value if isinstance(value, Analysis) else _analysis(f"{component}.{name}", value)
            continue
        names = expand(name)
        values = value if isinstance(value, list | tuple) else [value] * len(names)
        if len(values) != len(names):
            raise StructureError(f"{component}.{name} has {len(values)} start values, expected {len(names)}")
        if not all(is_number(v) or (is_foreign and isinstance(v, bool | str)) for v in values):
            refuse(f"{component}.{name}", value, "a number, or a list of numbers for a range")
        members |= dict(zip(names, values, strict=True))
    return members


def _analysis(label: str, value: Mapping[str, Any]) -> Analysis:
    """Return the analysis that a table stands for; `label` is the start value."""
    if not {"part", "key"} <= set(value) <= {"part", "key", "arguments"}:
        refuse(label, value, "a number, or an analysis with the keys part, key and, if need be, arguments")
    try:
        return Analysis(**value)
    except StructureError as error:
        raise StructureError(f"{label}: {error}") from None


def _pairwise(connection: Connection) -> list[Connection]:
    """Return the connections between the members of two ranges, or between two names."""
    starts, ends = expand(connection.start), expand(connection.end)
    if len(starts) != len(ends):
        raise StructureError(
            f"connection {connection} joins {len(starts)} output(s) to {len(ends)} input(s); ranges must be of one size"
        )
    return [replace(connection, start=start, end=end) for start, end in zip(starts, ends, strict=True)]
