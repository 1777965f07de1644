"""The system: which FMUs, which signal feeds which, in the words of SSP; and the scene, a system with a question to it.

    system = System(
        components=[Component("reference", "sdelta_reference"), Component("robot", "sdelta", "cartesian")],
        connections=[Connection("reference.drive[1..3].slide", "robot.drive[1..3].slide")],
    )
    check(system, connectors)            # against the FMUs' descriptions, before anything runs

Everything here is plain frozen data. A full name is `component.variable`; a range in it, `drive[1..3]`, stands for its
members in order, and a connection between two ranges joins them pairwise. The components' order is the order in which a
co-simulation algorithm steps them.
"""

import difflib
import itertools
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from functools import cached_property
from typing import Any

HELD = ("gauss_seidel", "jacobi", "jacobi_plain")
"""Algorithms that hold inputs over a communication step."""
EXTRAPOLATED = ("gauss_seidel_linear", "gauss_seidel_quadratic", "jacobi_linear", "jacobi_quadratic")
"""Algorithms that let inputs move over a step, on lines or parabolas."""
ITERATED = ("fixed_point", "quasi_newton")
"""Algorithms that take a step again until inputs and outputs agree at its end."""
ERROR_CONTROLLED = "error_controlled"
"""The iterated algorithm that chooses its communication steps."""
MONOLITHIC = "monolithic"
"""The algorithm that integrates all FMUs as one equation."""
MONOLITHIC_DAE = "monolithic_dae"
"""The same, with the values between the FMUs among the unknowns: a differential-algebraic equation."""
ALGORITHMS = (*HELD, *EXTRAPOLATED, *ITERATED, ERROR_CONTROLLED, "linearized_feedback", MONOLITHIC, MONOLITHIC_DAE)
"""Ways to run a system, see `masters/algorithms.py`."""
AUTO = "auto"
"""In place of an algorithm: the cheapest whose error is within the tolerance (`analysis/algorithm_choice.py`)."""

ORDERS: Mapping[str, int] = {
    **dict.fromkeys(HELD, 1),
    "gauss_seidel_linear": 2,
    "jacobi_linear": 2,
    "gauss_seidel_quadratic": 3,
    "jacobi_quadratic": 3,
    **dict.fromkeys(ITERATED, 2),
    "linearized_feedback": 2,
}
"""Order of the error in the communication step, of the algorithms that take the step they are given."""

DERIVATIVES = ("rate", "acceleration", "jerk")
"""First to third derivative of a signal: outputs of a sine source, and inputs beside that of the signal."""

_COMPONENT = re.compile(r"^[A-Za-z_]\w*(\[[1-9]\d*\])?$")
_RANGE = re.compile(r"\[(\d+)\.\.(\d+)\]")
_NUMBERED = re.compile(r"^([^[]*)\[(\d+)\](.*)$")


class StructureError(ValueError):
    """A system, scene or FMU that cannot be run as it is wired; the message names the component or connection."""


@dataclass(frozen=True)
class Connector:
    """One variable of an FMU, as its description tells it.

    `base_unit` holds what the description says of the unit: exponents of kg, m, s, A, K, mol, cd, rad, then factor and
    offset; `None` where it says nothing. `nominal` is 1 as well where it states none, `has_nominal` whether it does.
    `dependencies` names the inputs that an output follows without a step between;
    `None` means that it may follow every input.
    """

    name: str
    reference: int
    causality: str
    variability: str = "continuous"
    type: str = "Float64"
    unit: str | None = None
    base_unit: tuple[float, ...] | None = None
    start: float | None = None
    nominal: float = 1.0
    min: float | None = None
    max: float | None = None
    dependencies: tuple[str, ...] | None = ()
    has_nominal: bool = False

    @property
    def is_real(self) -> bool:
        """Whether it is a scalar Real (FMI 2) or Float64 (FMI 3), the only kind a connection carries."""
        return self.type in ("Real", "Float64")

    @property
    def changes_at_events(self) -> bool:
        """Whether it changes at events only, as numbers that are not real do at best."""
        is_smooth = self.type.startswith(("Real", "Float"))
        return self.variability == "discrete" or (self.variability == "continuous" and not is_smooth)


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


