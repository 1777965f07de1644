"""One fact, one owner, on running FMUs: effect of a scene's argument, and messages of the verbs on a difference."""

import json

import numpy as np
import pytest

from hfsa.components import rrr_stage
from hfsa.components._mechanics.pzt import Stack
from hfsa.components._mechanics.rrr_design import Design
from hfsa.cosim.assembly.build import build
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.linear.linearize import linear_response
from hfsa.cosim.masters.algorithms import make_master

ERRORS = [f"tracking.axis[{i}].error" for i in (1, 2, 3)]
LINKS = ("nominal", "calibrated")


@pytest.fixture
def ran(opened, library):
    """Run a scene with its own algorithm; returns time (n,) and the signals as rows."""

    def run(name: str, seconds: float, signals: list[str], step_size: float | None = None, **arguments):
        scene = load_scene(name, {key.replace("__", "."): value for key, value in arguments.items()})
        step_size = step_size or scene.step_size
        master = make_master(opened(build(scene.system).files), scene.system, "gauss_seidel", step_size, library)
        steps = round(seconds / step_size)
        recording = master.record(signals, rows=steps + 1)
        master.initialize()
        master.advance(steps)
        return np.array(recording.time), np.array([recording[name] for name in signals])

    return run


# Damping of the stage -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("damping_time", [0.0, 6e-5])
def test_computed_torque_knows_the_damping_of_the_stage(ran, damping_time):
    """On a ramp no static error remains; it is (beta - beta0) K v / (M Kp) where the controller has another beta0.

    With its 6.02 us that is 363 pm of a stage without damping, and 3.2 nm of one with ten times as much.
    """
    drive = {"law": "ctc", "actuator": "force", "sample_time": 20e-6, "damping_time": damping_time}
    time, error = ran("stage_tracking", 0.05, ERRORS, **drive)
    standing = error[:, time > 0.02].mean(axis=1)
    assert np.abs(standing).max() < 10e-12
    drive["controller__damping_time"] = 6.02e-6
    time, error = ran("stage_tracking", 0.05, ERRORS, **drive)
    stage = rrr_stage.analyze()
    kept = abs(6.02e-6 - damping_time) * 3e-6 * stage["stiffness"].sum() / stage["inertia"].sum() / (600 * np.pi) ** 2
    assert np.abs(error[:, time > 0.02].mean(axis=1)) == pytest.approx([kept] * 3, rel=0.06)


# Links of the stage ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("stage", ["constant_jacobian", pytest.param("exact", marks=pytest.mark.slow)])
def test_computed_torque_tracks_with_the_calibrated_links(ran, stage):
    """0.20 nm with a stage of 0.23 kg in the yaw, in place of 0.13 nm of 0.41 kg; the nominal ones lose control."""
    motion = {"law": "ctc", "actuator": "force", "motion": "three_axis", "stage": stage, "model": stage}
    peaks = {k: np.abs(ran("stage_tracking", 0.1, ERRORS, kinematics=k, **motion)[1]).max() for k in LINKS}
    assert peaks["nominal"] < 0.2e-9
    assert peaks["calibrated"] < 0.25e-9


def test_computed_torque_tracks_on_stacks_with_the_calibrated_links(ran):
    """A ramp by 0.59 nm, as with the nominal ones; three axes by 0.3 um, where a stack would have to pull."""
    peaks = {k: np.abs(ran("stage_tracking", 0.05, ERRORS, law="ctc", kinematics=k)[1]).max() for k in LINKS}
    assert peaks["calibrated"] == pytest.approx(peaks["nominal"], rel=0.02)
    pulling = rrr_stage.analyze(design=Design("calibrated"), elongation=(8e-6, 0.0, 0.0))
    assert pulling["force"][1:] == pytest.approx([-12.0, -12.0], abs=0.2)
    assert pulling["voltage"][1] < 0
    clipped = ["voltage.axis[2].saturation", "voltage.axis[2].command"]
    _, found = ran("stage_tracking", 0.1, [*ERRORS, *clipped], law="ctc", motion="three_axis", kinematics="calibrated")
    assert np.abs(found[:3]).max() == pytest.approx(0.3e-6, abs=0.05e-6)
    assert found[3].any()
    assert found[4].min() == 0


