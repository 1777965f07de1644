"""The command line: every verb answers, a wrong word is named with the nearest right one, exit codes are kept."""

import json
import os
import re
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from hfsa.cosim.cli import main
from hfsa.cosim.commands._shell import plain
from hfsa.cosim.results.files import Status, read_run, read_sweep
from hfsa.fmus.errors import ExportError

MASS = ["sweep", "mass_on_spring", "-p", "damping=5", "--from", "5", "--to", "50"]
SWEEP, LINEAR = [*MASS, "--jobs", "1"], [*MASS, "--method", "linear"]


def strict(text):
    """Read JSON as the standard has it: no NaN, no Infinity."""

    def refuse(name):
        raise AssertionError(f"{name} in JSON")

    return json.loads(text, parse_constant=refuse)


# Answers --------------------------------------------------------------------------------------------------------------


def test_list_names_every_part_and_scene(hfsa):
    code, out, _ = hfsa("list")
    assert code == 0
    for word in (
        "components",
        "controllers",
        "scenes",
        "sdelta (rigid, cartesian)",
        "drive[1..3].slide",
        "sdelta_shaker",
    ):
        assert word in out
    code, out, _ = hfsa("list", "--json")
    parts = {entry["name"]: entry for entry in strict(out)["components"]}
    assert parts["sdelta"]["levels"] == ["rigid", "cartesian"]
    assert parts["sdelta"]["has_analysis"]
    assert {"name": "base.position", "unit": "m"}.items() <= parts["mass_on_spring"]["inputs"][0].items()
    assert {"mass_on_spring", "sdelta_shaker"} <= {scene["name"] for scene in strict(out)["scenes"]}


def test_list_of_one_part_tells_its_arguments(hfsa):
    code, out, _ = hfsa("list", "sdelta")
    assert code == 0
    assert "-p posture.position=0,0,0.15" in out
    assert "-p damping_ratio=0.01" in out
    assert "ch3_full, ch3_rods, ch4, ch4_full" in out
    assert "sine_source" not in out


def test_analyze_answers_with_the_keys_of_the_robot(hfsa):
    words = ["-p", "posture.rotation=10,5,8", "-p", "posture.position=0.005,0.003,0.155", "-p", "stiffness=ch4"]
    code, out, _ = hfsa("analyze", "sdelta", "--level", "cartesian", *words, "--json")
    assert code == 0
    numbers = strict(out)
    assert set(numbers) == {
        "stiffness_S", "stiffness_C", "mass_C", "frequency_matrix_C", "natural_frequencies_hz", "modal_screws_C",
        "eigenstiffness", "eigenpitch", "translational_stiffness", "torsional_stiffness", "kappa", "kappa_t", "kappa_r",
        "motor_angles", "tube_slides", "tube_angles", "limb_lengths", "jacobian", "units",
    }  # fmt: skip
    assert set(numbers["units"]) == set(numbers) - {"units"}
    assert numbers["units"]["stiffness_S"] == "N.m/rad, N; N, N/m"
    assert np.shape(numbers["stiffness_S"]) == (6, 6)
    assert numbers["natural_frequencies_hz"] == sorted(numbers["natural_frequencies_hz"])
    code, out, _ = hfsa("analyze", "sdelta")
    assert code == 0
    assert "natural_frequencies_hz [Hz] =\n  23.58966  23.58966  24.54538  95.92521  95.92521  161.0828\n" in out
    assert "kappa = 25304.09 N\n" in out
    # in the symmetric posture half of the entries are rounding noise
    assert "  2488.029          0         0          0  29569.96         0\n" in out
    assert not re.search(r"e-[12]\d|-0(?![.\d])", out)


