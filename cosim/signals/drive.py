"""Signals over time that drive an input: their values and derivatives, jumps, and the content that steps must resolve.

    signal.derivatives(time)                  # (4, n): value, rate, acceleration, jerk
    signal.derivatives(time, -1e-9)           # the same just before a jump, where one is at that time

A signal consists of pieces, each smooth; `breaks` are the times between them. The piece in force a little after or
before a time is evaluated at that time itself, so that a value has two limits at a jump. Shapes with a formula are in
`shapes.py`, sums of sines in `sums.py`, tables in `table.py`. All derivatives are exact.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

ORDERS = 4
"""Rows of `derivatives`: the value, and its first three derivatives."""

Times = NDArray[Any]
"""Times [s]."""

Shift = float | NDArray[np.float64]
"""Time [s] from a time to the instant whose piece is in force, for all times or for each."""


class Signal(ABC):
    """A signal over time [s], in the unit of the input that it drives.

    Attributes:
        known: number of exact derivatives.
        is_smooth: whether the value and its rate are continuous; a signal that is not has `breaks`.
    """

    known: ClassVar[int] = ORDERS - 1
    is_smooth: ClassVar[bool] = True

    @abstractmethod
    def derivatives(self, time: Times, shift: Shift = 0.0) -> NDArray[np.float64]:
        """Return the value and three derivatives at times, (4, n), by the piece in force `shift` [s] later."""

    @property
    @abstractmethod
    def text(self) -> str:
        """The signal in the words of the command line, by which a run can be repeated."""

    @property
    def fingerprint(self) -> str:
        """Hash of the data behind `text`, empty where the text says all."""
        return ""

    @property
    def highest(self) -> float:
        """Highest frequency of its content [Hz], 0 where it has no upper end."""
        return 0.0

    def breaks(self, begin: float, end: float) -> NDArray[np.float64]:  # noqa: ARG002 (of signals with pieces)
        """Return the times [s] between `begin` and `end`, both excluded, at which the value or its rate jumps."""
        return np.zeros(0)

    def knots(self, begin: float, end: float) -> NDArray[np.float64]:
        """Return the times [s] in an interval at which the signal is given, beside its breaks; none for a formula."""
        return self.breaks(begin, end)

    def remarks(self, begin: float, end: float) -> list[str]:  # noqa: ARG002 (of signals with an end)
        """Return sentences on what a run from `begin` to `end` [s] makes of it."""
        return []


@dataclass(frozen=True)
class Function(Signal):
    """A function of the time [s] that returns the value, or the value and up to three derivatives.

    `known` of an object is the number of derivatives that it returns; the others are NaN. `ValueError` for a result
    that is no finite number, with the time.
    """

    function: Callable[[float], Any]

    def __post_init__(self):
        object.__setattr__(self, "known", len(self._at(0.0)) - 1)

    def derivatives(self, time: Times, shift: Shift = 0.0) -> NDArray[np.float64]:  # noqa: ARG002
        """Return the value and its derivatives as far as the function returns them, (4, n); NaN for the others."""
        found = np.full((ORDERS, len(time)), np.nan)
        for i, at in enumerate(time.tolist()):
            found[: self.known + 1, i] = self._at(at)
        return found

    @property
    def text(self) -> str:
        """Its name."""
        return f"function {getattr(self.function, '__qualname__', type(self.function).__name__)}"

    def _at(self, time: float) -> NDArray[np.float64]:
        """Return what the function returns at a time, (1 to 4,)."""
        try:
            result = self.function(time)
        except Exception as error:  # a function of the user's may raise anything
            raise ValueError(f"{self.text} raises {type(error).__name__} at {time:.9g} s: {error}") from error
        try:
            found = np.atleast_1d(np.asarray(result, dtype=float))
        except (TypeError, ValueError):
            found = np.zeros(0)
        if found.ndim != 1 or not 1 <= len(found) <= ORDERS or not np.all(np.isfinite(found)):
            raise ValueError(
                f"{self.text} returns {result!r} at {time:.9g} s, expected a finite number, or one with up to "
                f"{ORDERS - 1} derivatives"
            )
        return found


def described(name: str, **numbers: Any) -> str:
    """Return a shape in the words of the command line: `sine,amplitude=1e-06,frequency=20.0`."""
    return ",".join([name, *(f"{key.rstrip('_')}={value}" for key, value in numbers.items())])
