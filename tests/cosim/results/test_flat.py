"""Results files as flat tables: values and units of each kind, all digits, what is replaced and what is not."""

import csv
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import loadmat

from hfsa.cosim import Axis, run, sweep
from hfsa.cosim.results.files import read_run
from hfsa.cosim.results.flat import read_flat
from hfsa.cosim.results.records import ResultsError

INPUT, OUTPUT = "mass.base.position", "mass.position"


@pytest.fixture(scope="module")
def made(tmp_path_factory, scene_cache):
    """A run and a sweep by kind."""
    folder = tmp_path_factory.mktemp("made")
    found = {kind: folder / f"{kind}.h5" for kind in ("run", "sweep")}
    run("mass_on_spring", drive={INPUT: "chirp,amplitude=1e-3"}, stop_time=0.05, path=found["run"])
    sweep("mass_on_spring", points=3, low=1.0, high=9.0, method="linear", path=found["sweep"])
    return found


def rows_of(file):
    """Return the header and the rows of a CSV file."""
    header, *rows = csv.reader(file.read_text().splitlines())
    return header, rows


def test_a_run_keeps_all_digits(made, hfsa):
    """A column for each variable, with its unit."""
    assert hfsa("convert", made["run"], "-o", "run.csv")[0] == 0
    header, rows = rows_of(Path("run.csv"))
    assert header == ["time [s]", f"{INPUT} [m]", f"{OUTPUT} [m]"]
    values = np.array(rows, float)
    recorded, _ = read_run(made["run"])
    assert np.array_equal(values, np.column_stack([recorded[name] for name in ("time", INPUT, OUTPUT)]))


def test_a_sweep_has_a_row_for_each_response(made):
    """Its complex response in two columns, its status in words."""
    found = read_flat(made["sweep"]).columns
    assert np.allclose(found["frequency"], [1, 3, 9], rtol=0.02)
    assert list(found["output"]) == [OUTPUT] * 3
    response = found["response.real"] + 1j * found["response.imag"]
    assert np.allclose(np.abs(response), found["magnitude"])
    assert set(found["status"]) == {"done"}


def test_a_map_has_a_row_for_each_point(tmp_path):
    """Coordinates are repeated, the last fastest."""
    axes = [Axis("bandwidth", np.array([3.0, 6.0])), Axis("step_size", np.array([1e-4, 2e-4, 4e-4]))]
    path = tmp_path / "map.h5"
    with h5py.File(path, "w") as file:
        file.attrs["tool"], file.attrs["format_version"] = "hfsa", 1
        group = file.create_group("map")
        for axis in axes:
            group.create_dataset(axis.name, data=axis.values).make_scale(axis.name)
        data = group.create_dataset("growth", data=np.arange(6.0).reshape(2, 3))
        for place, axis in enumerate(axes):
            data.dims[place].attach_scale(group[axis.name])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hfsa.cosim.results.flat.reading", h5py.File)
        found = read_flat(path).columns
    assert np.array_equal(found["growth"], np.arange(6.0))
    assert np.array_equal(found["bandwidth"], [3, 3, 3, 6, 6, 6])
    assert np.array_equal(found["step_size"], [1e-4, 2e-4, 4e-4] * 2)


def test_a_mat_file_has_vectors_and_their_names(made, hfsa):
    """Names of MATLAB, and those of the file with units."""
    assert hfsa("convert", made["run"], "-o", "run.mat")[0] == 0
    found = loadmat("run.mat")
    names = {row[0].item(): (row[1].item(), row[2].item()) for row in found["columns"]}
    assert names["mass_base_position"] == (INPUT, "m")
    assert np.array_equal(found["mass_base_position"][:, 0], read_run(made["run"])[0][INPUT])


@pytest.mark.parametrize("kind", ["run", "sweep"])
def test_a_parquet_file_has_the_columns_with_their_units(made, hfsa, kind):
    parquet = pytest.importorskip("pyarrow.parquet", reason="the extra `analysis` is not installed")
    assert hfsa("convert", made[kind], "-o", "table.parquet")[0] == 0
    table, flat = parquet.read_table("table.parquet"), read_flat(made[kind])
    assert table.column_names == list(flat.columns)
    for name, column in flat.columns.items():
        assert table.schema.field(name).metadata[b"units"].decode() == flat.units[name]
        np.testing.assert_array_equal(table[name].to_numpy(), column)


@pytest.mark.parametrize(
    "words",
    [
        ["stability", "mass_on_spring", "--vary", "damping=0.1:10:3", "--vary", "step_size=1e-4:1e-3:2"],
        ["analyze", "tba_accelerometer", "--map", "tm=10e-6:40e-6,l"],
        ["analyze", "sdelta", "--over", "payload.mass=1,2,3"],
    ],
    ids=["stability", "map", "over"],
)
def test_other_results_become_tables_too(hfsa, tmp_path, words):
    """Every number of the file that has the axes of the table is a column of it."""
    assert hfsa(*words, "-o", "made.h5")[0] in (0, 1)
    assert hfsa("convert", "made.h5")[0] == 0
    header, rows = rows_of(tmp_path / "made.csv")
    assert len(rows) > 1
    assert all(len(row) == len(header) for row in rows)
    assert len(header) > 2


def test_a_matrix_has_a_column_for_each_entry(hfsa, tmp_path):
    """The stiffness of the robot at three payloads, beside the payload."""
    from hfsa.components.sdelta import analyze

    assert hfsa("analyze", "sdelta", "--over", "payload.mass=1,2,3", "-o", "made.h5")[0] == 0
    assert hfsa("convert", "made.h5")[0] == 0
    header, rows = rows_of(tmp_path / "made.csv")
    place = next(i for i, name in enumerate(header) if name.startswith("stiffness_S[3,5]"))
    assert [float(row[place]) for row in rows] == [analyze()["stiffness_S"][2, 4]] * 3
    frequency = next(i for i, name in enumerate(header) if name.startswith("natural_frequencies_hz[6]"))
    assert float(rows[2][frequency]) == pytest.approx(analyze()["natural_frequencies_hz"][5], rel=1e-9)


def test_only_tables_are_replaced_and_only_with_force(made, hfsa, tmp_path):
    """Of the same format."""
    target = tmp_path / "run.csv"
    assert hfsa("convert", made["run"], "-o", target)[0] == 0
    code, _, err = hfsa("convert", made["run"], "-o", target)
    assert (code, "--force replaces it" in err) == (2, True)
    assert hfsa("convert", made["run"], "-o", target, "--force")[0] == 0
    (tmp_path / "own.mat").write_text("mine")
    code, _, err = hfsa("convert", made["run"], "-o", tmp_path / "own.mat", "--force")
    assert (code, "which is not replaced" in err) == (2, True)
    assert (tmp_path / "own.mat").read_text() == "mine"


@pytest.mark.parametrize(
    ("name", "words"),
    [("run.txt", "expected one of the endings .csv, .mat, .parquet"), ("run", "expected one of the endings")],
    ids=["text", "none"],
)
def test_other_endings_are_refused(made, hfsa, name, words):
    """With those that there are."""
    code, _, err = hfsa("convert", made["run"], "-o", name)
    assert code == 2
    assert words in err


def test_a_file_of_another_program_is_refused(hfsa, tmp_path):
    """As by every verb."""
    (tmp_path / "other.h5").write_text("no HDF5")
    code, _, err = hfsa("convert", tmp_path / "other.h5")
    assert code == 2
    assert "other.h5" in err
    with pytest.raises(ResultsError):
        read_flat(tmp_path / "none.h5")
