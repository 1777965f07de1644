"""Recorded variables of a time-domain run, read from its results file."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.results.files import ErrorEstimate, ResultsError, read_errors, read_run, read_status
from hfsa.cosim.systems.names import nearest

if TYPE_CHECKING:
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

    def to_xarray(self) -> "Dataset":
        """Return the variables as an `xarray.Dataset` over `time`, with units; requires the extra `analysis`."""
        import xarray

        variables = {name: ("time", v, {"units": self.units[name]}) for name, v in self.values.items()}
        return xarray.Dataset(variables, coords={"time": ("time", self.time, {"units": "s"})})
