"""Writes a response map in HDF5: two dimensions as named axes, and the design it belongs to.

/         title created tool tool_version git_commit command python platform format_version status
/system   what was studied, as words
/map      the two dimensions: dimension scales; each response over them, NaN where nothing can be built
/design   dimension(dimension), value(dimension), unit(dimension): where the map was taken

xarray.open_dataset("results/tba_accelerometer_map.h5", group="map", engine="h5netcdf").frequency_ratio.plot()
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.results import hdf5
from hfsa.cosim.results.hdf5 import Node
from hfsa.cosim.results.records import SystemRecord


@dataclass(frozen=True)
class MapQuantity:
    """Values of a dimension or a response, with the unit and a description of them; `present`: the design's own."""

    values: NDArray[np.float64]
    unit: str
    description: str
    present: float


@dataclass(frozen=True)
class ResponseMap:
    """Responses over two dimensions.

    Attributes:
        title: what is studied.
        axes: values of the two dimensions by name, ascending.
        responses: by name, shape (values of the first, of the second); NaN where nothing can be built.
        design: present value and unit of every dimension, by name.
    """

    title: str
    axes: Mapping[str, MapQuantity]
    responses: Mapping[str, MapQuantity]
    design: Mapping[str, tuple[float, str]]


def write_response_map(path: Path, found: ResponseMap, words: str, force: bool = False) -> None:
    """Write a map, complete or not at all, with `force` in place of a results file; `words` say what was studied.

    `ResultsError` where that fails.
    """
    store = hdf5.Store.create(path, SystemRecord(found.title, words), lambda file: _fill(file, found), force)
    hdf5.set_status(store.file, hdf5.COMPLETE)
    store.close()


def _fill(file: Node, found: ResponseMap) -> None:
    """Write a map's axes and responses."""
    group = file.create_group("map")
    for name, axis in found.axes.items():
        hdf5.create_scale(group, name, axis.values, axis.unit).attrs["long_name"] = axis.description
    for name, response in found.responses.items():
        dataset = hdf5.create_dataset(group, name, list(found.axes), np.nan, float, response.unit)
        dataset[:] = response.values
        dataset.attrs["long_name"] = response.description
    design = file.create_group("design")
    hdf5.create_scale(design, "dimension", list(found.design))
    hdf5.create_dataset(design, "value", ["dimension"], np.nan, float)[:] = [
        value for value, _ in found.design.values()
    ]
    units = [unit for _, unit in found.design.values()]
    design.create_dataset("unit", data=units, dtype=h5py.string_dtype()).dims[0].attach_scale(design["dimension"])
