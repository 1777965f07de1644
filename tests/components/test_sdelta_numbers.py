"""The robot's reference numbers, each to its last printed digit.

They were obtained without this code, from the thesis' data, consistently where its own prints contradict each other.
Six of them were handed down with other last digits: `NOT_REPRODUCED`.
"""

import numpy as np
import pytest

from hfsa.components._elastostatics import eigenscrews, twist_compliant_axes, wrench_compliant_axes
from hfsa.components._modes import modal_damping, modes
from hfsa.components._screws import axis, shift, skew
from hfsa.components._sdelta_geometry import PLATFORM_RADIUS, SYMMETRIC, Posture
from hfsa.components._sdelta_inertia import CUBE, Payload, with_payload
from hfsa.components._sdelta_kinematics import DRIVE_MATRIX, DRIVES_MATRIX, Kinematics
from hfsa.components._sdelta_stiffness import PRESETS, limb_stiffness, stiffness
from hfsa.components.sdelta import analyze

NOT_REPRODUCED = {
    # quantity: (handed down, computed), and why the computed one stands
    "beta": ("556.40", "556.38"),  # ch3_full, N.m: K11 - K12^2/K22; kappa_r = 5862.3148 holds with this one only
    "c33": ("9.8528e-5", "9.8527e-5"),  # ch3_rods, rad/(N.m): 1/10149.46, the torsional stiffness of that preset
    "c66": ("1.108434e-5", "1.108433e-5"),  # ch3_rods, m/N: 1/(0.6 k_r) = 1.1084333e-5
    "rotation": ("9.16230", "9.16233"),  # modes 4, 5: its square and that of 5.27906 sum to 1/Ixx
    "axis": ("25.726", "25.727"),  # modes 4, 5 above C, mm: 25.7266 cut off
    "highest": ("160.541", "160.542"),  # the thesis' own example, Hz: 160.5419 cut off
}
COMPUTED = {name: computed for name, (_, computed) in NOT_REPRODUCED.items()}

A = Posture((10, 5, 8), (0.005, 0.003, 0.155))


def assert_printed(values, *texts: str):
    """Each value rounds to the number printed, to half a unit of its last digit."""
    values = np.ravel(values)
    assert len(values) == len(texts)
    for value, text in zip(values, texts, strict=True):
        mantissa, _, exponent = text.partition("e")
        unit = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
        assert abs(value - float(text)) <= 0.5000001 * unit, f"{value!r} is not {text}"


def twice(*texts: str) -> tuple[str, ...]:
    return tuple(text for text in texts for _ in range(2))


# Kinematics -----------------------------------------------------------------------------------------------------------


def test_symmetric_posture():
    limbs = Kinematics.at(SYMMETRIC).limbs
    np.testing.assert_allclose(limbs.slide, 0, atol=1e-16)
    assert_printed(limbs.length, *["0.1677051"] * 3)
    assert_printed(np.rad2deg(limbs.angle), *["63.4349"] * 3)
    assert_printed(DRIVE_MATRIX[0], "4.774648e-3", "-4.774648e-3")
    assert DRIVE_MATRIX[1].tolist() == [1 / 12, 1 / 12]


def test_pose_to_motor_angles_at_the_symmetric_posture():
    T = analyze()["jacobian"]
    rows = np.linalg.inv(T)
    assert_printed(rows[0], "-2.4", "0", "15.707963", "104.719755", "-32", "16")
    assert_printed(rows[1], "-2.4", "0", "-15.707963", "-104.719755", "-32", "16")
    assert_printed(rows[2], "1.2", "-2.0784610", "15.707963", "-24.647065", "106.689968", "16")
    assert_printed(np.linalg.det(Kinematics.at(SYMMETRIC).rows()), "-0.00203761694")


def test_limb_lengths_away_from_symmetry():
    assert_printed(analyze(posture=A)["limb_lengths"], "0.163335335", "0.160661098", "0.197499587")


# Stiffness ------------------------------------------------------------------------------------------------------------


def test_spring_constants():
    full = PRESETS["ch3_full"]
    assert_printed(full.rod, "1.503624e5")
    assert_printed(PRESETS["ch4"].rod, "1.7781905e5")
    assert_printed(full.shaft, "2.652444e3")
    slide, turn = 1 / (DRIVES_MATRIX**2).sum(axis=1)[:2] * full.shaft
    assert_printed(slide, "5.81746e7")
    assert_printed(turn / Kinematics.at(SYMMETRIC).limbs.length[0] ** 2, "6.790256e6")