def test_an_analysis_says_which_arguments_it_takes(hfsa):
    """Some are the FMU's alone, some its own; and a level that it does not depend on is one of the part's."""
    code, out, _ = hfsa("list", "rrr_stage")
    assert code == 0
    both, models, own = (
        part.splitlines() for part in re.split(r" take\n|analyze alone takes\n|the FMU alone takes\n", out)[1:]
    )
    assert any("-p stack.stiffness=" in line for line in both)
    assert any("-p kinematics=nominal" in line for line in both)
    assert {line.split("=")[0].strip() for line in own if "-p " in line} >= {"-p elongation", "-p voltage"}
    for line in (line for line in models if "-p " in line):
        name = line.split("=")[0].split()[-1]
        code, _, err = hfsa("analyze", "rrr_stage", "-p", f"{name}=1")
        assert code == 2
        assert f"rrr_stage: {name} is an argument of its FMU, which its analysis does not take" in err
        assert "kinematics" in err
        assert "voltage" in err
    code, out, _ = hfsa("list", "rrr_stage", "--json")
    (entry,) = strict(out)["components"]
    taken_by = {a["name"]: a["taken_by"] for a in entry["arguments"]}
    assert taken_by["kinematics"] == taken_by["causality"] == ["the FMU", "analyze"]
    assert taken_by["elongation"] == taken_by["voltage"] == ["analyze"]
    answers = [
        hfsa("analyze", "c_drive", *words)[1] for words in ((), ("--level", "ideal"), ("-p", "level=rigid_shaft"))
    ]
    assert answers[0] == answers[1] == answers[2] != ""
    code, _, err = hfsa("analyze", "c_drive", "--level", "idal")
    assert code == 2
    assert "c_drive: level is 'idal', expected one of ideal, rigid_shaft" in err
    code, _, err = hfsa("analyze", "sdelta", "--level", "rigid", "-p", "level=cartesian")
    assert code == 2
    assert "-p level is given twice: rigid and cartesian" in err


def test_export_writes_files_that_check_finds_clean(hfsa, tmp_path):
    code, out, _ = hfsa("export", "mass_on_spring", "-p", "damping=1", "-o", tmp_path / "built")
    files = [Path(line) for line in out.split()]
    assert code == 0
    assert [file.name for file in files] == ["MassOnSpring.fmi2.fmu", "MassOnSpring.fmi3.fmu"]
    code, out, _ = hfsa("check", *files)
    assert (code, out.count("no problem found")) == (0, 2)
    broken = tmp_path / "broken.fmu"
    broken.write_bytes(files[0].read_bytes()[:2000])
    code, out, _ = hfsa("check", broken, files[1], "--json")
    assert code == 1
    first, second = strict(out)
    assert first["problems"]
    assert second["problems"] == []
    code, out, _ = hfsa("export", "mass_on_spring", "--fmi", "3", "-o", tmp_path / "three", "--json")
    assert [Path(file).name for file in strict(out)["files"]] == ["MassOnSpring.fmi3.fmu"]


def test_sweep_then_bode(hfsa):
    code, out, err = hfsa(*SWEEP, "--points", "4", "-o", "swept.h5")
    assert (code, err) == (0, "")
    assert out.startswith("swept.h5: 4 done\n  algorithm gauss_seidel_linear: response within ")
    bode = read_sweep("swept.h5")
    assert (bode.frequency[0], bode.frequency[-1]) == (5, 50)
    assert np.abs(bode.frequency / 15.9 - 1).min() < 0.01  # one of four points hits the resonance
    assert bode.attributes["title"].startswith("The example's scene")
    code, out, _ = hfsa("sweep", "mass_on_spring", "-p", "damping=5", "--method", "linear", "--json")
    assert strict(out)["points"]["done"] == 1000
    assert strict(out)["peaks"][0]["magnitude"] == pytest.approx(20, rel=1e-2)
    code, out, _ = hfsa("bode", "swept.h5", "results/mass_on_spring_linear.h5")
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
    answer = strict(out)
    assert answer["steps"] == 10_000
    values, units = read_run(answer["file"])
    assert units == {"time": "s", "mass.base.position": "m", "mass.position": "m"}
    later = values["time"] > 0.5
    assert np.allclose(values["mass.base.position"][later], 1e-3 * np.sin(8 * np.pi * values["time"][later]))
    assert np.abs(values["mass.position"]).max() > 1e-3


