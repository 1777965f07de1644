"""Motions in tables: columns over time, joined by cubic splines with two continuous derivatives.

    y(t) = A y_i + B y_j + h^2 / 6 ((A^3 - A) c_i + (B^3 - B) c_j),    A = (t_j - t) / h,  B = 1 - A

between a row i and the next one j, h later. The second derivatives c make the first and second derivative continuous,
and the rate zero at the first and the last row, as the motion is constant before and after. Where a motion has four
continuous derivatives and begins and ends at rest, the error of y is 5/384 h^4 times its largest fourth derivative at
most, and that of the rate h^3 / 24 times (Hall and Meyer, Optimal error bounds for cubic spline interpolation, 1976).
The row is found by bisection, so the cost of a step hardly depends on the length of the table.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from hfsa.components._modelling.csv_file import read_csv
from hfsa.components._modelling.documents import Document
from hfsa.components._modelling.errors import ModelError

TIME = "time"
"""Column of the time of a row."""

UNITS = {
    TIME: "s",
    **dict.fromkeys(("x", "y", "z"), "m"),
    **dict.fromkeys(("yaw", "rotation_x", "rotation_y", "rotation_z"), "rad"),
    **dict.fromkeys(("elongation_1", "elongation_2", "elongation_3"), "m"),
}
"""Units of all columns that a motion may have."""

MOST_ROWS = 100_000
"""Largest number of rows: the FMU holds all of them."""


class Motion(NamedTuple):
    """A motion with its first and second derivatives, columns of expressions."""

    value: ca.SX
    rate: ca.SX
    acceleration: ca.SX


@dataclass(frozen=True)
class MotionTable(Document):
    """Table of a motion: its columns by name, `time` among them, in SI units.

    Raises:
        ModelError: no time, or nothing else; an unknown column; columns of different lengths; fewer than two rows, or
            more than `MOST_ROWS`; a value that is not finite; a time that does not rise, by the row.
    """

    columns: Mapping[str, tuple[float, ...]]

    ENDING: ClassVar[str] = ".csv"

    def __post_init__(self):
        for name in self.columns:
            if name not in UNITS:
                raise ModelError(f"no column {name!r}; a motion has {TIME} and some of {', '.join(list(UNITS)[1:])}")
        if TIME not in self.columns or len(self.columns) < 2:
            raise ModelError(f"it has the columns {', '.join(self.columns) or 'none'}, expected {TIME} and a motion")
        lengths = {name: len(values) for name, values in self.columns.items()}
        if len(set(lengths.values())) > 1:
            raise ModelError(f"its columns have different lengths: {lengths}")
        if not 2 <= lengths[TIME] <= MOST_ROWS:
            raise ModelError(
                f"it has {lengths[TIME]} rows, expected 2 to {MOST_ROWS}; the splines between them follow a smooth "
                "motion with some 20 rows per period of its highest frequency"
            )
        for name, values in self.columns.items():
            if len(wrong := np.flatnonzero(~np.isfinite(values))):
                raise ModelError(f"row {wrong[0] + 1}: {name} is {values[wrong[0]]}, expected a finite number")
        if len(falls := np.flatnonzero(np.diff(self.time) <= 0)):
            before, at = self.time[falls[0] : falls[0] + 2]
            raise ModelError(f"row {falls[0] + 2}: {TIME} is {at:g} s after {before:g} s, expected a later one")

    @classmethod
    def table_of(cls, file: Path) -> Mapping[str, Any]:
        """Return the table of a CSV file; `ModelError` as `read_csv`."""
        found = read_csv(file, UNITS, str(file)).columns
        return {"columns": {name: tuple(values.tolist()) for name, values in found.items()}}

    @property
    def time(self) -> NDArray[np.float64]:
        """Times of the rows, (rows,) [s]."""
        return np.asarray(self.columns[TIME])

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns beside the time."""
        return tuple(name for name in self.columns if name != TIME)

    def values(self, names: Sequence[str]) -> NDArray[np.float64]:
        """Return columns, zeros for those that the table has not, (rows, names)."""
        nothing = np.zeros(len(self.time))
        return np.column_stack([np.asarray(self.columns.get(name, nothing)) for name in names])

    @property
    def information(self) -> dict[str, Any]:
        """What an FMU tells of the table in its constants."""
        return {"rows": len(self.time), "end": float(self.time[-1]), "columns": ", ".join(self.columns)}


def splined(table: MotionTable, names: Sequence[str], time: ca.SX) -> Motion:
    """Return the motion of columns at a time: splines, constant before the first row and after the last one."""
    # scipy is slow to import
    from scipy.interpolate import CubicSpline

    at, values = table.time, table.values(names)
    second = CubicSpline(at, values, bc_type="clamped")(at, 2)
    stacked = _lookup(at, values, second)(ca.fmin(ca.fmax(time, at[0]), at[-1]))
    value, rate, acceleration = ca.vertsplit(stacked, len(names))
    is_moving = ca.logic_and(time >= at[0], time < at[-1])
    return Motion(value, rate, ca.if_else(is_moving, acceleration, 0))


def _lookup(at: NDArray[np.float64], values: NDArray[np.float64], second: NDArray[np.float64]) -> ca.Function:
    """Return the function of a time within the table to values, rates and accelerations, shape (3 n, 1).

    It is called, not inlined: matrix expressions have the bisection and the look-up that scalar ones lack.
    """
    n = values.shape[1]
    rows = ca.MX(ca.DM(np.column_stack([at, values, second]).T))
    t = ca.MX.sym("t")
    i = ca.low(ca.MX(ca.DM(at)), t, {"lookup_mode": "binary"})
    begin, end = rows[:, i], rows[:, i + 1]
    h = end[0] - begin[0]
    A, B = (end[0] - t) / h, (t - begin[0]) / h
    (y_i, c_i), (y_j, c_j) = ((row[1 : 1 + n], row[1 + n :]) for row in (begin, end))
    value = A * y_i + B * y_j + h**2 / 6 * ((A**3 - A) * c_i + (B**3 - B) * c_j)
    rate = (y_j - y_i) / h + h / 6 * ((1 - 3 * A**2) * c_i + (3 * B**2 - 1) * c_j)
    return ca.Function("motion_table", [t], [ca.vertcat(value, rate, A * c_i + B * c_j)], {"never_inline": True})
