"""Screws: axes, shifts, the exponential of a rotation vector and its inverse."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from hfsa.components._mechanics.screws import GAMMA, axis, expm1, exponential, log1p, numbers, shift, skew, unit_screw

vectors = st.tuples(*[st.floats(-1, 1) for _ in range(3)]).map(np.array)
few = settings(max_examples=50)


@given(vectors, st.floats(1e-8, np.pi))
@few
def test_exponential_is_the_rotation(direction, angle):
    vector = direction * angle
    np.testing.assert_allclose(
        numbers(exponential(ca.SX(vector))), Rotation.from_rotvec(vector).as_matrix(), atol=1e-14
    )


def test_exponential_is_smooth_at_zero():
    """Its first derivatives there are the skew matrices, its second ones their symmetrised products."""
    v = ca.SX.sym("v", 3)
    Q = exponential(v)

    def at_zero(expression: ca.SX) -> np.ndarray:
        return numbers(ca.substitute(expression, v, ca.SX.zeros(3)))

    for i, e in enumerate(np.eye(3)):
        first = ca.reshape(ca.jacobian(ca.vec(Q), v[i]), 3, 3)
        np.testing.assert_array_equal(at_zero(first), skew(e))
        for j, g in enumerate(np.eye(3)):
            second = ca.reshape(ca.jacobian(ca.vec(first), v[j]), 3, 3)
            expected = (skew(e) @ skew(g) + skew(g) @ skew(e)) / 2
            np.testing.assert_array_equal(at_zero(second), expected)


@given(vectors, st.floats(0, 75))
@few
def test_logarithm_undoes_the_exponential(direction, degrees):
    size = np.linalg.norm(direction)
    vector = np.deg2rad(degrees) * direction / size if size else direction
    back = numbers(log1p(ca.SX(Rotation.from_rotvec(vector).as_matrix()) - ca.SX.eye(3))).ravel()
    np.testing.assert_allclose(back, vector, atol=1e-14)


def test_logarithm_is_smooth_at_no_rotation():
    """Its derivative along the exponential is the identity there."""
    vector = ca.SX.sym("v", 3)
    slope = ca.Function("slope", [vector], [ca.jacobian(log1p(expm1(vector)), vector)])
    np.testing.assert_allclose(np.array(slope(0)), np.eye(3), atol=1e-15)


@given(vectors, st.floats(-200, 0))
@few
def test_a_rotation_however_small_has_all_its_digits(direction, exponent):
    """exp(v) - 1 is the skew matrix and half its square, and the logarithm gives v back."""
    vector = direction * 10.0**exponent
    size = np.abs(vector).max()
    change = numbers(expm1(ca.SX(vector)))
    W = skew(vector)
    np.testing.assert_allclose(change, W + W @ W / 2, rtol=0, atol=size * (1e-15 + size**2))
    np.testing.assert_allclose(numbers(log1p(ca.SX(change))).ravel(), vector, rtol=0, atol=1e-14 * size)


@given(vectors, vectors)
@few
def test_shift(offset, vector):
    X = shift(offset, Rotation.from_rotvec(vector).as_matrix())
    np.testing.assert_allclose(X.T, GAMMA @ np.linalg.inv(X) @ GAMMA, atol=1e-13)
    # A turn about the new origin moves the old one backwards along the cross product.
    np.testing.assert_allclose(shift(offset) @ [*vector, 0, 0, 0], [*vector, *np.cross(offset, vector)], atol=1e-15)


@given(vectors, vectors, st.floats(-2, 2))
@few
def test_axis_of_a_screw(direction, point, pitch):
    size = np.linalg.norm(direction)
    if size < 1e-2:
        return
    screw = np.concatenate([direction, np.cross(point, direction) + pitch * direction])
    found = axis(screw, 1.0)
    e = direction / size
    assert abs(abs(found.direction @ e) - 1) < 1e-12
    np.testing.assert_allclose(found.point, point - (point @ e) * e, atol=1e-10)
    assert found.pitch == pytest.approx(pitch, abs=1e-10)


def test_translations_have_infinite_pitch():
    found = axis(np.array([0, 0, 1e-12, 0, 0, -2.0]), 0.15)
    assert found.pitch == np.inf
    np.testing.assert_array_equal(found.direction, [0, 0, 1])
    np.testing.assert_allclose(unit_screw(np.array([0, -2.0, 0, 0.2, 0, 0]), 0.15), [0, 1, 0, -0.1, 0, 0])
