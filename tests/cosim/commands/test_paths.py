"""Paths and maps of the robot on the command line: tables, files, pictures, empty rows in words, and bad files."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray

from hfsa.components.sdelta import Posture, analyze

ROWS = """t, x, y, z, rz
0, 0, 0, 0.15, 0
0.1, 0.01, 0, 0.15, 2

0.4, 0.1, 0.01, 0.155, 8
0.5, 0.02, 0, 0.15, 4
"""


def written(text: str, name: str = "path.csv") -> str:
    Path(name).write_text(text, encoding="utf-8")
    return name


def test_a_path_is_a_table_of_analyses(hfsa):
    code, out, _ = hfsa("analyze", "sdelta", "--path", written(ROWS), "-p", "stiffness=ch4_full", "--json")
    found = json.loads(out)
    assert code == 0
    assert (found["rows"], found["t"]) == (4, [0, 0.1, 0.4, 0.5])
    assert found["failing_rows"] == {"the present assembly (no singularity between)": [3]}
    assert found["responses"]["f1"][2] is None
    assert Path(found["picture"]).stat().st_size > 10_000
    postures = {0: Posture(), 1: Posture((2, 0, 0), (0.01, 0, 0.15)), 3: Posture((4, 0, 0), (0.02, 0, 0.15))}
    with xarray.open_dataset(found["file"], group="path", engine="h5netcdf") as read:
        assert read.f6.dims == ("row",)
        assert (read.f1.attrs["units"], read.kappa_t.attrs["units"], read.time.attrs["units"]) == ("Hz", "N/m", "s")
        for row, posture in postures.items():
            numbers = analyze(posture=posture, stiffness="ch4_full")
            frequencies = [float(read[f"f{i}"][row]) for i in range(1, 7)]
            np.testing.assert_allclose(frequencies, numbers["natural_frequencies_hz"], rtol=1e-10)
            assert float(read.condition_number[row]) == pytest.approx(numbers["condition_number"], rel=1e-12)
            assert float(read.motor_R2[row]) == pytest.approx(numbers["motor_angles"][3], abs=1e-12)
        assert np.isnan(float(read.f1[2]))


def test_a_path_says_in_words_what_it_found(hfsa):
    code, out, _ = hfsa("analyze", "sdelta", "--path", written(ROWS), "-o", "along.h5")
    assert code == 0
    assert out.startswith("sdelta, stiffness ch4: 4 rows, 1 of them empty\n")
    assert "1 of 4 rows lack the present assembly (no singularity between): 3" in out
    assert out.splitlines()[-2:] == ["along.h5", "along.png"]
    code, _, err = hfsa("analyze", "sdelta", "--path", "path.csv", "-o", "along.h5")
    assert code == 2
    assert "along.h5" in err


def test_columns_that_a_path_does_not_name_stay(hfsa):
    words = ["-p", "posture.position=0.005,0.003,0.155", "-p", "posture.rotation=10,5,8"]
    code, out, _ = hfsa("analyze", "sdelta", "--path", written("rz\n0\n10\n"), *words, "--json")
    assert code == 0
    expected = analyze(posture=Posture((10, 5, 8), (0.005, 0.003, 0.155)))["kappa"]
    assert json.loads(out)["responses"]["kappa"][1] == pytest.approx(expected, rel=1e-12)


BAD = {
    "empty": ("", "is empty, expected a header with some of x, y, z, rz, rx, ry, t"),
    "no header": ("0,0,0.15\n", "line 1: numbers, expected a header"),
    "unknown": ("x,zz\n0,0\n", "line 1: no column 'zz'; did you mean z"),
    "twice": ("x,x\n0,0\n", "the column x is given twice"),
    "no rows": ("x,y\n", "has a header, but no rows"),
    "short": ("x,y\n0,0\n1\n", "line 3: 1 values, expected 2"),
    "word": ("x,y\n0,0\n0,left\n", "line 3: y is 'left', expected a finite number"),
    "nan": ("x,y\n0,nan\n", "line 2: y is 'nan', expected a finite number"),
    "time alone": ("t\n0\n", "only a time"),
    "time": ("t,x\n0,0\n1,0\n1,0\n", "line 4: t does not rise"),
}


@pytest.mark.parametrize(("text", "message"), BAD.values(), ids=BAD.keys())
def test_a_bad_file_is_named_with_its_line(hfsa, text, message):
    code, _, err = hfsa("analyze", "sdelta", "--path", written(text, "bad.csv"))
    assert code == 2
    assert message in " ".join(err.split())
    assert "bad.csv" in err


REFUSED = {
    "part": (["mass_on_spring", "--path", "path.csv"], "mass_on_spring follows no path; these do: sdelta"),
    "file": (["sdelta", "--path", "none.csv"], "--path none.csv: cannot be read"),
    "two": (["sdelta", "--path", "path.csv", "--sensitivity"], "--sensitivity and --path are different studies"),
    "argument": (["sdelta", "--path", "path.csv", "-p", "objective=f1"], "a path has no argument 'objective'"),
    "map": (
        ["sdelta", "--map", "posture.position[1],posture.position[2]"],
        "posture.position[1] is 0, of which half to twice is no range; give one: posture.position[1]=LOW:HIGH",
    ),
    "dimension": (["sdelta", "--map", "posture.position,gear"], "no dimension 'posture.position'"),
}


@pytest.mark.parametrize(("words", "message"), REFUSED.values(), ids=REFUSED.keys())
def test_what_cannot_be_is_refused(hfsa, words, message):
    written(ROWS)
    code, _, err = hfsa("analyze", *words)
    assert code == 2
    assert message in " ".join(err.split())


@pytest.mark.slow
def test_a_map_over_the_workspace_counts_its_empty_points(hfsa):
    words = ["--map", "posture.position[1]=-0.1:0.1,posture.rotation[1]=-30:30", "-o", "map.h5"]
    code, out, _ = hfsa("analyze", "sdelta", *words)
    assert code == 0
    assert "points, which lack the present assembly (no singularity between)" in out
    with xarray.open_dataset("map.h5", group="map", engine="h5netcdf") as read:
        assert read.f1.dims == ("posture.position[1]", "posture.rotation[1]")
        assert f"empty at {int(read.f1.isnull().sum())} of {read.f1.size} points" in out
        best = float(read.f1.sel({"posture.position[1]": 0.0, "posture.rotation[1]": 0.0}))
    assert best == pytest.approx(23.58966, abs=1e-5)
    assert Path("map.png").stat().st_size > 10_000


def test_sensitivities_leave_out_dimensions_that_are_0(hfsa):
    code, out, _ = hfsa("analyze", "sdelta", "--sensitivity")
    assert code == 0
    assert "dimensions that are 0 have no relative sensitivity: posture.rotation[1]" in out
    assert [line.split()[0] for line in out.splitlines()[3:5]] == ["rods.diameter", "rods.length"]
