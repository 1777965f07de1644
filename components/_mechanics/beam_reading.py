"""A normalised compliance as its source reads it: entry by entry, and column by column as screws.

    as_read(C)        entries below 0.01 of the largest one are 0 (eqs 10, 23)
    screws(C)         column j is the motion (v; w) by load j: pitch v.w / w.w, radius |w x v| / w.w (eqs 24 to 26)

The reading depends on the axes and on the reference point, unlike that of `mobility.py`: motions that remain on the
diagonal are not independent where columns are proportional, as those of a tilted module, v = -r x w.

Source: the paper of 2013 on beam modules.
"""

from typing import NamedTuple

import numpy as np

MOTIONS = ("x", "y", "z", "thx", "thy", "thz")
"""Names of the displacements."""
LOADS = ("p", "fy", "fz", "mx", "my", "mz")
"""Names of the loads."""

SMALL = 0.01
"""Size of an entry, relative to the largest, below which it is read as 0."""


class Screw(NamedTuple):
    """The motion by a load.

    Attributes:
        load: name of the load.
        pitch: translation along the axis per rotation; `None` of a translation.
        radius: distance of the axis from the reference point; `None` of a translation.
        direction: unit vector of the axis, or of the translation, shape (3,).
    """

    load: str
    pitch: float | None
    radius: float | None
    direction: np.ndarray


def as_read(C: np.ndarray) -> np.ndarray:
    """Return a compliance without its small entries, shape (6, 6)."""
    size = np.abs(C)
    return np.where(size < SMALL * size.max(), 0.0, C)


def motions(C: np.ndarray) -> list[str]:
    """Return the names of the displacements whose entries on the diagonal are not 0."""
    return [name for name, value in zip(MOTIONS, np.diag(C), strict=True) if value != 0]


def screws(C: np.ndarray) -> list[Screw]:
    """Return the screws of the columns of a compliance that are not 0."""
    found = []
    for load, column in zip(LOADS, C.T, strict=True):
        v, w = column[:3], column[3:]
        turn = float(w @ w)
        if turn > 0:
            radius = float(np.linalg.norm(np.cross(w, v))) / turn
            found.append(Screw(load, float(v @ w) / turn, radius, w / np.sqrt(turn)))
        elif np.any(v):
            found.append(Screw(load, None, None, v / np.linalg.norm(v)))
    return found
