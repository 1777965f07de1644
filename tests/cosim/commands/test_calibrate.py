"""Verb `calibrate`: tables, parameter sets that parts and scenes take, and messages."""

import json
import tomllib
from pathlib import Path

import h5py
import numpy as np
import pytest

from hfsa.components._mechanics.rrr_kinematics import Links
from hfsa.cosim import calibrate, run
from hfsa.cosim.cli import main

JACOBIAN = """1.610797127,-1.298942876,-0.164324634
-0.6056938677,-1.42884239,1.37702048
-32.69206385,-28.30203574,-20.19743117
"""
TRUTH = Links(16e-3, 12e-3, 28e-3, 1.25, 0.7)
COLUMNS = ("elongation_1", "elongation_2", "elongation_3", "x", "y", "yaw")


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def table() -> np.ndarray:
    elongations = 12e-6 * np.random.default_rng(1).random((6, 3))
    return np.column_stack([elongations, elongations @ TRUTH.jacobian.T])


def write_csv(name: str, heading: str, rows: np.ndarray) -> None:
    with open(name, "w") as file:
        file.write(heading + "\n" + "\n".join(",".join(map(repr, row)) for row in rows.tolist()) + "\n")


def test_a_jacobian_makes_a_parameter_set_that_part_and_scene_take(capsys):
    with open("jexp.csv", "w") as file:
        file.write(JACOBIAN)
    assert main(["calibrate", "rrr_stage", "--measured", "jexp.csv", "-p", "turn=53.961", "-o", "mine.toml"]) == 0
    said = capsys.readouterr().out
    assert "rank 3 of 5" in said
    assert "determined are links.radius, psi1 + psi2, crank sin(psi3)" in said
    saved = tomllib.loads(Path("mine.toml").read_text())
    assert saved["radius"] == pytest.approx(31.0855e-3, abs=5e-8)
    assert main(["analyze", "rrr_stage", "-p", "kinematics=mine.toml", "--json"]) == 0
    numbers = json.loads(capsys.readouterr().out)
    np.testing.assert_allclose(numbers["jacobian"], Links(**saved).jacobian, rtol=1e-9)


@pytest.mark.slow
def test_a_scene_with_calibrated_links_reaches_its_pose():
    """Reference and controller know the links of the file too."""
    write_csv("poses.csv", ",".join(COLUMNS), table())
    calibrate("rrr_stage", "poses.csv", path="mine.toml")
    arguments = {"kinematics": "mine.toml", "actuator": "force", "motion": "step", "pose": "2e-6,1e-6,-1e-4"}
    recorded = run("stage_tracking", arguments, stop_time=0.02, path="run.h5")
    pose = [recorded.values[f"stage.platform.{n}"][-1] for n in ("position[1]", "position[2]", "rotation")]
    np.testing.assert_allclose(pose, [2e-6, 1e-6, -1e-4], rtol=1e-3)


@pytest.mark.parametrize("kind", ["csv", "units", "h5"])
def test_tables_of_poses(kind):
    file = "poses.h5" if kind == "h5" else "poses.csv"
    if kind == "h5":
        with h5py.File(file, "w") as data:
            for name, values in zip(COLUMNS, table().T, strict=True):
                data[name] = values
            data["yaw"].attrs["unit"] = "rad"
    else:
        units = (*["m"] * 5, "rad")
        named = [f"{n} [{u}]" if kind == "units" else n for n, u in zip(COLUMNS, units, strict=True)]
        write_csv(file, ",".join(named), table())
    found = calibrate("rrr_stage", file)
    assert found.values["links.radius"] == pytest.approx(TRUTH.radius, rel=1e-8)


def test_a_parameter_set_is_replaced_with_force_alone_and_no_other_file_ever(capsys):
    write_csv("poses.csv", ",".join(COLUMNS), table())
    words = ["calibrate", "rrr_stage", "--measured", "poses.csv", "-o"]
    assert main([*words, "mine.toml"]) == 0
    assert main([*words, "mine.toml"]) == 2
    assert "mine.toml is a parameter set already: --force replaces it" in capsys.readouterr().err
    assert main([*words, "mine.toml", "--force"]) == 0
    with open("notes.toml", "w") as file:
        file.write("a = 1\n")
    assert main([*words, "notes.toml", "--force"]) == 2
    assert Path("notes.toml").read_text() == "a = 1\n"
    assert main(["export", "mass_on_spring", "-o", "mine.toml"]) == 2


def test_json_and_free_dimensions(capsys):
    write_csv("poses.csv", ",".join(COLUMNS), table())
    words = [
        "calibrate",
        "rrr_stage",
        "--measured",
        "poses.csv",
        "--free",
        "links.radius,links.psi1,links.crank",
        "--json",
    ]
    assert main([*words, "-p", "links.coupler=12e-3", "-p", "links.psi2=0.7", "--bounds", "links.crank=0.01:0.03"]) == 0
    data = json.loads(capsys.readouterr().out)
    values = {row["name"]: row["value"] for row in data["dimensions"]}
    assert values == pytest.approx({"links.radius": 28e-3, "links.psi1": 1.25, "links.crank": 16e-3}, rel=1e-8)
    assert data["rank"] == 3
    assert data["undetermined_directions"] == []


@pytest.mark.parametrize(
    ("heading", "words", "message"),
    [
        ("elongation_1,x,y,yaw [mrad],a,b", [], "poses.csv, line 1: yaw is in mrad, expected rad"),
        ("elongation_1,elongation_2,x,y,yaw,z", [], "poses.csv, line 1: no column 'z'"),
        (",".join(COLUMNS), ["--bounds", "links.crank"], "--bounds links.crank has no range"),
        (",".join(COLUMNS), ["--sizes", "x=1:2"], "--sizes x is a range, expected one number"),
        (",".join(COLUMNS), ["-o", "mine.h5"], "expected a name that ends in .toml"),
        (",".join(COLUMNS), ["-p", "turn=nan"], "turn is nan deg, expected a finite angle"),
    ],
    ids=["unit", "column", "no range", "range of sizes", "ending", "turn"],
)
def test_mistakes_are_named(capsys, heading, words, message):
    write_csv("poses.csv", heading, table())
    assert main(["calibrate", "rrr_stage", "--measured", "poses.csv", *words]) == 2
    assert message in capsys.readouterr().err


def test_what_cannot_be_calibrated(capsys):
    write_csv("poses.csv", ",".join(COLUMNS), table())
    assert main(["calibrate", "pd", "--measured", "poses.csv"]) == 2
    assert "pd offers no calibration" in capsys.readouterr().err
    assert main(["calibrate", "rrr_stage", "--measured", "none.csv"]) == 2
    assert "none.csv" in capsys.readouterr().err
    write_csv("motors.csv", "x,motor_L1", np.array([[0.01, 0.5], [0.0, 0.0], [0.02, 1.0], [0.01, 0.6]]))
    assert main(["calibrate", "sdelta", "--measured", "motors.csv", "-o", "robot.toml"]) == 2
    assert "sdelta takes no parameter set as a file" in capsys.readouterr().err
