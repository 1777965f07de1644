"""Pages of runs: what moved is what was recorded, times a factor, and what is left out is said."""

import json
import re

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hfsa.components._mechanics.rrr_kinematics import NOMINAL
from hfsa.components._mechanics.rrr_picture import links_in_motion, moved_hinges
from hfsa.components._mechanics.sdelta_geometry import Posture
from hfsa.components._mechanics.sdelta_inertia import CUBE
from hfsa.components._mechanics.sdelta_picture import joints
from hfsa.components._mechanics.sdelta_robot import THESIS_MACHINE, Robot
from hfsa.components._mechanics.tba_design import DESIGNS
from hfsa.components._mechanics.tba_picture import limb_points
from hfsa.components.sdelta import moving as robot_moving
from hfsa.components.tba_accelerometer import moving as sensor_moving
from hfsa.cosim.pages.thinning import envelope, kept_rows, lost_motion

TILTED = Posture((10.0, 5.0, 8.0), (0.02, 0.01, 0.155))


def displaced(moving, *columns) -> list[np.ndarray]:
    """Displacements of the layers of a part for columns of its signals, empty where a layer stands still."""
    found = moving.displacements(dict(zip(moving.signals, np.array(columns, dtype=float), strict=True)))
    return [np.zeros(0) if shift is None else shift for shift in found]


@pytest.mark.parametrize("point", ["S", "C"])
def test_joints_of_the_robot_follow_a_finite_rotation(point):
    found = robot_moving(posture=TILTED, reference_point=point)
    pose = [0.1, -0.2, 0.3, 0.01, 0.02, -0.03]
    *still, limbs, platform = displaced(found, *[[0.0, value] for value in pose])
    assert [shift.size for shift in still] == [0, 0]
    robot = Robot.at(TILTED, "ch4", CUBE, THESIS_MACHINE)
    pivot = np.array(TILTED.position) + (robot.offset if point == "C" else 0)
    expected = pivot + Rotation.from_rotvec(pose[:3]).apply(joints(robot) - pivot) + pose[3:]
    np.testing.assert_allclose(joints(robot) + platform[1], expected, rtol=1e-12)
    np.testing.assert_array_equal(platform[0], 0)
    np.testing.assert_array_equal(limbs[:, :3], 0)
    np.testing.assert_array_equal(limbs[:, 3:], platform)


@given(st.tuples(*[st.floats(-2e-5, 2e-5)] * 2, st.floats(-1e-3, 1e-3)))
def test_links_of_the_stage_follow_its_pose(pose):
    found = links_in_motion(NOMINAL)
    cranks, couplers, corners = displaced(found, *[[value] for value in pose])
    A, B, C = moved_hinges(NOMINAL, np.array(pose))
    np.testing.assert_allclose(cranks[0], np.vstack([A, B]) - found.panel.layers[0].points, atol=1e-15)
    np.testing.assert_allclose(couplers[0], np.vstack([B, C]) - found.panel.layers[1].points, atol=1e-15)
    np.testing.assert_allclose(corners[0], C - found.panel.layers[2].points, atol=1e-15)


def test_the_proof_mass_is_where_its_signals_say():
    found = sensor_moving()
    x = [0.0, 3e-6]
    frame, legs, bars, mass = displaced(found, x, [0.0, -1e-6])
    assert not frame.size
    np.testing.assert_allclose(mass[1], np.tile([3e-6, -1e-6], (4, 1)))
    shape = DESIGNS["mems"].shape
    expected = limb_points(shape, 3, np.array([3e-6, -1e-6])) - limb_points(shape, 3, np.zeros(2))
    np.testing.assert_allclose(legs[1], expected.reshape(-1, 2), atol=1e-18)
    np.testing.assert_array_equal(bars, legs)


@given(st.integers(1, 500), st.integers(2, 50))
def test_kept_rows_have_both_ends(rows, most):
    kept = kept_rows(rows, most)
    assert (kept[0], kept[-1]) == (0, rows - 1)
    assert len(kept) == min(rows, most)


def test_motion_between_frames_is_measured():
    """A sine of 100 periods in 51 frames is lost; in 2001 it is drawn to a few per cent."""
    t = np.linspace(0, 1, 20001)
    sine = np.sin(2 * np.pi * 100 * t)
    assert lost_motion(t, [sine], kept_rows(len(t), 51)) > 0.4
    assert lost_motion(t, [sine, np.zeros_like(t)], kept_rows(len(t), 2001)) < 0.03
    assert lost_motion(t, [sine], kept_rows(len(t), 20001)) == 0


def test_an_envelope_keeps_peaks_and_gaps():
    values = np.zeros(100_000)
    values[12_345], values[54_321] = 5.0, -3.0
    kept = envelope(values, 1000)
    assert len(kept) <= 1002
    assert {12_345, 54_321, 0, 99_999} <= set(kept)
    assert len(envelope(np.full(5000, np.nan), 100)) == 2


