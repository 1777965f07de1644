"""Paths on the command line: a table of rows to follow, and the numbers of a part along it as data and as text."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hfsa.components._modelling.csv_file import read_csv
from hfsa.components._modelling.study import Study
from hfsa.cosim.commands._shell import PICTURE, rendered, table
from hfsa.cosim.figures.path import path_figure, save
from hfsa.cosim.results.path import PathQuantity, PathTable, write_path
from hfsa.cosim.signals.prefixes import readable
from hfsa.cosim.systems.errors import StructureError

TIME = "t"
"""Column of the time of a row [s]."""


class Rows(NamedTuple):
    """Rows to follow: time of each, if given, and values of the named columns, shape (rows,)."""

    time: np.ndarray | None
    columns: Mapping[str, np.ndarray]


def path_answer(study: Study, source: Path, file: Path, words: str, force: bool) -> tuple[dict[str, Any], str]:
    """Follow a path, write its numbers and their picture; return them as data and as text.

    Args:
        study: study whose dimensions are the columns of a path.
        source: CSV file of the path.
        file: HDF5 file to write, its picture beside it.
        words: name and arguments of the part, for the file.
        force: whether to replace an existing results file.
    """
    path = read_path(source, study)
    rows = len(next(iter(path.columns.values())))
    points = np.tile(study.values[:, None], rows)
    for name, values in path.columns.items():
        points[list(study.variables).index(name)] = values
    found, fails = study.at(points), ~(study.margins(points) > 0)
    if fails.any(axis=0).all():
        lacking = [text for text, row in zip(study.conditions, fails, strict=True) if row.any()]
        raise StructureError(f"--path {source}: none of its {rows} rows can be taken; they lack {' or '.join(lacking)}")
    record = PathTable(
        study.title,
        path.time,
        {name: _quantity(values, study.variables[name]) for name, values in path.columns.items()},
        {name: _quantity(values, study.responses[name]) for name, values in found.items()},
    )
    write_path(file, record, words, force)
    picture = file.with_suffix(PICTURE)
    save(path_figure(record), picture)
    failing = {
        text: (np.flatnonzero(row) + 1).tolist() for text, row in zip(study.conditions, fails, strict=True) if row.any()
    }
    data = {
        "file": file,
        "picture": picture,
        "study": study.title,
        "rows": rows,
        "failing_rows": failing,
        **({} if path.time is None else {TIME: path.time}),
        "columns": path.columns,
        "responses": found,
        "units": {name: response.unit for name, response in study.responses.items()},
    }
    return data, "\n".join([*_lines(study, rows, found, failing), str(file), str(picture)])


def read_path(source: Path, study: Study) -> Rows:
    """Return the rows of a CSV file whose first row names its columns.

    Raises:
        ModelError: as `read_csv`. StructureError: no column beside the time; a time that does not rise.
    """
    label, known = f"--path {source}", {name: variable.unit for name, variable in study.variables.items()}
    found = read_csv(source, {**known, TIME: "s"}, label)
    columns = dict(found.columns)
    time = columns.pop(TIME, None)
    if not columns:
        raise StructureError(f"{label}: only a time, expected some of {', '.join(known)}")
    if time is not None and np.any(np.diff(time) <= 0):
        line = found.lines[int(np.argmax(np.diff(time) <= 0)) + 1]
        raise StructureError(f"{label}, line {line}: {TIME} does not rise")
    return Rows(time, columns)


def _quantity(values: np.ndarray, of: Any) -> PathQuantity:
    """Return values with the unit and description of a variable or response."""
    return PathQuantity(values, of.unit, of.description)


def _lines(study: Study, rows: int, found: Mapping[str, np.ndarray], failing: Mapping[str, list[int]]) -> list[str]:
    """Return the lines of the answer: which rows cannot be, and the range of every response."""
    possible = np.isfinite(next(iter(found.values())))
    lines = [
        f"{study.title}: {rows} row{'' if rows == 1 else 's'}"
        + ("" if possible.all() else f", {rows - possible.sum()} of them empty")
    ]
    for text, numbers in failing.items():
        some = ", ".join(map(str, numbers[:8])) + (", ..." if len(numbers) > 8 else "")
        lines.append(f"  {len(numbers)} of {rows} rows lack {text}: {some}")
    if not possible.any():
        return lines
    summary = table("", "", ">first", ">last", ">lowest", ">row", ">highest", ">row")
    present = np.flatnonzero(possible)
    for name, values in found.items():
        unit, low, high = study.responses[name].unit, int(np.nanargmin(values)), int(np.nanargmax(values))
        cells = [readable(values[i], unit) for i in (present[0], present[-1], low, high)]
        summary.add_row(
            name, study.responses[name].description, *cells[:2], cells[2], str(low + 1), cells[3], str(high + 1)
        )
    return [*lines, rendered(summary)]
