"""Verbs on scenes: sweep, bode and run, their options and results files."""

from pathlib import Path

import numpy as np
import pytest
from command_line import LINEAR, MASS, OWN_MOTION, SWEEP, strict_json

from hfsa.cosim.results.files import read_run, read_sweep


def test_sweep_then_bode(hfsa):
    code, out, err = hfsa(*SWEEP, "--points", "4", "-o", "swept.h5")
    assert (code, err) == (0, "")
    assert out.startswith("swept.h5: 4 done\n  algorithm gauss_seidel_linear: response within ")
    bode = read_sweep("swept.h5")
    assert (bode.frequency[0], bode.frequency[-1]) == (5, 50)
    assert np.abs(bode.frequency / 15.9 - 1).min() < 0.01  # one of four points hits the resonance
    assert bode.attributes["title"].startswith("The example's scene")
    code, out, _ = hfsa("sweep", "mass_on_spring", "-p", "damping=5", "--method", "linear", "--json")
    assert strict_json(out)["points"]["done"] == 1000
    assert strict_json(out)["peaks"][0]["magnitude"] == pytest.approx(20, rel=1e-2)
    code, out, _ = hfsa("bode", "swept.h5", "results/mass_on_spring.linear.h5")
    assert (code, out) == (0, "swept.png\n")
    assert Path("swept.png").read_bytes().startswith(b"\x89PNG")


def test_sweep_takes_signals_by_short_name_amplitude_and_grid(hfsa):
    words = [
        "--points",
        "3",
        "--grid",
        "log",
        "--amplitude",
        "2e-4",
        "--input",
        "base.position",
        "--signal",
        "position",
    ]
    assert hfsa(*SWEEP, *words, "-o", "a.h5")[0] == 0
    bode = read_sweep("a.h5")
    assert np.allclose(bode.frequency, [5, 5 * np.sqrt(10), 50])
    assert [(s.name, s.amplitude) for s in bode.inputs] == [("mass.base.position", 2e-4)]
    assert [s.name for s in bode.outputs] == ["mass.position"]


def test_resume_refuses_another_sweep_and_leaves_a_finished_one(hfsa):
    assert hfsa(*SWEEP, "--points", "2", "-o", "a.h5", "--resume")[0] == 0
    before = Path("a.h5").read_bytes()
    assert hfsa(*SWEEP, "--points", "2", "-o", "a.h5", "--resume")[0] == 0
    code, _, err = hfsa(*SWEEP, "--points", "2", "-o", "a.h5", "--resume", "--step", "5e-5")
    assert code == 2
    assert "a.h5 belongs to another sweep: step_size is 0.0001 there and 5e-05 here" in err
    assert len(Path("a.h5").read_bytes()) == len(before)


def test_run_records_the_input_and_the_outputs(hfsa):
    code, out, err = hfsa("run", "mass_on_spring", "--frequency", "4", "--stop", "1", "--json")
    assert (code, err) == (0, "")
    answer = strict_json(out)
    assert answer["steps"] == 10_000
    values, units = read_run(answer["file"])
    assert units == {"time": "s", "mass.base.position": "m", "mass.position": "m"}
    later = values["time"] > 0.5
    assert np.allclose(values["mass.base.position"][later], 1e-3 * np.sin(8 * np.pi * values["time"][later]))
    assert np.abs(values["mass.position"]).max() > 1e-3


