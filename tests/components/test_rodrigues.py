"""Modified Rodrigues parameters: rotation matrix, rotation vector and rates, far from the posture and close to it."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hfsa.components._mechanics.rodrigues import parameter_rate, rotation_vector, turn

S, W = ca.SX.sym("s", 3), ca.SX.sym("w", 3)
TURN, VECTOR = ca.Function("turn", [S], [turn(S)]), ca.Function("vector", [S], [rotation_vector(S)])
RATE = ca.Function("rate", [S, W], [parameter_rate(S, W)])

components = st.tuples(*[st.floats(-1, 1)] * 3).map(np.array).filter(lambda v: np.linalg.norm(v) > 0.1)
angles = st.floats(1e-12, np.pi)


def parameters(vector: np.ndarray) -> np.ndarray:
    """4 tan(angle / 4) along the axis of a rotation vector."""
    angle = np.linalg.norm(vector)
    return 4 * np.tan(angle / 4) / angle * vector


@given(components, angles)
def test_they_are_the_rotation(direction, angle):
    vector = angle * direction / np.linalg.norm(direction)
    found = np.array(TURN(parameters(vector)))
    expected = Rotation.from_rotvec(vector).as_matrix() - np.eye(3)
    np.testing.assert_allclose(found, expected, atol=1e-15 + 4e-16 * angle)


@given(components, angles)
def test_the_rotation_vector_comes_back_up_to_half_a_turn(direction, angle):
    vector = angle * direction / np.linalg.norm(direction)
    np.testing.assert_allclose(np.array(VECTOR(parameters(vector))).ravel(), vector, rtol=2e-15)


@given(components, angles, components)
def test_the_rate_is_that_of_the_rotation(direction, angle, angular_velocity):
    """R' = [w x] R, with R by its parameters and their rate."""
    s = parameters(angle * direction / np.linalg.norm(direction))
    slope = ca.Function("slope", [S, W], [ca.jtimes(turn(S), S, W)])
    found = np.array(slope(s, RATE(s, angular_velocity)))
    R = np.array(TURN(s)) + np.eye(3)
    skew = np.cross(angular_velocity, np.eye(3)).T
    np.testing.assert_allclose(found, skew @ R, atol=5e-15)


@pytest.mark.parametrize("size", [1e-3, 1e-12, 1e-30, 0.0], ids=str)
def test_small_rotations_keep_their_digits(size):
    """To first order R - 1 = [s x]; the symmetric part, of second order, is beside it."""
    s = size * np.array([0.3, -0.7, 0.2])
    found, skew = np.array(TURN(s)), np.cross(s, np.eye(3)).T
    np.testing.assert_allclose((found - found.T) / 2, skew, rtol=size**2 + 1e-15, atol=0)
    np.testing.assert_allclose((found + found.T) / 2, skew @ skew / 2, rtol=size**2 + 1e-15, atol=2e-16 * size)
    np.testing.assert_allclose(np.array(VECTOR(s)).ravel(), s, rtol=size**2 + 1e-15, atol=0)
