"""Kinds of values in systems and scenes: numbers, texts, lists and tables, and the sentence on a wrong one.

    text("component m: part", 5)      # StructureError: component m: part is 5, expected a text

Scenes in Python and in TOML are checked alike, where their objects are made.
"""

import math
from collections.abc import Iterable, Mapping
from numbers import Real
from typing import Any, NoReturn, TypeVar

from hfsa.cosim.systems.errors import StructureError

T = TypeVar("T")

_LONGEST = 100
"""Number of characters of a wrong value that a sentence shows."""


def refuse(what: str, value: Any, expected: str) -> NoReturn:
    """Raise `StructureError`: `what` is a value, expected another."""
    raise StructureError(f"{what} is {_shown(value)}, expected {expected}")


def _shown(value: Any) -> str:
    """Return a value on one line, its beginning if it is long."""
    try:
        found = " ".join(repr(value).split())
    except ValueError:  # Python writes no whole number of more than 4300 digits
        return "a number of too many digits"
    return found if len(found) <= _LONGEST else f"{found[:_LONGEST]}..."


def is_number(value: Any) -> bool:
    """Whether a value is a real number that fits into 64 bits; true and false are none."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return False
    try:
        float(value)
    except OverflowError:
        return False
    return True


def is_positive(value: Any) -> bool:
    """Whether a value is a positive and finite number."""
    return is_number(value) and 0 < value < math.inf


def text(what: str, value: Any, expected: str = "a text") -> str:
    """Return a text; `StructureError` for any other value."""
    return value if isinstance(value, str) else refuse(what, value, expected)


def instance(what: str, value: Any, kind: type[T]) -> T:
    """Return an instance of a class; `StructureError` for any other value."""
    return value if isinstance(value, kind) else refuse(what, value, f"a {kind.__name__}")


def listed(what: str, value: Any, expected: str) -> tuple[Any, ...]:
    """Return the items of a list as a tuple; `StructureError` for a text, a table, and what has no items."""
    is_list = isinstance(value, Iterable) and not isinstance(value, str | bytes | Mapping)
    return tuple(value) if is_list else refuse(what, value, expected)


def instances(what: str, value: Any, kind: type[T]) -> tuple[T, ...]:
    """Return the items of a list as a tuple, all of one class; `StructureError` for any other value."""
    items = listed(what, value, f"a list of {kind.__name__}s")
    return tuple(instance(f"{what}[{i}]", item, kind) for i, item in enumerate(items, 1))


def texts(what: str, value: Any, expected: str = "a list of names") -> tuple[str, ...]:
    """Return the texts of a list as a tuple; `StructureError` for any other value."""
    items = listed(what, value, expected)
    return items if all(isinstance(item, str) for item in items) else refuse(what, list(items), expected)


def table(what: str, value: Any, expected: str = "a table") -> Mapping[str, Any]:
    """Return a mapping whose keys are texts; `StructureError` for any other value."""
    is_table = isinstance(value, Mapping) and all(isinstance(key, str) for key in value)
    return value if is_table else refuse(what, value, expected)
