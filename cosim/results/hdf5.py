"""Datasets, dimension scales, texts and the status attribute of results files in HDF5."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.results.dimensions import attach, dataset_key, set_name
from hfsa.cosim.systems.names import legible

RUNNING, COMPLETE, INTERRUPTED, FAILED = b"running", b"complete", b"interrupted", b"failed"
LONGEST_STATUS = 16
"""Length [bytes] of the status attribute, so that it can be overwritten in place."""

LONGEST_MESSAGE = 240
"""Length [bytes] of the message of a point or a run."""

LONGEST_WARNINGS = 4000
"""Length [bytes] of all warnings of FMUs in a file."""

Node = Any
"""File, group or dataset of h5py, which does not declare the type of a group's members."""


def set_status(file: Node, status: bytes) -> None:
    """Overwrite the status attribute in place."""
    file.attrs.modify("status", np.bytes_(status.ljust(LONGEST_STATUS, b"\0")))


def status_of(file: Node) -> str:
    """Return the status attribute: `running`, `complete`, `interrupted` or `failed`."""
    return bytes(file.attrs["status"]).rstrip(b"\0").decode()


def set_warnings(file: Node, sentences: Iterable[str]) -> None:
    """Overwrite the warnings of FMUs, which a file of an earlier version lacks."""
    file.attrs["warnings"] = np.bytes_(clipped("\n".join(sentences), LONGEST_WARNINGS).ljust(LONGEST_WARNINGS, b"\0"))


def warnings_of(file: Node) -> list[str]:
    """Return the warnings of FMUs, a sentence for each instance; bytes that are no text become escapes."""
    return bytes(file.attrs.get("warnings", b"")).rstrip(b"\0").decode(errors="backslashreplace").splitlines()


def create_scale(group: Node, name: str, values: Any, unit: str | None = None) -> Node:
    """Create a dimension scale of numbers with their unit, or of texts."""
    if len(values) and isinstance(values[0], str):
        dataset = group.create_dataset(name, data=list(values), dtype=h5py.string_dtype())
    else:
        dataset = group.create_dataset(name, data=np.asarray(values, dtype=float))
    dataset.make_scale(name)
    if unit is not None:
        set_unit(dataset, unit)
    return dataset


def create_dataset(group: Node, name: str, dimensions: Sequence[str], fill: Any, dtype: Any, unit: str | None = None):
    """Create a dataset over dimension scales of its group, filled on disk; a complex fill value is `np.complex128`.

    Bytes have no fill value: netCDF-C 4.9 reads beyond that of a text of fixed length, and aborts.
    """
    shape = tuple(len(group[d]) for d in dimensions)
    filled = {} if isinstance(fill, bytes) else {"fillvalue": fill}
    dataset = group.create_dataset(dataset_key(name), shape, dtype, data=np.full(shape, fill, dtype), **filled)
    set_name(dataset, name)
    attach(dataset, [group[d] for d in dimensions])
    if unit is not None:
        set_unit(dataset, unit)
    return dataset


def create_texts(group: Node, name: str, dimensions: Sequence[str], values: Sequence[str]) -> Node:
    """Create a dataset of texts over dimension scales of its group."""
    dataset = group.create_dataset(name, data=list(values), dtype=h5py.string_dtype())
    attach(dataset, [group[d] for d in dimensions])
    return dataset


def set_unit(dataset: Node, unit: str) -> None:
    """Write the unit as the attributes of xarray (`units`) and of the Scientific Data Format (`UNIT`)."""
    dataset.attrs["units"] = unit
    dataset.attrs["UNIT"] = unit


def text(value: Any) -> str:
    """Return a text attribute or element as `str`."""
    return value.decode() if isinstance(value, bytes) else str(value)


def texts(dataset: Node) -> list[str]:
    """Return the elements of a dataset of texts."""
    return [text(value) for value in dataset[:]]


def array(group: Node, name: str, shape: tuple[int, ...] | None, kinds: str = "fiub") -> NDArray[Any]:
    """Return the values of a dataset; `ValueError`, which a reader takes for damage, where they are not as expected.

    `shape` is the expected shape, `None` for any row of values, `kinds` the expected kinds of numpy's types.
    """
    found = group[name]
    if not isinstance(found, h5py.Dataset):
        raise ValueError(f"{name} is a group, expected a dataset")
    is_row = shape is None and len(found.shape or ()) == 1
    if found.dtype.kind not in kinds or not (is_row or found.shape == shape):
        expected = "a row" if shape is None else f"shape {shape}"
        raise ValueError(f"{name} has type {found.dtype} and shape {found.shape}, expected {expected} of other numbers")
    return found[:]


def axis(group: Node, name: str) -> NDArray[np.float64]:
    """Return the values of an axis; `ValueError`, as of `array`, also where one of them is not finite."""
    found = array(group, name, None)
    if not np.isfinite(found).all():
        raise ValueError(f"{name} has values that are not finite, expected an axis")
    return found


def plain(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Return attributes as plain Python values."""
    values = {}
    for name, value in attributes.items():
        item = value.tolist() if isinstance(value, np.generic | np.ndarray) else value
        values[name] = text(item) if isinstance(item, bytes) else item
    return values


def clipped(message: str, length: int = LONGEST_MESSAGE) -> bytes:
    """Return a message as UTF-8 of at most `length` bytes, cut between characters."""
    return legible(message).encode()[:length].decode(errors="ignore").encode()
