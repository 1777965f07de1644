"""Motions of a scene that are in a file: a table in CSV, which the reference of the scene or a part before it reads."""

import csv
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import DERIVATIVES, nearest
from hfsa.cosim.systems.system import Component, Connection


class MotionFile(str):
    """Path of a motion file, as the annotation of an argument."""

    ENDING = ".csv"


_NO_END = 1.0
"""End [s] of a run on a file without one, which its reader refuses."""


def is_file(motion: str, scene: str, names: Sequence[str]) -> bool:
    """Whether a motion is a file; `StructureError` where it is neither that nor one of the names."""
    if not isinstance(motion, str) or (not motion.endswith(MotionFile.ENDING) and motion not in names):
        others = f"one of {', '.join(names)}, or " if names else ""
        near = nearest(str(motion), names).partition("; there are")[0]
        raise StructureError(
            f"{scene}: motion is {motion!r}, expected {others}the path of a {MotionFile.ENDING} file{near}"
        )
    return motion.endswith(MotionFile.ENDING)


def end_of(motion: str) -> float:
    """Return the last time in a motion file [s]; 1 s for a file that cannot be read, which its reader refuses."""
    if not Path(motion).is_file():
        return _NO_END
    try:
        rows = [row for row in csv.reader(Path(motion).read_text(encoding="utf-8-sig").splitlines()) if any(row)]
        header = [heading.partition("[")[0].strip() for heading in rows[0]]
        end = float(rows[-1][header.index("time")])
    except (OSError, ValueError, IndexError, csv.Error):
        return _NO_END
    return end if 0 < end < math.inf else _NO_END


class Command(NamedTuple):
    """Commanded pose of a robot: what generates it, or the inputs that can be excited, and the end of a run [s]."""

    components: list[Component]
    connections: list[Connection]
    inputs: list[str]
    stop_time: float


def commanded(motion: str | None, scene: str, stop_time: float, reach: float) -> Command:
    """Return the command of `reference`: the motion in a file, or without one free inputs and `stop_time` [s].

    `reach` is the farthest displacement of the platform that may be meant [m].
    """
    sides = ("rotation", "position")
    if motion is None:
        return Command([], [], [f"reference.command.{side}[1..3]" for side in sides], stop_time)
    is_file(motion, scene, ())
    orders = ("", *(f"_{derivative}" for derivative in DERIVATIVES[:2]))
    return Command(
        [Component("motion", "pose_table", None, {"table": motion, "reach": reach})],
        [
            Connection(f"motion.{side}{order}[1..3]", f"reference.command.{side}{order}[1..3]")
            for side in sides
            for order in orders
        ],
        [],
        end_of(motion),
    )
