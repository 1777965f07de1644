"""Results files of any kind as one flat table: a row for each combination of coordinates, a column for each quantity.

    found = read_flat("results/stage_run.h5")
    found.columns["time"], found.units["time"]        # (rows,), "s"
    found.left_out                                    # names of datasets over other coordinates

Of a run a row is a time; of a sweep it is a frequency, an output and an input. A complex quantity has two columns,
`response.real` and `response.imag`; a matrix at each row has a column for each entry, `stiffness[1,2]`. The coordinates
are those of most datasets of the file; datasets over some of them are repeated.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.results.dimensions import members
from hfsa.cosim.results.hdf5 import Node, text
from hfsa.cosim.results.records import ResultsError
from hfsa.cosim.results.store import reading

_GROUPS = ("time", "bode", "map", "path", "trade", "analyses", "identification")
"""Groups with the quantities of a file, the first of which counts."""


@dataclass(frozen=True)
class Flat:
    """A table: columns by name, (rows,) each, of numbers or texts, with units; `left_out` are other datasets."""

    columns: Mapping[str, NDArray[Any]]
    units: Mapping[str, str]
    left_out: Sequence[str]


def read_flat(path: str | Path) -> Flat:
    """Read a results file as a table; `ResultsError` where it has nothing over coordinates.

    Rows that a run has not reached are left out.
    """
    path = Path(path)
    with reading(path) as file:
        name = next((group for group in _GROUPS if group in file), None)
        data = {} if name is None else _datasets(file[name])
        counted = Counter(tuple(filter(None, dims)) for _, dims in data.values() if any(dims))
        if name is None or not counted:
            raise ResultsError(f"{path} holds nothing to convert; it has {', '.join(file) or 'nothing'}")
        main = max(counted, key=lambda dims: (counted[dims], len(dims)))
        found = _flat(file[name], data, main)
    return _reached(found) if name == "time" else found


def _datasets(group: Node) -> dict[str, tuple[Node, list[str]]]:
    """Return the datasets of a group by name, each with the names of its coordinates; those of a scale are its own."""
    found = {}
    for name, item in members(group).items():
        if isinstance(item, h5py.Dataset):
            scales = [item.dims[axis] for axis in range(item.ndim)]
            dims = [name] if item.is_scale else [str(s[0].name).rpartition("/")[2] if len(s) else "" for s in scales]
            found[name] = item, dims
    return found


def _flat(group: Node, data: Mapping[str, tuple[Node, list[str]]], main: Sequence[str]) -> Flat:
    """Return the table over coordinates."""
    shape = tuple(len(group[name]) for name in main)
    columns: dict[str, NDArray[Any]] = {}
    units: dict[str, str] = {}
    left_out = []
    for name in (*main, *(name for name in data if name not in main)):
        item, dims = data[name]
        own = [dimension for dimension in dims if dimension]
        if not own or not set(own) <= set(main) or dims[: len(own)] != own:
            left_out.append(name)
            continue
        places = [main.index(dimension) for dimension in own]
        unit = text(item.attrs["units"]) if "units" in item.attrs else ""
        for entry, values in _entries(_values(item), len(own)):
            ordered = np.moveaxis(values, np.argsort(np.argsort(places)), range(len(places)))
            spread = np.broadcast_to(ordered.reshape([n if i in places else 1 for i, n in enumerate(shape)]), shape)
            parts = {".real": np.real(spread), ".imag": np.imag(spread)} if np.iscomplexobj(spread) else {"": spread}
            for ending, part in parts.items():
                columns[name + entry + ending], units[name + entry + ending] = part.reshape(-1), unit
    return Flat(columns, units, left_out)


def _entries(values: NDArray[Any], axes: int) -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield the entries of arrays over the first axes, with their places from 1 in brackets; one entry has none."""
    if values.ndim == axes:
        yield "", values
        return
    for place in np.ndindex(values.shape[axes:]):
        yield f"[{','.join(str(i + 1) for i in place)}]", values[(..., *place)]


def _values(item: Node) -> NDArray[Any]:
    """Return the values of a dataset: numbers, texts, or words of an enumeration."""
    members = h5py.check_enum_dtype(item.dtype)
    values = item[()]
    if members is not None:
        words = {number: word for word, number in members.items()}
        return np.array([words[number] for number in values.flat], dtype=object).reshape(values.shape)
    if values.dtype.kind in "OS":
        found = [text(value.rstrip(b"\0") if isinstance(value, bytes) else value) for value in values.flat]
        return np.array(found, dtype=object).reshape(values.shape)
    return values


def _reached(found: Flat) -> Flat:
    """Return the table of a run without the rows that it has not reached."""
    reached = np.all([np.isfinite(column) for column in found.columns.values()], axis=0)
    return Flat({name: column[reached] for name, column in found.columns.items()}, found.units, found.left_out)
