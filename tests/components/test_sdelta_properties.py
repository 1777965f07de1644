"""Laws of the robot's kinematics, stiffness and modes, at random postures, presets and frames."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_postures import numbers_in, postures
from scipy.spatial.transform import Rotation

from hfsa.components import ModelError
from hfsa.components._mechanics.elastostatics import eigenscrews, twist_compliant_axes, wrench_compliant_axes
from hfsa.components._mechanics.modes import damping_matrix, frequency_matrix, modes
from hfsa.components._mechanics.screws import GAMMA, exponential, numbers, shift
from hfsa.components._mechanics.sdelta_direct import direct_kinematics
from hfsa.components._mechanics.sdelta_geometry import C_AXES, INWARDS, SYMMETRIC, THESIS_GEOMETRY, UP, Posture
from hfsa.components._mechanics.sdelta_inertia import CUBE, Payload, with_payload
from hfsa.components._mechanics.sdelta_kinematics import THESIS, Kinematics
from hfsa.components._mechanics.sdelta_stiffness import (
    PRESETS,
    Springs,
    limb_stiffness,
    spring_forces,
    springs_of,
    stiffness,
)

ZERO = np.zeros(3)
few = settings(max_examples=30)


presets = st.sampled_from(sorted(PRESETS)).map(springs_of)
frames = st.builds(
    shift,
    numbers_in(-0.3, 0.3, 3),
    numbers_in(-3, 3, 3).map(lambda v: Rotation.from_rotvec(v).as_matrix()),
)


def relative(actual, expected) -> float:
    """Largest difference over the largest entry, block by block, so that units do not mix."""
    actual, expected = np.atleast_2d(actual), np.atleast_2d(expected)
    if expected.shape != (6, 6):
        return np.abs(actual - expected).max() / np.abs(expected).max()
    blocks = [np.s_[:3, :3], np.s_[:3, 3:], np.s_[3:, :3], np.s_[3:, 3:]]
    scale = np.sqrt(np.abs(expected[blocks[0]]).max() * np.abs(expected[blocks[3]]).max())
    sizes = [np.abs(expected[blocks[0]]).max(), scale, scale, np.abs(expected[blocks[3]]).max()]
    return max(np.abs(actual[b] - expected[b]).max() / size for b, size in zip(blocks, sizes, strict=True))


# Kinematics -----------------------------------------------------------------------------------------------------------


@given(postures())
@few
def test_direct_kinematics_undoes_the_inverse(posture):
    there = Kinematics.at(posture)
    Q, position = direct_kinematics(there.motor_angles)
    assert np.abs(Q - there.Q).max() < 1e-12
    assert np.abs(position - there.position).max() < 1e-12


@given(postures())
@few
def test_jacobian_is_the_derivative_of_direct_kinematics(posture):
    there = Kinematics.at(posture)
    T = there.jacobian()
    # The curvature grows with the condition number.
    step = 3e-4 / there.condition_number
    columns = []
    for unit in np.eye(6):
        plus, minus = (direct_kinematics(there.motor_angles + s * step * unit, posture) for s in (1, -1))
        turn = Rotation.from_matrix(plus[0] @ minus[0].T).as_rotvec()
        columns.append(np.concatenate([turn, plus[1] - minus[1]]) / (2 * step))
    difference = np.column_stack(columns) - T
    assert np.abs(difference[:3]).max() < 1e-7 * np.abs(T[:3]).max()
    assert np.abs(difference[3:]).max() < 1e-7 * np.abs(T[3:]).max()


@given(postures(), numbers_in(-0.1, 0.1, 3))
@few
def test_rows_about_another_point_are_the_shifted_rows(posture, offset):
    kinematics = Kinematics.at(posture)
    assert relative(kinematics.rows(offset), kinematics.rows() @ shift(offset)) < 1e-13


# Stiffness ------------------------------------------------------------------------------------------------------------


@given(postures(), presets, numbers_in(-0.1, 0.1, 3))
@few
def test_least_energy_gives_the_same_stiffness(posture, springs, offset):
    kinematics = Kinematics.at(posture)
    G = spring_forces(kinematics, springs, offset)
    assert relative(G.T * springs.compliance @ G, stiffness(kinematics, springs, offset)) < 1e-12


def potential_energy(kinematics: Kinematics, springs: Springs, x: ca.SX) -> ca.SX:
    """Energy of rods and shafts with the tubes held and the platform displaced, by finite geometry instead of N."""
    Q = exponential(x[:3]) @ ca.SX(kinematics.Q)
    energy = ca.SX(0)
    slide_spring, turn_spring = 1 / (THESIS.drives_matrix[:2] ** 2).sum(axis=1) * springs.shaft
    for j, (slide, angle) in enumerate(zip(kinematics.limbs.slide, kinematics.limbs.angle, strict=True)):
        along = np.cos(angle) * INWARDS[j] + np.sin(angle) * UP
        across = np.cross(C_AXES[j], along)
        reach = (
            kinematics.position + x[3:] + Q @ THESIS_GEOMETRY.joints[j] - THESIS_GEOMETRY.middles[j] - slide * C_AXES[j]
        )
        length = ca.dot(along, reach)
        k_c = 1 / (1 / springs.rod + 1 / slide_spring)
        k_n = 1 / (1 / springs.rod + length**2 / turn_spring)
        energy += (k_c * ca.dot(C_AXES[j], reach) ** 2 + k_n * ca.dot(across, reach) ** 2) / 2
    return energy


@given(postures(), presets)
@few
def test_stiffness_is_the_hessian_of_the_energy(posture, springs):
    kinematics = Kinematics.at(posture)
    x = ca.SX.sym("x", 6)
    hessian = numbers(ca.substitute(ca.hessian(potential_energy(kinematics, springs, x), x)[0], x, ca.SX.zeros(6)))
    assert relative(hessian, stiffness(kinematics, springs, ZERO)) < 1e-10


@given(postures(), presets, numbers_in(-0.1, 0.1, 3))
@few
def test_shifted_stiffness_is_the_stiffness_about_the_other_point(posture, springs, offset):
    kinematics, X = Kinematics.at(posture), shift(offset)
    K = stiffness(kinematics, springs, ZERO)
    shifted = X.T @ K @ X
    assert relative(shifted, stiffness(kinematics, springs, offset)) < 1e-12
    np.testing.assert_allclose(shifted[3:, 3:], K[3:, 3:], rtol=1e-12, atol=1e-12 * K.max())


@given(postures(), presets)
@few
def test_eigenscrews(posture, springs):
    K = stiffness(Kinematics.at(posture), springs, ZERO)
    mu, pitch, k = eigenscrews(K)
    assert (mu[:3] < 0).all()
    assert (mu[3:] > 0).all()
    assert (np.sign(pitch) == np.sign(mu)).all()
    assert abs(mu.sum()) < 1e-10 * mu.max()
    assert abs(np.trace(K[:3, 3:])) < 1e-10 * mu.max()
    np.testing.assert_allclose(GAMMA @ K @ k, k * mu, atol=1e-8 * np.abs(K @ k).max())
    reciprocity = k.T @ GAMMA @ k
    np.testing.assert_allclose(reciprocity, np.diag(2 * pitch), atol=1e-10)
    assert relative(GAMMA @ k * (mu / (2 * pitch)) @ k.T @ GAMMA, K) < 1e-10


@given(postures(), presets, frames)
@few
def test_invariants_under_a_change_of_frame(posture, springs, X):
    there = Kinematics.at(posture)
    body = with_payload(CUBE)
    K = stiffness(there, springs, ZERO)
    from_C = shift(-there.Q @ body.center)
    M = from_C.T @ body.matrix(there.Q) @ from_C
    moved = X.T @ K @ X
    np.testing.assert_allclose(eigenscrews(moved).stiffness, eigenscrews(K).stiffness, rtol=1e-9)
    for axes in (wrench_compliant_axes, twist_compliant_axes):
        np.testing.assert_allclose(axes(moved).stiffness, axes(K).stiffness, rtol=1e-9)
    np.testing.assert_allclose(modes(X.T @ M @ X, moved).omega, modes(M, K).omega, rtol=1e-9)


@given(postures(), presets)
@few
def test_compliant_axes(posture, springs):
    """A translation along the one needs a wrench on that axis, a twist about the other a couple along it."""
    K = stiffness(Kinematics.at(posture), springs, ZERO)
    alphas, wrenches = wrench_compliant_axes(K)
    for alpha, screw in zip(alphas, wrenches.T, strict=True):
        translation = np.concatenate([ZERO, screw[:3] / alpha])
        np.testing.assert_allclose(K @ translation, GAMMA @ screw, atol=1e-9)
    betas, twists = twist_compliant_axes(K)
    for beta, screw in zip(betas, twists.T, strict=True):
        couple = np.concatenate([beta * screw[:3], ZERO])
        np.testing.assert_allclose(K @ screw, couple, atol=1e-9 * np.abs(K).max())


# Modes ----------------------------------------------------------------------------------------------------------------


@given(postures(), presets, st.floats(0, 20), numbers_in(-0.05, 0.05, 3))
@few
def test_modes(posture, springs, mass, center):
    there = Kinematics.at(posture)
    body = with_payload(Payload(mass, tuple(center), (1e-3 * mass, 2e-3 * mass, 1.5e-3 * mass)))
    M = body.matrix(there.Q)
    K = stiffness(there, springs, there.Q @ body.center)
    omega, H = modes(M, K)
    assert (np.diff(omega) >= 0).all()
    np.testing.assert_allclose(H.T @ M @ H, np.eye(6), atol=1e-10)
    np.testing.assert_allclose(H.T @ K @ H, np.diag(omega**2), atol=1e-10 * omega[-1] ** 2)
    Omega = frequency_matrix(M, K)
    np.testing.assert_allclose(np.trace(Omega @ Omega), np.trace(np.linalg.solve(M, K)), rtol=1e-10)
    np.testing.assert_allclose(np.linalg.eigvalsh(Omega), omega, rtol=1e-7)
    np.testing.assert_allclose(H.T @ damping_matrix(M, K) @ H, np.diag(2 * omega), atol=1e-9 * omega[-1])


@given(postures(), presets)
@few
def test_a_third_of_a_turn_changes_no_invariant(posture, springs):
    turn = Rotation.from_euler("z", 120, degrees=True).as_matrix()
    first = Kinematics.at(posture)
    second = Kinematics.of(turn @ first.Q @ turn.T, turn @ first.position)
    body, results = with_payload(CUBE), []
    for there in (first, second):
        K = stiffness(there, springs, there.Q @ body.center)
        results.append(
            [
                eigenscrews(K).stiffness,
                wrench_compliant_axes(K).stiffness,
                twist_compliant_axes(K).stiffness,
                modes(body.matrix(there.Q), K).omega,
            ]
        )
    for a, b in zip(*results, strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9)


# Bad input ------------------------------------------------------------------------------------------------------------

SINGULAR = [
    ((90, 0, 0), (0, 0, 0.15)),
    ((-90, 0, 0), (0, 0, 0.15)),
    ((0, -22.61986, 0), (0, 0, 0.15)),
    ((0, 24.42523, 0), (0, 0, 0.15)),
    ((0, 0, 23.41266), (0, 0, 0.15)),
    ((0, 0, -23.41266), (0, 0, 0.15)),
    ((0, 0, 0), (0.08660254, 0, 0.15)),
    ((0, 0, 0), (-0.08660254, 0, 0.15)),
    ((0, 0, 0), (0, -0.075, 0.15)),
]


@pytest.mark.parametrize(("rotation", "position"), SINGULAR)
@pytest.mark.parametrize("distance", [0, 1e-6, -1e-6])
def test_singular_postures_are_refused_with_their_condition(rotation, position, distance):
    """At the posture and a microradian or a micrometre beside it."""
    turned = tuple(np.array(rotation) + np.rad2deg(distance) * np.sign(rotation))
    moved = tuple(np.array(position) + distance * np.array([*np.sign(position[:2]), 0]))
    with pytest.raises(ModelError, match=r"singular: condition number \d"):
        Kinematics.at(Posture(turned, moved))


@pytest.mark.parametrize(("rotation", "position"), SINGULAR)
def test_postures_near_a_singularity_are_not(rotation, position):
    """A degree or a millimetre away the condition is in the hundreds, and falls with the distance."""
    near, far = (
        Kinematics.at(
            Posture(
                tuple(np.array(rotation) - d * np.sign(rotation)),
                tuple(np.array(position) - 1e-3 * d * np.array([*np.sign(position[:2]), 0])),
            )
        ).condition_number
        for d in (0.5, 1)
    )
    assert 20 < far < near < 1000
    assert near / far == pytest.approx(2, rel=0.1)


def test_a_limb_without_length_is_singular():
    corner = THESIS_GEOMETRY.middles[0] - THESIS_GEOMETRY.joints[0]
    with pytest.raises(ModelError, match="condition number inf"):
        Kinematics.at(Posture(position=tuple(corner)))


def test_attitudes():
    Q = Rotation.from_euler("ZXY", [10, 5, 8], degrees=True).as_matrix()
    np.testing.assert_allclose(Posture((10, 5, 8)).matrix, Q, atol=1e-15)
    np.testing.assert_allclose(Posture(Q).rotation, (10, 5, 8), atol=1e-13)
    with pytest.raises(ModelError, match=r"differs from 1 by 0\.002"):
        Posture(Q * 1.001)
    with pytest.raises(ModelError, match="det Q is -1"):
        Posture(Q @ np.diag([1, 1, -1]))
    with pytest.raises(ModelError, match="three finite numbers"):
        Posture((10, 5))
    with pytest.raises(ModelError, match="nan"):
        Posture(position=(0, 0, np.nan))


def test_negative_springs_and_payloads_are_refused():
    with pytest.raises(ModelError, match=r"rod is -1\.0"):
        Springs(-1.0)
    with pytest.raises(ModelError, match="shaft is nan"):
        Springs(1.0, np.nan)
    with pytest.raises(ModelError, match="mass is -3"):
        Payload(-3)
    with pytest.raises(ModelError, match="inertia"):
        Payload(3, inertia=(-1e-3, 1e-3, 1e-3))
    with pytest.raises(ModelError, match="sum of the others"):
        Payload(3, inertia=(1e-3, 1e-3, 3e-3))
    with pytest.raises(ModelError, match="no mass"):
        Payload(0, inertia=(1e-3, 1e-3, 1e-3))
    K = -np.eye(6)
    with pytest.raises(ModelError, match="eigenvalue -1"):
        modes(np.eye(6), K)
    with pytest.raises(ModelError, match="mass matrix has the eigenvalue -1"):
        modes(K, np.eye(6))


def test_direct_kinematics_that_leaves_the_workspace_is_refused():
    with pytest.raises(ModelError, match=r"singular|no pose"):
        direct_kinematics(np.array([0, 0, 0, 0, 60, 60]))


def test_limb_stiffness_of_stiff_shafts_tends_to_the_rods():
    kinematics = Kinematics.at(SYMMETRIC)
    errors = [np.abs(limb_stiffness(kinematics, Springs(1e5, k)) / 1e5 - 1).max() for k in (1e6, 1e7)]
    assert errors[0] / errors[1] == pytest.approx(10, rel=1e-2)
