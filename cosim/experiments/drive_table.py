"""Tables of driving signals from files: a column of a CSV file, or a recorded variable of a run.

    read_table("wind.csv", "force", "linear", ["plant.force"])             # time [s], force [N]
    read_table("results/stage_run.h5", "stage.force", "smooth", [])        # a file of `hfsa run`

Without a name, it is the column beside `time`, or among several that of the input.
"""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.components._modelling.csv_file import read_columns
from hfsa.components._modelling.errors import ModelError
from hfsa.cosim.results.run import Run
from hfsa.cosim.signals.table import Interpolation, Table
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import matching_names, nearest
from hfsa.cosim.systems.units import conversion, known_base

TIME = "time"

_FILE = re.compile(r"^(.*?\.(csv|h5|hdf5))(?::(.*))?$", re.IGNORECASE)


def file_and_column(text: str) -> tuple[str, str | None] | None:
    """Return the file and the column in `FILE.csv:COLUMN`, `None` for no column; `None` for any other text."""
    found = _FILE.match(text)
    return (found[1], found[3] or None) if found else None


def read_table(file: str, column: str | None, interpolation: Interpolation, inputs: Sequence[str]) -> Table:
    """Return the signal in a column of a file; `inputs` are the names of the input that it drives.

    Raises:
        StructureError: a file that cannot be read; no such column, or several to choose from; a row that is wrong, by
            its line.
        ResultsError: an HDF5 file that is no run of hfsa.
    """
    columns, units, lines = _read(Path(file))
    chosen = _chosen(file, column, [name for name in columns if name != TIME], inputs)
    try:
        return Table(
            columns[TIME] * _seconds(file, units.get(TIME)),
            columns[chosen],
            interpolation,
            f"{file}:{chosen}",
            units.get(chosen) or None,
            lines,
        )
    except ValueError as error:
        raise StructureError(str(error)) from None


def _read(file: Path) -> tuple[Mapping[str, NDArray[np.float64]], Mapping[str, str | None], Sequence[int] | None]:
    """Return columns by name, their units, and the line of each row in a CSV file."""
    if file.suffix.lower() != ".csv":
        run = Run.read(file)
        return {TIME: run.time, **run.values}, {TIME: "s", **run.units}, None
    try:
        found = read_columns(file, str(file))
    except ModelError as error:
        raise StructureError(str(error)) from None
    if TIME not in found.columns:
        raise StructureError(f"{file} has the columns {', '.join(found.columns)}, expected {TIME} among them")
    return found.columns, found.units, found.lines


def _chosen(file: str, column: str | None, offered: Sequence[str], inputs: Sequence[str]) -> str:
    """Return the name of the column; `StructureError` where there is none, or several fit."""
    if column is not None:
        found = matching_names(column, offered)
        if len(found) == 1:
            return found[0]
        if found:
            raise StructureError(f"{file}: {column} fits several columns: {', '.join(found)}; expected one of them")
        raise StructureError(f"{file}: no column {column!r}{nearest(column, offered)}")
    own = [name for name in inputs if name in offered]
    if own or len(offered) == 1:
        return (own or list(offered))[0]
    listed = ", ".join(offered[:8]) + (", ..." if len(offered) > 8 else "")
    raise StructureError(f"{file} has the columns {listed or 'time alone'}; expected {file}:COLUMN with one of them")


def _seconds(file: str, unit: str | None) -> float:
    """Return the factor to seconds of a unit of time; `StructureError` for another unit."""
    found = conversion(known_base(unit or "s"), known_base("s"))
    if found is None:
        raise StructureError(f"{file}: {TIME} is in {unit}, expected s")
    return found[0]