@pytest.mark.parametrize("law", ["ctc", "pd_ff"])
def test_no_law_saturates_for_the_calibrated_links(ran, law):
    """On stacks, to a pose of their own. PD takes a shorter sample time, 2 m / Kv being 9.2 us of 0.23 kg."""
    step = {"law": law, "motion": "step", "pose": (2e-6, 1e-6, -8e-5), "kinematics": "calibrated", "sample_time": 5e-6}
    signals = [*ERRORS, "stage.platform.position[1]", "stage.platform.position[2]", "stage.platform.rotation"]
    _, found = ran("stage_tracking", 0.02, signals, **step)
    assert np.abs(found[:3, -1]).max() < 1e-9
    assert found[3:5, -1] == pytest.approx([2e-6, 1e-6], abs=0.1e-6)  # the constant Jacobian errs by so much


@pytest.mark.parametrize("law", ["ctc", "pd"])
@pytest.mark.slow
def test_the_extremes_hold_for_the_calibrated_links(ran, law):
    """Femtometres, as with the nominal ones."""
    peaks = [
        np.abs(
            ran(
                "stage_extremes",
                50 * load_scene("stage_extremes", {"law": law}).step_size,
                ERRORS,
                law=law,
                kinematics=k,
            )[1]
        ).max()
        for k in LINKS
    ]
    assert peaks[1] == pytest.approx(peaks[0], rel=0.5)
    assert peaks[0] < 1e-14


@pytest.mark.parametrize("kinematics", LINKS)
def test_the_extremes_tick_by_the_mass_of_their_yaw(kinematics):
    """0.3 of 2 m / Kv, to one digit."""
    mass = np.linalg.eigvalsh(rrr_stage.analyze(design=Design(kinematics))["inertia"])[0]
    gains = {"law": "pd", "proportional_gain": 0, "derivative_gain": 1e7}
    scene = load_scene("stage_extremes", {**gains, "kinematics": kinematics})
    assert scene.step_size == scene.system["controller"].start["sample_time"] == float(f"{0.6 * mass / 1e7:.0e}")


# Stacks ---------------------------------------------------------------------------------------------------------------


def test_the_gain_of_a_stage_on_other_stacks(opened):
    """At rest x = J (K + k)^-1 alpha V: 1.672e-7 m/V of the first stack, where those of 2000 N push, not 3.217e-7."""
    stack = Stack(blocking_force=2000.0)
    scene = load_scene("stage_bode", {"pzt.blocking_force": "2000"})
    gain = linear_response(
        scene.system, opened(build(scene.system).files), scene.inputs, scene.outputs, np.array([1.0])
    )[0]
    rest = rrr_stage.analyze(stack=stack, voltage=(75.0,) * 3)["elongation_at_voltage"]
    stage = rrr_stage.analyze(elongation=tuple(rest.tolist()))
    expected = stage["jacobian"] @ np.linalg.inv(stage["stiffness"] + 125e6 * np.eye(3)) * 2000 / 150
    np.testing.assert_allclose(gain.real, expected, rtol=1e-4)
    assert np.abs(gain[0, 0]) == pytest.approx(1.672e-7, rel=1e-3)


def test_a_stage_on_other_stacks_rests_at_its_bias(ran):
    """From the first step on: the bias is that of the stacks which push."""
    _, found = ran("stage_bode", 0.01, ["stage.stack[1].elongation"], pzt__blocking_force="2000")
    rest = rrr_stage.analyze(stack=Stack(blocking_force=2000.0), voltage=(75.0,) * 3)["elongation_at_voltage"][0]
    assert found == pytest.approx(rest, rel=1e-6)
    assert rest == pytest.approx(6.49e-6, abs=0.005e-6)


@pytest.mark.parametrize("law", ["ctc", "pd_ff", "integral_ff"])
def test_every_law_tracks_on_other_stacks(ran, law):
    """Three axes on stacks of 2000 N and 20 um: by nanometres, the share of what the stiffer stack's volts hold."""
    stacks = {"pzt__blocking_force": "2000", "pzt__stroke": "20e-6"}
    peaks = [
        np.abs(ran("stage_tracking", 0.1, ERRORS, law=law, motion="three_axis", **given)[1]).max()
        for given in ({}, stacks)
    ]
    assert peaks[1] < 3 * peaks[0]


