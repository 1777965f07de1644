"""Scenes that cannot run, on the command line: message, exit code, and contents of the file."""

import re
import textwrap
from pathlib import Path

import numpy as np
import pytest

from hfsa.cosim.results.files import Status, read_run, read_sweep, read_warnings

VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
LOOPS = pytest.mark.parametrize("loop", ["c", "python"])


@pytest.fixture
def hfsa(hfsa):
    """Run the command in an empty folder; returns exit code, stdout, stderr on one line."""

    def run(*tokens):
        code, out, err = hfsa(*tokens)
        return code, out, " ".join(err.split())

    return run


# An FMU that misbehaves -----------------------------------------------------------------------------------------------


@VERSIONS
@LOOPS
@pytest.mark.parametrize(
    ("behaviour", "ending", "advice"),
    [
        (2, "discard", "; the FMU refuses a step of this size from here; try a smaller one"),
        (3, "error", "; the run cannot continue; check its inputs and parameters"),
        (4, "fatal", "; the FMU cannot be used in this process any more; check its inputs and parameters"),
        (5, "terminated", "; the FMU requests the end of the run"),
        (6, "not finite", "; where the loop is unstable at this step, a smaller one helps"),
    ],
)
def test_a_run_that_ends_early(hfsa, box, foreign, behaviour, ending, advice, version, loop):
    code, out, err = hfsa("run", box(foreign[version], behaviour=behaviour, at=0.2), "--backend", loop, "-o", "run.h5")
    values, _ = read_run("run.h5")
    if ending == "terminated" and version == 2:
        assert (code, err) == (0, "")  # FMI 2 has no such request
        return
    assert (code, out) == (4, "")
    assert err.startswith("error: box: ")
    assert f": {ending} at t = 0.2" in err
    assert err.endswith(advice)
    recorded = np.isfinite(values["box.y"])
    assert 200 <= np.sum(recorded) <= 201
    assert recorded[:200].all()


@LOOPS
def test_a_warning_is_said_once_and_the_run_goes_on(hfsa, box, foreign, loop):
    code, _, err = hfsa("run", box(foreign[3], behaviour=1, at=0.2), "--backend", loop, "-o", "run.h5")
    sentence = "box: fmi3DoStep: warning at t = 0.2 s: the spring is broken; 300 times in all"
    assert (code, err) == (0, f"hfsa: {sentence}")
    assert read_warnings("run.h5") == [sentence]
    assert np.isfinite(read_run("run.h5")[0]["box.y"]).all()


@pytest.mark.parametrize("method", ["stepped", "multisine"])
@pytest.mark.parametrize("jobs", [1, 2])
def test_warnings_in_a_sweep_are_counted_and_said_once(hfsa, box, foreign, method, jobs):
    """The box warns at every step from 0.2 s on, in each point."""
    words = ["--points", "3", "--from", "10", "--to", "30", "--method", method, "-j", str(jobs), "-o", "sweep.h5"]
    _, _, err = hfsa("sweep", box(foreign[2], behaviour=1, at=0.2), *words)
    sentence = r"box: fmi2DoStep: warning at t = 0\.2\S* s: the spring is broken; (\d+) times in all"
    (found,) = re.finditer(sentence, err)
    assert int(found[1]) > 100
    assert read_warnings("sweep.h5") == [found[0]]


def test_a_sweep_says_that_inputs_are_held(hfsa, box, foreign):
    """An FMU that takes no derivatives of its inputs is stepped with held ones, which a run says too."""
    words = ["--points", "1", "--from", "20", "--algorithm", "gauss_seidel_linear", "-o", "sweep.h5"]
    _, _, err = hfsa("sweep", box(foreign[2]), *words)
    assert err.count("takes no derivatives of its inputs") == 1


@pytest.mark.parametrize(("how", "words"), [("crash", "crashed with SIGSEGV"), ("exit", "ended the process")])
@pytest.mark.parametrize("verb", ["run", "sweep"])
def test_an_fmu_that_kills_whoever_loads_it(hfsa, box, deadly, verb, how, words):
    code, out, err = hfsa(verb, box(deadly[how]), "-o", "out.h5")
    assert (code, out) == (4, "")
    assert err == (
        f"error: box: Foreign.fmu: cannot be run: Co-Simulation: loading: the binary {words}; "
        "repair or replace it, `hfsa check Foreign.fmu` looks closer"
    )
    assert not Path("out.h5").exists()