def test_a_run_records_further_signals_of_any_component(hfsa):
    """A local velocity is the slope of the position; what is wired together is one signal; ranges and short names."""
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


def test_an_amplitude_of_zero_holds_still(hfsa):
    """A mass at rest stays there exactly; a robot under gravity sags as it does beside a vanishing sine."""
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
    assert (code, [run["groups"][0]["peak"] for run in strict(out)["runs"]]) == (0, [0, 0])
    words = ["--amplitude", "0", "-p", "robot.level=auto", "--tolerance", "0.1", "--stop", "0.01", "-o", "auto.h5"]
    assert hfsa("run", "sdelta_shaker", *words)[0] == 0  # judged by the scene's own amplitude
    assert not np.any(read_run("auto.h5")[0]["robot.platform.position[3]"])
    assert hfsa("sweep", "mass_on_spring", "--amplitude", "0")[0] == 2
    assert hfsa("run", "mass_on_spring", "--amplitude", "-1")[0] == 2


@pytest.mark.parametrize("method", ["stepped", "linear"])
def test_a_sweep_of_one_frequency(hfsa, method):
    """|H| of 1 kg on 1e4 N/m and 5 N.s/m: at the low end, or where both ends are one."""

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


def test_levels_are_judged_at_the_one_frequency_that_is_asked_for(hfsa):
    """At 1 Hz the robot is as good as rigid, at 15 Hz it is not."""
    words = ["sweep", "sdelta_shaker", "-p", "robot.level=auto", "--tolerance", "0.02", "--method", "linear", "--json"]
    words += ["--input", "command.position[3]", "--signal", "platform.position[3]"]
    for frequency, level in (("1", "rigid"), ("15", "cartesian")):
        code, out, _ = hfsa(*words, "--from", frequency, "--to", frequency, "--force")
        assert (code, strict(out)["levels"]["robot"]["level"]) == (0, level)


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
        said = f"-o {name}: mass.position is a signal, which --signal takes"
        assert ("its ending is no picture format" if is_picture else said) in err
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
    """Half a step beyond it, too: FMUs that are told the stop time refuse to go further. It is said where it ends."""
    for stop, steps, end in (("0.00124", 12, "0.0012"), ("0.00126", 13, "0.0013"), ("0.0012", 12, "")):
        code, out, err = hfsa("run", "mass_on_spring", "--step", "1e-4", "--stop", stop, "-o", f"{stop}.h5", "--json")
        said = f"hfsa: the stop time of {stop} s is no multiple of the step of 0.0001 s: the run ends at {end} s\n"
        assert (code, err) == (0, said if end else "")
        assert strict(out)["steps"] == steps


OWN_MOTION = """
inputs = []
outputs = ["mass.position"]
step_size = 1e-4
stop_time = 0.5

[[components]]
name = "shaker"
part = "sine_source"
arguments = { unit = "m" }
start = { frequency = 4.0, amplitude = 1e-3 }

[[components]]
name = "mass"
part = "mass_on_spring"

[[components]]
name = "other"
part = "mass_on_spring"

[[connections]]
start = "shaker.value"
end = "mass.base.position"
"""


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
    assert strict(out)["peaks"][0]["magnitude"] == pytest.approx(200, rel=1e-2)


def test_points_that_fail_are_exit_code_1_and_null_in_json(hfsa, failing_scene):
    code, out, _ = hfsa("sweep", failing_scene, "--points", "3", "--grid", "log", "--jobs", "1", "--json")
    assert code == 1
    answer = strict(out)
    assert answer["points"] == {"pending": 0, "done": 2, "not_settled": 0, "failed": 1, "limited": 0}
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


# Wrong words ----------------------------------------------------------------------------------------------------------

