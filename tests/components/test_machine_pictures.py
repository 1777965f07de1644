"""Pictures of robot, stage and accelerometer: drawn points are those of the kinematics, axes those of `analyze`."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hfsa.components import ModelError
from hfsa.components._mechanics.rrr_design import Dimensions
from hfsa.components._mechanics.rrr_kinematics import NOMINAL, forward
from hfsa.components._mechanics.rrr_picture import moved_hinges
from hfsa.components._mechanics.sdelta_geometry import C_AXES, Posture
from hfsa.components._mechanics.sdelta_inertia import CUBE
from hfsa.components._mechanics.sdelta_picture import displaced_joints, feet, joints
from hfsa.components._mechanics.sdelta_robot import THESIS_MACHINE, Robot
from hfsa.components._mechanics.tba_design import DESIGNS, link_length
from hfsa.components._mechanics.tba_picture import limb_points
from hfsa.components.rrr_stage import analyze as analyze_stage
from hfsa.components.rrr_stage import picture as stage_picture
from hfsa.components.sdelta import analyze, picture
from hfsa.components.tba_accelerometer import picture as sensor_picture

TILTED = Posture((10.0, 5.0, 8.0), (0.02, 0.01, 0.155))


def test_limbs_have_the_length_of_the_inverse_kinematics_and_stand_across_their_axes():
    robot = Robot.at(TILTED, "ch4", CUBE, THESIS_MACHINE)
    limbs = joints(robot) - feet(robot)
    np.testing.assert_allclose(np.linalg.norm(limbs, axis=1), analyze(posture=TILTED)["limb_lengths"], rtol=1e-12)
    np.testing.assert_allclose(np.sum(limbs * C_AXES, axis=1), 0, atol=1e-14)


def test_modes_of_the_drawing_have_the_frequencies_and_axes_of_analyze():
    drawing, numbers = picture(posture=TILTED), analyze(posture=TILTED)
    for i, panel in enumerate(drawing.panels[1:7]):
        assert f"{numbers['natural_frequencies_hz'][i]:.4g} Hz" in panel.title
        axis = panel.layers[-1].points
        along = (axis[1] - axis[0]) / np.linalg.norm(axis[1] - axis[0])
        np.testing.assert_allclose(np.abs(along @ numbers["modal_directions"][:, i]), 1, rtol=1e-12)
        offset = axis[0] - (np.array(TILTED.position) + numbers["modal_points_S"][:, i])
        assert np.linalg.norm(np.cross(offset, along)) < 1e-12
    # all modal screws in one panel are those of the modes
    (screws,) = drawing.showing(["modal_screws"]).panels
    for panel, layer in zip(drawing.showing(["modes"]).panels, screws.layers[-6:], strict=True):
        np.testing.assert_array_equal(layer.points, panel.layers[-1].points)


def test_a_displaced_joint_moves_as_a_rigid_body_does():
    robot = Robot.at(TILTED, "ch4", CUBE, THESIS_MACHINE)
    turn = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    shift = displaced_joints(robot, turn) - joints(robot)
    arms = joints(robot) - robot.kinematics.position - robot.offset
    np.testing.assert_allclose(shift[:, 2], 0, atol=1e-15)
    np.testing.assert_allclose(np.sum(shift * arms, axis=1), 0, atol=1e-15)


@given(st.tuples(*[st.floats(-1e-5, 1e-5)] * 3))
def test_links_of_the_stage_keep_their_lengths(elongation):
    A, B, C = moved_hinges(NOMINAL, forward(NOMINAL, elongation))
    np.testing.assert_allclose(np.linalg.norm(B - A, axis=1), NOMINAL.crank, rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(C - B, axis=1), NOMINAL.coupler, rtol=1e-12)


@settings(max_examples=10)
@given(st.tuples(*[st.integers(-10_000, 10_000)] * 3).filter(any))
def test_hinges_have_the_stress_of_analyze(nanometres):
    elongation = tuple(1e-9 * length for length in nanometres)
    numbers = analyze_stage(level="exact", elongation=elongation)
    *_, moved = stage_picture(elongation=elongation).panels
    (layer,) = [layer for layer in moved.layers if layer.values is not None]
    np.testing.assert_allclose(layer.values, list(numbers["hinge_stress"].values()), rtol=1e-9, atol=1e-3)
    assert [note.split(":")[0] for note in layer.notes] == [f"hinge {name}" for name in numbers["hinge_stress"]]


@pytest.mark.parametrize("elongation", [0.0, 5e-324, 1e-310, 1e-25], ids=str)
def test_a_stage_that_hardly_moves_is_drawn_at_rest(elongation):
    assert [panel.title for panel in stage_picture(elongation=(elongation, 0.0, 0.0)).panels] == ["at rest"]


@pytest.mark.parametrize("limbs", [3, 4, 6], ids=["three", "four", "six"])
@pytest.mark.parametrize("design", DESIGNS, ids=str)
def test_legs_of_the_accelerometer_keep_their_length_and_the_bars_their_direction(design, limbs):
    shape = DESIGNS[design].shape
    h = link_length(shape, limbs)
    home, moved = (limb_points(shape, limbs, h * np.array(shift)) for shift in ([0.0, 0.0], [0.2, -0.15]))
    for points in (home, moved):
        legs = np.diff(points, axis=1)
        np.testing.assert_allclose(np.linalg.norm(legs, axis=-1), h, rtol=1e-12)
        np.testing.assert_allclose(np.diff(points, axis=2), np.diff(home, axis=2), atol=1e-12 * h)
    shift = np.broadcast_to([0.2 * h, -0.15 * h], (limbs, 2, 2))
    np.testing.assert_allclose(moved[:, 2] - home[:, 2], shift, rtol=1e-9)
    np.testing.assert_allclose(moved[:, 0], home[:, 0], atol=0)


def test_the_legs_end_at_sides_of_frame_and_proof_mass():
    shape = DESIGNS["mems"].shape
    points = limb_points(shape, 3, np.zeros(2))
    inradius = 1 / (2 * np.sqrt(3))
    np.testing.assert_allclose(points[0, 0, :, 1], -shape.s * inradius, rtol=1e-12)
    np.testing.assert_allclose(points[0, 2, :, 1], -shape.a * inradius, rtol=1e-12)


def test_what_cannot_be_drawn_is_refused():
    with pytest.raises(ModelError, match="measured"):
        stage_picture(dimensions=Dimensions(kinematics="measured"))
    with pytest.raises(ModelError, match="limbs is 2"):
        sensor_picture(limbs=2)
