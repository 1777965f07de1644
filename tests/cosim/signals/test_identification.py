"""Expected accuracy of an identification of the SDelta's inertia, by numbers of the specification and independent data.

The demo motion has six tones, 7 to 17 Hz, of 10 mrad and 1 mm, over 1 s at 1 kHz.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_postures import numbers_in, postures
from scipy.linalg import expm

from hfsa.components._mechanics.modes import damping_matrix
from hfsa.components._mechanics.screws import shift
from hfsa.components._mechanics.sdelta_inertia import Payload
from hfsa.components._modelling.linearize import linearize
from hfsa.components.sdelta import analyze, sdelta
from hfsa.cosim.signals.differentiation import REACH, derivatives
from hfsa.cosim.signals.least_squares import Solution, solve
from hfsa.cosim.signals.rigid_body import full_regressor, linear_regressor, rates, skew, turned

TONES = 2 * np.pi * np.array([7.0, 9.0, 11.0, 13.0, 15.0, 17.0])
AMPLITUDES = np.array([10e-3] * 3 + [1e-3] * 3)
NOISE = np.array([0.01] * 3 + [0.1] * 3)
"""Standard deviations of moments [N.m] and forces [N]."""
TRUTH = analyze()["inertia_parameters_S"]
IZZ = TRUTH[9]
UP = np.array([0.0, 0.0, 9.81])


def motion(gain: np.ndarray, rate: float = 1000.0, size: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pose, twist and acceleration over 1 s, (samples, 6): response, columns by tone, to the tones."""
    turn = np.exp(1j * TONES * np.arange(rate)[:, None] / rate) * size * AMPLITUDES / 1j
    return (turn @ gain.T).real, (1j * TONES * turn @ gain.T).real, (-(TONES**2) * turn @ gain.T).real


def body_rates(pose: np.ndarray, twist: np.ndarray, acceleration: np.ndarray) -> tuple[np.ndarray, ...]:
    """Attitude, angular velocity and acceleration, world axes, of rotation vectors, by the series of their Jacobian."""
    r, v, b = (part[:, :3] for part in (pose, twist, acceleration))
    R, V = skew(r), skew(v)
    Q = np.array([expm(one) for one in R])
    # J = 1 + R/2 + R^2/6 + R^3/24 + ..., and its derivative term by term
    powers, factorials = [np.broadcast_to(np.eye(3), R.shape)], np.cumprod(np.arange(2.0, 12.0))
    for _ in factorials:
        powers.append(powers[-1] @ R)
    J = powers[0] + sum(p / f for p, f in zip(powers[1:], factorials, strict=True))
    change = np.zeros_like(J)
    for n, factor in enumerate(factorials, 1):
        change += sum(powers[k] @ V @ powers[n - 1 - k] for k in range(n)) / factor
    w = np.einsum("nij,nj->ni", J, v)
    return Q, w, np.einsum("nij,nj->ni", J, b) + np.einsum("nij,nj->ni", change, v)


def in_body(Q: np.ndarray, *vectors: np.ndarray) -> list[np.ndarray]:
    return [np.einsum("nji,nj->ni", Q, vector) for vector in vectors]


def solved(Y: np.ndarray, w: np.ndarray, sigma: np.ndarray = NOISE) -> Solution:
    return solve((Y / sigma[:, None]).reshape(-1, 10), (w / sigma).reshape(-1))


def elastic() -> np.ndarray:
    """Steady response of the pose of S to the commanded one, (6, 6), column i at tone i: the closed form of L1."""
    numbers = analyze()
    M, K = numbers["mass_C"], numbers["stiffness_C"]
    D, X = damping_matrix(M, K) * 0.01, shift(np.array([0.0, 0.0, TRUTH[3] / TRUTH[0]]))
    columns = []
    for i, w in enumerate(TONES):
        s = 1j * w
        columns.append((X @ np.linalg.solve(M * s**2 + D * s + K, D * s + K) @ np.linalg.inv(X))[:, i])
    return np.array(columns).T


@pytest.fixture(scope="module")
def demo() -> tuple[np.ndarray, np.ndarray]:
    """Full equations of the demo motion under gravity, and their exact wrench."""
    pose, twist, acceleration = motion(np.eye(6))
    Q, w, b = body_rates(pose, twist, acceleration)
    a, w, b = in_body(Q, acceleration[:, 3:] + UP, w, b)
    Y = full_regressor(a, b, w)
    return Y, Y @ TRUTH


