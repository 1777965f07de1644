"""Divergence: the time and the message of the stop, the recorded values, and runs that must not stop."""

import json
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from algorithm_groups import ALGORITHMS
from mass_and_law import law, plant

from hfsa.cosim.actions.divergence import FACTOR, DivergenceError, Scale, recorded_scales
from hfsa.cosim.assembly.build import build
from hfsa.cosim.assembly.load_scene import available_scenes, load_scene
from hfsa.cosim.commands._reports import run_report
from hfsa.cosim.experiments.run import SineInput, prepare
from hfsa.cosim.experiments.setup import set_up
from hfsa.cosim.figures.comparison import comparison_figure
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.fmi.description import describe
from hfsa.cosim.linear.linearize import linear_response
from hfsa.cosim.measurement.run import RunPlan, run
from hfsa.cosim.measurement.trial import Outcome, measure
from hfsa.cosim.results.files import SystemRecord, read_run, read_status
from hfsa.cosim.systems.connectors import connector
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, Connection, System

RATE, START, STEP = 10.0, 1e-6, 1e-3
"""Growth rate of the unstable loop [1/s], its initial position [m], and its step [s]."""
SCALE = Scale(START, "m", "the scene's scale")
LOOPS = pytest.mark.parametrize("is_compiled", [True, False], ids=["c", "python"])


@pytest.fixture
def unstable(exported, library):
    """An unstable mass, x = x0 cosh(RATE t), in a run of 2 s."""

    def plan(algorithm: str, is_compiled: bool = True, **changes) -> RunPlan:
        start = {"stiffness": -(RATE**2), "damping": 0.0}
        system = System(
            [Component("mass", "x", start={"q": START}), Component("law", "x", start=start)],
            [
                *(Connection(f"mass.{name}", f"law.{name}") for name in ("position", "velocity")),
                Connection("law.force", "mass.force"),
            ],
        )
        files = {"mass": exported(plant())[2], "law": exported(law())[2]}
        names, record = ("mass.velocity", "mass.position"), SystemRecord("unstable", "")
        scales = {"mass.position": SCALE}
        made = RunPlan(
            Assembly.read(system, files), names, 2.0, STEP, record, algorithm, library if is_compiled else None
        )
        return replace(made, **{"scales": scales, **changes})

    return plan


def stopped(plan: RunPlan) -> tuple[DivergenceError, dict[str, np.ndarray]]:
    """Return the error of a diverged run, and the values in its file."""
    with pytest.raises(DivergenceError) as caught:
        run(plan, Path("it.h5"))
    values, _ = read_run("it.h5")
    reached = np.isfinite(values["mass.position"])
    assert read_status("it.h5") == ("failed", str(caught.value))
    assert np.all(np.diff(reached.astype(int)) <= 0)  # rows without a gap, and then none
    return caught.value, {name: v[reached] for name, v in values.items()}


# When it stops --------------------------------------------------------------------------------------------------------


@LOOPS
@pytest.mark.parametrize("algorithm", [a for a in ALGORITHMS if a != "linearized_feedback"])
def test_a_run_stops_at_the_first_row_beyond_a_thousand_times_the_scale(unstable, algorithm, is_compiled, monkeypatch,
                                                                        tmp_path):  # fmt: skip
    """The row is kept, and all rows before it equal those of a run without a scale."""
    monkeypatch.chdir(tmp_path)
    error, values = stopped(unstable(algorithm, is_compiled))
    position, limit = values["mass.position"], FACTOR * START
    assert np.all(np.abs(position[:-1]) <= limit)
    assert position[-1] > limit
    assert (error.signal, error.value, error.time) == ("mass.position", position[-1], values["time"][-1])
    # held over a step, a force lags and the growth is less by a part of RATE STEP
    assert error.time == pytest.approx(np.arccosh(FACTOR) / RATE, rel=RATE * STEP)
    run(unstable(algorithm, is_compiled, scales={}), Path("free.h5"))
    for name, whole in read_run("free.h5")[0].items():
        assert np.array_equal(whole[: len(position)], values[name])


