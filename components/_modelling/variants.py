"""Names of the variants of a part: what differs from its default level and arguments, as the end of an identifier.

    Pd_continuous    SDelta_rigid_payload_mass_1    CDrive_encoder_resolution_1em06    SDelta_3f2a91c0

The level comes first, then the other arguments by name, each with its value, in alphabetical order. In numbers `p`
stands for the point and `m` for minus. What would be longer, or has other characters, is the beginning of a hash.
"""

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

_LONGEST = 40
_WORD = re.compile(r"[a-z0-9_]+|[A-Z]|True|False", re.ASCII)
"""Texts that can stand in a name: no two of them differ in case alone, which some file systems do not tell apart."""

Constants = Mapping[str, float | str]
"""The values of one argument, by name; several for a vector or a table."""


def variant(level: str, changed: Mapping[str, Constants]) -> str:
    """Return the name of a variant with a level, empty for the default, and other arguments that are not the default.

    Equal arguments give equal names, different ones different names.
    """
    named = [(name, *map(_word, values.values())) for name, values in sorted(changed.items())]
    words = [re.sub(r"\W+", "_", name).strip("_") + "".join(f"_{value}" for value in values) for name, *values in named]
    rest = "_".join(words)
    is_plain = all(value for _, *values in named for value in values) and all(changed.values())
    if rest and not (is_plain and len(rest) <= _LONGEST):
        rest = hashed([[name, sorted(values.items())] for name, values in sorted(changed.items())])
    return "_".join(word for word in (level, rest) if word)


def hashed(words: Sequence[Any]) -> str:
    """Return eight hexadecimal digits that depend on all words."""
    return hashlib.sha256(json.dumps(words).encode()).hexdigest()[:8]


def _word(value: float | str) -> str:
    """Return a value as it stands in an identifier, empty where it cannot."""
    if isinstance(value, str):
        return value if _WORD.fullmatch(value) else ""
    return repr(float(value)).removesuffix(".0").replace("-", "m").replace("+", "").replace(".", "p")
