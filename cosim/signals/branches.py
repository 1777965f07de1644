"""Branches of a nonlinear response: where upward and downward sweeps differ, and where a sweep jumps.

    flags = branch_flags(up, down, units, tolerance=1e-3)      # (frequencies,) of one input
    flags & JUMP_UP                                            # the upward sweep arrives at this frequency by a jump

Two sweeps of one branch are equal within the tolerance of settling. Where they differ by much more, the response has
two stable branches. At the end of such a range one of the two sweeps loses its branch and jumps to the other's: the one
that changes more from one frequency to the next. Ranges narrower than the spacing of the frequencies are not seen.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

JUMP_UP, JUMP_DOWN, DIFFERENT = 1, 2, 4
"""Flags of a frequency: the upward sweep arrives by a jump, the downward one does, the two differ."""

FACTOR = 10.0
"""Difference of two branches, in settling tolerances."""

_NOTHING = 1e-9
"""Size relative to the largest output below which all outputs of a unit are rounding noise."""


def branch_flags(
    up: NDArray[np.complex128], down: NDArray[np.complex128], units: Sequence[str], tolerance: float
) -> NDArray[np.int8]:
    """Return the flags of each frequency, (frequencies,), for responses to one input, (frequencies, outputs) each.

    `tolerance` is that of settling. Frequencies where one of the responses is NaN have no flags.
    """
    flags = np.zeros(len(up), dtype=np.int8)
    known = np.all(np.isfinite(up) & np.isfinite(down), axis=1)
    differs = known & (_change(up, down, units) > FACTOR * tolerance)
    flags[differs] |= DIFFERENT
    rise, fall = _change(up[1:], up[:-1], units), _change(down[1:], down[:-1], units)
    for k in np.flatnonzero(known[1:] & known[:-1] & (differs[1:] != differs[:-1])):
        if rise[k] > fall[k]:
            flags[k + 1] |= JUMP_UP
        else:
            flags[k] |= JUMP_DOWN
    return flags


def _change(one: NDArray[np.complex128], other: NDArray[np.complex128], units: Sequence[str]) -> NDArray[np.float64]:
    """Return the largest difference among outputs of a unit, relative to the largest of them, of all units the most."""
    size = np.nan_to_num(np.maximum(np.abs(one), np.abs(other)))
    difference, found = np.nan_to_num(np.abs(one - other)), np.zeros(len(one))
    for unit in dict.fromkeys(units):
        own = [i for i, u in enumerate(units) if u == unit]
        scale, change = size[:, own].max(axis=1), difference[:, own].max(axis=1)
        counts = scale > _NOTHING * size.max(axis=1)
        found = np.maximum(found, np.divide(change, scale, out=np.zeros(len(one)), where=counts))
    return found