def test_an_fmu_that_crashes_in_a_sweep_fails_its_points_only(hfsa, box, foreign):
    """It crashes at 1.5 s, which only the low frequency reaches."""
    words = ["--points", "3", "--grid", "log", "--jobs", "1", "-o", "sweep.h5"]
    code, _, _ = hfsa("sweep", box(foreign[2], behaviour=8, at=1.5), *words)
    bode = read_sweep("sweep.h5")
    assert code == 1
    assert bode.status[:, 0].tolist() == [Status.FAILED, Status.DONE, Status.DONE]
    assert bode.message[0, 0].startswith("box: fmi2DoStep: lost at t = 1.5 s: its process was ended by SIGSEGV")


# Scenes that do not fit -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("verb", ["run", "sweep"])
def test_a_step_that_does_not_fit_the_ticks(hfsa, verb):
    code, out, err = hfsa(verb, "sdelta_hfsa", "--step", "70e-6")
    assert (code, out) == (2, "")
    assert err == (
        "error: controller.sample_time is 0.00025 s and the step 7e-05 s: one must be a multiple of the other, so that "
        "ticks fall on communication points; the nearest step that fits is 6.25e-05 s"
    )
    assert not list(Path().rglob("*.h5"))


def test_a_rigid_robot_on_drives_with_inertia(hfsa):
    code, out, err = hfsa("run", "sdelta_hfsa", "-p", "robot.level=rigid")
    assert (code, out) == (2, "")
    assert "robot is sdelta at level rigid, which may be joined to sdelta_reference or c_drive (ideal) only" in err
    assert "drive[1] is c_drive at level rigid_shaft" in err


@pytest.fixture
def ring(tmp_path):
    """Write a scene of two parts with an algebraic loop through a slide of each."""

    def write(slide: int) -> Path:
        scene = tmp_path / f"ring{slide}.toml"
        scene.write_text(
            textwrap.dedent(f"""
            inputs = ["left.command.position[2]"]
            outputs = ["right.drive[{slide}].slide"]
            band = [1.0, 50.0]
            amplitude = {{ m = 1e-6 }}
            step_size = 1e-4
            stop_time = 0.01

            [[components]]
            name = "left"
            part = "sdelta_reference"

            [[components]]
            name = "right"
            part = "sdelta_reference"

            [[connections]]
            start = "left.drive[{slide}].slide"
            end = "right.command.position[1]"

            [[connections]]
            start = "right.drive[{slide}].slide"
            end = "left.command.position[1]"
            """)
        )
        return scene

    return write


def test_a_ring_of_feedthrough_is_refused(hfsa, ring):
    """With `refuse`, the message has the path of the loop before anything runs."""
    loops = [
        "left.drive[1].slide -> right.command.position[1] -> right.drive[1].slide -> left.command.position[1] -> ",
        "right.drive[1].slide -> left.command.position[1] -> left.drive[1].slide -> right.command.position[1] -> ",
    ]
    for words in (("run",), ("sweep",), ("compare", "--over", "left.level=linear,exact")):
        code, out, err = hfsa(words[0], ring(1), *words[1:], "--algebraic-loops", "refuse")
        assert (code, out) == (2, "")
        assert err.startswith("error: algebraic loop: ")
        spelt = err.removeprefix("error: algebraic loop: ").partition(";")[0]
        assert any(spelt in loop + loop for loop in loops), err
        assert spelt.count("->") >= 3
    assert not list(Path().rglob("*.h5"))


def test_a_ring_of_feedthrough_of_gain_1_has_no_solution(hfsa, ring):
    """A loop without a solution, or with any number of them, is an error of its solution."""
    for verb in ("run", "sweep"):
        code, out, err = hfsa(verb, ring(1))
        assert (code, out) == (4, "")
        assert "does not converge at t = 0 s: the algebraic loop " in err
        assert err.rstrip().endswith("has loop gain 1, and so no solution or any number of them")


def test_a_ring_of_feedthrough_of_another_gain_is_solved(hfsa, ring):
    """Drive 2 slides by -x / 2 + sqrt(3) / 2 y; where its slide is the other's x, and vice versa: by -y / sqrt(3)."""
    code, _, err = hfsa("run", ring(2), "--quiet-inputs", "-o", "ring.h5")
    assert (code, err) == (0, "")
    found, _ = read_run(Path("ring.h5"))
    y = found["left.command.position[2]"]
    assert y.max() > 1e-12
    np.testing.assert_allclose(found["right.drive[2].slide"], -y / np.sqrt(3), rtol=0, atol=1e-17)  # rounding of 0.1 m


# Wrong types in a scene -----------------------------------------------------------------------------------------------

TOML = """
inputs = ["mass.base.position"]
outputs = ["mass.position"]
band = [1, 100]
amplitude = { m = 1e-3 }
step_size = 1e-3
stop_time = 0.01
[[components]]
name = "mass"
part = "mass_on_spring"
start = { damping = 1 }
"""