# Payload of the robot -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", [{"law": "pd"}, {"law": "ctc"}, {"law": "pd", "feed_forward": "elastic"}])
@pytest.mark.parametrize("mass", [0.0, 1.0])
def test_another_payload_is_held_where_its_springs_let_it(ran, law, mass):
    """The holding torque is that of the payload: m g over the vertical stiffness is left, not 12.8 mm of lift."""
    stiffness = 4.4857 * 9.81 / 0.412e-3
    _, found = ran(
        "sdelta_hfsa",
        3.0,
        ["robot.platform.position[3]", "controller.axis[1].command"],
        0.25e-3,
        gravity="9.81",
        payload__mass=repr(mass),
        **law,
    )
    weight = (1.4857 + mass) * 9.81
    sag = 0.0 if "feed_forward" in law else -weight / stiffness
    assert found[0, -1] == pytest.approx(sag, abs=1e-6)
    assert found[1, -1] == pytest.approx(0.458382 * weight / (4.4857 * 9.81), abs=1e-4)


def test_elastic_feed_forward_inverts_the_robot_with_any_payload(opened):
    """Under continuous control no error remains; with the old payload it was 1.36 to 1.73 of the command."""
    scene = load_scene(
        "sdelta_hfsa", {"law": "ctc", "execution": "continuous", "feed_forward": "elastic", "payload.mass": "1"}
    )
    frequency = np.array([5.0, 10.0, 20.0])
    found = linear_response(scene.system, opened(build(scene.system).files), scene.inputs, scene.outputs, frequency)
    np.testing.assert_allclose(found, np.broadcast_to(np.eye(6), (3, 6, 6)), atol=1e-6)


# What the verbs say ---------------------------------------------------------------------------------------------------

MASSLESS = ("-p", "suspension=massless")
ALONE = (*MASSLESS, "-p", "payload.body.mass=0.2")
SAID = (
    "mass of the body on the beams differs: 0.1 kg in suspension.platform.mass; 0.2 kg in payload.body.mass; "
    "-p payload.mass=VALUE changes all of them"
)
VERBS = {
    "run": ("run", "beam_payload", "--stop", "1e-4"),
    "fused run": ("run", "beam_payload", "--stop", "1e-4", "--fuse", "suspension,payload"),
    "sweep": ("sweep", "beam_payload", "--method", "linear", "--points", "3"),
    "loop": ("sweep", "beam_payload", "--method", "linear", "--open-loop", "payload.platform.position[1]"),
    "compare": ("compare", "beam_payload", "--stop", "1e-4", "--jobs", "1", "--over", "damping_ratio=0.01,0.02"),
    "stability": ("stability", "beam_payload", "--algorithm", "jacobi"),
}


@pytest.mark.parametrize(
    "verb", [pytest.param(verb, marks=() if verb in ("run", "loop") else pytest.mark.slow) for verb in VERBS]
)
def test_every_verb_says_which_parts_differ(hfsa, verb):
    code, _, warned = hfsa(*VERBS[verb], *ALONE)
    assert code == 0
    assert SAID in warned
    force = [] if "stability" in VERBS[verb] else ["--force"]
    code, _, warned = hfsa(*VERBS[verb], *MASSLESS, "-p", "payload.mass=0.2", *force)
    assert code == 0
    assert "differs" not in warned


def test_a_comparison_says_which_run_it_is(hfsa):
    words = ("compare", "beam_payload", *MASSLESS, "--stop", "1e-4", "--jobs", "1")
    _, _, warned = hfsa(*words, "--over", "payload.body.mass=0.1,0.2")
    assert [line for line in warned.splitlines() if "differs" in line] == [f"hfsa: payload.body.mass=0.2: {SAID}"]


def test_a_map_says_it_of_what_it_varies(hfsa):
    words = ("stability", "beam_payload", *MASSLESS, "--vary", "step_size=1e-6:4e-6:2")
    assert SAID in hfsa(*words, "--vary", "payload.body.mass=0.1:0.2:2")[2]
    assert "differs" not in hfsa(*words, "--vary", "payload.mass=0.1:0.2:2")[2]


def test_the_analysis_of_the_stage_takes_the_stack(hfsa):
    code, out, _ = hfsa("analyze", "rrr_stage", "-p", "stack.stiffness=125e6", "--json")
    assert code == 0
    bonded = json.loads(out)["natural_frequencies_bonded_hz"]
    assert bonded == pytest.approx(rrr_stage.analyze(stack=Stack(stiffness=125e6))["natural_frequencies_bonded_hz"])
