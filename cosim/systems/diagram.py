"""Block diagram of a scene as data: a block per component, a link per pair of them that connections join, terminals.

    found = diagram(scene, connectors, facts)
    found.links[0].words                # ["platform.position[1..3]", "x 1000"]

Many components of one part that are numbered, `mass[1]` to `mass[60]`, are one block, whose signals have full names.

Links run from the block of the outputs to that of the inputs. Those of an algebraic loop carry its number, and those on
a feedback loop through a sampled block are marked. What the variables of the FMUs tell, conversions of units and
algebraic loops, is left out without `connectors`.
"""

import itertools
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from hfsa.cosim.systems.connectors import Connector, connector
from hfsa.cosim.systems.cycles import on_cycles
from hfsa.cosim.systems.feedthrough import feedthrough
from hfsa.cosim.systems.names import compact
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, Connection, System
from hfsa.cosim.systems.transformations import transformation

Connectors = Mapping[str, Mapping[str, Connector]]
Side = Literal["input", "output", "recorded"]
"""What a terminal is: inputs that are excited, outputs that are measured, variables recorded beside them."""

_MOST = 4
"""Number of lines of signals of a link or terminal."""
_LONGEST = 34
"""Number of characters of a line."""
_MOST_ALIKE = 8
"""Number of numbered components of one part above which they are one block."""
_NUMBERED = re.compile(r"^(.*?)\[?\d+\]?$")


@dataclass(frozen=True)
class Facts:
    """What is known of a component beside its scene: level, sample time [s], FMI version and tool of an FMU file."""

    level: str = ""
    sample_time: float | None = None
    origin: str = ""


@dataclass(frozen=True)
class Block:
    """A component as drawn, or many alike.

    Attributes:
        name: name of the component, or of all, `mass[1..60]`.
        words: lines below the name: its part and level, its arguments, what is special of it.
        is_sampled: whether it is sampled.
        is_foreign: whether it is given as an FMU file.
    """

    name: str
    words: tuple[str, ...]
    is_sampled: bool = False
    is_foreign: bool = False


@dataclass(frozen=True)
class Link:
    """All connections from one block to another.

    Attributes:
        start, end: names of the blocks.
        pairs: names of outputs and inputs, (output, input), without the component unless its block is of many.
        marks: factors, offsets and conversions of units.
        loop: number of the algebraic loop that it is on, from 1; 0 for none.
        is_sampled_loop: whether it is on a feedback loop through a sampled block.
    """

    start: str
    end: str
    pairs: tuple[tuple[str, str], ...]
    marks: tuple[str, ...] = ()
    loop: int = 0
    is_sampled_loop: bool = False

    @property
    def words(self) -> list[str]:
        """Lines beside the link: its outputs, the number of them where not all are named, marks, and its loop."""
        lines = [_short(name) for name in compact(self.names[0])]
        loop = [f"algebraic loop {self.loop}"] if self.loop else []
        return [*_few(lines, len(self.pairs)), *self.marks, *loop]

    @property
    def names(self) -> tuple[list[str], list[str]]:
        """Names of its outputs, and of the inputs."""
        return [start for start, _ in self.pairs], [end for _, end in self.pairs]

    @property
    def sentence(self) -> str:
        """All of the link in words, with outputs and inputs."""
        starts, ends = (", ".join(compact(names)) for names in self.names)
        marks = f" ({', '.join(self.marks)})" if self.marks else ""
        loop = f", on algebraic loop {self.loop}" if self.loop else ""
        sampled = ", on a feedback loop through a sampled part" if self.is_sampled_loop else ""
        return f"From {self.start} to {self.end}: {starts} to {ends}{marks}{loop}{sampled}."


@dataclass(frozen=True)
class Terminal:
    """Inputs or outputs of the scene at one block: names without the component, unless the block is of many."""

    side: Side
    block: str
    names: tuple[str, ...]

    @property
    def words(self) -> list[str]:
        """Lines of the terminal."""
        return _few([_short(name) for name in compact(self.names)], len(self.names))


