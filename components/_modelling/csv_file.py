"""Tables in CSV files: a header that names the columns, then rows of numbers.

    found = read_csv(Path("path.csv"), {"time": "s", "x": "m"}, "path.csv")
    found.columns["x"], found.lines          # (rows,); the line in the file of each row

A name in the header may be followed by its unit in brackets, `x [m]`.
"""

import csv
import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hfsa.components._modelling.errors import ModelError, nearest

_HEADING = re.compile(r"^(.*?)\s*(?:\[(.*)\])?$")


class Csv(NamedTuple):
    """Values of the columns by name, (rows,) each, and the line of each row in the file, from 1."""

    columns: Mapping[str, NDArray[np.float64]]
    lines: tuple[int, ...]


def read_csv(file: Path, units: Mapping[str, str], label: str) -> Csv:
    """Return the table of a CSV file.

    Args:
        file: the file, in UTF-8.
        units: unit of each column that the file may have, by name.
        label: words for the file in messages.

    Raises:
        ModelError: a file that cannot be read; no header or no rows; a column that is unknown, given twice or in
            another unit; a row with too few or too many values, or with one that is no finite number, by its line.
    """
    try:
        text = file.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ModelError(f"{label}: cannot be read as text: {error}") from error
    try:
        numbered = [(i, [cell.strip() for cell in row]) for i, row in enumerate(csv.reader(text.splitlines()), start=1)]
    except csv.Error as error:
        raise ModelError(f"{label}: not a CSV file: {error}") from None
    numbered = [(i, row) for i, row in numbered if any(row)]
    if not numbered:
        raise ModelError(f"{label} is empty, expected a header with some of {', '.join(units)}")
    (first, header), rows = numbered[0], numbered[1:]
    names = _named(header, units, f"{label}, line {first}")
    if not rows:
        raise ModelError(f"{label} has a header, but no rows")
    for line, row in rows:
        if len(row) != len(names):
            raise ModelError(f"{label}, line {line}: {len(row)} values, expected {len(names)}")
        for name, cell in zip(names, row, strict=True):
            if not math.isfinite(_number(cell)):
                raise ModelError(f"{label}, line {line}: {name} is {cell!r}, expected a finite number")
    values = np.array([row for _, row in rows], dtype=float).T
    return Csv(dict(zip(names, values, strict=True)), tuple(line for line, _ in rows))


def _named(header: list[str], units: Mapping[str, str], label: str) -> list[str]:
    """Return the names in a header; `ModelError` for one that is wrong, or in another unit."""
    if not any(math.isnan(_number(cell)) for cell in header):
        raise ModelError(f"{label}: numbers, expected a header that names the columns: {', '.join(units)}")
    if len(header) == 1 and ";" in header[0]:
        raise ModelError(f"{label}: columns are separated by semicolons, expected commas")
    names = []
    for heading in header:
        found = _HEADING.match(heading)
        assert found is not None
        name, unit = found.groups()
        if name not in units:
            raise ModelError(f"{label}: no column {name!r}{nearest(name, units)}")
        if unit is not None and unit.strip() != units[name]:
            raise ModelError(f"{label}: {name} is in {unit.strip() or 'no unit'}, expected {units[name]}")
        if name in names:
            raise ModelError(f"{label}: the column {name} is given twice")
        names.append(name)
    return names


def _number(cell: str) -> float:
    """Return a cell as a number, NaN where it is none."""
    try:
        return float(cell)
    except ValueError:
        return math.nan
