"""Paths of the stage: elongations that bring it to the poses of a table or a circle, with their exact derivatives."""

import re

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hfsa.components import ModelError
from hfsa.components._mechanics.rrr_kinematics import forward, links
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.model import Kind
from hfsa.components._modelling.motion_table import MotionTable
from hfsa.components.pose_table import pose_table
from hfsa.components.stage_path import stage_path

POSES = np.array([[0, 0, 0], [1e-6, -0.5e-6, -3e-4], [2e-6, 1e-6, -5e-4], [0.5e-6, 2e-6, -4e-4], [0, 0, -2e-4]])


def table(rows: np.ndarray, *names: str) -> MotionTable:
    columns = {"time": np.arange(len(rows)) * 0.1, **dict(zip(names, np.transpose(rows), strict=True))}
    return MotionTable({name: tuple(v.tolist()) for name, v in columns.items()})


def outputs(model):
    """Time -> outputs by name, as one column with derivatives, and the names."""
    out = functions(model).out
    parameters = [q.start for q in model.of(Kind.PARAMETER)]
    t = ca.MX.sym("t")
    return ca.Function("path", [t], [out(t, ca.DM(0, 1), ca.DM(0, 1), ca.DM(0, 1), parameters)]), [
        q.name for q in model.of(Kind.OUTPUT)
    ]


def at(model, time: float, ending: str) -> np.ndarray:
    """Values of the outputs of a name without indices, such as `stack.elongation`."""
    values, names = outputs(model)
    found = np.array(values(time)).ravel()
    return np.array([v for v, name in zip(found, names, strict=True) if re.sub(r"\[\d\]", "", name) == ending])


@pytest.mark.parametrize("kinematics", ["nominal", "calibrated"])
@pytest.mark.parametrize("time", [0.05, 0.13, 0.2, 0.37])
def test_the_stage_reaches_the_pose_between_the_rows_too(kinematics, time):
    """Forward kinematics by Newton's method, another way than the closed form of the reference."""
    model = stage_path(motion=table(POSES, "x", "y", "yaw"), kinematics=kinematics)
    pose = np.append(at(model, time, "platform.position"), at(model, time, "platform.rotation"))
    assert forward(links(kinematics), at(model, time, "stack.elongation")) == pytest.approx(pose, abs=1e-16)


@pytest.mark.parametrize("name", ["table", "circle"])
@pytest.mark.parametrize("time", [0.013, 0.117, 0.24, 0.31])
def test_rates_and_accelerations_are_the_derivatives(name, time):
    """Against differences of a far smaller step, not against the derivatives of the same expressions."""
    model = stage_path(motion=table(POSES, "x", "y", "yaw") if name == "table" else "circle")
    values, names = outputs(model)
    h = 1e-4
    past, now, next_ = (np.array(values(time + k * h)).ravel() for k in (-1, 0, 1))
    by_name = dict(zip(names, zip(past, now, next_, strict=True), strict=True))
    for i in (1, 2, 3):
        value, rate, acceleration = (by_name[f"stack[{i}].elongation{o}"] for o in ("", "_rate", "_acceleration"))
        assert rate[1] == pytest.approx((value[2] - value[0]) / (2 * h), rel=1e-4, abs=1e-10)
        assert acceleration[1] == pytest.approx((rate[2] - rate[0]) / (2 * h), rel=1e-4, abs=1e-8)


def test_a_circle_is_round_from_the_second_turn_on_and_begins_at_rest():
    model = stage_path(radius=3e-6, centre=(1e-6, 0.5e-6, -8e-4))
    for time in np.linspace(0.2, 0.4, 9):  # 5 turns per second
        position = at(model, time, "platform.position") - [1e-6, 0.5e-6]
        assert np.hypot(*position) == pytest.approx(3e-6, rel=1e-12)
        angle = 2 * np.pi * 5 * time
        assert position == pytest.approx(3e-6 * np.array([np.cos(angle), np.sin(angle)]), abs=1e-17)
        assert at(model, time, "platform.rotation")[0] == pytest.approx(-8e-4, rel=1e-13)
    for order in ("", "_rate", "_acceleration"):
        assert np.all(at(model, 0.0, f"stack.elongation{order}") == 0)


