"""Analyses of a part for values of its arguments, in HDF5: a table of cases.

/          title created tool tool_version git_commit command python platform format_version status
/system    name and arguments of the part
/over      case: dimension scale, from 1; each varied argument over the cases
/analyses  case; each result over the cases, NaN or empty where the part refuses one; refusal(case), the reason
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from hfsa.cosim.results import hdf5
from hfsa.cosim.results.hdf5 import Node
from hfsa.cosim.results.records import SystemRecord
from hfsa.cosim.results.store import Store


@dataclass(frozen=True)
class Analyses:
    """Results of a part over cases.

    Attributes:
        part: name of the part.
        words: name and arguments of the part that are the same in all cases.
        cases: values of each varied argument, one per case.
        numbers: results by name, arrays (cases, ...) of numbers or texts.
        units: their units, as far as known.
        refusals: reasons by case, from 0, for those that the part refuses.
    """

    part: str
    words: str
    cases: Mapping[str, tuple[Any, ...]]
    numbers: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    refusals: Mapping[int, str]

    @property
    def count(self) -> int:
        """Number of cases."""
        return len(next(iter(self.cases.values())))


def write_analyses(file: Path, found: Analyses, force: bool = False) -> None:
    """Write analyses, completely or not at all; `force` replaces a results file of hfsa.

    `ResultsError` where the file cannot be written.
    """
    record = SystemRecord(f"{found.part} over {', '.join(found.cases)}", found.words)
    store = Store.create(file, record, lambda node: _fill(node, found), force)
    hdf5.set_status(store.file, hdf5.COMPLETE)
    store.close()


def _fill(file: Node, found: Analyses) -> None:
    """Write the table."""
    over, group = file.create_group("over"), file.create_group("analyses")
    for node in (over, group):
        hdf5.create_scale(node, "case", np.arange(1, found.count + 1))
    for name, values in found.cases.items():
        _column(over, name, _numbers(values), None)
    for name, values in found.numbers.items():
        _column(group, name, values, found.units.get(name))
    hdf5.create_texts(group, "refusal", ["case"], [found.refusals.get(i, "") for i in range(found.count)])


def _column(group: Node, name: str, values: np.ndarray, unit: str | None) -> None:
    """Write one column."""
    if values.dtype == object:
        hdf5.create_texts(group, name, ["case"], values.tolist())
        return
    dataset = group.create_dataset(name, data=values, dtype=h5py.h5t.IEEE_F64LE if values.dtype == float else None)
    dataset.dims[0].attach_scale(group["case"])
    if unit is not None:
        hdf5.set_unit(dataset, unit)


def _numbers(values: tuple[Any, ...]) -> np.ndarray:
    """Return values as numbers where all are, else as texts."""
    try:
        return np.array([float(value) for value in values])
    except (TypeError, ValueError):
        return np.array([str(value) for value in values], dtype=object)
