"""Writes a response map in HDF5: two dimensions as named axes, and the design it belongs to.

/         title created tool tool_version git_commit command python platform format_version status
/system   what was studied, as words
/map      the two dimensions: dimension scales; each response over them, NaN where nothing can be built
/design   dimension(dimension), value(dimension), unit(dimension): where the map was taken

xarray.open_dataset("results/tba_accelerometer_map.h5", group="map", engine="h5netcdf").frequency_ratio.plot()
"""

from pathlib import Path

import h5py
import numpy as np

from hfsa.components._modelling.study import ResponseMap
from hfsa.cosim.results.files import hdf5
from hfsa.cosim.results.hdf5 import Node
from hfsa.cosim.results.records import SystemRecord


def write_map(path: Path, found: ResponseMap, words: str, force: bool = False) -> None:
    """Write a map, complete or not at all, with `force` in place of a results file; `words` say what was studied.

    `ResultsError` where that fails.
    """
    store = hdf5.Store.create(path, SystemRecord(found.study.title, words), lambda file: _fill(file, found), force)
    hdf5.set_status(store.file, hdf5.COMPLETE)
    store.close()


def _fill(file: Node, found: ResponseMap) -> None:
    """Write a map's axes and responses."""
    group = file.create_group("map")
    for name, values in found.axes.items():
        variable = found.study.variables[name]
        hdf5.scale(group, name, values, variable.unit).attrs["long_name"] = variable.description
    for name, values in found.responses.items():
        response = found.study.responses[name]
        dataset = hdf5.filled(group, name, list(found.axes), np.nan, float, response.unit)
        dataset[:] = values
        dataset.attrs["long_name"] = response.description
    design = file.create_group("design")
    hdf5.scale(design, "dimension", list(found.study.variables))
    hdf5.filled(design, "value", ["dimension"], np.nan, float)[:] = found.study.values
    units = [variable.unit for variable in found.study.variables.values()]
    design.create_dataset("unit", data=units, dtype=h5py.string_dtype()).dims[0].attach_scale(design["dimension"])