@dataclass(frozen=True)
class Scene:
    """A system with a question to it: the response of `outputs` to small sines at `inputs`, or to a motion of its own.

    Attributes:
        system: the wiring, without the measuring instruments.
        inputs: full names of the inputs that are excited, one at a time; none where a component gives the motion.
        outputs: full names of the outputs that are measured.
        band: lowest and highest frequency [Hz].
        amplitude: of the excitation, by unit of the input: `{"m": 1e-5, "rad": 1e-4}`; needed where there are inputs.
        step_size: communication step size [s].
        stop_time: end of a time-domain run [s].
        tolerance: relative error of a response that levels, algorithm and communication step may make.
        algorithm: one of `ALGORITHMS`, or `AUTO`.
        source: the sine source; it is given the excited input's unit as argument `unit`.
        marks: frequencies [Hz] that others have found, by who or how; a Bode plot shows them.
        fuse: groups of components that become one FMU each (`assembly/fuse.py`), by name.
        scale: sizes that variables (full names) have in use, from travel, bounds, force and torque limits, in their
            units; a run stops where one is a thousand times as large (`actions/divergence.py`).
    """

    system: System
    inputs: Sequence[str]
    outputs: Sequence[str]
    _: KW_ONLY
    step_size: float
    stop_time: float
    band: tuple[float, float] = (1.0, 100.0)
    amplitude: Mapping[str, float] = field(default_factory=dict)
    tolerance: float = 1e-3
    algorithm: str = AUTO
    source: Component = field(default_factory=lambda: Component("source", "sine_source"))
    marks: Mapping[str, float] = field(default_factory=dict)
    fuse: Sequence[Sequence[str]] = ()
    scale: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self):
        object.__setattr__(self, "fuse", tuple(tuple(group) for group in self.fuse))
        for label in ("inputs", "outputs"):
            names = tuple(member for name in getattr(self, label) for member in expand(name))
            for name in names:
                self.system.split(name)
            object.__setattr__(self, label, names)
        if not self.outputs:
            raise StructureError("a scene needs outputs; found none")
        if self.inputs and not self.amplitude:
            raise StructureError("a scene with inputs needs their amplitude, by unit; found none")
        low, high = self.band
        object.__setattr__(self, "band", (float(low), float(high)))
        if not 0 < low < high < math.inf:
            raise StructureError(f"band is {low:g} to {high:g} Hz, expected 0 < lowest < highest")
        for label in ("step_size", "stop_time", "tolerance"):
            value = getattr(self, label)
            if not 0 < value < math.inf:
                raise StructureError(f"{label} is {value:g}, expected a positive number")
        for label, frequency in self.marks.items():
            if not (isinstance(frequency, int | float) and 0 < frequency < math.inf):
                raise StructureError(f"mark {label!r} is at {frequency!r}, expected a frequency in Hz")
        known = (AUTO, *ALGORITHMS)
        if self.algorithm not in known:
            raise StructureError(f"no algorithm is called {self.algorithm!r}{nearest(self.algorithm, known)}")
        object.__setattr__(self, "scale", {n: size for name, size in self.scale.items() for n in expand(name)})
        for name, size in self.scale.items():
            self.system.split(name)
            if isinstance(size, bool) or not (isinstance(size, int | float) and 0 < size < math.inf):
                raise StructureError(f"the scale of {name} is {size!r}, expected a positive number in its unit")


def expand(name: str) -> list[str]:
    """Return the members of a name with ranges, `drive[1..3].slide` -> `drive[1].slide`, ...; other names alone."""
    parts = _RANGE.split(name)
    literals, bounds = parts[::3], list(zip(parts[1::3], parts[2::3], strict=True))
    for low, high in bounds:
        if int(low) > int(high):
            raise StructureError(f"range [{low}..{high}] in {name} is empty; expected the lower index first")
    ranges = [range(int(low), int(high) + 1) for low, high in bounds]
    members = []
    for indices in itertools.product(*ranges):
        tail = "".join(f"[{i}]{literal}" for i, literal in zip(indices, literals[1:], strict=True))
        members.append(literals[0] + tail)
    return members


def compact(names: Iterable[str]) -> list[str]:
    """Return names with members in a row joined: `position[1]`, `position[2]` -> `position[1..2]`."""
    groups: dict[str, list[int]] = {}
    for name in names:
        match = _NUMBERED.match(name)
        stem = f"{match[1]}[{{}}]{match[3]}" if match else name
        groups.setdefault(stem, []).extend([int(match[2])] if match else [])
    joined = []
    for stem, indices in groups.items():
        if len(indices) > 1 and indices == list(range(indices[0], indices[0] + len(indices))):
            joined.append(stem.format(f"{indices[0]}..{indices[-1]}"))
        else:
            joined += [stem.format(i) for i in indices] or [stem]
    return joined


def named(name: str, known: Iterable[str]) -> list[str]:
    """Return the full names that a name means, of those known: itself, or all that are called so in their component."""
    known = list(known)
    return [name] if name in known else [full for full in known if full.partition(".")[2] == name]


