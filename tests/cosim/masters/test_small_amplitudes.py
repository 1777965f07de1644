"""Amplitudes from a picometre to the limit of the workspace: linear responses, and references everywhere in it."""

from dataclasses import replace

import numpy as np
import pytest
from algorithm_groups import ALGORITHMS, ERROR_CONTROLLED, ITERATED, MONOLITHIC, MONOLITHIC_DAE
from scipy.linalg import expm

from hfsa.components._modelling.linearize import linearize
from hfsa.components.sdelta import sdelta
from hfsa.components.sdelta_reference import sdelta_reference
from hfsa.cosim.assembly.assemble import Variants
from hfsa.cosim.assembly.build import build, instrument, with_ports
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.masters.algorithms import open_master
from hfsa.cosim.results.files import read_run

pytestmark = pytest.mark.slow

BOTH = pytest.mark.parametrize("algorithm", [MONOLITHIC, MONOLITHIC_DAE])
AXES = [f"{kind}[{i}]" for kind in ("rotation", "position") for i in (1, 2, 3)]
HEIGHT = "robot.platform.position[3]"


def simulated(name, arguments, excited, amplitude, frequency, algorithm, step, stop, names=None, library=None):
    """Values of a scene under a sine on an input, or of its own motion, from 0 to `stop`, (points, names)."""
    scene = load_scene(name, arguments)
    if excited:
        unit = next(iter(instrument(scene, excited, scene.outputs)[scene.source.name].arguments.values()))
        scene = replace(scene, amplitude={**scene.amplitude, unit: amplitude})
    assembly = Variants(scene).driven(excited, frequency) if excited else build(scene.system)
    one = open_master(with_ports(assembly, algorithm), algorithm, step, library)
    try:
        names = names or scene.outputs
        recording = one.record(names, rows=round(stop / step) + 1)
        one.initialize()
        one.advance(round(stop / step))
        return np.array([recording[found] for found in names]).T
    finally:
        one.close()


def closed_form(axis: int, frequency: float, times: np.ndarray, amplitude: float) -> np.ndarray:
    """Pose and acceleration of S, (times, 12), while a sine sets in: under sin^2 it is three sinusoids, exactly."""
    robot, reference = linearize(sdelta()), linearize(sdelta_reference())
    omega, ramp = 2 * np.pi * frequency, np.pi / max(2 / frequency, 0.5)
    generator, value = np.zeros((6, 6)), np.zeros(6)
    for k, (rate, share) in enumerate(((omega, 0.5), (omega + ramp, -0.25), (omega - ramp, -0.25))):
        generator[2 * k, 2 * k + 1], generator[2 * k + 1, 2 * k] = rate, -rate
        value[2 * k] = amplitude * share
    kind, place = AXES[axis].split("[")
    command = np.zeros((reference.ninputs, 6))
    for suffix, row in (("", value), ("_rate", value @ generator), ("_acceleration", value @ generator @ generator)):
        command[reference.input_labels.index(f"command/{kind}{suffix}[{place}")] = row
    put_out = reference.D @ command
    driven = np.zeros((robot.ninputs, 6))
    for i, label in enumerate(robot.input_labels):
        if label in reference.output_labels:
            driven[i] = put_out[reference.output_labels.index(label)]
    whole = np.block([[robot.A, robot.B @ driven], [np.zeros((6, robot.nstates)), generator]])
    labels = [f"platform/{axis}" for axis in AXES]
    labels += [f"platform/{word}[{i}]" for word in ("angular_acceleration", "acceleration") for i in (1, 2, 3)]
    seen = np.hstack([robot.C, robot.D @ driven])[[robot.output_labels.index(label) for label in labels]]
    start = np.concatenate([np.zeros(robot.nstates), [0, 1] * 3])
    return np.array([seen @ expm(whole * t) @ start for t in times])


@BOTH
@pytest.mark.parametrize("amplitude", [1e-12, 1e-6, 1e-3])
@pytest.mark.parametrize("axis", [0, 3, 5])
def test_the_monolithic_solution_is_the_closed_form(algorithm, amplitude, axis):
    """As exactly at 1 pm as at 1 mm; axes that do not move stay at rounding."""
    names = [f"robot.platform.{name}" for name in AXES]
    found = simulated(
        "sdelta_shaker", {}, f"reference.command.{AXES[axis]}", amplitude, 17.0, algorithm, 0.02, 0.1, names
    )
    exact = closed_form(axis, 17.0, np.arange(6) * 0.02, amplitude)[:, :6]
    moving = np.abs(exact).max(axis=0) > 1e-6 * amplitude
    size = np.where(moving, np.abs(exact).max(axis=0), amplitude)
    tolerance = {MONOLITHIC: 1e-10, MONOLITHIC_DAE: 1e-8}[algorithm]
    assert (np.abs(found - exact).max(axis=0) < tolerance * size).all()


def test_a_millimetre_on_the_shaker(hfsa):
    """From rest, in points 1 ms apart: the command in which the reference came to rest."""
    words = "run sdelta_shaker --algorithm monolithic --step 1e-3 --stop 0.2 --amplitude 1e-3 --frequency 17 -o run.h5"
    code, _, _ = hfsa(*words.split(), "--input", "command.position[3]")
    assert code == 0
    found, _ = read_run("run.h5")
    exact = closed_form(5, 17.0, np.arange(201) * 1e-3, 1e-3)[:, 5]
    assert np.abs(found[HEIGHT] - exact).max() < 1e-9 * np.abs(exact).max()


