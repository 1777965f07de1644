"""Names of elements that are legal in every tool, `drive[1]` -> `drive_1`, and back, `wheel.left` -> `wheel_left`."""

import re
from collections.abc import Iterable, Sequence

_FOREIGN = re.compile(r"[^A-Za-z0-9_]+")


def legal_names(names: Iterable[str]) -> dict[str, str]:
    """Return for each name one of ASCII letters, digits and underscores, which no other has.

    OMSimulator takes no brackets, and a dot separates levels in all tools. A name that is legal already stays.
    """
    names = list(names)
    found = {name: name for name in names if _is_legal(name)}
    for name in names:
        if name not in found:
            found[name] = _free(_FOREIGN.sub("_", name).strip("_") or "element", list(found.values()))
    return {name: found[name] for name in names}


def _is_legal(name: str) -> bool:
    """Whether a name needs no change."""
    return name.isascii() and name.isidentifier()


def _free(name: str, taken: Sequence[str]) -> str:
    """Return the name, with a number if it is taken or begins with a digit."""
    name = name if name.isidentifier() else f"element_{name}"
    candidates = (name, *(f"{name}_{number}" for number in range(2, len(taken) + 3)))
    return next(candidate for candidate in candidates if candidate not in taken)
