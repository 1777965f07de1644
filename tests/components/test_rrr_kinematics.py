"""Kinematics of the 3-RRR stage: the maps against geometry written another way, and the parameter sets."""

import casadi as ca
import numpy as np
import pytest

from hfsa.components import ModelError
from hfsa.components._mechanics.rrr_kinematics import (
    CALIBRATED,
    NOMINAL,
    OFFSETS,
    corner_motion,
    elongations,
    forward,
    jacobian,
    legs,
    links,
)

UM = 1e-6
SETS = pytest.mark.parametrize("geometry", [NOMINAL, CALIBRATED], ids=["nominal", "calibrated"])
CORNERS_OF_THE_BOX = 12 * UM * np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1)

pose = ca.SX.sym("pose", 3)


def value(expression: ca.SX, at: np.ndarray) -> np.ndarray:
    return np.array(ca.Function("f", [pose], [expression])(at))


def rotation(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


@SETS
def test_psi1_is_the_direction_from_a_to_c(geometry):
    along = geometry.corners[1] - geometry.base_hinges[1]
    assert np.arctan2(along[1], along[0]) == pytest.approx(geometry.psi1, abs=1e-12)


def test_calibration_fits_the_measurement_at_one_point_only():
    at_12_0_12, elsewhere = np.array([12, 0, 12]) * UM, CORNERS_OF_THE_BOX
    missed = jacobian("calibrated") - jacobian("measured")
    assert np.abs(missed @ at_12_0_12)[:2].max() < 5e-9
    off = np.linalg.norm((missed @ elsewhere)[:2], axis=0)
    assert off.max() == pytest.approx(11.06e-6, abs=0.005e-6)
    np.testing.assert_allclose(elsewhere[:, off.argmax()], np.array([0, 12, 12]) * UM)
    for corner in ([0, 12, 0], [12, 12, 12]):
        assert np.linalg.norm((missed @ np.array(corner))[:2]) == pytest.approx(8.09, abs=0.005)


def test_measured_range_is_half_that_of_the_links_as_designed():
    measured, designed = (np.abs(jacobian(name)).sum(axis=1) for name in ("measured", "nominal"))
    assert (measured / designed > 0.4).all()
    assert (measured / designed < 0.6).all()


@SETS
def test_links_keep_their_lengths(geometry):
    at = np.array([30e-6, -20e-6, -1.5e-3])
    turns = legs(geometry, pose)
    theta, alpha = value(turns.crank, at).ravel(), value(turns.coupler, at).ravel()
    C = geometry.corners + value(corner_motion(geometry, pose), at).T
    for i in range(3):
        B = geometry.base_hinges[i] + rotation(theta[i]) @ (geometry.crank_ends[i] - geometry.base_hinges[i])
        np.testing.assert_allclose(
            C[i] - B, rotation(alpha[i]) @ (geometry.corners[i] - geometry.crank_ends[i]), atol=1e-16
        )


@SETS
def test_inverse_is_the_triangle_of_the_leg(geometry):
    """Against theta = atan2(d) - acos(...), the closed form before its rest value is taken off."""

    def theta(at):
        C = at[:2] + np.array([rotation(at[2]) @ c for c in geometry.corners])
        d = C - geometry.base_hinges
        D = np.linalg.norm(d, axis=1)
        angle = np.arccos((geometry.crank**2 + D**2 - geometry.coupler**2) / (2 * geometry.crank * D))
        return np.arctan2(d[:, 1], d[:, 0]) - angle

    at = np.array([40e-6, 25e-6, -2e-3])
    expected = -geometry.arm * (theta(at) - theta(np.zeros(3)))
    np.testing.assert_allclose(value(elongations(geometry, pose), at).ravel(), expected, atol=1e-17)


def test_rest_is_zero_to_the_last_bit():
    turns = legs(NOMINAL, pose)
    assert not value(ca.vertcat(turns.crank, turns.coupler), np.zeros(3)).any()


@SETS
def test_velocities_are_those_of_the_couplers_axis(geometry):
    """Each is l' = -R0 w . q' / (L_AB sin(alpha - theta)), w the velocity of a corner along its coupler."""
    at = np.array([30e-6, -20e-6, -1.5e-3])
    slope = value(ca.jacobian(elongations(geometry, pose), pose), at)
    turns = legs(geometry, pose)
    alpha = geometry.psi + OFFSETS + value(turns.coupler, at).ravel()
    theta = geometry.psi - geometry.psi3 + OFFSETS + value(turns.crank, at).ravel()
    w = np.column_stack([np.cos(alpha), np.sin(alpha), geometry.radius * np.sin(alpha - OFFSETS - at[2])])
    expected = -geometry.arm * w / (geometry.crank * np.sin(alpha - theta))[:, None]
    np.testing.assert_allclose(slope, expected, rtol=1e-11)


@SETS
def test_velocity_map_at_rest_is_the_constant_jacobian(geometry):
    slope = value(ca.jacobian(elongations(geometry, pose), pose), np.zeros(3))
    np.testing.assert_allclose(np.linalg.inv(slope), geometry.jacobian, rtol=1e-10)


@SETS
def test_forward_inverts_inverse(geometry):
    wanted = np.array([12, 3, 7]) * UM
    np.testing.assert_allclose(
        value(elongations(geometry, pose), forward(geometry, wanted)).ravel(), wanted, atol=1e-17
    )


def test_constant_jacobian_errs_as_stated():
    """Up to 0.15 um and 0.005 mrad in the box 0..12 um, and to second order in the elongation."""
    error = np.array([forward(NOMINAL, at) - NOMINAL.jacobian @ at for at in CORNERS_OF_THE_BOX.T])
    assert 0.12e-6 < np.abs(error[:, :2]).max() < 0.155e-6
    assert 4e-6 < np.abs(error[:, 2]).max() < 5.5e-6
    coarse, fine = (
        np.linalg.norm(forward(NOMINAL, at) - NOMINAL.jacobian @ at) for at in ([4e-6, 8e-6, 0], [2e-6, 4e-6, 0])
    )
    assert coarse / fine == pytest.approx(4, rel=0.02)


def test_an_elongation_out_of_reach_is_named():
    with pytest.raises(ModelError, match=r"no pose has the elongations \[0.02, 0, 0\] m"):
        forward(NOMINAL, [0.02, 0, 0])


def test_parameter_sets_are_named():
    with pytest.raises(ModelError, match="'measured' is a Jacobian without link dimensions"):
        links("measured")
    with pytest.raises(ModelError, match="kinematics is 'nominel'; did you mean nominal"):
        jacobian("nominel")
