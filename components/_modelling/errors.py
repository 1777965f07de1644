"""Errors of model definitions, with the nearest valid alternative."""

import difflib
from collections.abc import Iterable

_MOST_COMPARED = 10_000
"""Most names that a misspelt one is compared with: of a million, that takes a minute."""


class ModelError(ValueError):
    """An invalid quantity, equation or argument of a model; the message names it."""

    exit_code = 2


def nearest(name: str, names: Iterable[str]) -> str:
    """Return `; did you mean a, b?` with the names most similar to `name`, or the first names if none is similar."""
    names = list(names)
    near = difflib.get_close_matches(name, names[:_MOST_COMPARED], n=3, cutoff=0.5)
    if near:
        return f"; did you mean {', '.join(near)}?"
    return f"; there are {', '.join(names[:8])}{', ...' if len(names) > 8 else ''}" if names else ""


def one_of(name: str, names: Iterable[str], subject: str) -> str:
    """Return `name`, or raise `ModelError` with the nearest of `names` if it is not one of them.

    The message begins with `subject`, such as `sdelta: level`.
    """
    if name not in (names := list(names)):
        raise ModelError(f"{subject} is {name!r}{nearest(str(name), names)}")
    return name
