"""Recording: values at communication points, and the check that they are finite and within their bounds."""

from collections.abc import Mapping, Sequence

import numpy as np

from hfsa.cosim.actions.divergence import DivergenceError, Scale
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.systems.connectors import Connector


class Watch:
    """Check of an array of values, (n,): each must be finite and within the limits of its variable and its scale."""

    def __init__(self, names: Sequence[str], connectors: Sequence[Connector], values: np.ndarray):
        self.names, self.values = names, values
        self.low = np.array([-np.inf if c.min is None else c.min for c in connectors])
        self.high = np.array([np.inf if c.max is None else c.max for c in connectors])
        self.nominal = np.array([abs(c.nominal) for c in connectors])
        self.is_bounded = bool(np.isfinite(self.low).any() or np.isfinite(self.high).any())
        self._scales: dict[str, Scale] = {}

    def limit(self, scales: Mapping[str, Scale]) -> None:
        """Limit values (full names) to the limits of their scales as well."""
        self._scales |= scales
        limits = np.array([scales[name].limit if name in scales else np.inf for name in self.names])
        # in place: the stepping loop in C compares with these arrays
        np.maximum(self.low, -limits, out=self.low)
        np.minimum(self.high, limits, out=self.high)

    def check(self, time: float, bounds: bool = True) -> None:
        """Raise `StepError` for the first value that is not finite or, with `bounds`, outside its bounds.

        `DivergenceError` where it is outside the limit of its scale.
        """
        finite = np.isfinite(self.values)
        inside = (self.values >= self.low) & (self.values <= self.high) if bounds else True
        wrong = np.flatnonzero(~(finite & inside))
        if not wrong.size:
            return
        i = int(wrong[0])
        instance, _, variable = self.names[i].partition(".")
        scale = self._scales.get(self.names[i])
        if finite[i] and scale is not None and abs(self.values[i]) > scale.limit:
            raise DivergenceError(self.names[i], float(self.values[i]), scale, time)
        value = f"value {self.values[i]:.6g}"
        if finite[i]:
            message = f"{value}, expected {self.low[i]:.6g} to {self.high[i]:.6g}"
            raise StepError(instance, variable, "out of bounds", time, message)
        raise StepError(instance, variable, "not finite", time, value)


class Recording:
    """Values of named variables at every `every`-th communication point; `recording[name]` is one of them, (rows,).

    Attributes:
        names: full names of the variables.
        every: points between two rows.
        point: the values of the row being taken, (n,).
        watch: checks that row.
    """

    watch: Watch

    def __init__(self, names: tuple[str, ...], rows: int, every: int = 1):
        if rows < 1 or every < 1:
            raise ValueError(f"a recording of {rows} rows at every {every} points; expected at least 1 of each")
        self.names, self.every = names, every
        self.point = np.zeros(len(names))
        self._time = np.zeros(rows)
        self._values = np.zeros((rows, len(names)))
        self.rows = 0

    @property
    def time(self) -> np.ndarray:
        """Times of the rows so far [s], (rows,)."""
        return self._time[: self.rows]

    @property
    def values(self) -> np.ndarray:
        """Values so far, (rows, n)."""
        return self._values[: self.rows]

    def __getitem__(self, name: str) -> np.ndarray:
        return self.values[:, self.names.index(name)]

    def clear(self) -> None:
        """Remove all rows."""
        self.rows = 0

    def forget(self, rows: int) -> None:
        """Remove the first rows."""
        left = self.rows - rows
        self._time[:left] = self._time[rows : self.rows]
        self._values[:left] = self._values[rows : self.rows]
        self.rows = left

    def take(self, time: float) -> None:
        """Append the row `point`, then check it; `StepError` where a value is not finite or out of bounds."""
        if self.rows == len(self._time):
            self.grow()
        self._time[self.rows] = time
        self._values[self.rows] = self.point
        self.rows += 1
        self.watch.check(time)

    def grow(self) -> None:
        """Double the capacity, for a run longer than planned."""
        self._time = np.concatenate([self._time, np.zeros_like(self._time)])
        self._values = np.concatenate([self._values, np.zeros_like(self._values)])

    @property
    def room(self) -> tuple[np.ndarray, np.ndarray]:
        """Storage for the times, (capacity,), and values, (capacity, n), of all rows, used or not."""
        return self._time, self._values
