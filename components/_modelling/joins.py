"""Which parts may feed a part: levels that do not fit together although their ports do.

    JOINS = (Join("rigid", "drive[", {"sdelta_reference": None, "c_drive": ("ideal",)}, "it has no inertia"),)

A part declares `JOINS` beside its function; `hfsa.cosim` checks the systems in which the part stands.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Join:
    """Inputs of a part that only some parts may feed.

    Attributes:
        level: of the part; at its other levels any part may feed them.
        inputs: the beginning of their names.
        allowed: levels that may feed them by name of the part, `None` for all levels.
        reason: the end of a sentence that begins with the part.
        having: values that an argument of the feeding part must have one of, by argument.
    """

    level: str
    inputs: str
    allowed: Mapping[str, tuple[str, ...] | None]
    reason: str
    having: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
