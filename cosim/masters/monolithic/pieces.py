"""Pieces of driving signals: the solver integrates from one jump of a signal to the next, and never across it.

pieces = Pieces(drive, step_size)
pieces.begin(0.0)
pieces.next                     # time of the next jump [s]; there the solver stops
pieces.passes(time)             # True at a jump; the next piece is in force then
"""

import math

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.actions.drive import SAME, Drive


class Pieces:
    """The piece of each signal in force; without a `drive` there is one, without end.

    Attributes:
        next: time of the next jump [s], infinite where there is none.
        lead: time [s] by which inputs are fed ahead, within the piece in force.
    """

    def __init__(self, drive: Drive | None, step_size: float):
        self._drive, self._margin = drive, SAME * step_size
        self._first, self.next, self.lead = -math.inf, math.inf, 0.0

    def begin(self, time: float) -> None:
        """Begin at the start [s]."""
        self._first, self.next = time, math.inf if self._drive is None else self._drive.next_break(time)

    def passes(self, time: float) -> bool:
        """Return whether a jump is at a time [s]; the piece after it is in force then."""
        if time < self.next - self._margin - 8 * np.spacing(time):
            return False
        self.begin(self.next)
        return True

    def rows(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values of the driven inputs at one time [s], (1, n), by the piece in force."""
        assert self._drive is not None
        return self._drive.within(np.minimum(time + self.lead, self.next), self._first, self.next)