@dataclass(frozen=True)
class Diagram:
    """Block diagram of a scene.

    Attributes:
        title: title.
        blocks: components in their order of steps.
        links: connections by pair of blocks.
        terminals: inputs and outputs of the scene.
        groups: names of the blocks that are compiled into one FMU, for each such FMU.
    """

    title: str
    blocks: Sequence[Block]
    links: Sequence[Link]
    terminals: Sequence[Terminal]
    groups: Sequence[Sequence[str]] = ()

    @property
    def description(self) -> str:
        """The diagram in words, for those who cannot see it."""
        sides = {"input": "Inputs", "output": "Outputs", "recorded": "Recorded"}
        ends = [
            f"{words}: {', '.join(f'{one.block}.{name}' for one in found for name in compact(one.names))}."
            for side, words in sides.items()
            if (found := [one for one in self.terminals if one.side == side])
        ]
        blocks = [f"{block.name}: {', '.join(block.words)}." for block in self.blocks]
        links = [link.sentence for link in self.links]
        groups = [f"Compiled into one FMU: {', '.join(group)}." for group in self.groups]
        return printable(" ".join([*blocks, *groups, *links, *ends]))


def diagram(
    scene: Scene, title: str, facts: Mapping[str, Facts] | None = None, connectors: Connectors | None = None
) -> Diagram:
    """Return the block diagram of a scene.

    Args:
        scene: the scene.
        title: title of the diagram.
        facts: what is known of components, by name.
        connectors: variables of each component's FMU by name, without which units and algebraic loops are not known.

    Raises:
        StructureError: connections, inputs or outputs that an FMU does not have, or units that do not fit.
    """
    known, system = facts or {}, scene.system
    alone = {name for group in scene.fuse for name in group}
    blocks = _blocks(system, {c.name: _block(c, known.get(c.name, Facts())) for c in system.components}, alone)
    sides: list[tuple[Side, Sequence[str]]] = [
        ("input", scene.inputs),
        ("output", scene.outputs),
        ("recorded", [name for name in scene.recorded if name not in scene.outputs]),
    ]
    if connectors is not None:
        for name in itertools.chain(*(names for _, names in sides)):
            connector(system, connectors, name)
    places = _Places(system, blocks)
    terminals = [one for side, names in sides for one in _terminals(places, side, names)]
    found = dict.fromkeys(blocks.values())
    return Diagram(printable(title), tuple(found), _links(places, connectors), terminals, scene.fuse)


def _block(component: Component, facts: Facts) -> Block:
    """Return the block of a component."""
    part = Path(component.part).name
    level = facts.level or component.level or ""
    words = [_short(f"{part}, {level}" if level else part)]
    words += _few([_short(f"{name} = {_value(value)}") for name, value in _shown(component.arguments)], 0)
    if facts.origin:
        words.append(_short(facts.origin))
    if facts.sample_time is not None:
        words.append(f"sampled every {1e3 * facts.sample_time:.6g} ms" if facts.sample_time else "sampled")
    return Block(component.name, tuple(words), facts.sample_time is not None, component.is_foreign)


def _blocks(system: System, single: Mapping[str, Block], alone: Collection[str]) -> dict[str, Block]:
    """Return the block of each component by its name: its own, or one of many alike; those `alone` have their own."""
    families: dict[tuple[Any, ...], list[Block]] = {}
    for component in system.components:
        block, match = single[component.name], _NUMBERED.match(component.name)
        stem = match[1] if match and component.name not in alone else component.name
        key = (stem, component.part, block.words[0], block.is_sampled, block.is_foreign)
        families.setdefault(key, []).append(block)
    found = dict(single)
    for family in families.values():
        if len(family) > _MOST_ALIKE:
            found |= dict.fromkeys([block.name for block in family], _of_many(family))
    return found


def _of_many(family: Sequence[Block]) -> Block:
    """Return one block for many of one part."""
    first, *_, last = (block.name for block in family)
    joined = compact(block.name for block in family)
    name = joined[0] if len(joined) == 1 else f"{first} ... {last}"
    common = [words for words in family[0].words if all(words in block.words for block in family)]
    differ = ["arguments differ"] if any(len(block.words) > len(common) for block in family) else []
    return replace(family[0], name=name, words=(f"{len(family)} components", *common, *differ))


class _Places:
    """Where the components and variables of a system are in a diagram."""

    def __init__(self, system: System, blocks: Mapping[str, Block]):
        self.system, self._blocks = system, blocks

    def of(self, name: str) -> tuple[str, str]:
        """Return the name of the block of a variable (full name), and how the variable is called there."""
        component, variable = self.system.split(name)
        block = self._blocks[component].name
        return block, variable if block == component else f"{component}.{variable}"

    @property
    def sampled(self) -> set[str]:
        """Names of the components that are sampled."""
        return {name for name, block in self._blocks.items() if block.is_sampled}