def test_a_run_records_further_signals_of_any_component(hfsa):
    """A local velocity is the slope of the position; connected variables are equal; ranges and short names."""
    words = ["--frequency", "4", "--stop", "0.2", "--signal", "mass.velocity", "--signal", "position", "-o", "a.h5"]
    assert hfsa("run", "mass_on_spring", *words)[0] == 0
    values, units = read_run("a.h5")
    assert (list(values)[1:], units["mass.mass.velocity"]) == (
        ["mass.base.position", "mass.mass.velocity", "mass.position"],
        "m/s",
    )
    slope = np.gradient(values["mass.position"], values["time"])
    assert np.abs(slope - values["mass.mass.velocity"])[1:-1].max() < 1e-3 * np.abs(slope).max()
    words = ["--signal", "axis[1..2].command", "--signal", "drive[1].motor[1..2].torque", "--stop", "0.02"]
    assert hfsa("run", "sdelta_hfsa", *words, "-o", "b.h5")[0] == 0
    values, units = read_run("b.h5")
    assert units["controller.axis[2].command"] == "N.m"
    for axis in (1, 2):
        torque = values[f"drive[1].motor[{axis}].torque"]
        assert np.abs(torque).max() > 0
        assert np.array_equal(torque, values[f"controller.axis[{axis}].command"])


@pytest.mark.slow
def test_an_amplitude_of_zero_holds_still(hfsa):
    """A mass at rest stays there exactly; a robot under gravity sags as with a vanishing sine."""
    assert hfsa("run", "mass_on_spring", "--amplitude", "0", "--stop", "0.1", "-o", "rest.h5")[0] == 0
    values, _ = read_run("rest.h5")
    assert not np.any(values["mass.base.position"])
    assert not np.any(values["mass.position"])
    heights = []
    for amplitude in ("0", "1e-12"):
        words = ["-p", "gravity=9.81", "--amplitude", amplitude, "--stop", "0.05", "-o", f"{amplitude}.h5"]
        assert hfsa("run", "sdelta_hfsa", *words)[0] == 0
        heights.append(read_run(f"{amplitude}.h5")[0]["robot.platform.position[3]"])
    assert heights[0].min() < -1e-4
    assert np.abs(heights[0] - heights[1]).max() < 1e-11
    code, out, _ = hfsa("compare", "mass_on_spring", "--over", "damping=1,2", "--amplitude", "0", "--stop", "0.1",
                        "-j", "1", "--json")  # fmt: skip
    assert (code, [run["groups"][0]["peak"] for run in strict_json(out)["runs"]]) == (0, [0, 0])
    words = ["--amplitude", "0", "-p", "robot.level=auto", "--tolerance", "0.1", "--stop", "0.01", "-o", "auto.h5"]
    assert hfsa("run", "sdelta_shaker", *words)[0] == 0  # judged by the scene's own amplitude
    assert not np.any(read_run("auto.h5")[0]["robot.platform.position[3]"])
    assert hfsa("sweep", "mass_on_spring", "--amplitude", "0")[0] == 2
    assert hfsa("run", "mass_on_spring", "--amplitude", "-1")[0] == 2


@pytest.mark.parametrize("method", ["stepped", "linear"])
def test_a_sweep_of_one_frequency(hfsa, method):
    """|H| of 1 kg on 1e4 N/m and 5 N.s/m: at the lower end, or where both ends are equal."""

    def gain(f):
        s = 2j * np.pi * f
        return abs((1e4) / (s**2 + 5 * s + 1e4))

    words = ["sweep", "mass_on_spring", "-p", "damping=5", "--method", method]
    for more, f in (
        (["--from", "5", "--points", "1"], 5.0),
        (["--from", "5", "--to", "50", "--points", "1", "--grid", "log"], 5.0),
        (["--from", "12", "--to", "12", "--points", "1"], 12.0),
        (["--from", "12", "--to", "12"], 12.0),
    ):
        code, out, _ = hfsa(*words, *more, "-o", "one.h5", "--force")
        assert (code, out.splitlines()[0]) == (0, "one.h5: 1 done")
        bode = read_sweep("one.h5")
        assert bode.frequency.tolist() == [f]
        assert np.abs(bode.response[0, 0, 0]) == pytest.approx(gain(f), rel=1e-2)
        assert hfsa("bode", "one.h5")[0] == 0
    code, _, err = hfsa(*words, "--from", "12", "--to", "12", "--points", "5")
    assert code == 2
    assert "--points 5: from 12 to 12 Hz there is one" in err


