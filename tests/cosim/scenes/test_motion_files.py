"""Scenes on a motion from a file, and on sensors with steps and noise, against built-in motions and closed forms."""

import csv
from pathlib import Path

import numpy as np
import pytest

from hfsa.cosim import load_scene, run
from hfsa.cosim.systems.errors import StructureError

STACKS = [f"stage.stack[{i}].elongation" for i in (1, 2, 3)]
ERRORS = [f"tracking.axis[{i}].error" for i in (1, 2, 3)]
DIRECT = ["elongation_1", "elongation_2", "elongation_3"]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def written(name: str, time: np.ndarray, **columns: np.ndarray) -> str:
    """Write a motion file; return its name."""
    with Path(name).open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["time", *columns])
        rows.writerows(np.column_stack([time, *columns.values()]).tolist())
    return name


def test_a_file_of_a_built_in_motion_gives_its_run():
    """Rows 1 ms apart of three sines of up to 15 Hz: the splines are 4 pm from them, and so is the stage."""
    time = np.linspace(0, 0.4, 401)
    columns = {name: 8e-6 * np.sin(np.pi * i * 5 * time) ** 2 for i, name in enumerate(DIRECT, 1)}
    motion = written("three.csv", time, **columns)
    assert load_scene("stage_tracking", {"motion": motion}).stop_time == 0.4
    own = run("stage_tracking", {"motion": "three_axis"}, stop_time=0.05, path="own.h5", warn=lambda _: None)
    found = run("stage_tracking", {"motion": motion}, stop_time=0.05, path="file.h5", warn=lambda _: None)
    for name in STACKS:
        difference = np.abs(found[name] - own[name]).max()
        assert 0 < difference < 5e-12


def test_a_changed_file_is_another_motion():
    """The FMUs in the cache, and the scene in the results file, go by the content."""
    ends = []
    for end in (1e-6, 2e-6):
        written("it.csv", np.array([0.0, 0.01]), **{name: np.array([0.0, end]) for name in DIRECT})
        found = run("stage_tracking", {"motion": "it.csv"}, path="it.h5", force=True, warn=lambda _: None)
        ends.append(found[STACKS[0]][-1])
    assert ends[1] == pytest.approx(2 * ends[0], rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["sdelta_shaker", "sdelta_hfsa", "sdelta_accelerometer", "sdelta_manoeuvre"])
def test_every_scene_of_the_robot_follows_a_file(scene):
    """A lift of 10 um in 50 ms, from rest to rest: its command is met at the rows, and the robot is lifted."""
    time = np.linspace(0, 0.05, 51)
    lift = 10e-6 * np.sin(np.pi * time / 0.1) ** 4
    found = run(
        scene,
        {"motion": written("lift.csv", time, z=lift)},
        record=["motion.position[3]", "robot.platform.position[3]"],
        interval=1e-3,
        path="it.h5",
        warn=lambda _: None,
    )
    assert found.time[-1] == pytest.approx(0.05, rel=1e-12)
    assert found["motion.position[3]"] == pytest.approx(lift, abs=1e-16)
    assert found["robot.platform.position[3]"].max() > 2e-6


@pytest.mark.slow
def test_a_file_drives_the_robot_as_the_sine_source_does():
    """The ramped sine of a run at one input, in rows 0.25 ms apart, with splines 1e-6 of it away."""
    words = {"input": "command.position[3]", "frequency": 20.0, "amplitude": 1e-5}
    own = run("sdelta_shaker", **words, stop_time=0.1, path="own.h5", warn=lambda _: None)
    kept = slice(None, None, 5)
    motion = written("sine.csv", own.time[kept], z=own["reference.command.position[3]"][kept])
    found = run("sdelta_shaker", {"motion": motion}, path="file.h5", warn=lambda _: None)
    name = "robot.platform.position[3]"
    inside = own.time < 0.08  # the file ends at rest, the sine does not
    difference = np.abs(found[name] - own[name])[inside]
    assert difference.max() < 1e-6 * np.abs(own[name]).max()


