"""Recorded variables of a time-domain run, read from its results file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.results.files import ErrorEstimate, ResultsError, read_errors, read_run, read_status
from hfsa.cosim.results.recorded import TIME, Recorded
from hfsa.cosim.signals.prefixes import readable
from hfsa.cosim.systems.names import nearest
from hfsa.cosim.systems.notebook import drawn_by, summarized, summary

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from xarray import Dataset


@dataclass(frozen=True)
class Run:
    """Recorded variables over time.

    Attributes:
        path: results file.
        time: communication points reached [s], (points,).
        values: recorded variables by full name, (points,) each, in `units`.
        errors: error estimates by variable; empty unless the run was verified.
        status: `complete`, `failed`, `interrupted` or `running`.
        message: reason of a failure, else empty.
    """

    path: Path
    time: NDArray[np.float64]
    values: Mapping[str, NDArray[np.float64]]
    units: Mapping[str, str]
    errors: Mapping[str, ErrorEstimate]
    status: str
    message: str

    @classmethod
    def read(cls, path: str | Path) -> Self:
        """Read a run, finished or not; `ResultsError` where the file holds none."""
        path = Path(path)
        values, units = read_run(path)
        status, message = read_status(path)
        reached = np.all([np.isfinite(v) for v in values.values()], axis=0)
        reached_values = {name: v[reached] for name, v in values.items()}
        time = reached_values.pop("time")
        return cls(path, time, reached_values, units, read_errors(path), status, message)

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        """Return one variable over time, (points,); `ResultsError` with the nearest names if there is none."""
        if name not in self.values:
            raise ResultsError(f"{self.path} has no variable {name!r}{nearest(name, self.values)}")
        return self.values[name]

    def plot(self, signals: Sequence[str] = (), *, x: str | None = None) -> "Figure":
        """Return the figure of variables over time, or over another one; arguments and errors as `hfsa.cosim.plot`."""
        recorded = Recorded(self.path, self.path.stem, TIME, self.time, self.values, self.units)
        return drawn_by("signals", "signals_figure")([recorded], signals, x)

    @summarized
    def _repr_html_(self) -> str:
        """Return the range and the last value of every variable, and its error where it was estimated."""
        span = f"{len(self.time)}, {self.time[0]:g} to {self.time[-1]:g} s" if len(self.time) else "none"
        facts = {"file": self.path, "status": self.status, "rows": span, "failure": self.message}
        rows = (self._summary(name, values) for name, values in self.values.items())
        return summary(f"run {self.path.stem}", facts, ["variable", ">least", ">largest", ">last", ">error"], rows)

    def _summary(self, name: str, values: NDArray[np.float64]) -> tuple[object, ...]:
        """Return the row of a variable in the summary."""
        unit = self.units.get(name, "1")
        error = readable(self.errors[name].absolute, unit, ".2g") if name in self.errors else ""
        if not len(values):
            return name, "", "", "", error
        return name, *(readable(float(value), unit) for value in (values.min(), values.max(), values[-1])), error

    def to_xarray(self) -> "Dataset":
        """Return the variables as an `xarray.Dataset` over `time`, with units; requires the extra `analysis`."""
        import xarray

        variables = {name: ("time", v, {"units": self.units[name]}) for name, v in self.values.items()}
        return xarray.Dataset(variables, coords={"time": ("time", self.time, {"units": "s"})})
