"""Names of variables and components: ranges, members, and suggestions for a misspelt name.

A full name is `component.variable`. A range in a name, `drive[1..3]`, stands for its members in order.
"""

import difflib
import itertools
import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.kinds import text

DERIVATIVES = ("rate", "acceleration", "jerk")
"""First to third time derivative of a signal: outputs of a sine source, and inputs beside the input of the signal."""

MOST_MEMBERS = 1_000_000
"""Most members of a name with ranges."""

_MOST_COMPARED = 10_000
"""Most names that a misspelt one is compared with: of a million, that takes a minute."""

_DIGITS = 18
_RANGE = re.compile(r"\[(\d+)\.\.(\d+)\]")

_NUMBERED = re.compile(r"^([^[]*)\[(\d+)\](.*)$")


def expand(name: str) -> list[str]:
    """Return the members of a name with ranges, `drive[1..3].slide` -> `drive[1].slide`, ...; else the name alone."""
    parts = _RANGE.split(text("a name", name))
    literals, bounds = parts[::3], list(zip(parts[1::3], parts[2::3], strict=True))
    for low, high in bounds:
        if len(high) > _DIGITS or int(high) - int(low) >= MOST_MEMBERS:
            raise StructureError(
                f"range [{low[:20]}..{high[:20]}] has more members than {MOST_MEMBERS}, expected fewer"
            )
        if int(low) > int(high):
            raise StructureError(f"range [{low}..{high}] in {name} is empty; expected the lower index first")
    ranges = [range(int(low), int(high) + 1) for low, high in bounds]
    if math.prod(map(len, ranges)) > MOST_MEMBERS:
        raise StructureError(f"{name} has more members than {MOST_MEMBERS}, expected fewer")
    members = []
    for indices in itertools.product(*ranges):
        tail = "".join(f"[{i}]{literal}" for i, literal in zip(indices, literals[1:], strict=True))
        members.append(literals[0] + tail)
    return members


def compact(names: Iterable[str]) -> list[str]:
    """Return names with consecutive members joined to ranges: `position[1]`, `position[2]` -> `position[1..2]`."""
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


def matching_names(name: str, known: Iterable[str]) -> list[str]:
    """Return the known full names that match a name: the name itself, or every variable of that name."""
    known = list(known)
    return [name] if name in known else [full for full in known if full.partition(".")[2] == name]


def resolve_names(word: str, known: Sequence[str]) -> list[str]:
    """Return the components of a name as typed: one component, a range, or all numbered components of that name.

    `drive[1..3]`, `drive` and `drives` give the same three. `StructureError` with the nearest names for other words.
    """
    names = expand(word)
    if all(name in known for name in names):
        return names
    for common in (word, word.removesuffix("s")):
        if numbered := [name for name in known if name.endswith("]") and name.partition("[")[0] == common]:
            return numbered
    missing = next(name for name in names if name not in known)
    raise StructureError(f"no component is called {missing!r}{nearest(missing, known)}")


def reorder(known: Sequence[str], names: Sequence[str]) -> list[str]:
    """Return the known components with some of them permuted among their places: `names` gives their new order.

    The others keep their places. `StructureError` for a name that does not exist or is given twice.
    """
    for name in names:
        if name not in known:
            raise StructureError(f"no component is called {name!r}{nearest(name, known)}")
        if names.count(name) > 1:
            raise StructureError(f"{name} is named twice in an order; a component steps once")
    moved = iter(names)
    return [next(moved) if name in names else name for name in known]


def companions(name: str) -> tuple[str, ...]:
    """Return the names of an input's `DERIVATIVES`: `command.position[3]` -> `command.position_rate[3]`, ..."""
    stem, bracket, index = name.rpartition("[") if name.endswith("]") else (name, "", "")
    return tuple(f"{stem}_{derivative}{bracket}{index}" for derivative in DERIVATIVES)


def repeated(names: Iterable[str]) -> str | None:
    """Return the first name that is there for the second time, `None` where all differ."""
    known: set[str] = set()
    for name in names:
        if name in known:
            return name
        known.add(name)
    return None


def nearest(name: str, names: Iterable[str]) -> str:
    """Return `; did you mean a, b?` with the most similar names, or the first few names where none is similar."""
    names = list(names)
    near = difflib.get_close_matches(name, names[:_MOST_COMPARED], n=3, cutoff=0.5)
    if near:
        return f"; did you mean {', '.join(near)}?"
    return f"; there are {', '.join(names[:8])}{', ...' if len(names) > 8 else ''}" if names else ""


def legible(words: str) -> str:
    """Return words as a file can hold them: a byte that is no UTF-8, such as in a path, becomes its escape."""
    return words.encode("utf-8", "backslashreplace").decode("utf-8")


def refuse_signal(file: Path, known: Iterable[str]) -> None:
    """Raise `StructureError` for an output file named like a signal; `known` holds full names of signals."""
    known = list(known)
    for name in expand(str(file)):
        if found := matching_names(name, known):
            raise StructureError(
                f"-o {file}: {found[0]} is a signal, which --signal takes; -o and --output take a file"
            )
