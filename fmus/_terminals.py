"""terminalsAndIcons.xml: the ports of an FMU as terminals, which importers connect as a whole, and their places.

A terminal has the inputs and outputs with the same beginning of their names: `drive[1].slide` is member `slide` of
`drive[1]`. Terminals with inputs and outputs are flanges, which fit where all members do (`plug`); all others are
signals, joined by the names that both have (`bus`). The file is in FMI since 3.0 and 2.0.4, in the same folder.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from lxml import etree

from hfsa.fmus._variables import Role, Variable

FOLDER = "terminalsAndIcons"

SIZE = 200
"""Width and height of the icon."""

PORT = 12
"""Width and height of the icon of a terminal."""

_INPUTS, _OUTPUTS = (Role.INPUT,), (Role.OUTPUT, Role.SAMPLED_OUTPUT)

_KINDS = {
    "tube": {"slide", "angle"},
    "platform": {"rotation", "position"},
    "motor": {"torque", "speed"},
    "wrench": {"torque", "force"},
}
"""Kinds of terminals by members that they have, the first that fits."""


@dataclass(frozen=True)
class Terminal:
    """A terminal: its name, its variables by the names of members, and its place on the icon, from its centre.

    `x` and `y` count from the middle, to the right and up.
    """

    name: str
    members: Mapping[str, Variable]
    x: float
    y: float

    @property
    def is_flange(self) -> bool:
        """Whether it has inputs and outputs."""
        return len({v.role in _INPUTS for v in self.members.values()}) == 2

    @property
    def kind(self) -> str:
        """Kind of the terminal; empty where it is none of those that have a name."""
        roots = {re.split(r"[.\[]", member)[0] for member in self.members}
        return next((f"org.hfsa.{kind}" for kind, needs in _KINDS.items() if needs <= roots), "")


def terminals(variables: Sequence[Variable]) -> list[Terminal]:
    """Return the terminals of an FMU: on the left those with inputs, on the right all others, from the top."""
    members: dict[str, dict[str, Variable]] = {}
    for variable in variables:
        name, dot, member = variable.name.partition(".")
        if dot and variable.role in (*_INPUTS, *_OUTPUTS):
            members.setdefault(name, {})[member] = variable
    sides: dict[int, list[str]] = {-1: [], 1: []}
    for name, found in members.items():
        sides[-1 if any(v.role in _INPUTS for v in found.values()) else 1].append(name)
    places = {
        name: (side * (SIZE - PORT) / 2, SIZE / 2 - SIZE * (i + 1) / (len(names) + 1))
        for side, names in sides.items()
        for i, name in enumerate(names)
    }
    return [Terminal(name, found, *places[name]) for name, found in members.items()]


def terminals_and_icons(variables: Sequence[Variable]) -> bytes:
    """Return terminalsAndIcons.xml as UTF-8."""
    root = etree.Element("fmiTerminalsAndIcons", {"fmiVersion": "3.0"})
    picture = etree.SubElement(root, "GraphicalRepresentation")
    edge = _box(0.0, 0.0, SIZE)
    etree.SubElement(picture, "CoordinateSystem", {**edge, "suggestedScalingFactorTo_mm": "0.1"})
    etree.SubElement(picture, "Icon", edge)
    found = terminals(variables)
    parent = etree.SubElement(root, "Terminals") if found else root
    for terminal in found:
        rule = {"name": terminal.name, "matchingRule": "plug" if terminal.is_flange else "bus"}
        kind = {"terminalKind": terminal.kind} if terminal.kind else {}
        element = etree.SubElement(parent, "Terminal", rule | kind)
        for member, variable in terminal.members.items():
            names = {"variableName": variable.name, "memberName": member, "variableKind": "signal"}
            etree.SubElement(element, "TerminalMemberVariable", names)
        place = {**_box(terminal.x, terminal.y, PORT), "iconBaseName": "terminal"}
        etree.SubElement(element, "TerminalGraphicalRepresentation", place)
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _box(x: float, y: float, size: float) -> dict[str, str]:
    """Return the corners of a square about a point."""
    low, high = -size / 2, size / 2
    return {"x1": f"{x + low:g}", "y1": f"{y + low:g}", "x2": f"{x + high:g}", "y2": f"{y + high:g}"}
