"""Driving signals from tables: values at rising times, joined in one of three ways, constant before and after.

    held     the value of a row up to the next one
    linear   straight lines
    smooth   cubic splines with two continuous derivatives, of rate 0 at both ends

The error of `linear` for a signal of frequency f with rows a time h apart is (2 pi f h)^2 / 8 of its amplitude at most,
that of `smooth` (2 pi f h)^4 5 / 384, where the signal begins and ends at rest.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hfsa.cosim.signals.drive import ORDERS, Shift, Signal, Times

Interpolation = Literal["held", "linear", "smooth"]
"""Ways to join the rows of a table."""


@dataclass(frozen=True, eq=False)
class Table(Signal):
    """A signal given at rising times, (rows,) [s].

    Attributes:
        source: words for the table in messages and in the results file.
        unit: unit of its values, `None` where it states none.
        rows: the line in its file of each row, `None` where it is from no file.

    Raises:
        ValueError: fewer than two rows, arrays of other shapes, a number that is not finite, or a time that does not
            rise, by the row.
    """

    time: NDArray[np.float64]
    values: NDArray[np.float64]
    interpolation: Interpolation = "linear"
    source: str = "a table"
    unit: str | None = None
    rows: Sequence[int] | None = field(default=None, repr=False)

    def __post_init__(self):
        if self.interpolation not in ("held", "linear", "smooth"):
            raise ValueError(f"interpolation is {self.interpolation!r}, expected held, linear or smooth")
        for name in ("time", "values"):
            object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), dtype=float))
        if self.time.ndim != 1 or self.time.shape != self.values.shape:
            raise ValueError(
                f"{self.source} has times of shape {self.time.shape} and values of shape {self.values.shape}, expected "
                "one value for each time"
            )
        if len(self.time) < 2:
            raise ValueError(f"{self.source} has {len(self.time)} rows, expected 2 or more")
        for name, column in (("time", self.time), ("value", self.values)):
            if len(wrong := np.flatnonzero(~np.isfinite(column))):
                raise ValueError(f"{self._row(wrong[0])}: {name} is {column[wrong[0]]}, expected a finite number")
        if len(falls := np.flatnonzero(np.diff(self.time) <= 0)):
            before, at = self.time[falls[0] : falls[0] + 2]
            raise ValueError(f"{self._row(falls[0] + 1)}: time is {at:.9g} s after {before:.9g} s, expected a rise")

    def _row(self, row: int) -> str:
        """Return words for a row: its line in a file, or its number from 1."""
        return f"{self.source}, row {row + 1}" if self.rows is None else f"{self.source}, line {self.rows[row]}"

    @property
    def is_smooth(self) -> bool:  # type: ignore[override]
        """Whether splines join the rows."""
        return self.interpolation == "smooth"

    @property
    def text(self) -> str:
        """The table in the words of the command line."""
        return f"{self.source},interpolation={self.interpolation}"

    @property
    def fingerprint(self) -> str:
        """Hash of the times and values."""
        return hashlib.sha256(self.time.tobytes() + self.values.tobytes()).hexdigest()

    @cached_property
    def _pieces(self) -> Any:
        """Polynomials between the rows, as coefficients (4, rows - 1) of falling powers of the time since a row."""
        if self.interpolation == "smooth":
            # scipy is slow to import
            from scipy.interpolate import CubicSpline

            return CubicSpline(self.time, self.values, bc_type="clamped").c
        slope = np.diff(self.values) / np.diff(self.time) if self.interpolation == "linear" else 0 * self.time[1:]
        return np.array([0 * slope, 0 * slope, slope, self.values[:-1]])

    def derivatives(self, time: Times, shift: Shift = 0.0) -> NDArray[np.float64]:
        """Return the value and its derivatives, (4, n); all but the value are 0 outside of the table."""
        piece = np.searchsorted(self.time, time + shift, side="right") - 1
        inside = (piece >= 0) & (piece < len(self.time) - 1)
        found = np.zeros((ORDERS, len(time)))
        found[0] = np.where(piece < 0, self.values[0], self.values[-1])
        i = piece[inside]
        s = time[inside] - self.time[i]
        a, b, c, d = self._pieces[:, i]
        found[:, inside] = [((a * s + b) * s + c) * s + d, (3 * a * s + 2 * b) * s + c, 6 * a * s + 2 * b, 6 * a]
        return found

    def breaks(self, begin: float, end: float) -> NDArray[np.float64]:
        """Return the times of the rows in an interval; with splines those of the first and the last one alone."""
        times = self.time[[0, -1]] if self.interpolation == "smooth" else self.time
        return _between(times, begin, end)

    def knots(self, begin: float, end: float) -> NDArray[np.float64]:
        """Return the times of the rows in an interval."""
        return _between(self.time, begin, end)

    def remarks(self, begin: float, end: float) -> list[str]:
        """Return a sentence for a run that begins before the table or ends after it."""
        slack = 1e-9 * (end - begin)
        parts = []
        if begin < self.time[0] - slack:
            parts.append(f"{self.values[0]:.6g} before {self.time[0]:.6g} s")
        if end > self.time[-1] + slack:
            parts.append(f"{self.values[-1]:.6g} after {self.time[-1]:.6g} s")
        return [f"{self.source} is held at its ends: {' and '.join(parts)}"] if parts else []


def _between(times: NDArray[np.float64], begin: float, end: float) -> NDArray[np.float64]:
    """Return the rising times in an interval, its ends excluded."""
    return times[np.searchsorted(times, begin, side="right") : np.searchsorted(times, end, side="left")]


def table(rows: ArrayLike, interpolation: Interpolation = "linear", source: str = "a table") -> Table:
    """Return the signal of an array of rows (time [s], value), (rows, 2); `ValueError` for any other shape."""
    found = np.asarray(rows, dtype=float)
    if found.ndim != 2 or found.shape[1] != 2:
        raise ValueError(f"{source} has the shape {found.shape}, expected rows of a time and a value, (rows, 2)")
    return Table(found[:, 0], found[:, 1], interpolation, source)
