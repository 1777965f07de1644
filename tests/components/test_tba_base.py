"""What a moving base does to the accelerometer: against differentiated positions, and to first order."""

import casadi as ca
import numpy as np
import pytest

from hfsa.components import Model, ModelError
from hfsa.components._mechanics.tba_base import Mounting, base_inputs, linear_specific_force, specific_force

QUARTER = (0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
"""A quarter of a turn about Z."""
ARM = np.array([0.05, -0.02, 0.03])
RNG = np.random.default_rng(8)

position, rate, gravity = ca.SX.sym("q", 3), ca.SX.sym("v", 3), ca.SX.sym("g")


def force_function(Q: np.ndarray, full: bool) -> ca.Function:
    """(a, w, w', theta, q, q', gravity) -> f."""
    base = base_inputs(Model("Test", "Base alone"))
    f = specific_force(base, Q, ARM, gravity, position, rate) if full else linear_specific_force(base, Q, ARM, gravity)
    return ca.Function("f", [*base, position, rate, gravity], [f])


def any_rotation() -> np.ndarray:
    Q, _ = np.linalg.qr(RNG.standard_normal((3, 3)))
    return Q * np.linalg.det(Q)


def rotation(vector: ca.SX) -> ca.SX:
    """The matrix of a rotation vector that is not zero, by Rodrigues."""
    angle = ca.norm_2(vector)
    axis = ca.skew(vector / angle)
    return ca.SX.eye(3) + ca.sin(angle) * axis + (1 - ca.cos(angle)) * axis @ axis


def test_in_full_it_is_the_second_derivative_of_a_position():
    """A base that tumbles while the proof mass moves: f is its acceleration less that in its frame, less g."""
    t, Q, g = ca.SX.sym("t"), any_rotation(), 9.81
    path, theta, q = (ca.DM(RNG.standard_normal((3, 4))) @ ca.vertcat(1, t, t**2, t**3) for _ in range(3))

    def by_time(expression: ca.SX) -> ca.SX:
        return ca.jacobian(ca.vec(expression), t)

    R = rotation(theta)
    turning = ca.reshape(by_time(R), 3, 3) @ R.T
    w = ca.vertcat(turning[2, 1], turning[0, 2], turning[1, 0])
    S = R @ ca.DM(Q)
    there = path + R @ ca.DM(ARM) + S @ q
    wanted = S.T @ (by_time(by_time(there)) + ca.DM([0, 0, g])) - by_time(by_time(q))
    inputs = [by_time(by_time(path)), w, by_time(w), theta, q, by_time(q), g]
    both = ca.Function("both", [t], [force_function(Q, True)(*inputs), wanted])
    for time in (0.0, 0.3, 0.7):
        found, expected = both(time)
        np.testing.assert_allclose(np.array(found), np.array(expected), rtol=1e-10)


def test_to_first_order_it_is_in_full_less_the_second_order():
    Q = any_rotation()
    directions = [RNG.standard_normal(3) for _ in range(6)]

    def difference(size: float) -> np.ndarray:
        at = [*[size * d for d in directions], 9.81]
        return np.array(force_function(Q, True)(*at) - force_function(Q, False)(*at)).ravel()

    # The proof mass's own displacement and rate count only together with the base's motion.
    np.testing.assert_allclose(difference(1e-4) / difference(0.5e-4), 4, rtol=2e-3)


def test_a_base_that_does_not_turn_has_exact_derivatives():
    """The rotation vector's series joins its sine and cosine, in value and slope."""
    full = force_function(np.eye(3), True)
    theta = ca.SX.sym("theta", 3)
    still = np.zeros(3)
    f = full(still, still, still, theta, still, still, 1.0)
    both = ca.Function("both", [theta], [f, ca.jacobian(f, theta)])
    axis = np.array([0.6, 0.0, 0.8])
    for here, beside in ((0.0, 1e-9), (0.001 * (1 - 1e-9), 0.001 * (1 + 1e-9))):
        for before, after in zip(both(here * axis), both(beside * axis), strict=True):
            np.testing.assert_allclose(np.array(before), np.array(after), rtol=0, atol=1e-8)
    np.testing.assert_allclose(np.array(both(still)[1]), [[0, -1, 0], [1, 0, 0], [0, 0, 0]], atol=1e-15)


def test_turning_about_an_axis_through_the_sensor_is_not_felt():
    """The reference point then moves around the sensor."""
    Q = any_rotation()
    w, w_dot, theta = RNG.standard_normal((3, 3))
    turned = np.array(ca.DM(ca.evalf(rotation(ca.SX(theta))))) @ ARM
    of_reference = -np.cross(w_dot, turned) - np.cross(w, np.cross(w, turned))
    felt = force_function(Q, True)(of_reference, w, w_dot, theta, 0, 0, 0)
    np.testing.assert_allclose(np.array(felt), 0, atol=1e-15)
    felt = force_function(Q, False)(-np.cross(w_dot, ARM), 0, w_dot, 0, 0, 0, 0)
    np.testing.assert_allclose(np.array(felt), 0, atol=1e-15)


@pytest.mark.parametrize("full", [True, False])
def test_gravity_is_an_acceleration_upwards(full):
    f = force_function(any_rotation(), full)
    pulled, pushed = f(0, 0, 0, 0, 0, 0, 9.81), f([0, 0, 9.81], 0, 0, 0, 0, 0, 0)
    assert np.array_equal(np.array(pulled), np.array(pushed))


def test_a_tilted_base_feels_gravity_as_a_tilted_mounting_does():
    theta = np.array([0.1, -0.2, 0.05])
    tilted = np.array(ca.evalf(rotation(ca.SX(theta))))
    by_base = force_function(np.eye(3), True)(0, 0, 0, theta, 0, 0, 9.81)
    by_mounting = force_function(tilted, True)(0, 0, 0, 0, 0, 0, 9.81)
    np.testing.assert_allclose(np.array(by_base), np.array(by_mounting), rtol=1e-12)


def test_a_turned_mounting_sees_turned_accelerations():
    f = force_function(Mounting(rotation=QUARTER).matrix("test"), False)
    np.testing.assert_array_equal(np.array(f([1, 2, 3], 0, 0, 0, 0, 0, 0)).ravel(), [2, -1, 3])


def test_rounding_of_a_mounting_is_taken_out():
    c, s = 0.8660254, 0.5
    Q = Mounting(rotation=(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)).matrix("test")
    np.testing.assert_allclose(Q.T @ Q, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(Q[:, 0], [np.sqrt(0.75), 0.5, 0], atol=5e-8)
    exact = Mounting(rotation=QUARTER)
    assert np.array_equal(exact.matrix("test").ravel(), exact.rotation)


@pytest.mark.parametrize(
    ("mounting", "message"),
    [
        (
            Mounting(rotation=(1.0, 0.1, 0, -0.1, 1.0, 0, 0, 0, 1.0)),
            r"no rotation: .* deviate .* 0.01, .* 0.99503719,",
        ),
        (Mounting(rotation=(1.0, 0, 0, 0, 1.0, 0, 0, 0, -1.0)), "is a reflection, determinant -1"),
        (Mounting(rotation=(float("nan"),) * 9), "no rotation: .* expected below 1e-06$"),
        (Mounting(lever=(0.0, float("inf"), 0.0)), "mounting.lever is .* m, expected three finite numbers"),
    ],
)
def test_an_impossible_mounting_is_named(mounting, message):
    with pytest.raises(ModelError, match=f"^sensor: .*{message}"):
        _ = mounting.matrix("sensor"), mounting.arm("sensor")
