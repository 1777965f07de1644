"""The system: which FMUs, and which signal feeds which, in the words of SSP.

    system = System(
        components=[Component("reference", "sdelta_reference"), Component("robot", "sdelta", "cartesian")],
        connections=[Connection("reference.drive[1..3].slide", "robot.drive[1..3].slide")],
    )

Everything here is plain frozen data. A connection between two ranges joins their members pairwise. The order of the
components is the order in which a co-simulation algorithm steps them.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import expand, nearest, reorder

_COMPONENT = re.compile(r"^[A-Za-z_]\w*(\[[1-9]\d*\])?$")


@dataclass(frozen=True)
class Analysis:
    """A start value that a part's analysis gives: `Analysis("sdelta_tuning", "motor_angles[3..4]")`.

    `key` is one of the analysis' results, a number or, with a range, members of an array counted from 1; `arguments`
    are the analysis' own. `build.load_scene` puts the numbers in its place.
    """

    part: str
    key: str
    arguments: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Component:
    """One FMU of a system: `part` is the name of a part, or the path of a foreign `.fmu` file.

    `arguments` are structural (they choose the FMU), `start` are values of its variables at the start of a run, in the
    variables' units. A name with a range takes one value for all members, or a list, or an `Analysis`; `computed` are
    the analyses that start values have come from, by name.

    One FMU may be made of several parts (`assembly/fuse.py`): it has `members` then, and `connections` between them,
    its variables are named `member.variable`, and `part` only says what it is made of.
    """

    name: str
    part: str
    level: str | None = None
    arguments: Mapping[str, Any] = field(default_factory=dict)
    start: Mapping[str, Any] = field(default_factory=dict)
    members: Sequence["Component"] = ()
    connections: Sequence["Connection"] = ()
    computed: Mapping[str, Analysis] = field(default_factory=dict, compare=False)

    def __post_init__(self):
        if not _COMPONENT.match(self.name):
            raise StructureError(f"component name {self.name!r} is not an identifier, such as robot or drive[1]")
        arguments = {name: tuple(v) if isinstance(v, list) else v for name, v in self.arguments.items()}
        object.__setattr__(self, "arguments", arguments)
        object.__setattr__(self, "start", _members(self.name, self.start))

    def variable(self, member: str, name: str) -> str:
        """Return what the variable `name` of a member is called in the FMU; the clock and the solver are common."""
        return name if name == "sample_time" or name.startswith("solver.") else f"{member}.{name}"


@dataclass(frozen=True)
class Connection:
    """The output `start` feeds the input `end`; both are full names."""

    start: str
    end: str

    def __str__(self) -> str:
        return f"{self.start} -> {self.end}"


@dataclass(frozen=True)
class System:
    """Components and the connections between them; ranges in connections are expanded."""

    components: Sequence[Component]
    connections: Sequence[Connection] = ()

    def __post_init__(self):
        pairs = [pair for connection in self.connections for pair in _pairwise(connection)]
        object.__setattr__(self, "components", tuple(self.components))
        object.__setattr__(self, "connections", tuple(pairs))
        names = [component.name for component in self.components]
        for name in names:
            if names.count(name) > 1:
                raise StructureError(f"two components are called {name}; every component needs a name of its own")
        fed: dict[str, Connection] = {}
        for connection in pairs:
            for end in (connection.start, connection.end):
                self.split(end)
            if connection.end in fed:
                other = fed[connection.end]
                raise StructureError(f"input {connection.end} is fed twice: by {other.start} and by {connection.start}")
            fed[connection.end] = connection

    def __getitem__(self, name: str) -> Component:
        """Return the component of that name; `StructureError` with the nearest names if there is none."""
        if name not in self._named:
            raise StructureError(f"no component is called {name!r}{nearest(name, self._named)}")
        return self._named[name]

    @cached_property
    def _named(self) -> dict[str, Component]:
        """Components by name."""
        return {component.name: component for component in self.components}

    @cached_property
    def _wholes(self) -> dict[str, Component]:
        """Components that members are fused into, by the member's name."""
        return {member.name: whole for whole in self.components for member in whole.members}

    def split(self, name: str) -> tuple[str, str]:
        """Return (component, variable) of a full name; `StructureError` if there is no such component.

        `member.variable` is a full name as well, of a variable of the component that the member is fused into.
        """
        component, dot, variable = name.partition(".")
        if not dot:
            raise StructureError(f"{name!r} is not a full name; expected component.variable")
        if component in self._wholes:
            return self._wholes[component].name, self._wholes[component].variable(component, variable)
        return self[component].name, variable

    @property
    def unfused(self) -> "System":
        """The system with members in the place of the component that they are fused into."""
        inside = [connection for whole in self.components for connection in whole.connections]
        between = [Connection(*map(self.own_name, (c.start, c.end))) for c in self.connections]
        return System([part for whole in self.components for part in whole.members or (whole,)], [*inside, *between])

    def own_name(self, name: str) -> str:
        """Return a full name as it was before components were fused: `fused.robot.angle` -> `robot.angle`."""
        component, variable = self.split(name)
        is_of_member = any(variable.startswith(f"{member.name}.") for member in self[component].members)
        return variable if is_of_member else name


def in_order(system: System, names: Sequence[str]) -> System:
    """Return the system whose components of these names stand in this order; errors and places as `reorder`."""
    order = reorder([component.name for component in system.components], names)
    return System([system[name] for name in order], system.connections)


def _members(component: str, start: Mapping[str, Any]) -> dict[str, Any]:
    """Return start values member by member; those of an `Analysis` still under the name with its range."""
    members: dict[str, Any] = {}
    for name, value in start.items():
        if isinstance(value, Analysis | Mapping):
            members[name] = value if isinstance(value, Analysis) else Analysis(**value)
            continue
        names = expand(name)
        values = value if isinstance(value, list | tuple) else [value] * len(names)
        if len(values) != len(names):
            raise StructureError(f"{component}.{name} has {len(values)} start values, expected {len(names)}")
        members |= dict(zip(names, values, strict=True))
    return members


def _pairwise(connection: Connection) -> list[Connection]:
    """Return the connections between the members of two ranges, or of two names."""
    starts, ends = expand(connection.start), expand(connection.end)
    if len(starts) != len(ends):
        raise StructureError(
            f"connection {connection} joins {len(starts)} output(s) to {len(ends)} input(s); ranges must be of one size"
        )
    return [Connection(start, end) for start, end in zip(starts, ends, strict=True)]
