"""Engineering numbers as text: with units, seven significant digits, and rounding noise as 0.

stiffness_S [N.m/rad, N; N, N/m] =
1200.279          0          0          0   16003.71          0
...
kappa = 25304.09 N
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

NOISE = 1e-12
"""Size, relative to other entries of an array, below which an entry is rounding noise."""

_ACROSS = 120
"""Largest number of characters in a line of a vector."""


def numbers_text(numbers: Mapping[str, Any], units: Mapping[str, str]) -> str:
    """Return numbers as text, one quantity after the other, arrays in rows; `units` by key, as far as known."""
    return "\n".join(line for name, value in numbers.items() for line in _lines(name, value, units.get(name, "1")))


def without_noise(array: np.ndarray) -> np.ndarray:
    """Return a real or complex array with rounding noise set to 0: entries below `NOISE` of the largest entry.

    In a matrix, whose rows and columns may have different units, the scale of an entry is the geometric mean of the
    largest entry of its row and the largest entry of its column.
    """
    size = np.where(np.isfinite(array), np.abs(array), 0.0)
    if array.ndim == 2 and array.size:
        scale = np.sqrt(size.max(axis=1, keepdims=True) * size.max(axis=0, keepdims=True))
    else:
        scale = size.max(initial=0.0)
    if np.iscomplexobj(array):
        return _cleared(np.real(array), scale) + 1j * _cleared(np.imag(array), scale)
    return _cleared(array, scale)


def _cleared(part: np.ndarray, scale: np.ndarray | float) -> np.ndarray:
    """Return real numbers with those below `NOISE` of a scale set to 0."""
    return np.where(np.abs(part) < NOISE * scale, 0.0, part)


def _lines(name: str, value: Any, unit: str) -> Iterator[str]:
    """Yield the lines of one quantity."""
    value = _rows(value)
    if np.ndim(value) == 0 and not isinstance(value, Mapping):
        yield f"{name} = {_text(value)}{'' if unit == '1' else f' {unit}'}"
        return
    yield f"{name}{'' if unit == '1' else f' [{unit}]'} ="
    if isinstance(value, Mapping):
        rows = [(key, _text(item)) for key, item in value.items()]
    else:
        array = np.asarray(value)
        array = without_noise(array) if array.dtype.kind in "fc" else array
        is_vector = array.ndim == 1 and array.dtype != object
        rows = (
            _folded([*map(_text, array)]) if is_vector else [[_text(item) for item in np.atleast_1d(r)] for r in array]
        )
    yield from (f"  {row}" for row in _aligned(rows))


def _rows(value: Any) -> Any:
    """Return a value, where it is a list of rows of unequal lengths as an array of them."""
    try:
        np.ndim(value)
    except ValueError:
        rows = np.empty(len(value), dtype=object)
        rows[:] = [[*row] if isinstance(row, list | tuple | np.ndarray) else [row] for row in value]
        return rows
    return value


def _folded(cells: Sequence[str]) -> Sequence[Sequence[str]]:
    """Return the cells of a vector in rows of at most `_ACROSS` characters."""
    count = max(1, _ACROSS // (2 + max(map(len, cells), default=1)))
    return [cells[i : i + count] for i in range(0, len(cells), count)]


def _aligned(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield rows of cells with aligned columns: words to the left, numbers to the right."""
    columns = max(map(len, rows), default=0)
    widths = [max(len(row[i]) for row in rows if i < len(row)) for i in range(columns)]
    for row in rows:
        cells = (c.ljust(w) if c[:1].isalpha() else c.rjust(w) for c, w in zip(row, widths, strict=False))
        yield "  ".join(cells).rstrip()


def _text(value: Any) -> str:
    """Return an entry as text: a number to seven digits, without a sign at 0; a mapping with all its items."""
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_text(item)}" for key, item in value.items())
    if isinstance(value, list | tuple | np.ndarray):
        return " ".join(map(_text, value))
    if isinstance(value, complex | np.complexfloating):
        sign = "-" if value.imag < 0 else "+"
        return _text(value.real) if value.imag == 0 else f"{_text(value.real)} {sign} {_text(abs(value.imag))}j"
    if isinstance(value, float | np.floating):
        return f"{value + 0.0:.7g}"
    return "none" if value is None else str(value)
