"""Numbers of `analyze sdelta`: printed axes and bands, invariants of frames, and laws that hold at every posture."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from random_postures import postures
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from hfsa.components import ModelError
from hfsa.components._mechanics import cartesian_numbers as cartesian
from hfsa.components._mechanics.bands import tracking_band
from hfsa.components._mechanics.modes import damping_matrix
from hfsa.components._mechanics.screws import GAMMA, shift
from hfsa.components._mechanics.sdelta_geometry import Posture
from hfsa.components._mechanics.sdelta_robot import Machine, Robot
from hfsa.components.sdelta import CUBE, analyze

few = settings(max_examples=30, suppress_health_check=[HealthCheck.too_slow], deadline=None)
A = Posture((10, 5, 8), (0.005, 0.003, 0.155))
LENGTH = 0.15


def robot(posture: Posture = A, preset: str = "ch4_full") -> Robot:
    return Robot.at(posture, preset, CUBE, Machine())


def screws(numbers: dict, name: str, pitch: str, label: str) -> np.ndarray:
    """Screws of unit rotation from the directions, points and pitches that are given of their axes."""
    e, points = numbers[f"{name}_directions"], numbers[f"{name}_points{label}"]
    return np.vstack([e, np.cross(points.T, e.T).T + numbers[pitch] * e])


# Printed digits -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("preset", "height"), [("ch3_full", -0.0329759), ("ch3_rods", -1 / 30)], ids=["with shafts", "rods"]
)
def test_axes_in_the_plane_meet_below_the_joints(preset, height):
    found = analyze(stiffness=preset)
    for name in ("eigenscrew", "wrench_compliant", "twist_compliant"):
        directions, points = found[f"{name}_directions"], found[f"{name}_points_S"]
        horizontal = np.abs(directions[2]) < 1e-9
        assert horizontal.sum() in (2, 4)
        np.testing.assert_allclose(points[:, horizontal][2], height, atol=5.1e-8)
        np.testing.assert_allclose(points[:, ~horizontal], 0, atol=1e-9)


def test_pitches_of_eigenscrews():
    found = np.sort(np.abs(analyze(stiffness="ch3_full")["eigenpitch"]))
    np.testing.assert_allclose(found, [0.0372261] * 4 + [0.3386661] * 2, atol=5.1e-8)


def test_modes_have_the_printed_axes():
    found = analyze()
    assert found["modal_kinds"] == ["rotation"] * 2 + ["translation"] + ["rotation"] * 3
    np.testing.assert_allclose(found["modal_directions"], np.eye(3)[:, [0, 1, 2, 0, 1, 2]], atol=1e-9)
    np.testing.assert_allclose(found["modal_points_C"][2, [0, 1, 3, 4]], [-0.077496] * 2 + [0.025727] * 2, atol=1e-6)
    np.testing.assert_allclose(found["modal_points_S"][2, [0, 1, 3, 4]], [-0.04924] * 2 + [0.05398] * 2, atol=5e-6)
    assert np.all(found["modal_pitches"] == [0, 0, np.inf, 0, 0, 0])
    H = found["modal_matrix_C"]
    np.testing.assert_allclose([H[0, 0], H[4, 0], H[0, 3], H[4, 3]], [5.27906, -0.40911, 9.16230, 0.23572], atol=3.1e-5)


def test_stiffness_of_the_shafts_at_the_joints():
    found = analyze(stiffness="ch3_full")
    np.testing.assert_allclose(found["shaft_along"], 5.81746e7, rtol=1e-6)
    np.testing.assert_allclose(found["shaft_across"], 6.790256e6, rtol=1e-7)
    np.testing.assert_allclose(found["joint_stiffness"], [149974.738, 147104.905] * 3, rtol=4e-9)
    assert np.all(np.isinf(analyze(stiffness="ch3_rods")["shaft_along"]))


def test_compliance_has_the_printed_entries():
    C = analyze(stiffness="ch3_rods")["compliance_S"]
    printed = {(0, 0): 1.77349e-3, (2, 2): 9.8528e-5, (0, 4): -5.91164e-5, (1, 3): 5.91164e-5, (3, 3): 4.43373e-6}
    for place, value in printed.items():
        assert C[place] == pytest.approx(value, rel=1e-5)


def test_rows_have_the_printed_determinant():
    assert np.linalg.det(analyze(level="rigid")["limb_rows_S"]) == pytest.approx(-0.00203761694, abs=5.1e-12)


def test_band_at_the_joints():
    """The numbers of the specification, to 0.2 %; the exact ones follow by an independent search below."""
    band = analyze()["tracking_band_hz_S"]
    np.testing.assert_allclose(band[[5, 0, 3, 2]], [5.36, 6.82, 7.08, 35.1], rtol=2e-3)


def test_statics_do_not_depend_on_the_inertia_of_the_limbs():
    found, expected = analyze(level="generalized", posture=A), analyze(posture=A, stiffness="ch4_full")
    for key in ("stiffness_S", "eigenscrew_points_S", "kappa_r", "minimum_energy_S", "condition_number"):
        np.testing.assert_array_equal(found[key], expected[key])


# Laws at every posture ------------------------------------------------------------------------------------------------


@given(postures())
@few
def test_modal_matrices_are_orthonormal_at_every_point(posture):
    found = analyze(posture=posture, point=(0.05, -0.02, 0.1))
    squares = (2 * np.pi * found["natural_frequencies_hz"]) ** 2
    for label in ("_S", "_C", "_P"):
        M, K, H = (found[name + label] for name in ("mass", "stiffness", "modal_matrix"))
        np.testing.assert_allclose(H.T @ M @ H, np.eye(6), atol=1e-8)
        np.testing.assert_allclose(H.T @ K @ H, np.diag(squares), atol=1e-9 * squares[-1])
        np.testing.assert_allclose(
            found[f"dynamic_matrix{label}"] @ H, H * squares, atol=1e-8 * np.abs(H * squares).max()
        )
        np.testing.assert_allclose(found[f"compliance{label}"] @ K, np.eye(6), atol=1e-6)
    cholesky = np.linalg.eigvalsh(found["squared_frequency_matrix_cholesky_C"])
    np.testing.assert_allclose(cholesky, squares, rtol=1e-9)
    Omega = found["frequency_matrix_C"]
    np.testing.assert_allclose(np.linalg.eigvalsh(Omega @ Omega), squares, rtol=1e-9)


@given(postures())
@few
def test_axes_reconstruct_the_stiffness(posture):
    """From their directions, points and pitches alone; eigenscrews are reciprocal."""
    found = analyze(posture=posture)
    for label in ("_S", "_C"):
        k = screws(found, "eigenscrew", "eigenpitch", label)
        K = found[f"stiffness{label}"]
        G = GAMMA @ k
        rebuilt = (G * (found["eigenstiffness"] / (2 * found["eigenpitch"]))) @ G.T
        np.testing.assert_allclose(rebuilt, K, atol=1e-7 * np.abs(K).max())
        products = k.T @ GAMMA @ k
        np.testing.assert_allclose(products, np.diag(2 * found["eigenpitch"]), atol=1e-8)


@given(postures())
@few
def test_compliant_axes_do_what_they_are_called_for(posture):
    """A force along a wrench-compliant axis only translates, a moment about a twist-compliant axis only rotates."""
    found = analyze(posture=posture)
    K, C = found["stiffness_S"], found["compliance_S"]
    forces = screws(found, "wrench_compliant", "wrench_compliant_pitches", "_S")
    moved = C @ (GAMMA @ forces)
    np.testing.assert_allclose(moved[:3], 0, atol=1e-9 * np.abs(C).max())
    np.testing.assert_allclose(moved[3:] * found["translational_stiffness"], forces[:3], atol=1e-7)
    turns = screws(found, "twist_compliant", "twist_compliant_pitches", "_S")
    load = K @ turns
    np.testing.assert_allclose(load[3:], 0, atol=1e-8 * np.abs(K).max())
    np.testing.assert_allclose(load[:3], turns[:3] * found["torsional_stiffness"], atol=1e-7 * np.abs(K[:3, :3]).max())


@given(
    arrays(float, 3, elements=st.floats(-1, 1)),
    arrays(float, 4, elements=st.floats(-1, 1)).filter(lambda q: np.linalg.norm(q) > 0.1),
)
@few
def test_invariants_do_not_depend_on_the_frame(offset, quaternion):
    here = robot()
    X = shift(offset, Rotation.from_quat(quaternion).as_matrix())
    one, other = (
        cartesian.static_numbers(K, {"": np.zeros(3)}, LENGTH)
        | cartesian.modal_numbers(M, K, {"": np.zeros(3)}, "", LENGTH)
        for K, M in ((here.stiffness, here.mass), (X.T @ here.stiffness @ X, X.T @ here.mass @ X))
    )
    for key in ("eigenstiffness", "eigenpitch", "translational_stiffness", "torsional_stiffness", "kappa_r"):
        np.testing.assert_allclose(other[key], one[key], rtol=1e-7)
    np.testing.assert_allclose(other["natural_frequencies_hz"], one["natural_frequencies_hz"], rtol=1e-7)
    np.testing.assert_allclose(other["modal_pitches"], one["modal_pitches"], rtol=1e-5, atol=1e-9)


def test_points_of_axes_move_with_the_place():
    """The same axis is seen from every place: its points there differ along the axis alone, and are perpendicular."""
    found = analyze(posture=A, point=(0.05, -0.02, 0.1))
    C = robot().offset
    for name in ("eigenscrew", "wrench_compliant", "twist_compliant", "modal"):
        e = found[f"{name}_directions"]
        for label, place in (("_C", C), ("_P", np.array([0.05, -0.02, 0.1]))):
            between = found[f"{name}_points{label}"] + place[:, None] - found[f"{name}_points_S"]
            np.testing.assert_allclose(np.cross(between.T, e.T), 0, atol=1e-9)
            np.testing.assert_allclose(np.sum(found[f"{name}_points{label}"] * e, axis=0), 0, atol=1e-12)


def test_minimum_energy_has_the_stiffness_and_reaches_the_pose():
    found = analyze(posture=A, stiffness="ch4_full")
    F = found["minimum_energy_S"]
    K_q = np.repeat([found["shaft_stiffness"], found["rod_stiffness"]], 6)
    np.testing.assert_allclose(F.T * K_q @ F, found["stiffness_S"], rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(found["drive_paths"] @ F, found["limb_rows_S"], atol=1e-12)


@pytest.mark.parametrize("posture", [Posture(), A], ids=["symmetric", "asymmetric"])
def test_band_is_where_the_response_leaves_it(posture):
    """By a search of the damped response of six coordinates."""
    found = analyze(posture=posture)
    M, K = found["mass_S"], found["stiffness_S"]
    D = 0.01 * damping_matrix(M, K)

    def excess(f: float, i: int) -> float:
        s = 2j * np.pi * f
        G = np.linalg.solve(M * s**2 + D * s + K, D * s + K)
        return abs(G[i, i] - 1) - 0.05

    for i in range(6):
        grid = np.linspace(0.5, 200, 4000)
        first = next(k for k, f in enumerate(grid) if excess(f, i) > 0)
        root = brentq(excess, grid[first - 1], grid[first], args=(i,))
        assert found["tracking_band_hz_S"][i] == pytest.approx(root, rel=1e-9)


def test_band_of_single_modes_has_a_closed_form():
    """|r^2 / (1 - r^2 + 2 i zeta r)| = e, quadratic in r^2."""
    e, zeta = 0.05, 0.01
    a, b = 1 - e**2, 2 * e**2 * (1 - 2 * zeta**2)
    r = np.sqrt((-b + np.sqrt(b**2 + 4 * a * e**2)) / (2 * a))
    band = tracking_band(np.diag([1.0, 4.0]), np.diag([100.0, 100.0]), e)
    np.testing.assert_allclose(band, r * np.array([10.0, 5.0]), rtol=1e-12)


# Close to a singularity -----------------------------------------------------------------------------------------------


def test_a_posture_close_to_a_singularity_says_so():
    found = analyze(posture=Posture(position=(0.0865, 0, 0.15)))
    assert found["condition_number"] > 1e3
    assert "close to a singularity" in found["regularity"]
    assert f"{found['natural_frequencies_hz'][0]:.3g} Hz" in found["regularity"]
    assert analyze()["regularity"] == "regular"


@pytest.mark.parametrize("point", [(0, 0), (0, np.nan, 0)], ids=["two", "nan"])
def test_a_point_that_is_none_is_refused(point):
    with pytest.raises(ModelError, match="point is"):
        analyze(point=point)