START = "start = { damping = 1 }"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('inputs = ["mass.base.position"]', "inputs = [5]", "inputs is [5], expected"),
        (
            'inputs = ["mass.base.position"]',
            'inputs = "mass.base.position"',
            "inputs is 'mass.base.position', expected",
        ),
        ('outputs = ["mass.position"]', "outputs = [true]", "outputs is [True], expected"),
        ("band = [1, 100]", 'band = ["a", 5.0]', "band is ['a', 5.0], expected"),
        ("band = [1, 100]", "fuse = [[5]]", "a group of fuse is [5], expected"),
        ("band = [1, 100]", "algorithm = 5", "algorithm is 5, expected"),
        ("band = [1, 100]", "source = 5", "source is 5, expected a table"),
        ("step_size = 1e-3", "step_size = true", "step_size is True, expected a number"),
        ("amplitude = { m = 1e-3 }", "amplitude = { m = true }", "the amplitude in m is True, expected a number"),
        ('name = "mass"', "name = 5", "component name 5 is not an identifier"),
        ('part = "mass_on_spring"', "part = 5", "component mass: part is 5, expected"),
        ('part = "mass_on_spring"', 'part = "./folder"', "error: mass: "),
        ('part = "mass_on_spring"', 'part = "sdelta_tuning"', "mass: sdelta_tuning is an analysis and has no model"),
        (START, "start = 5", "component mass: start is 5, expected"),
        (START, "start = { damping = { a = 1 } }", "mass.damping is {'a': 1}, expected a number, or an analysis"),
        (START, "arguments = 5", "component mass: arguments is 5, expected"),
        (START, "arguments = { level = 5 }", "mass_on_spring has no argument 'level'"),
        (START, "arguments = { damping = [1] }", "mass_on_spring: damping is (1,), expected a number"),
        (START, "arguments = { solver = 5 }", "mass_on_spring: solver is 5"),
        (START, '[[connections]]\nstart = 5\nend = "mass.u"', "start of a connection is 5, expected"),
    ],
)
def test_a_wrong_type_in_a_scene_file(hfsa, old, new, words):
    assert old in TOML
    Path("folder").mkdir()
    Path("x.toml").write_text(TOML.replace(old, new))
    code, out, err = hfsa("run", "./x.toml", "-o", "run.h5")
    assert (code, out) == (2, "")
    assert err.startswith("error: ")
    assert words in err
    assert "Traceback" not in err
    assert not Path("run.h5").exists()


@pytest.mark.parametrize("text", [b"\xff\xfe", TOML.replace("[1, 100]", "5").encode()], ids=["bytes", "number"])
def test_one_broken_scene_breaks_no_listing(hfsa, text):
    Path("broken.toml").write_bytes(text)
    Path("good.toml").write_text(TOML)
    code, out, err = hfsa("list", ".")
    assert (code, err) == (0, "")
    assert "broken" in out
    assert "good" in out


# A torque beyond the limit --------------------------------------------------------------------------------------------

LIMIT = [word for i in range(1, 7) for word in ("-p", f"controller.axis[{i}].limit=1e-4")]


@LOOPS
def test_a_run_into_the_limit_says_so(hfsa, loop):
    words = ["--input", "command.position[3]", "--frequency", "20", "--stop", "0.5", "--backend", loop, "-o", "run.h5"]
    code, _, err = hfsa("run", "sdelta_hfsa", *words)
    assert (code, err) == (0, "")
    assert not read_run("run.h5")[0]["controller.axis[1].saturation"].any()
    code, out, err = hfsa("run", "sdelta_hfsa", *LIMIT, *words, "--force")
    assert code == 0
    values, _ = read_run("run.h5")
    flags = values["controller.axis[1].saturation"]
    first, share = values["time"][np.argmax(flags)], np.mean(flags)
    assert 0 < first < 0.5
    assert share < 1
    often = f"{100 * share:.3g} % of the time"
    assert f"controller.axis[1].saturation: saturated, first at {first:.6g} s, {often}" in out
    assert f"hfsa: controller: axis[1].saturation: saturated, first at t = {first:.9g} s, {often}" in err
    assert ": a command is held at its limit; take a smaller motion or a higher limit" in err


def test_a_point_measured_in_the_limit_is_marked(hfsa):
    words = ["--input", "command.position[3]", "--from", "20", "--to", "25", "--points", "2", "--grid", "log"]
    code, out, _ = hfsa("sweep", "sdelta_hfsa", *LIMIT, *words, "--settling-time", "1", "--jobs", "1", "-o", "sweep.h5")
    assert code == 1
    bode = read_sweep("sweep.h5")
    assert (bode.status == Status.LIMITED).all()
    assert np.isfinite(bode.response).all()
    assert "limited: controller: axis[" in out
    assert "saturated at t = " in out
    assert "and the response is not the small-signal response; take a smaller motion or a higher limit" in out
