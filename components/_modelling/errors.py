"""What cannot be in a model, said with the nearest right answer."""

import difflib
from collections.abc import Iterable


class ModelError(ValueError):
    """A quantity, an equation or an argument of a model that cannot be; the message names it."""

    exit_code = 2


def nearest(name: str, names: Iterable[str]) -> str:
    """Return `; did you mean a, b?` with the names most like `name`, or the first few where none is like it."""
    names = list(names)
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.5)
    if near:
        return f"; did you mean {', '.join(near)}?"
    return f"; there are {', '.join(names[:8])}{', ...' if len(names) > 8 else ''}" if names else ""


def one_of(name: str, names: Iterable[str], what: str) -> str:
    """Return `name`; `ModelError` that says `what` it is, with the nearest names, unless it is one of `names`."""
    if name not in (names := list(names)):
        raise ModelError(f"{what} is {name!r}{nearest(name, names)}")
    return name