@LOOPS
def test_linearized_feedback_stops_as_well(library, monkeypatch, tmp_path, is_compiled):
    """On a scene whose scale is made smaller than its motion."""
    monkeypatch.chdir(tmp_path)
    loaded = set_up("sdelta_hfsa", {"execution": "continuous"}, algorithm="linearized_feedback", stop_time=0.1)
    name, limit = "robot.platform.position[3]", 1e-8
    loaded = replace(loaded, scene=replace(loaded.scene, scale={name: limit / FACTOR}))
    with pytest.raises(DivergenceError, match=r"position\[3\]: diverged"):
        run(prepare(loaded, SineInput("command.position[3]"), library if is_compiled else None, print), Path("it.h5"))
    position = read_run("it.h5")[0][name]
    reached = np.abs(position[np.isfinite(position)])
    assert np.all(reached[:-1] <= limit)
    assert limit < reached[-1] < 1.1 * limit


def test_the_bounds_of_a_variable_go_before_its_scale(box, foreign, hfsa):
    """A value beyond the FMU's own bound of 1000 is out of bounds, or diverged where the scale has a smaller limit."""
    scene = box(foreign[2], stop_time=2.0)
    text, words = scene.read_text(), ["--frequency", "1", "--amplitude", "1e5"]
    for scale, status in (("10.0", "out of bounds at"), ("0.9", "diverged at")):
        scene.write_text(f'scale = {{ "box.y" = {scale} }}\n{text}')
        code, _, err = hfsa("run", scene, *words, "--force")
        assert code == 4
        assert f"box: y: {status}" in err


# Message and recorded rows ------------------------------------------------------------------------------------------


def test_the_message_names_signal_time_figure_and_scale(unstable, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    error, values = stopped(unstable("gauss_seidel"))
    assert isinstance(error, StepError)
    assert str(error) == (
        f"mass: position: diverged at t = {values['time'][-1]:.9g} s: {1e3 * error.value:.4g} mm, more than 1000 times "
        "the scene's scale of 1 um; where the loop is unstable at this step, a smaller one helps"
    )
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.signal, again.value, again.scale) == (str(error), error.signal, error.value, error.scale)


