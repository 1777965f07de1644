"""Section of a report on results that are numbers over rows: a map, a path, an analysis over arguments, an inertia."""

from pathlib import Path

from hfsa.cosim.pages.blocks import Section, paragraph, table
from hfsa.cosim.results.flat import read_flat

_ROWS, _COLUMNS = 200, 24
"""Rows and columns that a report shows at most."""


def table_section(file: Path) -> Section:
    """Return the section on a file as a table, with what it leaves out."""
    found = read_flat(file)
    names = list(found.columns)[:_COLUMNS]
    count = len(next(iter(found.columns.values())))
    headings = [f">{name} [{found.units[name]}]" if found.units[name] else f">{name}" for name in names]
    rows = zip(*(map(_shown, found.columns[name][:_ROWS]) for name in names), strict=True)
    blocks = [table(headings, rows, "Numbers")]
    if count > _ROWS or len(found.columns) > _COLUMNS:
        shown = f"{min(count, _ROWS)} of {count} rows and {len(names)} of {len(found.columns)} columns"
        blocks.append(paragraph(f"{shown}; hfsa convert writes all of them."))
    return Section("Numbers", blocks)


def _shown(value: object) -> str:
    """Return a cell as text."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)
