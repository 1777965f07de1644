"""Equations of a rigid body against Newton and Euler, rotations against the matrix exponential."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from hfsa.cosim.signals.differentiation import REACH, derivatives
from hfsa.cosim.signals.rigid_body import PARAMETERS, full_regressor, linear_regressor, rates, skew, turned

SEEDS = st.integers(0, 2**32 - 1)


def points_of_a_body(random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Some point masses, (n,), and their places from the reference point, (n, 3)."""
    return random.uniform(0.1, 2.0, 7), random.uniform(-0.1, 0.1, (7, 3))


def parameters_of(masses: np.ndarray, places: np.ndarray) -> np.ndarray:
    """The ten inertia parameters of point masses."""
    squares = np.sum(places**2, axis=1)
    tensor = np.einsum("n,nij->ij", masses, squares[:, None, None] * np.eye(3) - places[:, :, None] * places[:, None])
    return np.array([masses.sum(), *(masses @ places), *tensor[np.triu_indices(3)]])


@given(SEEDS)
def test_the_wrench_is_that_of_the_points_of_the_body(seed):
    """Force and moment of point masses, each with the acceleration of its place: no tensor takes part."""
    random = np.random.default_rng(seed)
    masses, places = points_of_a_body(random)
    a, b, w = random.normal(size=(3, 3))
    of_points = a + np.cross(b, places) + np.cross(w, np.cross(w, places))
    forces = masses[:, None] * of_points
    wrench = np.concatenate([np.cross(places, forces).sum(axis=0), forces.sum(axis=0)])
    Y = full_regressor(a[None], b[None], w[None])[0]
    np.testing.assert_allclose(Y @ parameters_of(masses, places), wrench, atol=1e-12)


def test_without_angular_velocity_the_equations_are_the_linear_ones():
    random = np.random.default_rng(0)
    a, b = random.normal(size=(2, 5, 3))
    assert np.array_equal(full_regressor(a, b, np.zeros((5, 3))), linear_regressor(a, b))
    turned_by = 1j * a
    assert np.array_equal(linear_regressor(turned_by, 1j * b), 1j * linear_regressor(a, b))
    assert linear_regressor(a, b).shape == (5, 6, len(PARAMETERS))


@given(SEEDS, st.sampled_from([1e-9, 1e-3, 1.0, 3.0]))
def test_a_rotation_is_the_exponential_of_its_vector(seed, size):
    vector = size * np.random.default_rng(seed).normal(size=(1, 3))
    np.testing.assert_allclose(turned(vector)[0] + np.eye(3), expm(skew(vector)[0]), atol=1e-14 * max(size, 1) ** 2)


def test_a_tiny_rotation_keeps_all_its_digits():
    vector = np.array([[1e-12, -2e-12, 3e-12]])
    np.testing.assert_allclose(turned(vector), skew(vector), rtol=1e-11, atol=1e-23)
    assert np.array_equal(turned(np.zeros((2, 3))), np.zeros((2, 3, 3)))


def test_rates_of_a_body_that_spins_about_a_turning_axis():
    """Q = Rz(p t) Rx(q t): the angular velocity is p z + q Rz x, its derivative p q z x (Rz x)."""
    p, q, h = 0.7, -1.3, 1e-3
    t = h * np.arange(-REACH, 3 + REACH)
    about_z = np.array([expm(skew(np.array([[0.0, 0.0, p * s]]))[0]) for s in t])
    about_x = np.array([expm(skew(np.array([[q * s, 0.0, 0.0]]))[0]) for s in t])
    change = about_z @ about_x - np.eye(3)
    velocity, acceleration = rates(change[REACH:-REACH], *derivatives(change, h))
    z, x = np.array([0.0, 0.0, 1.0]), about_z[REACH:-REACH, :, 0]
    np.testing.assert_allclose(velocity, p * z + q * x, atol=1e-11)
    np.testing.assert_allclose(acceleration, p * q * np.cross(z, x), atol=1e-8)


def test_differences_are_exact_for_polynomials_of_degree_four():
    t = 0.1 * np.arange(9)
    first, second = derivatives(t**4 - 2 * t**3 + t, 0.1)
    inner = t[REACH:-REACH]
    np.testing.assert_allclose(first, 4 * inner**3 - 6 * inner**2 + 1, atol=1e-13)
    np.testing.assert_allclose(second, 12 * inner**2 - 12 * inner, atol=1e-12)


@pytest.mark.parametrize("turn", [0.2, 0.1, 0.05], ids=["0.2 rad", "0.1 rad", "0.05 rad"])
def test_the_error_for_a_sine_falls_with_the_fourth_power_of_the_step(turn):
    first, second = derivatives(np.exp(1j * turn * np.arange(5)), turn)
    middle = np.exp(2j * turn)
    assert 1 - (first[0] / (1j * middle)).real == pytest.approx(turn**4 / 30, rel=0.02)
    assert 1 - (second[0] / -middle).real == pytest.approx(turn**4 / 90, rel=0.02)


def test_four_samples_have_no_derivative():
    with pytest.raises(ValueError, match="4 samples, expected five or more"):
        derivatives(np.zeros(4), 1.0)
