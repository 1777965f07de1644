"""Recorded signals of a results file: of a run over time, or the numbers of a part over the rows of a path or a table.

found = read_recorded("results/stage_tracking_run.h5")
found.values["stage.stack[1].elongation"], found.units, found.axis
"""

import dataclasses
import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.results import hdf5
from hfsa.cosim.results.dimensions import members
from hfsa.cosim.results.hdf5 import Node
from hfsa.cosim.results.records import ResultsError
from hfsa.cosim.results.store import reading

TIME, ROW, CASE = "time", "row", "case"

_KINDS = {"time": "time", "path": "row"}
"""Coordinate of each group of signals."""
_OTHERS = {
    "bode": "frequency responses, which `hfsa bode` draws",
    "map": "a map, whose picture is beside it",
}


@dataclass(frozen=True)
class Recorded:
    """Signals over a common axis.

    Attributes:
        path: the file.
        title: title of the scene or study.
        axis: `time`, `row` where the rows have no time, `case` of a table.
        at: times [s] or numbers of the rows or cases, (rows,), ascending.
        values: signals by name, (rows,) each, NaN where a part cannot be.
        units: units by name.
    """

    path: Path
    title: str
    axis: str
    at: NDArray[np.float64]
    values: Mapping[str, NDArray[np.float64]]
    units: Mapping[str, str]

    def between(self, low: float | None, high: float | None) -> "Recorded":
        """Return the signals from one place of the axis to another; `ResultsError` where there are none."""
        kept = np.ones(len(self.at), dtype=bool)
        kept &= True if low is None else self.at >= low
        kept &= True if high is None else self.at <= high
        if not kept.any():
            wanted = " ".join(f"{word} {end:g}" for word, end in (("from", low), ("to", high)) if end is not None)
            there = f"{self.at[0]:g} to {self.at[-1]:g}" if len(self.at) else "none"
            raise ResultsError(f"{self.path} has no {self.axis} {wanted}; it has {there}".replace("  ", " "))
        return dataclasses.replace(self, at=self.at[kept], values={name: v[kept] for name, v in self.values.items()})


def read_recorded(path: str | Path) -> Recorded:
    """Read the signals of a run, a path or a table, finished or not; `ResultsError` where the file holds none."""
    path = Path(path)
    with reading(path) as file:
        if "analyses" in file and "over" in file:
            return _read_analyses(path, hdf5.text(file.attrs["title"]), file["over"], file["analyses"])
        kind = next((name for name in _KINDS if name in file), None)
        if kind is None:
            other = next((words for name, words in _OTHERS.items() if name in file), f"{', '.join(file) or 'nothing'}")
            raise ResultsError(f"{path} holds no signals over time or rows, but {other}")
        return _read(path, hdf5.text(file.attrs["title"]), _KINDS[kind], file[kind])


def _read(path: Path, title: str, axis: str, group: Node) -> Recorded:
    """Return the signals of a group; rows of a run that were not reached are left out."""
    found = members(group)
    values = {name: np.asarray(dataset[:], dtype=float) for name, dataset in found.items()}
    units = {name: hdf5.text(dataset.attrs.get("units", "1")) for name, dataset in found.items()}
    rows = values.pop(axis)
    if axis == ROW:
        axis, at = (TIME, values.pop(TIME)) if TIME in values else (ROW, rows)
        return Recorded(path, title, axis, at, values, units)
    reached = np.all([np.isfinite(v) for v in values.values()], axis=0) if values else np.isfinite(rows)
    return Recorded(path, title, axis, rows[reached], {name: v[reached] for name, v in values.items()}, units)


def _read_analyses(path: Path, title: str, over: Node, group: Node) -> Recorded:
    """Return the numbers of a table over its cases, and the varied arguments; elements are `pose[1]`, `stiffness[1,2]`.

    Units of a result stand for its elements along the first axis, where there are several.
    """
    values: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    for node in (over, group):  # a result of an argument's name has its unit
        for name, dataset in members(node).items():
            if name == "case" or dataset.dtype.kind not in "fi":
                continue
            array = np.asarray(dataset[:], dtype=float)
            each = hdf5.text(dataset.attrs.get("units", "1")).split("; ")
            for place in itertools.product(*map(range, array.shape[1:])):
                index = ",".join(str(i + 1) for i in place)
                full = f"{name}[{index}]" if place else name
                values[full] = array[(slice(None), *place)]
                units[full] = each[place[0]] if place and len(each) == array.shape[1] else each[0]
    return Recorded(path, title, CASE, np.asarray(over["case"][:], dtype=float), values, units)
