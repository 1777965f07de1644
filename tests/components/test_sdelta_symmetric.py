"""The robot at its symmetric posture: what its symmetry and closed forms say, to rounding.

The numbers themselves are among the published ones (`test_published.py`).
"""

import numpy as np
import pytest

from hfsa.components._mechanics.elastostatics import eigenscrews, twist_compliant_axes, wrench_compliant_axes
from hfsa.components._mechanics.screws import axis, shift
from hfsa.components._mechanics.sdelta_geometry import SYMMETRIC, THESIS_GEOMETRY, Posture
from hfsa.components._mechanics.sdelta_inertia import CUBE, Payload, with_payload
from hfsa.components._mechanics.sdelta_kinematics import THESIS, Kinematics
from hfsa.components._mechanics.sdelta_stiffness import PRESETS, limb_stiffness, springs_of, stiffness
from hfsa.components.sdelta import analyze

PRESET = pytest.mark.parametrize("preset", sorted(PRESETS))


def test_tubes_do_not_slide_and_turn_by_half_the_sum_of_the_motors():
    np.testing.assert_allclose(Kinematics.at(SYMMETRIC).limbs.slide, 0, atol=1e-16)
    assert THESIS.transmission.matrix[1].tolist() == [1 / 12, 1 / 12]


@PRESET
def test_stiffness_in_closed_form(preset):
    kinematics = Kinematics.at(SYMMETRIC)
    c, n = limb_stiffness(kinematics, springs_of(preset))[:2]
    K = np.diag([0.00675 * n, 0.00675 * n, 0.0675 * c, 1.5 * c + 1.2 * n, 1.5 * c + 1.2 * n, 0.6 * n])
    K[0, 4] = K[4, 0] = 0.09 * n
    K[1, 3] = K[3, 1] = -0.09 * n
    np.testing.assert_allclose(analyze(stiffness=preset)["stiffness_S"], K, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(stiffness(kinematics, springs_of(preset), np.zeros(3)), K, rtol=1e-12, atol=1e-9)


@PRESET
def test_horizontal_axes_meet_in_one_point(preset):
    """Of eigenscrews, wrench- and twist-compliant axes alike, on the vertical through S."""
    K = analyze(stiffness=preset)["stiffness_S"]
    screws = np.hstack([eigenscrews(K).screws, wrench_compliant_axes(K).screws, twist_compliant_axes(K).screws]).T
    horizontal = [
        a for a in (axis(screw, THESIS_GEOMETRY.platform_radius) for screw in screws) if abs(a.direction[2]) < 1e-6
    ]
    assert len(horizontal) == 8
    for one in horizontal:
        np.testing.assert_allclose(one.point, [0, 0, horizontal[0].point[2]], atol=1e-9)


def test_modes_along_and_about_the_vertical():
    axes = [axis(screw, THESIS_GEOMETRY.platform_radius) for screw in analyze()["modal_screws_C"].T]
    assert axes[2].pitch == np.inf
    np.testing.assert_allclose(axes[2].direction, [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(axes[5].direction, [0, 0, 1], atol=1e-9)


def test_the_platform_alone_is_centred_on_its_joints():
    np.testing.assert_allclose(with_payload(Payload(0.0, (0, 0, 0), (0, 0, 0))).center, 0, atol=1e-16)


def test_stiffness_at_both_points_is_one_spring():
    """Away from symmetry, too."""
    posture = Posture((10, 5, 8), (0.005, 0.003, 0.155))
    numbers = analyze(posture=posture)
    X = shift(posture.matrix @ with_payload(CUBE).center)
    np.testing.assert_allclose(X.T @ numbers["stiffness_S"] @ X, numbers["stiffness_C"], rtol=1e-11, atol=1e-7)