def test_the_report_of_a_run_that_stopped_is_of_what_it_recorded(unstable, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    error, values = stopped(unstable("gauss_seidel"))
    data, text = run_report(Path("it.h5"))
    assert (data["status"], data["message"]) == ("failed", str(error))
    assert (data["stop_time"], data["steps"]) == (error.time, len(values["time"]) - 1)
    position = next(v for v in data["variables"] if v["name"] == "mass.position")
    assert (position["minimum"], position["maximum"]) == (START, error.value)
    assert str(error) in text


def test_a_run_of_the_command_line_that_diverges_is_exit_code_4(hfsa):
    """PD on the stage with too long a sample time: it is unstable by itself."""
    words = ["-p", "law=pd", "-p", "actuator=force", "-p", "damping_time=0", "-p", "sample_time=20e-6"]
    code, out, err = hfsa("run", "stage_tracking", *words, "--step", "20e-6", "--stop", "0.01", "-o", "it.h5")
    assert (code, out) == (4, "")
    assert "diverged at t = 0.00078 s" in err
    assert "more than 1000 times the scene's scale of 833 N" in err
    assert read_status("it.h5")[0] == "failed"
    assert np.isfinite(read_run("it.h5")[0]["stage.platform.rotation"]).sum() == 40


@pytest.mark.slow
def test_of_a_comparison_the_others_go_on(hfsa):
    words = ["-p", "actuator=force", "-p", "damping_time=0", "-p", "sample_time=20e-6", "--step", "20e-6"]
    code, out, _ = hfsa("compare", "stage_tracking", "--over", "law=pd,ctc", *words, "--stop", "0.01", "-j", "1",
                        "--json")  # fmt: skip
    assert code == 1
    wrong, right = json.loads(out)["runs"]
    assert (wrong["status"], wrong["failure_time"], wrong["steps"]) == ("failed", pytest.approx(780e-6), 39)
    assert (right["status"], right["steps"]) == ("complete", 500)
    # numbers are there, and all of them below what stopped the run but for the row that did
    peaks = {group["name"]: group["peak"] for group in wrong["groups"]}
    assert 833e3 < peaks["controller.axis.command"] < 1e9
    assert peaks["tracking.axis.error"] < 12e-3
    code, out, _ = hfsa("compare", "stage_tracking", "--over", "law=pd,pd_ff", *words, "--stop", "0.01", "--force")
    assert code == 4
    assert out.count("FAILED at 780.0 us") == 2


def test_a_run_that_stopped_is_drawn_up_to_the_edge_of_the_others():
    time = np.linspace(0, 1, 1001)
    calm = measure(time, {"a.y": np.sin(7 * time)}, {"a.y": "m"})
    wild = measure(time[:200], {"a.y": np.exp(40 * time[:200])}, {"a.y": "m"})
    figure = comparison_figure(
        "T", ["calm", "wild"], [Outcome(Path("x"), calm, stop_time=1.0), Outcome(Path("y"), wild, failure="diverged")]
    )
    low, high = figure.axes[0].get_ylim()
    assert (low, high) == pytest.approx((-1, 1), abs=0.2)
    (cross,) = [line for line in figure.axes[0].lines if line.get_marker() == "x"]
    assert (cross.get_xdata()[0], cross.get_ydata()[0]) == (time[199], high)
    assert "end of a run that failed" in [text.get_text() for text in figure.legends[0].get_texts()]


# Where a scale comes from ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize(
    ("facts", "size"),
    [
        ("", None),  # 1 by default is nothing that the FMU says
        ('nominal="1e-3"', 1e-3),
        ('nominal="1"', 1.0),
        ('min="-5" max="5"', None),  # bounds stop a run themselves
        ('min="-5" max="5" nominal="1e-3"', None),
        ('min="-5" nominal="1e-3"', 1e-3),
    ],
)
def test_without_a_word_of_the_scene_it_is_what_the_fmu_says(foreign, rewritten, version, facts, size):
    old = "<Real max=" if version == 2 else 'causality="output" max='
    file = rewritten(foreign[version], f'{old}"1000"', f"{old.removesuffix('max=')}{facts}")
    connectors = {"box": describe(file).variables}
    system = System([Component("box", str(file))])
    scene = Scene(system, ["box.u"], ["box.y"], step_size=1e-3, stop_time=1.0, amplitude={"m": 0.1})
    found = recorded_scales(scene, system, connectors, ["box.u", "box.y"])
    assert {name: scale.size for name, scale in found.items()} == ({} if size is None else {"box.y": size})
    declared = replace(scene, scale={"box.y": 7.0})
    assert recorded_scales(declared, system, connectors, ["box.u", "box.y"])["box.y"].size == 7.0
    with pytest.raises(StructureError, match=r"box .* has no variable 'z'"):
        recorded_scales(replace(scene, scale={"box.z": 7.0}), system, connectors, ["box.y"])


@pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
def test_a_start_value_far_above_the_nominal_value_stops_no_run(foreign, rewritten, version):
    """Some tools state a nominal value of 1e-4 for a variable that starts at 1, which has not diverged at its start."""
    old = "<Real max=" if version == 2 else 'causality="output" max='
    file = rewritten(foreign[version], f'{old}"1000"', f'{old.removesuffix("max=")}nominal="1e-4"')
    connectors = {"box": describe(file).variables}
    given = System([Component("box", str(file), start={"y": -1.0})])
    scene = Scene(given, ["box.u"], ["box.y"], step_size=1e-3, stop_time=1.0, amplitude={"m": 1e-6})
    assert recorded_scales(scene, given, connectors, ["box.y"])["box.y"].size == 1.0
    stated = {"box": {**connectors["box"], "y": replace(connectors["box"]["y"], start=2.0)}}
    plain = System([Component("box", str(file))])
    found = recorded_scales(scene, plain, stated, ["box.y"])["box.y"]
    assert (found.size, found.origin) == (2.0, "its start value")


