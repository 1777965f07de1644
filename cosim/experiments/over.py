"""Values of arguments in words: `law=pd,ctc`, `pose=1,2,3;4,5,6`, `rate=1e-6:3e-6:5`."""

import re
from collections.abc import Sequence

import numpy as np

from hfsa.cosim.systems.errors import StructureError

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_SPACED = re.compile(rf"^({_NUMBER}):({_NUMBER}):([1-9]\d{{0,3}})$")
"""FIRST:LAST:COUNT, up to 9999 values."""
_LIKE_SPACED = re.compile(rf"^{_NUMBER}:{_NUMBER}(:.*)?$")


def parse_over(words: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return values by name from words NAME=VALUES; values are separated by semicolons if there is one, else by commas.

    `0:12e-6:7` are seven values, evenly spaced from 0 to 12e-6.

    `StructureError` for a word without `=`, a name given twice, and an empty value.
    """
    over: dict[str, tuple[str, ...]] = {}
    for word in words:
        name, equals, text = word.partition("=")
        if not (name and equals):
            raise StructureError(f"--over {word!r} is not of the form NAME=VALUES, such as law=pd,ctc")
        if name in over:
            raise StructureError(f"--over {name} is given twice; write all its values at once")
        values = [value.strip() for value in text.split(";" if ";" in text else ",")]
        if not all(values):
            raise StructureError(f"--over {word!r} has an empty value; expected values between commas or semicolons")
        over[name] = tuple(item for value in values for item in _spaced(value))
    return over


def _spaced(word: str) -> list[str]:
    """Return the values of FIRST:LAST:COUNT; of any other word, itself."""
    match = _SPACED.match(word)
    if match is None:
        if _LIKE_SPACED.match(word):
            raise StructureError(f"--over has {word!r}, expected FIRST:LAST:COUNT with a count of 1 to 9999")
        return [word]
    values = np.linspace(float(match[1]), float(match[2]), int(match[3]))
    is_whole = all(re.fullmatch(r"[+-]?\d+", end) for end in match.groups()) and not np.any(values % 1)
    return [str(int(value)) if is_whole else repr(value) for value in values.tolist()]
