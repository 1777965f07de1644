"""The part `sdelta_reference`: tubes and motors of a commanded pose, with exact rates and accelerations."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st
from random_postures import numbers_in, postures
from scipy.spatial.transform import Rotation

from hfsa.components import ModelError
from hfsa.components._mechanics.sdelta_direct import direct_kinematics
from hfsa.components._mechanics.sdelta_geometry import SYMMETRIC, Posture
from hfsa.components._mechanics.sdelta_kinematics import Kinematics
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.linearize import linearize
from hfsa.components._modelling.model import Kind
from hfsa.components.sdelta_reference import sdelta_reference

A = Posture((10, 5, 8), (0.005, 0.003, 0.155))
AXES, MOTORS = range(1, 4), range(1, 7)
REST = np.zeros(6)
ORDERS = ("", "_rate", "_acceleration")


def labels(suffix: str) -> tuple[list[str], list[str], list[str]]:
    """Names of commands, tubes and motors of one order."""
    commands = [f"command/{kind}{suffix}[{i}]" for kind in ("rotation", "position") for i in AXES]
    tubes = [f"drive[{j}]/{kind}{suffix}" for j in AXES for kind in ("slide", "angle")]
    return commands, tubes, [f"motor[{i}]/angle{suffix}" for i in MOTORS]


def evaluate(model, command, rate=REST, acceleration=REST) -> dict[str, float]:
    inputs = {}
    for suffix, values in zip(ORDERS, (command, rate, acceleration), strict=True):
        inputs |= dict(zip(labels(suffix)[0], values, strict=True))
    u = [inputs[q.name.replace(".", "/")] for q in model.of(Kind.INPUT)]
    out = np.array(functions(model).out(0, [], [], u, [])).ravel()
    return dict(zip([q.name.replace(".", "/") for q in model.of(Kind.OUTPUT)], out, strict=True))


def pick(outputs: dict[str, float], names: list[str]) -> np.ndarray:
    return np.array([outputs[name] for name in names])


@pytest.mark.parametrize("level", ["linear", "exact"])
@pytest.mark.parametrize("posture", [SYMMETRIC, A])
def test_where_tubes_and_motors_stand_is_a_constant(level, posture):
    kinematics, model = Kinematics.at(posture), sdelta_reference(level=level, posture=posture)
    shown = {q.name: q.start for q in model.of(Kind.CONSTANT)}
    np.testing.assert_array_equal([shown[f"drive[{j}].slide_at_posture"] for j in AXES], kinematics.limbs.slide)
    np.testing.assert_array_equal([shown[f"drive[{j}].angle_at_posture"] for j in AXES], kinematics.limbs.angle)
    np.testing.assert_array_equal([shown[f"motor[{i}].angle_at_posture"] for i in MOTORS], kinematics.motor_angles)


@pytest.mark.parametrize("level", ["linear", "exact"])
def test_bode_plot_is_what_the_docstring_says(level):
    """Each order passes by L^-1 N and T^-1, and nothing else passes."""
    model, kinematics = sdelta_reference(level=level, posture=A), Kinematics.at(A)
    system = linearize(model)
    assert system.nstates == 0
    to_tubes, to_motors = np.linalg.inv(kinematics.tubes_to_pose()), np.linalg.inv(kinematics.jacobian())
    for i, inputs in enumerate(ORDERS):
        for j, outputs in enumerate(ORDERS):
            commands, (_, tubes, motors) = labels(inputs)[0], labels(outputs)
            columns = [system.input_labels.index(name) for name in commands]
            for names, expected in ((tubes, to_tubes), (motors, to_motors)):
                rows = [system.output_labels.index(name) for name in names]
                found = system.D[np.ix_(rows, columns)]
                np.testing.assert_allclose(found, expected * (i == j), atol=1e-12 * np.abs(expected).max())


@given(postures(), numbers_in(-0.25, 0.25, 3), numbers_in(-0.02, 0.02, 3))
@settings(max_examples=20)
def test_exact_is_the_inverse_kinematics(posture, rotation, displacement):
    """What it puts out and what the posture has make what the commanded pose takes, tubes and motors."""
    there = Kinematics.at(posture)
    Q, position = Rotation.from_rotvec(rotation).as_matrix() @ posture.matrix, np.array(posture.position) + displacement
    try:
        wanted = Kinematics.of(Q, position)
    except ModelError:
        reject()
    model = sdelta_reference(level="exact", posture=posture)
    outputs = evaluate(model, np.concatenate([rotation, displacement]))
    _, tubes, motors = labels("")
    np.testing.assert_allclose(there.limbs.slide + pick(outputs, tubes)[0::2], wanted.limbs.slide, atol=1e-15)
    np.testing.assert_allclose(there.limbs.angle + pick(outputs, tubes)[1::2], wanted.limbs.angle, atol=2e-15)
    np.testing.assert_allclose(there.motor_angles + pick(outputs, motors), wanted.motor_angles, atol=1e-13)


def test_the_motors_of_exact_lead_to_the_commanded_pose():
    command = np.array([0.1, -0.2, 0.3, 0.01, -0.02, 0.015])
    outputs = evaluate(sdelta_reference(level="exact", posture=A), command)
    found_Q, found_position = direct_kinematics(Kinematics.at(A).motor_angles + pick(outputs, labels("")[2]), A)
    np.testing.assert_allclose(found_Q, Rotation.from_rotvec(command[:3]).as_matrix() @ A.matrix, atol=1e-12)
    np.testing.assert_allclose(found_position, np.array(A.position) + command[3:], atol=1e-12)


@given(postures(), numbers_in(-0.4, 0.4, 3), numbers_in(-0.04, 0.04, 3), st.floats(-15, -7))
@settings(max_examples=20)
@pytest.mark.slow
def test_a_command_however_small_has_all_its_digits(posture, rotation, displacement, exponent):
    """Up and down by as much is 2 L^-1 N of it, curvature cancelled, within a few units in the last place."""
    command = 10.0**exponent * np.concatenate([rotation, displacement])
    there, names = Kinematics.at(posture), labels("")
    expected = np.concatenate(
        [np.linalg.solve(there.tubes_to_pose(), command), np.linalg.solve(there.jacobian(), command)]
    )
    for level in ("linear", "exact"):
        model = sdelta_reference(level=level, posture=posture)
        up, down = (pick(evaluate(model, sign * command), names[1] + names[2]) for sign in (1, -1))
        size = np.repeat([np.abs(expected[:6]).max(), np.abs(expected[6:]).max()], 6)
        assert (np.abs((up - down) / 2 - expected) <= 1e-13 * size).all()


@pytest.mark.parametrize("amplitude", [1.0, 1e-6, 0.0])
def test_exact_rates_and_accelerations_are_derivatives(amplitude):
    """Along a curve in time, by a fourth-order difference; also through zero rotation, where it is smooth."""
    model = sdelta_reference(level="exact", posture=A)
    a = np.array([0.1, -0.15, 0.2, 0.01, -0.02, 0.015]) * amplitude
    b = np.array([0.3, 0.2, -0.1, 0.05, 0.02, -0.03])
    c = np.array([-0.5, 0.4, 0.6, 0.1, -0.1, 0.2])

    def at(t: float) -> dict[str, float]:
        return evaluate(model, a + b * t + c * t**2 / 2, b + c * t, c)

    h, now = 1e-3, at(0.0)
    around = {k: at(k * h) for k in (-2, -1, 1, 2)}
    for lower, higher in pairwise(ORDERS):
        for names, derived in zip(labels(lower)[1:], labels(higher)[1:], strict=True):
            y = {k: pick(values, names) for k, values in around.items()}
            slope = (y[-2] - 8 * y[-1] + 8 * y[1] - y[2]) / (12 * h)
            expected = pick(now, derived)
            np.testing.assert_allclose(slope, expected, atol=1e-9 * np.abs(expected).max())


def test_exact_tends_to_linear_with_the_square_of_the_command():
    command = np.array([0.4, -0.3, 0.2, 0.04, -0.02, 0.03])
    _, tubes, motors = labels("")
    errors = []
    for size in (1e-2, 1e-3):
        linear, exact = (
            evaluate(sdelta_reference(level=level, posture=A), size * command) for level in ("linear", "exact")
        )
        errors.append(np.abs(pick(exact, tubes + motors) - pick(linear, tubes + motors)).max())
    assert errors[0] / errors[1] == pytest.approx(100, rel=0.05)


def test_angles_stay_continuous_past_the_half_turn():
    """A limb that points outwards: its angle is near half a turn, where a principal value would jump."""
    posture = Posture((0, 0, 0), (0, 0.3, 0.01))
    kinematics = Kinematics.at(posture)
    assert np.abs(kinematics.limbs.angle).max() > 3
    steps = [np.array([0, 0, 0, 0, 0, z]) for z in (-0.02, 0.02)]
    low, high = (
        pick(evaluate(sdelta_reference(level="exact", posture=posture), s), labels("")[1])[1::2] for s in steps
    )
    assert np.abs(low - high).max() < 1


def test_bad_arguments():
    with pytest.raises(ModelError, match=r"level is 'exakt'; did you mean exact"):
        sdelta_reference(level="exakt")
    with pytest.raises(ModelError, match="condition number"):
        sdelta_reference(posture=Posture(rotation=(90, 0, 0)))


@given(st.tuples(*[st.floats(-180, 180)] * 3))
def test_the_attitude_is_turned_about_z_x_y_of_the_platform(angles):
    expected = Rotation.from_euler("ZXY", angles, degrees=True).as_matrix()
    np.testing.assert_allclose(Posture(angles).matrix, expected, atol=2e-15, rtol=0)


def test_the_symmetric_attitude_is_exactly_level():
    np.testing.assert_array_equal(SYMMETRIC.matrix.view(np.int64), np.eye(3).view(np.int64))
