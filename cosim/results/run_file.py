"""Results file of a time-domain run: recorded variables over time, and their error estimates."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.results import hdf5
from hfsa.cosim.results.dimensions import dataset_key, members
from hfsa.cosim.results.hdf5 import LONGEST_MESSAGE, Node, clipped
from hfsa.cosim.results.records import ErrorEstimate, ResultsError, SystemRecord
from hfsa.cosim.results.store import Store, reading, translate_errors

_ERRORS = ("error_estimate", "relative_error")
"""Attributes of a recorded variable."""


_STEP_SIZE, _FLAGS = "step_size", "limit_flags"
"""Attributes of `/time`."""


class RunFile:
    """Results file of a time-domain run: recorded variables by full name; rows that are not reached stay NaN.

    `step_size` is the communication step [s], `flags` names the variables that are limit flags. `force` replaces a
    results file of hfsa, as `Store.create`. `identity` is independent of the name of the file.
    """

    def __init__(
        self,
        path: Path,
        time: NDArray[np.float64],
        units: Mapping[str, str],
        system: SystemRecord,
        force: bool = False,
        step_size: float | None = None,
        flags: Sequence[str] = (),
    ):
        def fill(file: Node) -> None:
            """Create the time axis and a dataset for each variable."""
            group = file.create_group("time")
            if step_size is not None:
                group.attrs[_STEP_SIZE] = step_size
            group.attrs.create(_FLAGS, list(flags), shape=(len(flags),), dtype=h5py.string_dtype())
            hdf5.create_scale(group, "time", time, "s")
            for name, unit in units.items():
                dataset = hdf5.create_dataset(group, name, ["time"], np.nan, float, unit)
                for attribute in _ERRORS:
                    dataset.attrs[attribute] = np.nan  # a verification overwrites it in place
            group.attrs.create("message", np.bytes_(b""), dtype=f"S{LONGEST_MESSAGE}")

        self._store = Store.create(path, system, fill, force)
        self.identity = self._store.identity

    def write(self, row: int, values: Mapping[str, NDArray[np.float64]], time: float | None = None) -> None:
        """Write a block of values of recorded variables, beginning at a row, and flush.

        `time` [s] is that of the row, where it is not the planned one.
        """
        with self._store.writing():
            if time is not None:
                self._store.file["time"]["time"][row] = time
            for name, block in values.items():
                self._store.file["time"][dataset_key(name)][row : row + len(block)] = block
            self._store.flush()

    def tell(self, sentences: Iterable[str]) -> None:
        """Keep the warnings of FMUs, one sentence for each instance."""
        with self._store.writing():
            hdf5.set_warnings(self._store.file, sentences)

    def close(self, failure: str = "") -> None:
        """Close the file with status `complete`, or `failed` with the message as attribute of `/time`."""
        self._close(hdf5.FAILED if failure else hdf5.COMPLETE, failure)

    def interrupt(self) -> None:
        """Close the file of a run that a signal ended, with status `interrupted`."""
        self._close(hdf5.INTERRUPTED, "interrupted before the end")

    def _close(self, status: bytes, message: str) -> None:
        """Close the file with a status and a message."""
        with self._store.writing():
            try:
                self._store.file["time"].attrs.modify("message", np.bytes_(clipped(message)))
                hdf5.set_status(self._store.file, status)
            finally:
                self._store.close()


def read_run(path: str | Path) -> tuple[dict[str, NDArray[np.float64]], dict[str, str]]:
    """Read a time-domain run: arrays over time by name (`time` [s] first), and the units."""
    path = Path(path)
    with reading(path) as file:
        if "time" not in file:
            raise ResultsError(f"{path} holds no run; it has {', '.join(file) or 'nothing'}")
        found = members(file["time"])
        found = {"time": found.pop("time"), **found}
        shape = (len(hdf5.axis(file["time"], "time")),)
        values = {name: hdf5.array(file["time"], dataset.name, shape) for name, dataset in found.items()}
        return values, {name: hdf5.text(dataset.attrs["units"]) for name, dataset in found.items()}


def read_status(path: str | Path) -> tuple[str, str]:
    """Read the status of a time-domain run and its error message, empty unless it failed."""
    path = Path(path)
    with reading(path) as file:
        return hdf5.status_of(file), hdf5.text(file["time"].attrs["message"])


def read_warnings(path: str | Path) -> list[str]:
    """Return the warnings of FMUs in the file of a run or a sweep, one sentence for each instance.

    `ResultsError` where it is no results file.
    """
    path = Path(path)
    with reading(path) as file:
        return hdf5.warnings_of(file)


def read_step_size(path: str | Path) -> float | None:
    """Read the communication step of a time-domain run [s]; `None` where the file is of a version without it."""
    path = Path(path)
    with reading(path) as file:
        found = file["time"].attrs.get(_STEP_SIZE)
    return None if found is None else float(found)


def read_limit_flags(path: str | Path) -> list[str] | None:
    """Read which variables of a time-domain run are limit flags; `None` where the file is of a version without them."""
    path = Path(path)
    with reading(path) as file:
        found = file["time"].attrs.get(_FLAGS)
        return None if found is None else [hdf5.text(name) for name in found]


def write_errors(path: Path, errors: Mapping[str, ErrorEstimate]) -> None:
    """Write error estimates of recorded variables, by full name, to the file of a complete run."""
    with translate_errors(path, "write"):
        store = Store.resume(path, lambda _: None)
        try:
            for name, error in errors.items():
                for attribute, value in zip(_ERRORS, (error.absolute, error.relative), strict=True):
                    store.file["time"][dataset_key(name)].attrs.modify(attribute, np.float64(value))
        finally:
            store.close()


def read_errors(path: str | Path) -> dict[str, ErrorEstimate]:
    """Read the error estimates of a time-domain run by variable; empty where the run was not verified."""
    path = Path(path)
    with reading(path) as file:
        found = {
            name: ErrorEstimate(*(float(dataset.attrs.get(attribute, np.nan)) for attribute in _ERRORS))
            for name, dataset in members(file["time"]).items()
        }
    return {name: error for name, error in found.items() if np.isfinite(error.absolute)}