def meant(word: str, known: Sequence[str]) -> list[str]:
    """Return the components that a word means: one, a range, or by their common name all that are numbered.

    `drive[1..3]`, `drive` and `drives` are three of them. `StructureError` with the nearest names for other words.
    """
    names = expand(word)
    if all(name in known for name in names):
        return names
    for common in (word, word.removesuffix("s")):
        if numbered := [name for name in known if name.endswith("]") and name.partition("[")[0] == common]:
            return numbered
    missing = next(name for name in names if name not in known)
    raise StructureError(f"no component is called {missing!r}{nearest(missing, known)}")


def in_order(system: System, names: Sequence[str]) -> System:
    """Return the system whose components of these names stand in this order; errors and places as `permuted`."""
    order = permuted([component.name for component in system.components], names)
    return System([system[name] for name in order], system.connections)


def permuted(known: Sequence[str], names: Sequence[str]) -> list[str]:
    """Return components of which these take, in this order, the places that they had; the others stay where they are.

    `StructureError` for a name that does not exist or is given twice.
    """
    for name in names:
        if name not in known:
            raise StructureError(f"no component is called {name!r}{nearest(name, known)}")
        if names.count(name) > 1:
            raise StructureError(f"{name} is named twice in an order; a component steps once")
    moved = iter(names)
    return [next(moved) if name in names else name for name in known]


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


def companions(name: str) -> tuple[str, ...]:
    """Return the names of an input's `DERIVATIVES`: `command.position[3]` -> `command.position_rate[3]`, ..."""
    stem, bracket, index = name.rpartition("[") if name.endswith("]") else (name, "", "")
    return tuple(f"{stem}_{derivative}{bracket}{index}" for derivative in DERIVATIVES)


def check(system: System, connectors: Mapping[str, Mapping[str, Connector]]) -> None:
    """Raise `StructureError` unless every connection joins an output to an input of the same unit.

    `connectors` holds the variables of each component's FMU by name.
    """
    for connection in system.connections:
        start = connector(system, connectors, connection.start)
        end = connector(system, connectors, connection.end)
        for side, full, wanted in ((start, connection.start, "output"), (end, connection.end, "input")):
            if side.causality != wanted:
                raise StructureError(
                    f"connection {connection}: {full} is an FMU's {side.causality}, expected an {wanted}"
                )
            if not side.is_real:
                raise StructureError(
                    f"connection {connection}: {full} is of type {side.type}, expected a scalar Real or Float64"
                )
        if not _same_unit(start, end):
            raise StructureError(
                f"connection {connection}: {connection.start} is in {start.unit}, but {connection.end} in {end.unit}"
            )
    for component in system.components:
        for name, value in component.start.items():
            _check_start(connector(system, connectors, full := f"{component.name}.{name}"), full, value)


def _check_start(variable: Connector, name: str, value: Any) -> None:
    """Raise `StructureError` for a start value that is no number, or outside its variable's bounds."""
    low = -math.inf if variable.min is None else variable.min
    high = math.inf if variable.max is None else variable.max
    if not (isinstance(value, int | float) and math.isfinite(value) and low <= value <= high):
        unit = f" {variable.unit}" if variable.unit not in (None, "1") else ""
        raise StructureError(f"{name} starts at {value}{unit}, expected a number from {low:g} to {high:g}{unit}")


def connector(system: System, connectors: Mapping[str, Mapping[str, Connector]], name: str) -> Connector:
    """Return the variable of a full name; `StructureError` with the nearest names if there is none."""
    component, variable = system.split(name)
    if variable not in connectors[component]:
        raise StructureError(
            f"{component} ({system[component].part}) has no variable {variable!r}"
            f"{nearest(variable, connectors[component])}"
        )
    return connectors[component][variable]


def nearest(name: str, names: Iterable[str]) -> str:
    """Return `; did you mean a, b?` with the names most like `name`, or the first few where none is like it."""
    names = list(names)
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.5)
    if near:
        return f"; did you mean {', '.join(near)}?"
    return f"; there are {', '.join(names[:8])}{', ...' if len(names) > 8 else ''}" if names else ""


def _pairwise(connection: Connection) -> list[Connection]:
    """Return the connections between the members of two ranges, or of two names."""
    starts, ends = expand(connection.start), expand(connection.end)
    if len(starts) != len(ends):
        raise StructureError(
            f"connection {connection} joins {len(starts)} output(s) to {len(ends)} input(s); ranges must be of one size"
        )
    return [Connection(start, end) for start, end in zip(starts, ends, strict=True)]


def _same_unit(start: Connector, end: Connector) -> bool:
    """Whether no conversion lies between two units; a foreign FMU may spell a unit differently or not state it."""
    if start.unit is None or end.unit is None or start.unit == end.unit:
        return True
    return start.base_unit is not None and start.base_unit == end.base_unit
