"""Tables in CSV files: a header that names the columns, then rows of numbers.

    found = read_csv(Path("path.csv"), {"time": "s", "x": "m"}, "path.csv")
    found.columns["x"], found.lines          # (rows,); the line in the file of each row
    found = read_columns(Path("record.csv"), "record.csv")
    found.columns["u"], found.units["u"]     # of any column; the unit is None where the header has none

A name in the header may be followed by its unit in brackets, `x [m]`.
"""

import csv
import math
import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hfsa.components._modelling.errors import ModelError, nearest
from hfsa.components._modelling.regular_file import check_regular

_HEADING = re.compile(r"^(.*?)\s*(?:\[(.*)\])?$")

_ANY_HEADING = re.compile(r"^(.*?)(?:\s+\[([^][]*)\])?$")
"""Heading of a column of any name, which may end with an index in brackets: a space is before the unit."""


class Csv(NamedTuple):
    """Values of the columns by name, (rows,) each, and the line of each row in the file, from 1."""

    columns: Mapping[str, NDArray[np.float64]]
    lines: Sequence[int]


class Columns(NamedTuple):
    """Values of the columns by name, (rows,) each, their units, `None` without one, and the line of each row."""

    columns: Mapping[str, NDArray[np.float64]]
    units: Mapping[str, str | None]
    lines: Sequence[int]


def read_csv(file: Path, units: Mapping[str, str], label: str) -> Csv:
    """Return the table of a CSV file with known columns.

    Args:
        file: the file, in UTF-8.
        units: unit of each column that the file may have, by name.
        label: words for the file in messages.

    Raises:
        ModelError: a file that cannot be read; no header or no rows; a column that is unknown, given twice or in
            another unit; a row with too few or too many values, or with one that is no finite number, by its line.
    """
    numbered = _numbered(_lines(file, label), label)
    if not numbered:
        raise ModelError(f"{label} is empty, expected a header with some of {', '.join(units)}")
    (first, header), rows = numbered[0], numbered[1:]
    names = _named(header, units, f"{label}, line {first}")
    values = _values(rows, names, label)
    return Csv(dict(zip(names, values.T, strict=True)), tuple(line for line, _ in rows))


def read_columns(file: Path, label: str) -> Columns:
    """Return all columns of a CSV file, in UTF-8; a million rows take a second.

    Raises:
        ModelError: as `read_csv`, but for the names and units, which are any.
    """
    lines = _lines(file, label)
    first = next((i for i, line in enumerate(lines) if line.strip()), None)
    if first is None:
        raise ModelError(f"{label} is empty, expected a header that names the columns, and rows")
    header = [cell.strip() for cell in next(csv.reader([lines[first]]))]
    _check_header(header, (), f"{label}, line {first + 1}")
    headings = [_heading(cell, _ANY_HEADING) for cell in header]
    names = [name for name, _ in headings]
    repeated = [name for name, count in Counter(names).items() if count > 1]
    if repeated:
        raise ModelError(f"{label}, line {first + 1}: the column {repeated[0]} is given twice")
    body = lines[first + 1 :]
    numbers = range(first + 2, len(lines) + 1) if all(body) else [i for i, t in enumerate(lines, 1) if t.strip()][1:]
    values = _plain(body) if len(numbers) else None
    if values is None or values.shape != (len(numbers), len(names)) or not np.all(np.isfinite(values)):
        rows = _numbered(body, label)  # finds the first wrong row, or reads quoted numbers
        values = _values([(first + 1 + i, row) for i, row in rows], names, label)
        numbers = [first + 1 + i for i, _ in rows]
    return Columns(dict(zip(names, np.ascontiguousarray(values.T), strict=True)), dict(headings), numbers)


def _plain(lines: Sequence[str]) -> NDArray[np.float64] | None:
    """Return numbers separated by commas, (rows, columns); `None` for anything else."""
    try:
        return np.loadtxt(lines, delimiter=",", ndmin=2, comments=None)
    except ValueError:
        return None


def _lines(file: Path, label: str) -> list[str]:
    """Return the lines of a text file; `ModelError` where it is none."""
    check_regular(file, label)
    try:
        return file.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ModelError(f"{label}: cannot be read as text: {error}") from error


def _numbered(lines: Sequence[str], label: str) -> list[tuple[int, list[str]]]:
    """Return the rows that are not blank, each with its line from 1."""
    try:
        numbered = [(i, [cell.strip() for cell in row]) for i, row in enumerate(csv.reader(lines), start=1)]
    except csv.Error as error:
        raise ModelError(f"{label}: not a CSV file: {error}") from None
    return [(i, row) for i, row in numbered if any(row)]


def _values(rows: Sequence[tuple[int, list[str]]], names: Sequence[str], label: str) -> NDArray[np.float64]:
    """Return the numbers of rows, (rows, names); `ModelError` with the line of the first that is wrong."""
    if not rows:
        raise ModelError(f"{label} has a header, but no rows")
    for line, row in rows:
        if len(row) != len(names):
            raise ModelError(f"{label}, line {line}: {len(row)} values, expected {len(names)}")
        for name, cell in zip(names, row, strict=True):
            if not math.isfinite(_number(cell)):
                raise ModelError(f"{label}, line {line}: {name} is {cell!r}, expected a finite number")
    return np.array([row for _, row in rows], dtype=float)


def _named(header: list[str], units: Mapping[str, str], label: str) -> list[str]:
    """Return the names in a header; `ModelError` for one that is wrong, or in another unit."""
    _check_header(header, units, label)
    names = []
    for name, unit in (_heading(cell, _HEADING) for cell in header):
        if name not in units:
            raise ModelError(f"{label}: no column {name!r}{nearest(name, units)}")
        if unit is not None and unit != units[name]:
            raise ModelError(f"{label}: {name} is in {unit or 'no unit'}, expected {units[name]}")
        if name in names:
            raise ModelError(f"{label}: the column {name} is given twice")
        names.append(name)
    return names


def _check_header(header: Sequence[str], expected: Collection[str], label: str) -> None:
    """Raise `ModelError` for a first row that is no header with commas."""
    if not any(math.isnan(_number(cell)) for cell in header):
        words = f": {', '.join(expected)}" if expected else ", time among them"
        raise ModelError(f"{label}: numbers, expected a header that names the columns{words}")
    if len(header) == 1 and ";" in header[0]:
        raise ModelError(f"{label}: columns are separated by semicolons, expected commas")


def _heading(cell: str, pattern: re.Pattern[str]) -> tuple[str, str | None]:
    """Return the name and the unit in a cell of a header; `None` without brackets for a unit."""
    found = pattern.match(cell)
    assert found is not None
    name, unit = found.groups()
    return name, None if unit is None else unit.strip()


def _number(cell: str) -> float:
    """Return a cell as a number, NaN where it is none."""
    try:
        return float(cell)
    except ValueError:
        return math.nan