WRONG = {
    "scene": (["sweep", "sdelta_shakr"], "no scene is called 'sdelta_shakr'; did you mean sdelta_shaker"),
    "scene file": (["run", "mine.toml"], "there is no file mine.toml"),
    "scene argument": (["run", "mass_on_spring", "-p", "dampin=1"], "has no argument 'dampin'; did you mean damping"),
    "scene value": (["run", "mass_on_spring", "-p", "damping=much"], "damping is 'much', expected a number"),
    "component": (["sweep", "sdelta_shaker", "-p", "robt.level=rigid"], "'robt.level'; did you mean robot.level"),
    "level": (["sweep", "sdelta_shaker", "-p", "robot.level=cartesain"], "did you mean cartesian?"),
    "out of bounds": (["run", "mass_on_spring", "-p", "mass.damping=-1"], "damping is -1 N.s/m, expected 0 to inf"),
    "start": (["run", "mass_on_spring", "-p", "mass.dampin=1"], "mass has no argument 'dampin'; did you mean damping?"),
    "input": (
        ["sweep", "mass_on_spring", "--input", "base.positon"],
        "no input is called 'base.positon'; did you mean",
    ),
    "output": (["sweep", "mass_on_spring", "--signal", "mass.positon"], "did you mean mass.position"),
    "band": (["sweep", "mass_on_spring", "--from", "9", "--to", "2"], "frequencies from 9 to 2 Hz, expected"),
    "step": (["sweep", "mass_on_spring", "--to", "9000"], "9000 Hz has 1.11 steps of 0.0001 s in a period"),
    "stop": (["run", "mass_on_spring", "--stop", "1e-9"], "less than a step"),
    "pair": (["analyze", "sdelta", "-p", "stiffness"], "-p 'stiffness' is not of the form NAME=VALUE"),
    "pair twice": (["analyze", "sdelta", "-p", "a=1", "-p", "a=2"], "-p a is given twice: 1 and 2"),
    "part": (["export", "sdlta"], "no part is called 'sdlta'; did you mean sdelta"),
    "part level": (["export", "sdelta", "--level", "rigit"], "level is 'rigit', expected one of rigid, cartesian"),
    "argument": (
        ["export", "sdelta", "-p", "stifness=ch4"],
        "sdelta has no argument 'stifness'; did you mean stiffness",
    ),
    "choice": (["analyze", "sdelta", "-p", "stiffness=ch5"], "expected one of ch3_full, ch3_rods, ch4, ch4_full"),
    "bounds": (["export", "mass_on_spring", "-p", "stiffness=-1"], "stiffness is -1 N/m, expected 0 to inf N/m"),
    "analysis": (["analyze", "mass_on_spring"], "mass_on_spring has no analysis"),
    "listed": (["list", "sdlta"], "nothing is called 'sdlta'; did you mean sdelta"),
    "results": (["bode", "none.h5"], "there is no file none.h5"),
    "fmu": (["check", "none.fmu"], "there is no file none.fmu"),
    "verb": (["sweeep"], 'Did you mean "sweep"'),
    "option": (["sweep", "mass_on_spring", "--metod", "linear"], "--method"),
    "method": (["sweep", "mass_on_spring", "--method", "multisine"], "stepped"),
    "points": (["sweep", "mass_on_spring", "--points", "0"], "1"),
    "nothing": (["sweep"], "SCENE"),
}


OWN_MOTION_WRONG = {
    "frequency": (["run", "--frequency", "3"], "motion of its own; a sine takes --input beside --frequency and"),
    "amplitude": (["run", "--input", "other.base.position"], "no amplitude for other.base.position in m; it has none"),
    "fed": (["run", "--input", "mass.base.position", "--amplitude", "1"], "input mass.base.position is fed twice"),
    "sweep": (["sweep"], "no input to excite; name one with --input; there are other.base.position"),
}


