"""What the docstrings of a part say of its structural arguments: a sentence, and the unit of the numbers.

The sentence is the entry under `Args:` of the function, for a field of a dataclass that under `Attributes:` there. A
unit stands in brackets in it, `mass [kg]`; an entry of several units, or of none, gives none.
"""

import inspect
import re
from collections.abc import Callable, Mapping
from typing import Any, get_args, get_type_hints

from hfsa.components._modelling.arguments import Argument, arguments_of
from hfsa.components._modelling.origin import Explanation
from hfsa.components._modelling.units import unit as parse_unit

DEGREE = "deg"

_UNIT = re.compile(r"\s*\[([^\]\s]+)\]")
_ENTRY = re.compile(r"(\w+(?:, \w+)*): (.+)")


def explanations(function: Callable[..., Any] | None) -> dict[str, Explanation]:
    """Return what is said of each argument of a function, by full name, as far as something is said."""
    found = {name: _explained(function, argument) for name, argument in arguments_of(function).items()}
    return {name: explanation for name, explanation in found.items() if explanation is not None}


def explanation_of(name: str, known: Mapping[str, Explanation]) -> Explanation | None:
    """Return what is said of a constant: of the argument of its name, or of that which it is an element or field of."""
    while name and name not in known:
        name = name[: max(name.rfind("."), name.rfind("["), 0)]
    return known.get(name)


def _explained(function: Callable[..., Any] | None, argument: Argument) -> Explanation | None:
    """Return what is said of one argument, by the innermost docstring that says something."""
    assert function is not None
    owner: Any = inspect.unwrap(function)
    text = None
    for name in argument.path:
        text = _entries(owner).get(name) if owner is not None else None
        owner = _type_of(owner, name)
    return None if text is None else _explanation(text)


def _type_of(owner: Any, name: str) -> Any:
    """Return the type of an argument or field, `None` where it is unknown."""
    kind = get_type_hints(owner).get(name) if owner is not None else None
    return next((k for k in (kind, *get_args(kind)) if isinstance(k, type)), None)


def _entries(owner: Any) -> dict[str, str]:
    """Return the entries on arguments or attributes in a docstring, by name."""
    lines = (inspect.getdoc(owner) or "").splitlines()
    starts = [i for i, line in enumerate(lines) if line in ("Args:", "Attributes:")]
    entries: dict[str, str] = {}
    names: list[str] = []
    for line in lines[starts[0] + 1 :] if starts else ():
        if line and not line.startswith("    "):
            break
        match = _ENTRY.fullmatch(line[4:]) if not line.startswith("     ") else None
        if match:
            names = match[1].split(", ")
            entries |= dict.fromkeys(names, match[2])
        else:
            entries |= {name: f"{entries[name]} {line.strip()}" for name in names}
    return entries


def _explanation(text: str) -> Explanation:
    """Return an entry as a sentence with its unit."""
    units = {found for found in _UNIT.findall(text) if _is_unit(found)}
    (unit,) = units if len(units) == 1 else ("",)
    if not unit and re.search(r"\bin degrees\b", text) and not units:
        unit = DEGREE
    sentence = (_UNIT.sub("", text) if unit else text).replace("`", "").strip().removesuffix(".")
    is_symbol = sentence[1:2] == "_"
    return Explanation(sentence if is_symbol else sentence[:1].upper() + sentence[1:], unit)


def _is_unit(text: str) -> bool:
    """Whether a text in brackets is a unit."""
    try:
        parse_unit(text)
    except ValueError:
        return False
    return True
