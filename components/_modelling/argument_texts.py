"""Sentence and unit of an argument, from the docstring of the function or the dataclass that has it.

    def part(*, length: float = 0.1) -> Model:
        \"\"\"Return a part.

Args:
            length: length of the rod [m].
        \"\"\"

An entry may describe several arguments, `along, across: ...`. The unit is the one of the entry in square brackets.
"""

import inspect
import re
from collections.abc import Mapping
from functools import cache
from typing import Any, NamedTuple

from docstring_parser.google import DEFAULT_SECTIONS, GoogleParser, Section, SectionType

from hfsa.components._modelling.arguments import Argument
from hfsa.components._modelling.units import unit as known_unit

_PARSER = GoogleParser([*DEFAULT_SECTIONS, Section("Further arguments", "param", SectionType.MULTIPLE)])
_BRACKETS = re.compile(r"\[([^\[\]]+)\]")


class Text(NamedTuple):
    """Sentence on an argument, and its unit; both empty where its docstring has no entry."""

    sentence: str
    unit: str


def text_of(argument: Argument, *others: Any) -> Text:
    """Return the text of an argument: that of its owner, else of the first of other owners that has one."""
    for owner in (argument.owner, *others):
        if owner is not None and (found := _texts(owner).get(argument.path[-1])) is not None:
            return found
    return Text("", "")


@cache
def _texts(owner: Any) -> Mapping[str, Text]:
    """Return the texts of a function's arguments, or of a dataclass' attributes and those of its bases, by name."""
    found: dict[str, Text] = {}
    for described in reversed(inspect.getmro(owner)) if inspect.isclass(owner) else (owner,):
        for entry in _PARSER.parse(described.__doc__ or "").params:
            sentence = " ".join((entry.description or "").split())
            found |= {name.strip(): Text(sentence, _unit(sentence)) for name in entry.arg_name.split(",")}
    return found


def _unit(sentence: str) -> str:
    """Return the unit in square brackets, empty where there is none, or several."""
    found = {text for text in _BRACKETS.findall(sentence) if _is_unit(text)}
    return found.pop() if len(found) == 1 else ""


def _is_unit(text: str) -> bool:
    """Whether a text is a unit in Modelica notation."""
    try:
        known_unit(text)
    except ValueError:
        return False
    return True
