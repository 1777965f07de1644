"""Origin of a model: what an FMU of it tells of the part that it is made from."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from importlib.metadata import version
from types import ModuleType


@dataclass(frozen=True)
class Credits:
    """Author, version, licence and copyright of a part; empty where nothing is said."""

    author: str = ""
    version: str = ""
    license: str = ""
    copyright: str = ""


@dataclass(frozen=True)
class Explanation:
    """Sentence on a structural argument, and the unit of its numbers, empty where it has none."""

    sentence: str
    unit: str = ""


@dataclass(frozen=True)
class Origin:
    """Origin of a model.

    Attributes:
        variant: what differs from the default level and arguments, as the end of an identifier (`variants`).
        documents: docstrings of parts by their names.
        credits: author, version, licence and copyright.
        explained: structural arguments by name.
    """

    variant: str = ""
    documents: Mapping[str, str] = field(default_factory=dict)
    credits: Credits = field(default_factory=Credits)
    explained: Mapping[str, Explanation] = field(default_factory=dict)


def house_credits() -> Credits:
    """Return the credits of the parts that come with hfsa."""
    return Credits("The hfsa developers", version("hfsa"), "BSD-3-Clause", "Copyright (c) 2026, the hfsa authors")


def credits_of(module: ModuleType) -> Credits:
    """Return the credits in `__author__`, `__version__`, `__license__` and `__copyright__` of a module."""
    found = {name: getattr(module, f"__{name}__", "") for name in ("author", "version", "license", "copyright")}
    return Credits(**{name: " ".join(str(text).split()) for name, text in found.items()})


def shared(parts: Iterable[Credits]) -> Credits:
    """Return the credits that all parts of a group have; none where they differ."""
    different = set(parts)
    return different.pop() if len(different) == 1 else Credits()