def test_the_true_parameters_are_those_of_the_analysis():
    printed = [4.4857, 0, 0, 0.12675, 0.0125247, 0, 0, 0.0125247, 0, 0.0117172]
    assert pytest.approx(printed, abs=5e-8) == TRUTH


def test_rank_and_condition_of_the_demo_motion(demo):
    found = solved(*demo, sigma=np.ones(6))
    assert found.rank == 10
    assert round(found.condition, 4) == 1.0036


def test_exact_kinematics_and_wrench_give_all_digits(demo):
    found = solved(*demo)
    np.testing.assert_allclose(found.values, TRUTH, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize(
    ("rate", "expected"), [(1000, 6.7e-7), (2000, 4.2e-8), (5000, 1.1e-9)], ids=["1 kHz", "2 kHz", "5 kHz"]
)
def test_numerical_differentiation_of_the_pose(rate, expected):
    """The errors of the first moment, whose tones lie between those of mass and inertia."""
    pose, twist, acceleration = motion(np.eye(6), rate)
    Q, w, b = body_rates(pose, twist, acceleration)
    a, w, b = in_body(Q, acceleration[:, 3:], w, b)
    wrench = (full_regressor(a, b, w) @ TRUTH)[REACH:-REACH]
    change, inner = turned(pose[:, :3]), Q[REACH:-REACH]
    w5, b5 = rates(change[REACH:-REACH], *derivatives(change, 1 / rate))
    a5, w5, b5 = in_body(inner, derivatives(pose[:, 3:], 1 / rate)[1], w5, b5)
    errors = solved(full_regressor(a5, b5, w5), wrench).values / np.where(TRUTH, TRUTH, np.inf) - (TRUTH != 0)
    assert abs(errors[3]) == pytest.approx(expected, rel=0.1)
    assert np.abs(errors).max() < 2 * expected


def test_linear_data_with_the_linear_equations():
    _, _, acceleration = motion(elastic())
    Y = linear_regressor(acceleration[:, 3:], acceleration[:, :3])
    found = solved(Y, linear_wrench(acceleration))
    np.testing.assert_allclose(found.values, TRUTH, rtol=1e-13, atol=1e-13)


def linear_wrench(acceleration: np.ndarray) -> np.ndarray:
    """Wrench of the limbs about S by the mass matrix of the analysis, world axes, symmetric posture."""
    to_C = shift(np.array([0.0, 0.0, -TRUTH[3] / TRUTH[0]]))
    return acceleration @ (to_C.T @ analyze()["mass_C"] @ to_C).T


def bias(gain: np.ndarray, size: float) -> np.ndarray:
    """Errors of the moments of inertia by the full equations on linear data, as parts of Izz."""
    pose, twist, acceleration = motion(gain, size=size)
    wrench = linear_wrench(acceleration)
    Q = turned(pose[:, :3]) + np.eye(3)
    a, b, w, torque, force = in_body(
        Q, acceleration[:, 3:], acceleration[:, :3], twist[:, :3], wrench[:, :3], wrench[:, 3:]
    )
    return (solved(full_regressor(a, b, w), np.hstack([torque, force])).values - TRUTH)[4:] / IZZ


def test_linear_data_with_the_full_equations_have_a_bias_that_falls_with_the_square_of_the_amplitude():
    """For a platform that moves by 10 mrad; where the elastic one amplifies its command, the bias is more."""
    at_ten, at_one = bias(np.eye(6), 1.0), bias(np.eye(6), 0.1)
    assert np.abs(at_ten).max() <= 5e-4
    assert np.abs(at_one).max() == pytest.approx(np.abs(at_ten).max() / 100, rel=0.02)
    amplified = [np.abs(bias(elastic(), size)).max() for size in (1.0, 0.1)]
    assert amplified[0] == pytest.approx(1.35e-3, rel=0.01)
    assert amplified[1] == pytest.approx(amplified[0] / 100, rel=0.02)


def test_standard_deviations_under_noise_are_those_of_repeated_draws(demo):
    """Ixx, of the slowest tone, has 2.3e-5 kg.m2; the other moments 0.8 to 1.4e-5."""
    Y, wrench = demo
    found = solved(Y, wrench)
    deviation = np.sqrt(np.diag(found.covariance))
    assert deviation[0] == pytest.approx(2.1e-4, rel=0.02)
    assert np.all((deviation[1:4] > 2e-5) & (deviation[1:4] < 4e-5))
    assert np.all((deviation[5:] > 0.75e-5) & (deviation[5:] < 1.45e-5))
    random, draws = np.random.default_rng(14), 400
    noisy = wrench[..., None] + NOISE[:, None] * random.normal(size=(*wrench.shape, draws))
    # another solver, which takes all draws at once
    values = np.linalg.lstsq((Y / NOISE[:, None]).reshape(-1, 10), (noisy / NOISE[:, None]).reshape(-1, draws))[0]
    np.testing.assert_allclose(solved(Y, noisy[..., 0]).values, values[:, 0], rtol=1e-9, atol=1e-12)
    spread, mean = np.std(values, axis=1), np.mean(values, axis=1)
    # five standard deviations of a standard deviation and of a mean
    np.testing.assert_allclose(spread, deviation, rtol=5 / np.sqrt(2 * draws))
    assert np.all(np.abs(mean - TRUTH) < 5 * deviation / np.sqrt(draws))


def test_the_commanded_motion_in_place_of_the_measured_one():
    """Mass 69 % too large, a moment of inertia by up to 14.5 % of Izz: the platform resonates."""
    wrench = linear_wrench(motion(elastic())[2])
    _, _, commanded = motion(np.eye(6))
    found = solved(linear_regressor(commanded[:, 3:], commanded[:, :3]), wrench).values
    assert round(100 * (found[0] / TRUTH[0] - 1)) == 69
    assert round(100 * np.abs((found - TRUTH)[4:]).max() / IZZ, 1) == 14.5


@st.composite
def payloads(draw) -> Payload:
    """Payloads of any mass up to 6 kg, off centre, with the inertia of a box."""
    mass, center, edges = draw(st.floats(0.1, 6.0)), draw(numbers_in(-0.08, 0.08, 3)), draw(numbers_in(0.02, 0.2, 3))
    squares = edges**2
    return Payload(mass, tuple(center), tuple(mass / 12 * (squares.sum() - squares)))


@settings(max_examples=8)
@given(posture=postures(), payload=payloads(), level=st.sampled_from(["rigid", "cartesian"]))
def test_any_payload_in_any_posture_is_identified_from_responses_of_the_model(posture, payload, level):
    """Of the equations of the part, linearised: tubes and applied wrenches move the platform at three frequencies."""
    numbers = analyze(posture=posture, payload=payload)
    system = linearize(sdelta(level=level, posture=posture, payload=payload))
    rows, columns = system.output_labels.index, system.input_labels.index
    axes = range(1, 4)
    outputs = [
        rows(f"{name}[{i}]")
        for name in ("platform/acceleration", "platform/angular_acceleration", "limbs/torque", "limbs/force")
        for i in axes
    ]
    applied = [columns(f"wrench/{name}[{i}]") for name in ("torque", "force") for i in axes]
    tubes = [[columns(f"drive[{j}]/{kind}{o}") for j in axes for kind in ("slide", "angle")] for o in
             ("", "_rate", "_acceleration")]  # fmt: skip
    Y, w = [], []
    for s in 2j * np.pi * np.array([3.0, 12.0, 40.0]):
        inside = np.linalg.solve(s * np.eye(len(system.A)) - system.A, system.B)
        response = (system.C @ inside + system.D)[outputs]
        moved = sum(s**k * response[:, columns] for k, columns in enumerate(tubes))
        pushed = response[:, applied] + np.vstack([np.zeros((6, 6)), np.eye(6)])
        for column in np.hstack([1e-3 * moved, pushed]).T:
            a, b, torque, force = (part @ numbers["attitude"] for part in column.reshape(4, 3))
            Y.append(linear_regressor(a[None], b[None])[0])
            w.append(np.concatenate([torque, force]))
    A, b = np.concatenate(Y), np.concatenate(w)
    found = solve(np.concatenate([A.real, A.imag]), np.concatenate([b.real, b.imag]))
    assert found.rank == 10
    expected = numbers["inertia_parameters_S"]
    np.testing.assert_allclose(found.values, expected, rtol=1e-9, atol=1e-9 * expected[0])