def test_levels_are_judged_at_the_one_frequency_that_is_requested(hfsa):
    """At 1 Hz the robot is rigid within the tolerance, at 15 Hz it is not."""
    words = ["sweep", "sdelta_shaker", "-p", "robot.level=auto", "--tolerance", "0.02", "--method", "linear", "--json"]
    words += ["--input", "command.position[3]", "--signal", "platform.position[3]"]
    for frequency, level in (("1", "rigid"), ("15", "cartesian")):
        code, out, _ = hfsa(*words, "--from", frequency, "--to", frequency, "--force")
        assert (code, strict_json(out)["levels"]["robot"]["level"]) == (0, level)


@pytest.mark.parametrize("word", ["--output", "-o"])
@pytest.mark.parametrize(
    "verb",
    [
        ["run", "mass_on_spring"],
        ["compare", "mass_on_spring", "--over", "damping=1,2"],
        ["sweep", "mass_on_spring", "--method", "linear", "--points", "9"],
        ["stability", "mass_on_spring", "--vary", "damping=1:2:3"],
        ["bode", "swept.h5"],
    ],
    ids=lambda verb: verb[0],
)
def test_output_is_a_file_in_every_verb_and_a_signal_there_is_refused(hfsa, verb, word):
    if verb[0] == "bode":
        assert hfsa(*LINEAR, "--points", "9", "-o", "swept.h5")[0] == 0
    before = set(Path().iterdir())
    for name in ("mass.position", "position"):
        code, out, err = hfsa(*verb, word, name)
        assert (code, out) == (2, "")
        is_picture = verb[0] == "compare"  # a figure's ending is looked at before any FMU is
        message = f"-o {name}: mass.position is a signal, which --signal takes"
        assert ("its ending is no picture format" if is_picture else message) in err
    assert set(Path().iterdir()) == before
    file = "made.png" if verb[0] in ("bode", "compare") else "made.h5"
    assert hfsa(*verb, word, file)[0] == 0
    assert Path(file).is_file()


def test_bode_draws_signals_by_range_and_short_name(hfsa):
    words = ["--method", "linear", "--points", "9", "--grid", "log", "-o", "shaken.h5"]
    assert hfsa("sweep", "sdelta_shaker", *words)[0] == 0
    for name in ("platform.position[2..3]", "robot.platform.position[3]"):
        assert hfsa("bode", "shaken.h5", "--signal", name, "--input", "command.position[1..3]")[0] == 0
    code, _, err = hfsa("bode", "shaken.h5", "--signal", "platform.position[3..4]")
    assert code == 2
    assert "no file has an output 'platform.position[4]'; did you mean" in err


def test_a_run_ends_at_the_step_nearest_to_its_stop_time(hfsa):
    """Also half a step beyond it: FMUs with a stop time refuse to step further. A warning has the actual end."""
    for stop, steps, end in (("0.00124", 12, "0.0012"), ("0.00126", 13, "0.0013"), ("0.0012", 12, "")):
        code, out, err = hfsa("run", "mass_on_spring", "--step", "1e-4", "--stop", stop, "-o", f"{stop}.h5", "--json")
        message = f"hfsa: the stop time of {stop} s is no multiple of the step of 0.0001 s: the run ends at {end} s\n"
        assert (code, err) == (0, message if end else "")
        assert strict_json(out)["steps"] == steps


def test_a_scene_with_a_motion_of_its_own_runs_as_it_is(hfsa):
    Path("own.toml").write_text(OWN_MOTION)
    assert hfsa("run", "own.toml")[0] == 0
    values, _ = read_run("results/own_run.h5")
    assert list(values) == ["time", "mass.position"]
    assert np.abs(values["mass.position"]).max() > 1e-3
    sine = ["--input", "other.base.position", "--frequency", "4", "--amplitude", "2e-3", "--stop", "1"]
    assert hfsa("run", "own.toml", *sine, "--force")[0] == 0
    values, _ = read_run("results/own_run.h5")
    assert values["other.base.position"].max() == pytest.approx(2e-3, rel=1e-3)
    assert np.abs(values["mass.position"]).max() > 1e-3
    code, out, _ = hfsa("sweep", "own.toml", "--input", "other.base.position", "--signal", "other.position",
                        "--amplitude", "1e-3", "--method", "linear", "--json")  # fmt: skip
    assert code == 0
    assert strict_json(out)["peaks"][0]["magnitude"] == pytest.approx(200, rel=1e-2)