def test_the_default_amplitude_on_the_accelerometer(hfsa):
    words = "run sdelta_accelerometer --algorithm monolithic --step 1e-3 --stop 0.05 --frequency 20 -o run.h5"
    code, _, _ = hfsa(*words.split(), "--input", "command.position[3]")
    assert code == 0
    found, _ = read_run("run.h5")
    exact = closed_form(5, 20.0, np.arange(51) * 1e-3, 10e-6)[:, 11]
    assert np.abs(found["robot.platform.acceleration[3]"] - exact).max() < 1e-9 * np.abs(exact).max()


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_responses_are_linear(algorithm, library):
    """A billionth of the command leads to a billionth of the motion; iterations stop at 1e-10 of nominals."""
    tolerance = {**dict.fromkeys(ITERATED, 1e-5), ERROR_CONTROLLED: 1e-3}.get(algorithm, 1e-9)
    arguments = {"execution": "continuous", "law": "ctc", "feed_forward": "elastic"}
    step = 1e-3 if algorithm in (MONOLITHIC, MONOLITHIC_DAE) else 50e-6
    found = [
        simulated(
            "sdelta_hfsa",
            arguments,
            "reference.command.position[3]",
            amplitude,
            17.0,
            algorithm,
            step,
            0.02,
            [HEIGHT],
            library,
        )
        / amplitude
        for amplitude in (1e-3, 1e-6, 1e-9, 1e-12)
    ]
    for one in found[1:]:
        assert np.abs(one - found[0]).max() < tolerance * np.abs(found[0]).max()


COMMAND = "reference.command"
POSE = [
    (f"{COMMAND}.position[1]", (1e-12, 20e-3)),
    (f"{COMMAND}.position[3]", (1e-12, 20e-3)),
    (f"{COMMAND}.rotation[1]", (1e-12, 0.2)),
    (f"{COMMAND}.rotation[3]", (1e-12, 0.2)),
]
VOLTS = [("stack[1].command.voltage", (1e-5, 70.0))]
LAWS = [{"law": "pd"}, {"law": "ctc"}, {"law": "ctc_cartesian", "feed_forward": "elastic"}]
DRIVEN = [
    *(("sdelta_shaker", {}, *case, 17.0, 0.03) for case in POSE),
    *(("sdelta_accelerometer", {}, *case, 17.0, 5e-3) for case in POSE),
    *(("sdelta_hfsa", {**law, "execution": "sampled"}, *POSE[1], 17.0, 5e-3) for law in LAWS),
    *(("sdelta_hfsa", {**law, "execution": "continuous"}, *POSE[1], 17.0, 0.03) for law in LAWS),
    ("sdelta_hfsa", {"law": "ctc", "feedback": "pose", "bandwidth": 1.0}, *POSE[0], 17.0, 5e-3),
    ("sdelta_hfsa", {"gravity": 9.81, "posture.rotation": (10, 5, 8)}, *POSE[2], 17.0, 5e-3),
    ("accelerometer_shaker", {}, "sensor.base.acceleration[1]", (1e-9, 100.0), 50.0, 0.02),
    *(
        ("stage_bode", {"stage": stage}, *case, 100.0, 0.01)
        for stage in ("constant_jacobian", "exact")
        for case in VOLTS
    ),
    *(("stage_accelerometer", {}, *case, 100.0, 0.01) for case in VOLTS),
    ("stage_accelerometer", {"stage": "jacobian"}, "stage.stack[1].elongation", (1e-12, 1e-5), 100.0, 0.01),
    ("beam_bode", {}, "stage.wrench.force[1]", (1e-9, 100.0), 50.0, 0.01),
    ("beam_payload", {}, "payload.base.acceleration[2]", (1e-9, 100.0), 50.0, 0.01),
    ("mass_on_spring", {}, "mass.base.position", (1e-12, 1e-3), 17.0, 0.05),
]


@BOTH
@pytest.mark.parametrize(
    ("name", "arguments", "excited", "amplitudes", "frequency", "stop"),
    DRIVEN,
    ids=[" ".join([name, *map(str, arguments.values()), excited]) for name, arguments, excited, *_ in DRIVEN],
)
def test_every_scene_runs_at_every_amplitude(name, arguments, excited, amplitudes, frequency, stop, algorithm):
    """No noise shortens the steps, and all motion is resolved."""
    for amplitude in amplitudes:
        found = simulated(name, arguments, excited, amplitude, frequency, algorithm, 1e-3, stop)
        assert np.isfinite(found).all()
        assert (np.ptp(found, axis=0) > 0).any()


MOVING = [
    *(
        ("stage_tracking", {"law": law, "motion": "three_axis"}, 1e-5, 2e-4)
        for law in ("pd", "pd_ff", "ctc", "integral")
    ),
    ("stage_tracking", {"law": "integral_ff", "motion": "step"}, 1e-5, 2e-4),
    ("stage_tracking", {"stage": "exact", "stack": "hysteretic"}, 1e-5, 2e-4),
    *(("stage_extremes", {"law": law, "execution": "continuous"}, 1e-6, 10e-6) for law in ("ctc", "pd")),
]


@BOTH
@pytest.mark.parametrize(
    ("name", "arguments", "step", "stop"), MOVING, ids=[" ".join(map(str, [n, *a.values()])) for n, a, *_ in MOVING]
)
def test_every_motion_runs(name, arguments, step, stop, algorithm):
    assert np.isfinite(simulated(name, arguments, None, None, None, algorithm, step, stop)).all()