@pytest.mark.slow
def test_noise_of_the_sensors_moves_the_stage_as_theory_says():
    """Computed torque cancels the springs of the hinges by what it measures, noise n included.

    In each mode

        e'' + 2 w e' + w^2 e = (w_i^2 - w^2) n,      w_i = 2 pi 529.05 Hz twice, 2 pi 1334.7 Hz for the yaw

    and n has the variance s^2 and is held over T, so that for w T << 1 that of e is s^2 T w / 4 (w_i^2 / w^2 - 1)^2.
    """
    still = written("still.csv", np.array([0.0, 1.0]), **{name: np.zeros(2) for name in DIRECT})
    spread, sample_time, omega = 4.2e-9, 10e-6, 2 * np.pi * 300
    arguments = {"motion": still, "law": "ctc", "actuator": "force", "sensor_noise": spread}
    found = run("stage_tracking", arguments, path="it.h5", every=10, warn=lambda _: None)
    later = found.time > 0.01
    measured = np.sqrt(np.mean([found[name][later] ** 2 for name in ERRORS]))
    gains = (np.array([529.05, 529.05, 1334.7]) / 300) ** 2 - 1
    assert measured == pytest.approx(spread * np.sqrt(sample_time * omega / 4 * np.mean(gains**2)), rel=0.03)
    again = run("stage_tracking", arguments, stop_time=0.01, path="b.h5", every=10, warn=lambda _: None)
    assert np.array_equal(again[ERRORS[0]], found[ERRORS[0]][: len(again.time)])
    other = run("stage_tracking", {**arguments, "sensor.seed": 2}, stop_time=0.01, path="c.h5", warn=lambda _: None)
    assert not np.array_equal(other[ERRORS[0]][::10], again[ERRORS[0]])


@pytest.mark.slow
def test_a_stage_on_steps_stays_within_one_of_them():
    """Sensors of 5 nm: what they read are multiples, and PD holds the stage no further than a step from its aim."""
    arguments = {"motion": "step", "law": "pd_ff", "actuator": "force"}
    readings = [f"sensor.axis[{i}].reading" for i in (1, 2, 3)]
    quantised = {**arguments, "sensor_resolution": 5e-9}
    found = run("stage_tracking", quantised, record=readings, path="it.h5", warn=lambda _: None)
    ideal = run("stage_tracking", arguments, path="ideal.h5", warn=lambda _: None)
    for name in readings:
        steps = found[name][1:] / 5e-9
        assert steps == pytest.approx(np.round(steps), abs=1e-6)
    settled = found.time > 0.015
    errors = [max(np.abs(of[name][settled]).max() for name in ERRORS) for of in (ideal, found)]
    assert errors[0] < errors[1] < 5e-9


def test_without_steps_and_noise_there_is_no_sensor():
    assert "sensor" not in [c.name for c in load_scene("stage_tracking", {}).system.components]


WRONG = {
    "name": ("stage_tracking", "stairs", "motion is 'stairs', expected one of ramp, three_axis, step, circle, or the"),
    "near": ("stage_tracking", "stepp", "a .csv file; did you mean step?"),
    "robot": ("sdelta_hfsa", "ramp", "sdelta_hfsa: motion is 'ramp', expected the path of a .csv file"),
    "none": ("stage_tracking", "none.csv", "none.csv: cannot be read"),
    "columns": ("sdelta_hfsa", "yaw.csv", "pose_table: the table has the columns yaw, expected some of x, y, z"),
    "row": ("stage_tracking", "far.csv", "row 2, 1 s: pose 0.01 m, 0 m, 0 rad is out of the legs' reach"),
}  # fmt: skip


@pytest.mark.parametrize(("scene", "motion", "message"), WRONG.values(), ids=WRONG.keys())
def test_a_motion_that_cannot_be_is_a_sentence(hfsa, scene, motion, message):
    time = np.array([0.0, 1.0])
    written("yaw.csv", time, yaw=time)
    written("far.csv", time, x=0.01 * time, y=0 * time, yaw=0 * time)
    code, _, err = hfsa("run", scene, "-p", f"motion={motion}")
    assert code == 2
    assert message in err
    assert not Path("results").exists()


def test_a_scene_with_a_file_has_no_input_to_excite():
    motion = written("lift.csv", np.array([0.0, 1.0]), z=np.array([0.0, 1e-6]))
    with pytest.raises(StructureError, match="the scene has a motion of its own"):
        run("sdelta_hfsa", {"motion": motion}, frequency=20.0, path="it.h5")