def data_of(file) -> dict:
    found = re.search(r'id="data">(.*?)</script>', file.read_text(), re.DOTALL)
    assert found
    return json.loads(found[1])


def test_the_page_of_a_run_holds_what_was_recorded(hfsa, tmp_path):
    assert hfsa("run", "sdelta_shaker", "--frequency", "20", "--stop", "0.4", "-o", "run.h5")[0] == 0
    code, out, err = hfsa("view", "run.h5", "--json")
    assert code == 0
    answer = json.loads(out)
    assert answer["bodies"] == ["robot"]
    assert "drawn at 1500 of 8001 points" in err
    assert (tmp_path / "run.html").stat().st_size < 6e6
    data = data_of(tmp_path / "run.html")
    from hfsa.cosim.results.files import read_run

    values, _ = read_run(tmp_path / "run.h5")
    y = np.array(values["robot.platform.position[2]"])
    frame = 900
    row = int(np.argmin(np.abs(values["time"] - data["time"][frame])))
    platform = np.array(data["bodies"][0]["shifts"][-1][frame])  # [axis][joint], mm
    turn = [values[f"robot.platform.rotation[{i}]"][row] for i in (1, 2, 3)]
    arms = joints(Robot.at(Posture(), "ch4", CUBE, THESIS_MACHINE)) - [0, 0, 0.15]
    shift = Rotation.from_rotvec(turn).apply(arms) - arms
    np.testing.assert_allclose(platform[1], 1e3 * (y[row] + shift[:, 1]), rtol=1e-5, atol=1e-12)
    names = {signal["name"] for signal in data["signals"]}
    assert names == set(values) - {"time"}
    factor = data["bodies"][0]["times"]
    assert re.match(r"[125](\.0)?(e|0*$)", f"{factor:g}".replace("+", ""))


def test_a_body_whose_signals_are_not_recorded_is_told(hfsa, tmp_path):
    words = ["--signal", "platform.position[3]", "--frequency", "20", "--stop", "0.01"]
    (tmp_path / "one.toml").write_text(
        """
inputs = ["robot.wrench.force[3]"]
outputs = ["robot.platform.position[3]"]
band = [1.0, 50.0]
amplitude = { N = 1.0 }
step_size = 1e-4
stop_time = 0.1

[[components]]
name = "robot"
part = "sdelta"
"""
    )
    assert hfsa("run", "./one.toml", *words, "--quiet-inputs", "-o", "run.h5")[0] == 0
    code, out, err = hfsa("view", "run.h5")
    assert code == 0
    assert "robot is not drawn: robot.platform.rotation[1], " in err
    assert "record with --signal" in err
    assert "signals alone" in out


@pytest.mark.parametrize(
    ("words", "answer"),
    [
        (["missing.h5"], "there is no file missing.h5"),
        (["sdelta", "--from", "1"], "--from and --to choose a stretch of a run"),
        (["sweep.h5"], "holds no signals over time"),
        (["run.h5", "-p", "x=1"], "--level and -p are those of a part"),
        (["run.h5", "-o", "run.png"], "expected the ending .html"),
        (["run.h5", "--from", "99"], "has no time from 99"),
    ],
    ids=["missing", "stretch", "sweep", "parameter", "picture", "empty"],
)
def test_what_is_no_run_is_refused(hfsa, tmp_path, words, answer):
    assert hfsa("run", "mass_on_spring", "--stop", "0.01", "--frequency", "50", "-o", "run.h5")[0] == 0
    assert hfsa("sweep", "mass_on_spring", "--method", "linear", "--points", "3", "-o", "sweep.h5")[0] == 0
    code, _, err = hfsa("view", *words)
    assert code == 2
    assert answer in err
    assert not list(tmp_path.glob("*.html"))


@pytest.mark.parametrize(
    ("name", "value", "answer"),
    [
        ("time", np.nan, "its time in row 3 is nan s"),
        ("time", 0.0, "its time in row 3 is 0 s"),
        ("mass.position", np.nan, "has no time at which every signal is a number"),
    ],
    ids=["no-time", "backwards", "no-number"],
)
@pytest.mark.parametrize("ending", ["html", "glb"])
def test_a_run_whose_numbers_are_damaged_is_not_drawn(hfsa, tmp_path, name, value, answer, ending):
    assert hfsa("run", "mass_on_spring", "--stop", "0.01", "--frequency", "50", "-o", "run.h5")[0] == 0
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        file["time"][name][2 if name == "time" else ...] = value
    code, _, err = hfsa("view", "run.h5", "-o", f"run.{ending}")
    assert code == 2
    assert answer in err
    assert not (tmp_path / f"run.{ending}").exists()