def test_a_nominal_value_stops_no_run_that_is_driven_further(hfsa):
    """The nominal value is 1 mm; shaken by 0.1 m the mass moves by metres at its resonance, and the run goes on."""
    text = """
        inputs = ["mass.base.position"]
        outputs = ["mass.position"]
        amplitude = { m = 1e-3 }
        step_size = 1e-4
        stop_time = 1.0
        [[components]]
        name = "mass"
        part = "mass_on_spring"
    """
    Path("own.toml").write_text(text)
    words = ["--frequency", "15.9", "--json", "--amplitude", "0.1", "--force", "--quiet-inputs"]
    code, out, err = hfsa("run", "own.toml", *words)
    assert (code, err) == (0, "")
    assert next(v["maximum"] for v in json.loads(out)["variables"] if v["name"] == "mass.position") > 1.0
    Path("own.toml").write_text(text.replace("[[components]]", '[scale]\n"mass.position" = 1e-3\n[[components]]'))
    code, _, err = hfsa("run", "own.toml", *words)
    assert code == 4
    assert "more than 1000 times the scene's scale of 1 mm" in err
    at = err.partition(": diverged at")[0]
    # the same where the mass is one FMU with what shakes it, or with another mass
    Path("own.toml").write_text(Path("own.toml").read_text() + '[[components]]\nname="other"\npart="mass_on_spring"\n')
    code, _, err = hfsa("run", "own.toml", *words, "--fuse", "mass,other", "--keep", "all")
    assert (code, err.partition(": diverged at")[0]) == (4, at)


# The scenes we ship ---------------------------------------------------------------------------------------------------

VARIANTS = [
    *((name, {}) for name in available_scenes()),
    ("stage_tracking", {"actuator": "force"}),
    ("stage_tracking", {"law": "integral"}),
    ("stage_accelerometer", {"stage": "jacobian"}),
    ("beam_payload", {"suspension": "massless"}),
    ("stage_extremes", {"law": "pd"}),
]
MOST = {
    "sdelta_hfsa": {"m": 10e-3, "rad": 0.1},
    "sdelta_shaker": {"m": 10e-3, "rad": 0.1},
    "sdelta_accelerometer": {"m": 10e-3, "rad": 0.1},
    "stage_bode": {"V": 75.0},
    "stage_accelerometer": {"V": 75.0, "m": 12e-6},
    "accelerometer_shaker": {"m/s2": 1e3},
    "beam_bode": {"N": 80.0, "N.m": 1.6},
    "beam_payload": {"m/s2": 100.0},
    "mass_on_spring": {"m": 0.1},
}
"""Amplitudes to the end of travels: of the platform, of stacks about their bias, of the proof mass, of the beams."""


@pytest.mark.parametrize(("name", "arguments"), VARIANTS, ids=str)
@pytest.mark.slow
def test_every_output_has_a_scale_which_no_motion_of_the_machine_comes_near(name, arguments, opened):
    """At all frequencies of the band, and at the end of the travel, a response is at most a tenth of the limit."""
    scene = load_scene(name, arguments)
    assert set(scene.scale) == set(scene.outputs)
    files = build(scene.system).files
    variables = {name: describe(file).variables for name, file in files.items()}
    limits = np.array([FACTOR * scene.scale[name] for name in scene.outputs])
    if not scene.inputs:
        return
    amplitude = np.array([MOST[name][connector(scene.system, variables, n).unit or ""] for n in scene.inputs])
    frequency = np.geomspace(*scene.band, 2000)
    response = linear_response(scene.system, opened(files), scene.inputs, scene.outputs, frequency)
    assert np.all(np.abs(response).max(axis=0) * amplitude < limits[:, None] / 10)