@pytest.mark.parametrize(("tokens", "message"), OWN_MOTION_WRONG.values(), ids=OWN_MOTION_WRONG)
def test_what_a_scene_with_a_motion_of_its_own_does_not_take(hfsa, tokens, message):
    Path("own.toml").write_text(OWN_MOTION)
    code, out, err = hfsa(tokens[0], "own.toml", *tokens[1:])
    assert (code, out) == (2, "")
    assert message in " ".join(err.split())
    assert not list(Path().rglob("*.h5"))


@pytest.mark.parametrize(("tokens", "message"), WRONG.values(), ids=WRONG)
def test_a_wrong_word_is_named_with_the_nearest_right_one(hfsa, tokens, message):
    code, out, err = hfsa(*tokens)
    assert (code, out) == (2, "")
    assert message in " ".join(err.split())
    assert not list(Path().rglob("*.h5"))


def test_a_build_that_fails_is_exit_code_3(hfsa, monkeypatch):
    def fail(*_):
        raise ExportError("no C compiler: tried cc, gcc, clang")

    monkeypatch.setattr("hfsa.fmus.export.export", fail)
    assert hfsa("export", "mass_on_spring") == (3, "", "error: no C compiler: tried cc, gcc, clang\n")


def test_a_full_disk_is_exit_code_4(hfsa):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, hard))
    try:
        code, out, err = hfsa("sweep", "mass_on_spring", "--method", "linear", "--points", "9000", "-o", "big.h5")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert (code, out, err) == (4, "", "error: cannot write big.h5: File too large\n")
    assert list(Path().iterdir()) == []


def test_a_file_that_cannot_be_is_wrong_usage(hfsa):
    code, _, err = hfsa(*LINEAR, "--points", "2", "-o", "/dev/full/a.h5")
    assert code == 2
    assert "error: cannot write /dev/full/a.h5: " in err


def test_json_has_neither_nan_nor_numpy():
    value = {"a": np.array([[1.0, np.nan]]), "b": 1 + 2j, "c": np.int64(3), "d": Path("x"), "e": (np.inf, None, True)}
    assert strict(json.dumps(plain(value), allow_nan=False)) == {
        "a": [[1.0, None]],
        "b": {"real": 1.0, "imaginary": 2.0},
        "c": 3,
        "d": "x",
        "e": [None, None, True],
    }


# As a process ---------------------------------------------------------------------------------------------------------


def test_help_comes_without_the_heavy_libraries():
    heavy = {"casadi", "control", "fmpy", "h5py", "matplotlib", "numpy", "scipy"}
    script = f"import sys; from hfsa.cosim.cli import main; main(['--help']); print({heavy} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("set()\n")
    for verb in ("list", "analyze", "export", "check", "run", "compare", "sweep", "bode"):
        assert f" {verb} " in done.stdout


def test_a_reader_that_goes_away_is_no_error():
    command = [sys.executable, "-m", "hfsa.cosim.cli", "list", "--json"]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    child.stdout.close()
    err = child.stderr.read()
    assert (child.wait(), err) == (0, "")


def test_an_interrupted_sweep_keeps_its_points_and_resumes(tmp_path):
    path = tmp_path / "sweep.h5"
    words = ["sweep", "mass_on_spring", "-p", "damping=0.5", "--points", "12", "--jobs", "2", "-o", str(path)]
    command = [sys.executable, "-m", "hfsa.cosim.cli", *words]
    child = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    while not (path.is_file() and measured(path)):
        assert child.poll() is None
        time.sleep(0.05)
    os.killpg(child.pid, signal.SIGINT)  # as the keyboard does, to all processes
    _, err = child.communicate()
    assert child.returncode == 130
    assert "sweep with --resume to continue" in err
    assert "Traceback" not in err
    half = read_sweep(path)
    assert half.attributes["status"] == "interrupted"
    assert 0 < np.sum(half.status == Status.DONE) < 12
    assert main([*words, "--resume"]) == 0
    assert read_sweep(path).attributes["status"] == "complete"


def measured(path):
    """Count the finished points of a file that another process is writing."""
    import h5py

    with h5py.File(path, "r", locking=False) as file:
        return np.sum(file["bode/status"][:] == Status.DONE)
