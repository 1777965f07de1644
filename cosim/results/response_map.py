"""Response map in HDF5: responses of a design over two of its dimensions.

/         title created tool tool_version git_commit command python platform format_version status
/system   name and arguments of the study
/map      the two dimensions: dimension scales; each response over them, NaN where the design is not possible
/design   dimension(dimension), value(dimension), unit(dimension): the present design

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
from hfsa.cosim.results.store import Store


@dataclass(frozen=True)
class MapQuantity:
    """Values of a dimension or a response with unit and description; `present` is the value of the present design."""

    values: NDArray[np.float64]
    unit: str
    description: str
    present: float


@dataclass(frozen=True)
class ResponseMap:
    """Responses over two dimensions.

    Attributes:
        title: title of the study.
        axes: values of the two dimensions by name, ascending.
        responses: by name, shape (values of the first, of the second); NaN where the design is not possible.
        design: present value and unit of every dimension, by name.
    """

    title: str
    axes: Mapping[str, MapQuantity]
    responses: Mapping[str, MapQuantity]
    design: Mapping[str, tuple[float, str]]


def write_response_map(path: Path, found: ResponseMap, words: str, force: bool = False) -> None:
    """Write a map, completely or not at all; `words` are name and arguments of the study.

    `force` replaces a results file of hfsa. `ResultsError` where the file cannot be written.
    """
    store = Store.create(path, SystemRecord(found.title, words), lambda file: _fill(file, found), force)
    hdf5.set_status(store.file, hdf5.COMPLETE)
    store.close()


def _fill(file: Node, found: ResponseMap) -> None:
    """Write the axes, responses and design of a map."""
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