@pytest.mark.parametrize(
    ("preset", "k_c", "k_n"),
    [
        ("ch3_full", "149974.738", "147104.905"),
        ("ch4_full", "177277.180", "173281.269"),
        ("ch4", "177819.053", "177819.053"),
    ],
)
def test_limb_stiffness_and_closed_form(preset, k_c, k_n):
    kinematics = Kinematics.at(SYMMETRIC)
    K_D = limb_stiffness(kinematics, PRESETS[preset])
    assert_printed(K_D, *[k_c, k_n] * 3)
    c, n = K_D[:2]
    K = np.diag([0.00675 * n, 0.00675 * n, 0.0675 * c, 1.5 * c + 1.2 * n, 1.5 * c + 1.2 * n, 0.6 * n])
    K[0, 4] = K[4, 0] = 0.09 * n
    K[1, 3] = K[3, 1] = -0.09 * n
    np.testing.assert_allclose(analyze(stiffness=preset)["stiffness_S"], K, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(stiffness(kinematics, PRESETS[preset], np.zeros(3)), K, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize(
    ("preset", "mu", "alpha", "beta", "kappas"),
    [
        (
            "ch3_full",
            ("14945.834", "29891.668"),
            ("401487.99", "88262.943"),
            (COMPUTED["beta"], "10123.295"),
            ("21136.601", "331750.69", "5862.3148"),
        ),
        (
            "ch3_rods",
            ("15129.922", "30259.844"),
            ("405978.41", "90217.42"),
            ("563.86", "10149.46"),
            ("21396.941", "335547.37", "5877.8515"),
        ),
    ],
)
def test_indices_of_chapter_3(preset, mu, alpha, beta, kappas):
    numbers = analyze(stiffness=preset)
    values = numbers["eigenstiffness"]
    assert_printed(values, f"-{mu[1]}", f"-{mu[0]}", f"-{mu[0]}", mu[0], mu[0], mu[1])
    assert_printed(numbers["translational_stiffness"], alpha[1], alpha[0], alpha[0])
    assert_printed(numbers["torsional_stiffness"], beta[0], beta[0], beta[1])
    assert_printed([numbers["kappa"], numbers["kappa_t"], numbers["kappa_r"]], *kappas)


def test_eigenpitches():
    pitch = analyze(stiffness="ch3_full")["eigenpitch"]
    large, small = "0.3386661", "0.0372261"
    assert_printed(pitch, f"-{large}", f"-{small}", f"-{small}", small, small, large)


@pytest.mark.parametrize(("preset", "height"), [("ch3_full", "-0.0329759"), ("ch3_rods", "-0.0333333")])
def test_horizontal_axes_meet_in_one_point(preset, height):
    """Of eigenscrews, wrench- and twist-compliant axes alike."""
    K = analyze(stiffness=preset)["stiffness_S"]
    screws = np.hstack([eigenscrews(K).screws, wrench_compliant_axes(K).screws, twist_compliant_axes(K).screws]).T
    horizontal = [a for a in (axis(screw, PLATFORM_RADIUS) for screw in screws) if abs(a.direction[2]) < 1e-6]
    assert len(horizontal) == 8
    for one in horizontal:
        np.testing.assert_allclose(one.point[:2], 0, atol=1e-9)
        assert_printed(one.point[2], height)


def test_compliance_of_the_rods():
    C = np.linalg.inv(analyze(stiffness="ch3_rods")["stiffness_S"])
    assert_printed(np.diag(C), *twice("1.77349e-3"), COMPUTED["c33"], *twice("4.43373e-6"), COMPUTED["c66"])
    assert_printed([C[0, 4], C[1, 3]], "-5.91164e-5", "5.91164e-5")


def test_eigenstiffness_away_from_symmetry():
    expected = ("-43403.337", "-21761.114", "-8186.795", "13272.315", "26988.268", "33090.663")
    assert_printed(analyze(posture=A)["eigenstiffness"], *expected)


# Inertia, modes and damping -------------------------------------------------------------------------------------------


def test_inertia_of_platform_and_cube():
    total, alone = with_payload(CUBE), with_payload(Payload(0.0, (0, 0, 0), (0, 0, 0)))
    assert_printed([total.mass, total.center[2]], "4.4857", "0.0282565")
    assert_printed(np.diag(total.tensor), *twice("0.0089432"), "0.0117172")
    assert_printed(np.diag(total.about(np.zeros(3))), *twice("0.0125247"), "0.0117172")
    assert_printed(alone.mass, "1.4857")
    assert_printed(np.diag(alone.tensor), *twice("0.0045775"), "0.0091252")
    np.testing.assert_allclose(alone.center, 0, atol=1e-16)


def test_matrices_at_the_centre_of_mass():
    numbers = analyze()
    K, Omega = numbers["stiffness_C"], numbers["frequency_matrix_C"]
    assert_printed(np.diag(K), *twice("2488.029"), "12002.786", *twice("480111.44"), "106691.43")
    assert_printed([K[0, 4], K[1, 3]], "29569.964", "-29569.964")
    assert_printed(np.diag(Omega), *twice("489.43971"), "1012.11325", *twice("261.49436"), "154.22318")
    assert_printed([Omega[0, 4], Omega[1, 3]], "196.60176", "-196.60176")
    omega = 2 * np.pi * numbers["natural_frequencies_hz"]
    assert_printed(omega, *twice("148.21823"), "154.22318", *twice("602.71585"), "1012.11325")
    D = 0.01 * modal_damping(numbers["mass_C"], K)
    assert_printed(np.diag(D), *twice("0.0875431"), "0.2371827", *twice("23.459705"), "13.835979")
    assert_printed([D[0, 4], D[1, 3]], "0.7875515", "-0.7875515")


FREQUENCIES = [
    ("ch4", SYMMETRIC, (*twice("23.58966"), "24.54538", *twice("95.92521"), "161.08283")),
    ("ch4_full", SYMMETRIC, (*twice("23.50500"), "24.23017", *twice("94.88949"), "160.83720")),
    ("ch3_full", SYMMETRIC, (*twice("21.62625"), "22.32514", *twice("87.40124"), "147.93439")),
    ("ch3_rods", SYMMETRIC, (*twice("21.69213"), "22.57097", *twice("88.20906"), "148.12545")),
    ("ch4", A, ("14.010946", "26.388403", "30.515937", "91.665410", "102.070123", "160.262484")),
    ("ch3_full", A, ("12.794764", "24.025400", "27.998465", "83.516133", "92.973636", "147.138340")),
]


@pytest.mark.parametrize(("preset", "posture", "expected"), FREQUENCIES)
def test_natural_frequencies(preset, posture, expected):
    assert_printed(analyze(stiffness=preset, posture=posture)["natural_frequencies_hz"], *expected)


@pytest.mark.parametrize(
    ("posture", "lowest"),
    [
        (Posture(position=(0.010, 0, 0.150)), "21.983"),
        (Posture(position=(0.050, 0, 0.150)), "12.048"),
        (Posture(position=(0, 0, 0.160)), "22.841"),
        (Posture(position=(0, 0, 0.140)), "24.373"),
        (Posture(rotation=(0, 5, 0)), "19.234"),
        (Posture(rotation=(0, 0, 5)), "18.679"),
        (Posture(rotation=(30, 0, 0)), "26.321"),
    ],
)
def test_lowest_frequency_over_postures(posture, lowest):
    assert_printed(analyze(posture=posture)["natural_frequencies_hz"][0], lowest)


def test_axes_of_the_modes():
    numbers = analyze()
    axes = [axis(screw, PLATFORM_RADIUS) for screw in numbers["modal_screws_C"].T]
    assert_printed([1e3 * axes[i].point[2] for i in (0, 1, 3, 4)], *twice("-77.496", COMPUTED["axis"]))
    C = 1e3 * with_payload(CUBE).center[2]
    assert_printed([1e3 * axes[i].point[2] + C for i in (0, 3)], "-49.24", "53.98")
    assert axes[2].pitch == np.inf
    np.testing.assert_allclose(axes[2].direction, [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(axes[5].direction, [0, 0, 1], atol=1e-9)
    shapes = modes(numbers["mass_C"], numbers["stiffness_C"]).shapes
    sizes = np.linalg.norm(shapes.reshape(2, 3, 6), axis=1)
    assert_printed(sizes[:, 0], "5.27906", "0.40911")
    assert_printed(sizes[:, 3], COMPUTED["rotation"], "0.23572")


def test_printed_arbitrary_posture():
    """The thesis' own example (eqs 4.45 to 4.51) comes out with its slips: degrees / 180, and a transposed rotation."""
    posture = Posture((np.rad2deg(10 / 180), 5, 8), A.position)
    Q, body = posture.matrix, with_payload(CUBE)
    d = Q @ body.center
    M = body.matrix(Q)
    M[:3, :3] = Q.T @ body.about(np.zeros(3)) @ Q + body.mass * skew(d) @ skew(d)
    K = stiffness(Kinematics.at(posture), PRESETS["ch4"], d)
    assert_printed(
        modes(M, K).omega / (2 * np.pi), "13.534", "26.004", "30.408", "91.099", "101.617", COMPUTED["highest"]
    )


def test_stiffness_at_both_points_is_one_spring():
    numbers = analyze(posture=A)
    X = shift(A.matrix @ with_payload(CUBE).center)
    np.testing.assert_allclose(X.T @ numbers["stiffness_S"] @ X, numbers["stiffness_C"], rtol=1e-11, atol=1e-7)