def test_points_that_fail_are_exit_code_1_and_null_in_json(hfsa, failing_scene):
    code, out, _ = hfsa("sweep", failing_scene, "--points", "3", "--grid", "log", "--jobs", "1", "--json")
    assert code == 1
    answer = strict_json(out)
    assert answer["points"] == {
        "pending": 0,
        "done": 2,
        "not_settled": 0,
        "failed": 1,
        "limited": 0,
        "not_excited": 0,
        "disagrees": 0,
    }
    (trouble,) = answer["troubles"]
    assert trouble["frequency"] == 1
    assert "box.y" in trouble["message"].replace("box: y", "box.y")
    code, out, err = hfsa("sweep", failing_scene, "--points", "3", "--jobs", "1", "--force")
    assert code == 1
    assert "there is no linear response" in err
    assert "box.u at 1 Hz failed: " in out


def test_a_run_that_turns_nan_is_exit_code_4_and_keeps_what_was_recorded(hfsa, failing_scene):
    code, out, err = hfsa("run", failing_scene, "-o", "run.h5")
    assert (code, out) == (4, "")
    assert "box" in err
    assert "not finite at t = 1.5" in err
    values, _ = read_run("run.h5")
    recorded = np.isfinite(values["box.y"])
    assert 1500 <= np.sum(recorded) <= 1502


# Frequencies and amplitudes ------------------------------------------------------------------------------------------


def test_one_point_where_a_band_begins_and_a_grid_in_hertz(hfsa):
    """A single point needs no end of the band, and may lie above that of the scene; a grid in hertz is even."""
    assert hfsa(*MASS[:2], "--from", "300", "--points", "1", "--jobs", "1", "-o", "one.h5")[0] == 0
    assert read_sweep("one.h5").frequency.tolist() == [300.0]
    words = ["--from", "10", "--to", "300", "--points", "30", "--grid", "linear"]
    for command in (["--method", "linear"], ["--method", "linear", "--open-loop", "controller.axis[1].command"]):
        scene = "sdelta_hfsa" if "--open-loop" in command else "mass_on_spring"
        assert hfsa("sweep", scene, *command, *words, "-o", "even.h5", "--force")[0] == 0
        assert np.allclose(read_sweep("even.h5").frequency, 10 * np.arange(1, 31))


@pytest.mark.slow
def test_a_linear_sweep_needs_no_amplitude(hfsa):
    """Statics of a force and a torque on the stage, units without an amplitude in the scene: those of thesis ch. 2."""
    words = ["--input", "stage.wrench.force[1]", "--input", "stage.wrench.torque", "--from", "1", "--points", "1"]
    for amplitude in ([], ["--amplitude", "0"], ["--amplitude", "2"]):
        assert hfsa("sweep", "stage_bode", "--method", "linear", *words, *amplitude, "-o", "a.h5", "--force")[0] == 0
        bode = read_sweep("a.h5")
        assert abs(bode.entry("stage.platform.position[1]", "stage.wrench.force[1]")[0]) == pytest.approx(
            1.98978e-7, rel=1e-4
        )
        assert abs(bode.entry("stage.platform.rotation", "stage.wrench.torque")[0]) == pytest.approx(
            1.32936e-4, rel=1e-4
        )
    code, _, err = hfsa("sweep", "stage_bode", *words, "-o", "b.h5")
    assert code == 2
    assert "is in N, for which no amplitude is given" in err
