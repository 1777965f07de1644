"""Section of a report on results that are numbers over rows: a map, a path, an analysis over arguments, an inertia."""

from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from hfsa.cosim.pages.blocks import Section, paragraph, table
from hfsa.cosim.results.flat import read_flat

_ROWS, _COLUMNS = 200, 24
"""Rows and columns that a report shows at most."""


def table_section(file: Path) -> Section:
    """Return the section on a file as a table, with what it leaves out."""
    found = read_flat(file)
    names = list(found.columns)[:_COLUMNS]
    count = len(next(iter(found.columns.values())))
    headings = [_heading(name, found.units[name], found.columns[name]) for name in names]
    rows = zip(*(map(_shown, found.columns[name][:_ROWS]) for name in names), strict=True)
    blocks = [table(headings, rows)]
    if count > _ROWS or len(found.columns) > _COLUMNS:
        shown = f"{min(count, _ROWS)} of {count} rows and {len(names)} of {len(found.columns)} columns"
        blocks.append(paragraph(f"{shown}; hfsa convert writes all of them."))
    return Section("Numbers", blocks)


def _heading(name: str, unit: str, values: NDArray[Any]) -> str:
    """Return the heading of a column, which stands to the right above numbers."""
    return (">" if values.dtype.kind in "biuf" else "") + (f"{name} [{unit}]" if unit else name)


def _shown(value: object) -> str:
    """Return a cell as text; minus zero is zero."""
    return f"{value + 0.0:.6g}" if isinstance(value, float) else str(value)
