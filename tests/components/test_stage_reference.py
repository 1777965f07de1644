"""Reference motions of the stage: consistent derivatives, the stated shapes, poses turned into elongations."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hfsa.components import ModelError
from hfsa.components._mechanics.rrr_kinematics import NOMINAL, forward, links
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.model import Kind
from hfsa.components.stage_reference import analyze, stage_reference
from hfsa.components.tracking_error import tracking_error


def outputs(motion: str):
    """Time -> elongations, rates, accelerations of the three stacks, (9,), as a function with derivatives."""
    model = stage_reference(motion=motion)
    out, inputs = functions(model).out, [0.0] * 9
    parameters = [q.start for q in model.of(Kind.PARAMETER)]
    t = ca.MX.sym("t")
    return ca.Function("reference", [t], [out(t, ca.DM(0, 1), ca.DM(0, 1), inputs, parameters)])


@pytest.mark.parametrize("motion", ["ramp", "three_axis", "step"])
def test_rate_and_acceleration_are_the_derivatives(motion):
    reference = outputs(motion)
    slope = reference.jacobian()
    for time in (0.0005, 0.013, 0.4, 3.9, 4.1):
        value, rate = np.array(reference(time)).ravel(), np.array(slope(time, 0)).ravel()
        scale = np.abs(value).max() + 1e-9
        assert value[3:6] == pytest.approx(rate[:3], rel=1e-12, abs=1e-14 * scale)
        assert value[6:9] == pytest.approx(rate[3:6], rel=1e-12, abs=1e-14 * scale)


def test_the_ramp_is_the_sources():
    reference = outputs("ramp")
    assert np.array(reference(2.0))[:6].ravel() == pytest.approx([6e-6] * 3 + [3e-6] * 3, rel=1e-15)
    assert np.array(reference(5.0))[:6].ravel() == pytest.approx([12e-6] * 3 + [0] * 3, rel=1e-15)


def test_three_axes_move_at_frequencies_of_their_own_from_rest():
    reference = outputs("three_axis")
    times = np.arange(4000) * 1e-4  # two periods of 5 Hz
    moves = np.array([reference(t) for t in times])[:, :3, 0]
    assert np.all(np.array(reference(0.0))[:6] == 0)
    assert moves.min() >= 0
    assert moves.max(axis=0) == pytest.approx([8e-6] * 3, rel=1e-6)
    lines = np.abs(np.fft.rfft(moves - moves.mean(axis=0), axis=0))
    assert list(lines.argmax(axis=0)) == [2, 4, 6]
    poses = np.array([forward(NOMINAL, move) for move in moves[::200]])
    assert np.linalg.matrix_rank(poses - poses.mean(axis=0), tol=1e-7) == 3


def test_the_step_waits_for_its_time():
    reference = outputs("step")
    assert np.all(np.array(reference(1e-3 - 1e-9)) == 0)
    assert np.array(reference(1e-3))[:3].ravel() == pytest.approx([1e-6] * 3, rel=1e-15)


@settings(max_examples=20)
@given(st.tuples(*[st.floats(0, 12e-6)] * 3), st.sampled_from(["nominal", "calibrated"]))
def test_the_elongations_of_a_pose_bring_the_stage_there(elongation, kinematics):
    pose = forward(links(kinematics), elongation)
    assert analyze(pose=tuple(pose), kinematics=kinematics)["elongation"] == pytest.approx(elongation, abs=1e-16)


def test_a_longer_stroke_reaches_further():
    pose = tuple(forward(NOMINAL, [20e-6, 0.0, 0.0]))
    with pytest.raises(ModelError, match=r"needs elongations of 20.000, .*expected 0 to 16 um"):
        analyze(pose=pose)
    assert analyze(pose=pose, stroke=24e-6)["elongation"] == pytest.approx([20e-6, 0, 0], abs=1e-15)


@pytest.mark.parametrize(
    ("pose", "message"),
    [
        ((1e-2, 0.0, 0.0), "pose 0.01 m, 0 m, 0 rad is out of the legs' reach"),
        ((5e-6, 0.0, 0.0), r"needs elongations of 0.605, 0.418, -1.024 um, expected 0 to 16 um"),
        ((0.0, 0.0, -5e-3), "expected 0 to 16 um"),
    ],
)
def test_a_pose_out_of_reach_is_named(pose, message):
    with pytest.raises(ModelError, match=message):
        analyze(pose=pose)


def test_an_unknown_motion_is_named():
    with pytest.raises(ModelError, match="motion is 'stairs'; there are ramp, three_axis, step"):
        stage_reference(motion="stairs")  # type: ignore[arg-type]


def test_the_error_is_the_difference():
    out = functions(tracking_error(axes=2)).out(0, [], [], [3.0, 1.0, 1.0, 4.0], [])
    assert list(np.array(out).ravel()) == [2.0, -3.0]
    with pytest.raises(ModelError, match="axes is 0, expected 1 or more"):
        tracking_error(axes=0)
