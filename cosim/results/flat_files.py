"""Flat tables as files for other programs: CSV, MATLAB's MAT, Parquet; the ending of the file decides.

write_flat(read_flat("results/stage_run.h5"), Path("stage.csv"))
"""

import csv
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hfsa.cosim.results.flat import Flat
from hfsa.cosim.results.placement import put_in_place, temporary_file
from hfsa.cosim.results.records import ResultsError
from hfsa.cosim.results.target import check_table, os_refusal

_BLOCK = 100_000
"""Rows of a CSV file that are written at once."""

_LONGEST = 63
"""Length of a name in MATLAB."""


def write_flat(found: Flat, path: Path, force: bool = False) -> None:
    """Write a table, completely or not at all; `force` replaces a table of the same format.

    `ResultsError` for an ending that is no format, a package that is not installed, and as `check_table`.
    """
    write = writer(path)
    check_table(path, force)
    with temporary_file(path) as part:
        try:
            write(found, part)
        except OSError as error:
            raise os_refusal(path, error) from error
        put_in_place(part, path, lambda: check_table(path, force))


def writer(path: Path) -> Callable[[Flat, Path], None]:
    """Return the function that writes the format of a file name ending."""
    ending = path.suffix.lower()
    if ending not in _WRITERS:
        raise ResultsError(f"cannot write {path}: expected one of the endings {', '.join(_WRITERS)}")
    return _WRITERS[ending]


def _write_csv(found: Flat, part: Path) -> None:
    """Write a CSV file: a header with units, numbers with all their digits."""
    with open(part, "w", newline="", encoding="utf-8") as file:
        lines = csv.writer(file)
        lines.writerow([f"{name} [{found.units[name]}]" if found.units[name] else name for name in found.columns])
        columns = list(found.columns.values())
        for first in range(0, len(columns[0]), _BLOCK):
            lines.writerows(zip(*(column[first : first + _BLOCK].tolist() for column in columns), strict=True))


def _write_mat(found: Flat, part: Path) -> None:
    """Write a MAT file of version 5: a vector for each column, and `columns`, which has their names and units."""
    from scipy.io import savemat

    names = _variables(found.columns)
    rows = [[variable, name, found.units[name]] for name, variable in names.items()]
    data: dict[str, Any] = {variable: found.columns[name] for name, variable in names.items()}
    data["columns"] = np.array(rows, dtype=object)
    with open(part, "wb") as file:
        savemat(file, data, long_field_names=True, do_compression=True, oned_as="column")


def _write_parquet(found: Flat, part: Path) -> None:
    """Write a Parquet file; the metadata of each field has its unit."""
    try:
        import pyarrow  # type: ignore[import-not-found]
        import pyarrow.parquet  # type: ignore[import-not-found]
    except ImportError:
        raise ResultsError("a .parquet file needs the package pyarrow, which is not installed; .csv does not") from None
    arrays = [pyarrow.array(_plain(column)) for column in found.columns.values()]
    fields = [
        pyarrow.field(name, array.type, metadata={"units": found.units[name]})
        for name, array in zip(found.columns, arrays, strict=True)
    ]
    pyarrow.parquet.write_table(pyarrow.table(arrays, schema=pyarrow.schema(fields)), part)


def _plain(column: np.ndarray) -> Any:
    """Return a column of numbers as it is, one of texts as a list."""
    return column if column.dtype.kind in "biuf" else column.tolist()


def _variables(names: Iterable[str]) -> Mapping[str, str]:
    """Return a name of MATLAB for each name, letters, digits and underscores, none twice."""
    found: dict[str, str] = {}
    for name in names:
        word = re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_")
        stem = (word if word[:1].isalpha() else f"x_{word}")[:_LONGEST]
        chosen, number = stem, 1
        while chosen in found.values() or chosen == "columns":
            number += 1
            ending = f"_{number}"
            chosen = stem[: _LONGEST - len(ending)] + ending
        found[name] = chosen
    return found


_WRITERS: Mapping[str, Callable[[Flat, Path], None]] = {
    ".csv": _write_csv,
    ".mat": _write_mat,
    ".parquet": _write_parquet,
}
