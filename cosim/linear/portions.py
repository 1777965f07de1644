"""Portions of frequencies whose equations are solved in one call: more would only take memory."""

from collections.abc import Iterator

_MOST = 256
"""Frequencies of a portion at most."""
_NUMBERS = 2**22
"""Numbers of the matrices of a portion at most, 64 MB of them; a single matrix may be larger."""


def portions(count: int, unknowns: int) -> Iterator[slice]:
    """Yield slices of `count` frequencies, each of which takes a square matrix of so many unknowns."""
    at_once = min(_MOST, max(1, _NUMBERS // max(1, unknowns**2)))
    for first in range(0, count, at_once):
        yield slice(first, first + at_once)
