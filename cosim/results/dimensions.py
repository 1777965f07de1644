"""Dimension scales of datasets, and names of datasets that HDF5 does not take as they are.

    dataset = group.create_dataset(dataset_key("tank.flow/in"), ...)    # HDF5 would make a group of `tank.flow`
    set_name(dataset, "tank.flow/in")
    attach(dataset, [group["time"]])                                    # any number of datasets share a scale
    members(group)["tank.flow/in"]

Where the key differs, the attribute `name` of the dataset is its name.
"""

from collections.abc import Sequence
from typing import Any

import h5py
import numpy as np

NAME = "full_name"
"""Attribute of a dataset whose key is not its name."""

_ESCAPES = {"%": "%25", "/": "%2F", "\0": "%00"}
_MOST_REFERENCES = 4000
"""Number of datasets that a scale lists; HDF5 takes 4095."""

_REFERENCES, _SCALES = "REFERENCE_LIST", "DIMENSION_LIST"


def dataset_key(name: str) -> str:
    """Return the name of a dataset in its group: the name itself, with `%2F` for `/`, and `%25` for `%`."""
    if name == ".":
        return "%2E"
    return "".join(_ESCAPES.get(character, character) for character in name)


def set_name(dataset: Any, name: str) -> None:
    """Note the name of a dataset that lies under another key."""
    if dataset_key(name) != name:
        dataset.attrs[NAME] = name


def members(group: Any) -> dict[str, Any]:
    """Return the members of a group by their names."""
    return {_name(item, own): item for own, item in group.items()}


def _name(item: Any, own: str) -> str:
    """Return the name of a member, `own` unless it lies under another key."""
    noted = item.attrs.get(NAME)
    return own if noted is None else noted.decode() if isinstance(noted, bytes) else str(noted)


def attach(dataset: Any, scales: Sequence[Any]) -> None:
    """Attach a scale to each axis of a dataset.

    A scale lists the datasets that it belongs to in an attribute of 64 KiB at most. Datasets beyond that name their
    scales, which is all that readers need, and are not listed.
    """
    listed = [scale.attrs.get_id(_REFERENCES).shape[0] if _REFERENCES in scale.attrs else 0 for scale in scales]
    if max(listed, default=0) < _MOST_REFERENCES:
        for axis, scale in enumerate(scales):
            dataset.dims[axis].attach_scale(scale)
        return
    references = np.empty(len(scales), dtype=object)
    for axis, scale in enumerate(scales):
        references[axis] = np.array([scale.ref], dtype=h5py.ref_dtype)
    dataset.attrs.create(_SCALES, references, dtype=h5py.vlen_dtype(h5py.ref_dtype))
