"""Motions of a scene that are in a file: a table in CSV, which the reference reads."""

from collections.abc import Sequence
from pathlib import Path

from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import nearest

ENDING = ".csv"
"""Ending of the name of a motion file."""

_NO_END = 1.0
"""End [s] of a run on a file without one, which its reader refuses."""


def is_file(motion: str, scene: str, names: Sequence[str]) -> bool:
    """Whether a motion is a file; `StructureError` where it is neither that nor one of the names."""
    if not motion.endswith(ENDING) and motion not in names:
        raise StructureError(
            f"{scene}: motion is {motion!r}, expected one of {', '.join(names)}, or the path of a {ENDING} file"
            f"{nearest(motion, names).partition('; there are')[0]}"
        )
    return motion.endswith(ENDING)


def end_of(motion: str) -> float:
    """Return the last time in a motion file [s]; 1 s for a file that cannot be read, which its reader refuses."""
    try:
        lines = Path(motion).read_text(encoding="utf-8-sig").split()
        header = [heading.partition("[")[0].strip() for heading in lines[0].split(",")]
        return float(lines[-1].split(",")[header.index("time")])
    except (OSError, ValueError, IndexError):
        return _NO_END