@settings(max_examples=8)
@given(st.lists(st.tuples(*[st.floats(0, 12e-6)] * 3), min_size=2, max_size=5))
def test_a_path_of_poses_is_that_of_their_elongations_at_the_rows(rows):
    """Poses from forward kinematics; between the rows the two differ, as one spline is of poses, one of elongations."""
    poses = [forward(links("nominal"), row) for row in rows]
    by_pose = stage_path(motion=table(np.array(poses), "x", "y", "yaw"))
    direct = stage_path(motion=table(np.array(rows), "elongation_1", "elongation_2", "elongation_3"))
    for k, row in enumerate(rows):
        for model in (by_pose, direct):
            assert at(model, 0.1 * k, "stack.elongation") == pytest.approx(row, abs=1e-15)


def test_a_jacobian_takes_the_place_of_the_links():
    J = (1.9, 1.3, -3.2, 2.6, -2.9, 0.3, -60.0, -60.0, -60.0)
    model = stage_path(motion=table(POSES, "x", "y", "yaw"), jacobian=J)
    pose = np.append(at(model, 0.13, "platform.position"), at(model, 0.13, "platform.rotation"))
    assert np.reshape(J, (3, 3)) @ at(model, 0.13, "stack.elongation") == pytest.approx(pose, rel=1e-12)


WRONG = {
    "columns": (POSES[:, :2], ("x", "y"), "the table has the columns x, y, expected x, y, yaw, or elongation_1, "),
    "reach": (np.array([[0, 0, 0], [1e-2, 0, 0]]), ("x", "y", "yaw"), "row 2, 0.1 s: pose 0.01 m, 0 m, 0 rad is out"),
    "stroke": (
        np.array([[0, 0, 0], [5e-6, 0, 0]]), ("x", "y", "yaw"),
        r"row 2, 0.1 s: pose 5e-06 m, 0 m, 0 rad needs elongations of 0.605, 0.418, -1.024 um, expected 0 to 16 um",
    ),
    "direct": (
        np.array([[0, 0, 0], [0, 17e-6, 0]]), ("elongation_1", "elongation_2", "elongation_3"),
        "row 2, 0.1 s: elongations of 0.000, 17.000, 0.000 um, expected 0 to 16 um, the free stroke",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("rows", "names", "message"), WRONG.values(), ids=WRONG.keys())
def test_a_row_that_cannot_be_is_named(rows, names, message):
    with pytest.raises(ModelError) as caught:
        stage_path(motion=table(rows, *names))
    assert message in str(caught.value)


def test_a_circle_out_of_reach_is_named_by_its_angle():
    with pytest.raises(
        ModelError, match=r"the circle at 0 degrees: pose .* needs elongations of .* expected 0 to 16 um"
    ):
        stage_path(radius=60e-6)
    with pytest.raises(ModelError, match=r"motion is 'square', expected circle or the path of a \.csv file"):
        stage_path(motion="square")  # type: ignore[arg-type]


def test_the_pose_of_a_robot_has_the_columns_that_are_given():
    rows = np.array([[0, 0], [1e-3, 2e-3], [0, 1e-3]])
    values, names = outputs(pose_table(table=table(rows, "z", "rotation_x")))
    found = dict(zip(names, np.array(values(0.1)).ravel(), strict=True))
    assert (found["position[3]"], found["rotation[1]"]) == pytest.approx((1e-3, 2e-3), rel=1e-14)
    others = {name: v for name, v in found.items() if "position[3]" not in name and "rotation[1]" not in name}
    assert not any(v for name, v in others.items() if not name.endswith(("[3]", "[1]")))
    with pytest.raises(ModelError, match="the table has the columns yaw, expected some of x, y, z, rotation_x"):
        pose_table(table=table(rows, "x", "yaw"))
