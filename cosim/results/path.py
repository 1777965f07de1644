"""Numbers of a part along a path, in HDF5: a table of its rows.

/         title created tool tool_version git_commit command python platform format_version status
/system   name and arguments of the part
/path     row: dimension scale, from 1; time(row) if the path has it; each column of the path and each response over
          the rows, NaN where the part cannot be

xarray.open_dataset("results/sdelta_path.h5", group="path", engine="h5netcdf").f1.plot()
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.results import hdf5
from hfsa.cosim.results.hdf5 import Node
from hfsa.cosim.results.records import SystemRecord
from hfsa.cosim.results.store import Store


@dataclass(frozen=True)
class PathQuantity:
    """Values along a path with unit and description, shape (rows,)."""

    values: NDArray[np.float64]
    unit: str
    description: str


@dataclass(frozen=True)
class PathTable:
    """Numbers along a path.

    Attributes:
        title: title of the study.
        time: time of the rows [s]; `None` where the path has none.
        columns: columns of the path by name.
        responses: responses by name, NaN where the part cannot be.
    """

    title: str
    time: NDArray[np.float64] | None
    columns: Mapping[str, PathQuantity]
    responses: Mapping[str, PathQuantity]


def write_path(file: Path, found: PathTable, words: str, force: bool = False) -> None:
    """Write a path, completely or not at all; `words` are name and arguments of the part.

    `force` replaces a results file of hfsa. `ResultsError` where the file cannot be written.
    """
    store = Store.create(file, SystemRecord(found.title, words), lambda node: _fill(node, found), force)
    hdf5.set_status(store.file, hdf5.COMPLETE)
    store.close()


def _fill(file: Node, found: PathTable) -> None:
    """Write the table."""
    group = file.create_group("path")
    rows = len(next(iter(found.responses.values())).values)
    hdf5.create_scale(group, "row", np.arange(1, rows + 1))
    time = {} if found.time is None else {"time": PathQuantity(found.time, "s", "Time")}
    for name, quantity in {**time, **found.columns, **found.responses}.items():
        dataset = hdf5.create_dataset(group, name, ["row"], np.nan, float, quantity.unit)
        dataset[:] = quantity.values
        dataset.attrs["long_name"] = quantity.description
