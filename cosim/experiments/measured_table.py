"""Tables of measurements: columns of a CSV or HDF5 file by name, or the matrix of a CSV file without a header.

    read_measured(Path("poses.csv"), {"x": "m", "yaw": "rad"})      # {"x": (rows,), "yaw": (rows,)}
    read_measured(Path("jacobian.csv"), ...)                        # array, (rows, columns)

An HDF5 file has one dataset per column, with its unit as the attribute `unit`, where it has one.
"""

import csv
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.components._modelling.csv_file import read_csv
from hfsa.components._modelling.errors import nearest
from hfsa.cosim.results.records import ResultsError

_HDF5 = (".h5", ".hdf5")


def read_measured(file: Path, units: Mapping[str, str]) -> dict[str, NDArray[np.float64]] | NDArray[np.float64]:
    """Return the columns of a table by name, (rows,) each, or a matrix.

    Args:
        file: CSV file, or HDF5 file by its ending.
        units: unit of each column that the table may have, by name.

    Raises:
        ModelError: as `read_csv`.
        ResultsError: an HDF5 file that cannot be read, with an unknown dataset, another unit, or numbers that are not
            finite or not of one length.
    """
    if file.suffix.lower() in _HDF5:
        return _of_hdf5(file, units)
    matrix = _matrix(file)
    return dict(read_csv(file, units, str(file)).columns) if matrix is None else matrix


def _matrix(file: Path) -> NDArray[np.float64] | None:
    """Return the matrix of a file of numbers alone; `None` for any other file."""
    if not file.is_file():
        return None
    try:
        rows = [row for row in csv.reader(file.read_text(encoding="utf-8-sig").splitlines()) if any(row)]
        matrix = np.array([[float(cell) for cell in row] for row in rows])
    except (OSError, ValueError, csv.Error):
        return None
    return matrix if matrix.ndim == 2 and np.all(np.isfinite(matrix)) else None


def _of_hdf5(file: Path, units: Mapping[str, str]) -> dict[str, NDArray[np.float64]]:
    """Return the columns of an HDF5 file."""
    import h5py

    columns = {}
    try:
        with h5py.File(file, "r") as data:
            for name, item in data.items():
                if name not in units:
                    raise ResultsError(f"{file}: no column {name!r}{nearest(name, units)}")
                if not isinstance(item, h5py.Dataset) or item.ndim != 1 or item.dtype.kind not in "fiu":
                    raise ResultsError(f"{file}: {name} is no dataset of one row of numbers")
                unit = item.attrs.get("unit", units[name])
                if str(unit) != units[name]:
                    raise ResultsError(f"{file}: {name} is in {unit}, expected {units[name]}")
                columns[name] = np.array(item, dtype=float)
    except OSError as error:
        raise ResultsError(f"{file} cannot be read as HDF5: {error}") from error
    lengths = {name: len(values) for name, values in columns.items()}
    if not lengths or len(set(lengths.values())) > 1 or not min(lengths.values()):
        raise ResultsError(f"{file}: columns of {lengths or 'no'} rows, expected some of one length")
    for name, values in columns.items():
        if len(wrong := np.flatnonzero(~np.isfinite(values))):
            raise ResultsError(f"{file}: {name}[{wrong[0]}] is {values[wrong[0]]}, expected a finite number")
    return columns