def _shown(arguments: Mapping[str, Any]) -> Iterable[tuple[str, Any]]:
    """Return the arguments of a component that have one value of few characters."""
    return [(name, value) for name, value in arguments.items() if isinstance(value, str | bool | int | float)]


def _value(value: Any) -> str:
    """Return the value of an argument as it is typed; of several lines the first."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else str(value).partition("\n")[0]


def _links(places: _Places, connectors: Connectors | None) -> list[Link]:
    """Return the links of a system."""
    system = places.system
    loops = () if connectors is None else feedthrough(system, connectors).loops
    loop_of = {connection: number for number, loop in enumerate(loops, 1) for connection in loop}
    pairs = {c: (system.split(c.start)[0], system.split(c.end)[0]) for c in system.connections}
    groups = on_cycles([component.name for component in system.components], set(pairs.values()))
    group_of = {name: group for group in groups for name in group}
    sampled = {group for group in groups if places.sampled & set(group)}
    bundles: dict[tuple[str, str, int, bool], list[Connection]] = {}
    for connection, (start, end) in pairs.items():
        is_sampled_loop = group_of[start] is group_of[end] and group_of[start] in sampled
        ends = places.of(connection.start)[0], places.of(connection.end)[0]
        bundles.setdefault((*ends, loop_of.get(connection, 0), is_sampled_loop), []).append(connection)
    return [
        Link(
            start,
            end,
            tuple((places.of(c.start)[1], places.of(c.end)[1]) for c in connections),
            _marks(system, connections, connectors),
            loop,
            is_sampled_loop,
        )
        for (start, end, loop, is_sampled_loop), connections in bundles.items()
    ]


def _marks(system: System, connections: Sequence[Connection], connectors: Connectors | None) -> tuple[str, ...]:
    """Return what connections do to their values, with the number of them where not all do it."""
    counts: dict[str, int] = {}
    for connection in connections:
        words = _mark(system, connection, connectors)
        counts[words] = counts.get(words, 0) + 1
    several = len(counts) > 1
    found = [
        f"{words} ({count} of {len(connections)})" if several else words for words, count in counts.items() if words
    ]
    return tuple(_few([_short(words) for words in found], 0))


def _mark(system: System, connection: Connection, connectors: Connectors | None) -> str:
    """Return factor, offset and conversion of a connection; empty where it passes the value on."""
    if connectors is None:
        return _linear(connection.factor, connection.offset) if connection.is_transformed else ""
    start, end = (connector(system, connectors, name) for name in (connection.start, connection.end))
    found = transformation(connection, start, end)
    if found is None:
        return ""
    are_known = start.unit and end.unit and start.unit != end.unit
    return _linear(found.factor, found.offset) + (f" ({start.unit} to {end.unit})" if are_known else "")


def _linear(factor: float, offset: float) -> str:
    """Return factor and offset as text: `x 1000 + 0.5`."""
    added = f" {'-' if offset < 0 else '+'} {abs(offset):.6g}" if offset else ""
    return f"x {factor:.6g}{added}"


def _terminals(places: _Places, side: Side, names: Sequence[str]) -> list[Terminal]:
    """Return the terminals of inputs or outputs, one per block."""
    found: dict[str, list[str]] = {}
    for name in names:
        block, variable = places.of(name)
        found.setdefault(block, []).append(variable)
    return [Terminal(side, block, tuple(dict.fromkeys(variables))) for block, variables in found.items()]


def _few(lines: Sequence[str], count: int) -> list[str]:
    """Return the first few of several lines, with the number of signals where there are more."""
    if len(lines) <= _MOST:
        return list(lines)
    return [*lines[: _MOST - 1], f"... {count} signals" if count else f"... and {len(lines) - _MOST + 1} more"]


def _short(line: str) -> str:
    """Return a line without its middle where it is long, and without what cannot be printed."""
    half = _LONGEST // 2 - 1
    return printable(line if len(line) <= _LONGEST else f"{line[:half]}...{line[-half:]}")


def printable(line: str) -> str:
    """Return a line with a mark in the place of each character that cannot be printed."""
    return "".join(letter if letter.isprintable() else "?" for letter in line)
