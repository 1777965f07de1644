"""Error due to communication steps in a chain that ends in an accelerometer."""

import numpy as np
import pytest
from accelerometer_by_hand import IDEAL, SENSOR, VOLTS, X, gain
from scene_responses import ahead, errors, linear, one_step, responses, scene, swept


def test_a_step_costs_on_the_robot_what_is_said(opened):
    at, names = scene("sdelta_accelerometer"), [SENSOR[0], IDEAL[0], SENSOR[1]]
    frequency, turning = np.array([5.0, 10.0, 20.0, 30.0, 31.8, 50.0]), at.inputs[2]
    expected = linear(opened, at, [X, turning], names, frequency)
    first, second = (
        one_step(opened, at, X, names[:2], frequency, algorithm) for algorithm in ("gauss_seidel", "jacobi")
    )
    assert ahead(first[:, 0], expected[:, 0, 0]) == pytest.approx([0.9, 0.4, 0.1, -0.75, 0.57, 0.16], abs=0.03)
    lag = 180 * at.step_size * frequency
    quotients = (first[:, 0] / first[:, 1], expected[:, 0, 0] / expected[:, 1, 0])
    np.testing.assert_allclose(ahead(*quotients), -lag, atol=1e-3)
    decibels, degrees = errors((first + second)[:, 0] / 2, expected[:, 0, 0])
    assert decibels < 0.002
    assert degrees < 0.05
    turned = ahead(one_step(opened, at, turning, names[2:], frequency)[:, 0], expected[:, 2, 1])
    fast, omega = 2 * np.pi * 161.1, 2 * np.pi * frequency
    half = at.step_size * fast**2 / (2 * omega)
    assert turned[0] == pytest.approx(4.7, abs=0.05)
    np.testing.assert_allclose(turned, np.degrees(np.arctan(half)) - lag, atol=0.02)


@pytest.mark.parametrize(
    ("name", "excited", "frequency"),
    [("sdelta_accelerometer", X, [5.0, 20.0, 50.0]), ("stage_accelerometer", VOLTS, [100.0, 919.0, 3000.0])],
)
def test_algorithms_and_steps_agree_in_the_limit(opened, name, excited, frequency):
    """The error of each halves with the step; twice the half step's less the whole step's has none."""
    at = scene(name)
    expected = linear(opened, at, [excited], SENSOR[:1], frequency)[:, :, 0]
    for algorithm in ("gauss_seidel", "jacobi", "jacobi_plain"):
        whole, half = (
            one_step(opened, at, excited, SENSOR[:1], frequency, algorithm, at.step_size / n) for n in (1, 2)
        )
        ratio = (whole - expected) / (half - expected)
        np.testing.assert_allclose(ratio, 2, atol=0.15)
        assert max(errors(2 * half - whole, expected)) < 0.01


def test_with_robot_rigid_only_the_sensors_hold_remains(opened):
    at, frequency = scene("sdelta_accelerometer", robot="rigid"), np.array([5.0, 20.0, 50.0])
    names = [SENSOR[0], "robot.platform.position[1]"]
    expected = linear(opened, at, [X], names, frequency)[:, :, 0]
    np.testing.assert_allclose(expected[:, 0], -((2 * np.pi * frequency) ** 2) * gain("mems", frequency), rtol=1e-6)
    found = one_step(opened, at, X, names[:1], frequency)[:, 0]
    np.testing.assert_allclose(ahead(found, expected[:, 0]), -180 * at.step_size * frequency, atol=1e-3)


@pytest.mark.parametrize(
    ("name", "excited", "frequency", "step", "amplitude"),
    [
        ("sdelta_accelerometer", X, [20.0, 50.0], 1e-4, 1e-5),
        ("stage_accelerometer", VOLTS, [200.0, 919.0], 5e-6, 0.5),
    ],
)
def test_swept_in_a_chain_is_the_exact_one_step_response(library, opened, name, excited, frequency, step, amplitude):
    at = scene(name)
    found = responses(swept(library, at, excited, [SENSOR[0], IDEAL[0]], frequency, step, amplitude))
    expected = one_step(opened, at, excited, [SENSOR[0], IDEAL[0]], frequency, step_size=step)
    np.testing.assert_allclose(found, expected, rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "excited", "frequency"),
    [("sdelta_accelerometer", X, [5.0, 20.0, 23.59, 50.0]), ("stage_accelerometer", VOLTS, [200.0, 919.0, 3000.0])],
)
def test_swept_in_a_chain_with_the_scenes_step(library, opened, name, excited, frequency):
    at = scene(name)
    found = responses(
        swept(library, at, excited, SENSOR[:1], frequency, amplitude=at.amplitude["m" if excited == X else "V"])
    )
    expected = one_step(opened, at, excited, SENSOR[:1], frequency)
    np.testing.assert_allclose(found, expected, rtol=1e-3)
    assert errors(found, linear(opened, at, [excited], SENSOR[:1], frequency)[:, :, 0])[1] < 1.0


def test_a_step_costs_on_the_stage_what_is_said(opened):
    at, frequency = scene("stage_accelerometer"), np.array([100.0, 200.0, 500.0, 919.0, 2000.0, 3000.0])
    names = [SENSOR[0], IDEAL[0]]
    expected = linear(opened, at, [VOLTS], names, frequency)[:, :, 0]
    found = one_step(opened, at, VOLTS, names, frequency)
    behind = -ahead(found[:, 0], expected[:, 0])
    assert behind[:3] == pytest.approx([1.5, 0.7, 0.3], abs=0.05)
    assert np.abs(behind[2:]).max() < 0.3
    lead = ahead(found[:, 0] / found[:, 1], expected[:, 0] / expected[:, 1])
    np.testing.assert_allclose(lead, -180 * at.step_size * frequency, atol=2e-3)
