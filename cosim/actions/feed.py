"""The action that feeds values of its own to inputs: rows that are known ahead of time, or of the present time.

    feed = Ahead(rows, array, calls, clock)     # rows(times) -> (n, width)
    feed.run()                                  # the next row goes into the array, then the calls are made

`Ahead` computes a block of rows at once, for communication points whose times are known; the stepping loop in C takes
the rows from the same block. `Now` computes the row of the present time, for steps of any length.
"""

from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.actions.action import CompositeAction, Group
from hfsa.cosim.actions.algebraic_loop import STALE
from hfsa.cosim.fmi.co_simulation import Call, Number

BLOCK = 4096
"""Rows that are computed at once."""


@dataclass
class Clock:
    """Times of the communication points: `start + k step` [s], up to number `last`."""

    start: float
    step: float
    last: int


@dataclass(eq=False)
class Feed(CompositeAction):
    """Writes a row into an array, (width,), and makes the calls that hand it over.

    Attributes:
        affected: groups with direct feedthrough from the inputs that it sets.
    """

    rows: Callable[[NDArray[np.float64]], NDArray[np.float64]]
    array: NDArray[np.float64]
    calls: Sequence[Call]
    affected: list[Group] = field(default_factory=list, init=False)

    @abstractmethod
    def begin(self) -> None:
        """Forget what is known, before a start."""


@dataclass(eq=False)
class Now(Feed):
    """Feeds the row of the present time."""

    time: Number

    def begin(self) -> None:
        """Do nothing, as nothing is kept."""

    def run(self) -> int:
        """Compute the row and hand it over; return the first status that is not ok."""
        self.array[:] = self.rows(np.array([self.time.value]))[0]
        return self._run(self.calls)


@dataclass(eq=False)
class Ahead(Feed):
    """Feeds one row after the other, each once.

    Attributes:
        block: rows of `BLOCK` communication points, (BLOCK, width); `next` is the place of the next one, (1,).
    """

    clock: Clock
    block: NDArray[np.float64] = field(init=False)
    next: NDArray[np.uintp] = field(init=False)

    def __post_init__(self):
        self.block = np.zeros((BLOCK, len(self.array)))
        self.next = np.full(1, BLOCK, dtype=np.uintp)

    def begin(self) -> None:
        """Forget the block, before a start."""
        self.next[0] = BLOCK

    def run(self) -> int:
        """Hand over the next row; return the first status that is not ok, `STALE` where the block is used up."""
        row = int(self.next[0])
        if row == BLOCK:
            return STALE
        self.array[:] = self.block[row]
        self.next[0] = row + 1
        return self._run(self.calls)

    def solve(self, time: float) -> int:
        """Compute the rows from `time` [s] on, and hand over the first; `StepError` where that fails."""
        clock = self.clock
        first = round((time - clock.start) / clock.step)
        count = min(max(clock.last + 1 - first, 1), BLOCK)
        self.block[BLOCK - count :] = self.rows(
            clock.start + np.arange(first, first + count, dtype=np.float64) * clock.step
        )
        self.next[0] = BLOCK - count
        return self._checked(self.run(), time)
