"""Names that HDF5 does not take as they are, and more datasets than a dimension scale lists."""

import h5py
import numpy as np
import pytest

from hfsa.cosim.results.dimensions import attach, dataset_key, members
from hfsa.cosim.results.files import RunFile, SystemRecord, read_run
from hfsa.cosim.results.flat import read_flat
from hfsa.cosim.results.recorded import read_recorded

ODD = ["tank.a/b", "tank.a", "tank./", "tank.a%2Fb", "tank.%", "tank.ä/ö", "tank.//x", "tank.."]


def test_names_with_slashes_come_back_with_their_values(tmp_path):
    path, time = tmp_path / "run.h5", np.arange(4.0)
    file = RunFile(path, time, dict.fromkeys(ODD, "m"), SystemRecord("t", "scene"))
    file.write(0, {name: time + i for i, name in enumerate(ODD)})
    file.close()
    values, units = read_run(path)
    assert set(values) == {"time", *ODD}
    for i, name in enumerate(ODD):
        assert values[name].tolist() == (time + i).tolist()
        assert units[name] == "m"
    assert set(read_recorded(path).values) == set(ODD)
    assert set(read_flat(path).columns) == {"time", *ODD}
    with h5py.File(path) as raw:
        assert not [name for name, node in raw["time"].items() if isinstance(node, h5py.Group)]


@pytest.mark.parametrize("name", ["a/b", ".", "a\0b", "/"])
def test_keys_are_single_names_for_hdf5(tmp_path, name):
    with h5py.File(tmp_path / "k.h5", "w") as file:
        file.create_dataset(dataset_key(name), data=1.0)
        assert list(file) == [dataset_key(name)]
        assert list(members(file)) == [dataset_key(name)]


def test_more_datasets_than_a_scale_lists_keep_their_coordinate(tmp_path, monkeypatch):
    monkeypatch.setattr("hfsa.cosim.results.dimensions._MOST_REFERENCES", 3)
    with h5py.File(tmp_path / "many.h5", "w") as file:
        scale = file.create_dataset("time", data=np.arange(3.0))
        scale.make_scale("time")
        for i in range(6):
            attach(file.create_dataset(f"x{i}", data=np.ones(3)), [scale])
    with h5py.File(tmp_path / "many.h5") as file:
        assert [file[f"x{i}"].dims[0][0].name for i in range(6)] == ["/time"] * 6
        assert len(file["time"].attrs["REFERENCE_LIST"]) == 3
    xarray = pytest.importorskip("xarray")
    with xarray.open_dataset(tmp_path / "many.h5", engine="h5netcdf") as found:
        assert {found[f"x{i}"].dims for i in range(6)} == {("time",)}


@pytest.mark.slow
def test_five_thousand_signals_are_recorded(tmp_path):
    names = [f"plant.x[{i}]" for i in range(5000)]
    file = RunFile(tmp_path / "r.h5", np.arange(2.0), dict.fromkeys(names, "m"), SystemRecord("t", "scene"))
    file.write(0, dict.fromkeys(names, np.ones(2)))
    file.close()
    values, _ = read_run(tmp_path / "r.h5")
    assert set(values) == {"time", *names}
