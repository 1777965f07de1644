"""Analyses over values of arguments on the command line: one table, as data and as text."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hfsa.cosim.commands._numbers import without_noise
from hfsa.cosim.commands._shell import plain, rendered, table
from hfsa.cosim.experiments.analyze_over import analyze_over
from hfsa.cosim.experiments.over import parse_over
from hfsa.cosim.results.analyses import Analyses, write_analyses
from hfsa.cosim.results.target import check_new

_SHOWN = 8
"""Largest number of cases in a table; others are in the data and in the file."""
_WORD = 20
"""Longest text in a cell of a table."""
_ELEMENTS = 12
"""Largest number of elements of a result in a table."""


def over_answer(
    name: str, over: Sequence[str], arguments: Mapping[str, str], output: Path | None, force: bool
) -> tuple[dict[str, Any], str, bool]:
    """Return the analyses for values NAME=VALUES as data and as text, and whether the part takes all of them.

    They are written to a file, if there is one.
    """
    if output is not None:
        check_new(output, force)
    found = analyze_over(name, parse_over(over), arguments)
    if output is not None:
        write_analyses(output, found, force)
    text = analyses_text(found) if output is None else f"{analyses_text(found)}\n{output}"
    return {**analyses_data(found), "file": output}, text, not found.refusals


def analyses_data(found: Analyses) -> dict[str, Any]:
    """Return analyses for JSON: columns of cases and of results."""
    return {
        "part": found.part,
        "over": dict(found.cases),
        "numbers": plain(dict(found.numbers), f"{found.part}: analyze()"),
        "units": dict(found.units),
        "refusals": [{"case": i + 1, "reason": reason} for i, reason in found.refusals.items()],
    }


def analyses_text(found: Analyses) -> str:
    """Return a table with a row per result and a column per case, and the reasons of cases without results."""
    shown = range(min(found.count, _SHOWN))
    whole = table("", "", *(f">{i + 1}" for i in shown))
    for name, values in found.cases.items():
        whole.add_row(name, "", *(str(values[i]) for i in shown))
    whole.add_section()
    for name, unit, cells in _rows(found, shown):
        whole.add_row(name, unit, *cells)
    lines = [rendered(whole)]
    if found.count > _SHOWN:
        lines.append(f"{found.count - _SHOWN} more of {found.count} cases; -o FILE.h5 or --json has all")
    large = [name for name, values in found.numbers.items() if values.size > _ELEMENTS * found.count]
    if large:
        lines.append(f"not in the table: {', '.join(large)}; -o FILE.h5 or --json has them")
    for i in shown:
        lines += [f"case {i + 1}: {name}: {v[i]}" for name, v in found.numbers.items() if _is_long(v) and v[i]]
    return "\n".join([*lines, *(f"case {i + 1}: {reason}" for i, reason in found.refusals.items())])


def _is_long(values: np.ndarray) -> bool:
    """Whether a result is sentences rather than words or numbers."""
    return values.dtype == object and any(len(text) > _WORD for text in values)


def _rows(found: Analyses, shown: range) -> Iterator[tuple[str, str, list[str]]]:
    """Yield name, unit and values of each element of each result that fits."""
    for name, values in found.numbers.items():
        if values.dtype == object:
            if not _is_long(values):
                yield name, "", [str(values[i]) for i in shown]
            continue
        if values.size > _ELEMENTS * found.count:
            continue
        cleared = np.array([without_noise(np.asarray(value)) for value in values])
        units = _units(found.units.get(name, ""), values.shape[1:])
        for place in np.ndindex(values.shape[1:]):
            label = f"{name}[{','.join(str(k + 1) for k in place)}]" if place else name
            yield label, str(units[place]), [_cell(cleared[(i, *place)]) for i in shown]


def _units(words: str, shape: tuple[int, ...]) -> np.ndarray:
    """Return the unit of each element: `m; m; rad` by row, `N/m, N; N, N.m` by row and column, or one for all."""
    found = np.full(shape, "" if words == "1" else words, dtype=object)
    rows = [[cell.strip() for cell in row.split(",")] for row in words.split(";")]
    for place in np.ndindex(shape):
        if place and len(rows) == shape[0]:
            row = rows[place[0]]
            unit = row[place[1]] if len(place) > 1 and len(row) == shape[1] else row[0]
            found[place] = "" if unit == "1" else unit
    return found


def _cell(value: Any) -> str:
    """Return a number as text."""
    if isinstance(value, complex | np.complexfloating) and value.imag:
        return f"{value.real + 0.0:.5g}{value.imag:+.5g}j"
    return f"{np.real(value) + 0.0:.6g}"
