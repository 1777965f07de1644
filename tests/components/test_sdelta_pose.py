"""Direct kinematics of the SDelta: the pose that its motors reach, in the assembly in which they start."""

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, reject, settings
from hypothesis import strategies as st
from random_postures import numbers_in
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from hfsa.components import ModelError
from hfsa.components._mechanics.sdelta_direct import follow_motors
from hfsa.components._mechanics.sdelta_geometry import SYMMETRIC, Geometry, Posture
from hfsa.components._mechanics.sdelta_kinematics import Kinematics, Mechanism
from hfsa.components.sdelta import analyze as analyze_sdelta
from hfsa.components.sdelta_pose import analyze

few = settings(max_examples=18, suppress_health_check=[HealthCheck.too_slow], deadline=None)
HOME = Kinematics.at(SYMMETRIC)


@st.composite
def wide_postures(draw) -> Kinematics:
    """Postures within 30 degrees, 60 mm sideways and 80 to 220 mm of height, whatever their assembly."""
    rotation, place, height = (
        draw(numbers_in(-30, 30, 3)),
        draw(numbers_in(-0.06, 0.06, 2)),
        draw(st.floats(0.08, 0.22)),
    )
    try:
        found = Kinematics.at(Posture(tuple(rotation), (*place, height)))
    except ModelError:
        reject()
    assume(found.condition_number < 500)
    return found


def integrated_home(there: Kinematics) -> Kinematics | None:
    """Where the differential kinematics lead as all motors turn to 0 evenly; nothing if they meet a singularity."""
    motors = there.motor_angles

    def pose(y: np.ndarray) -> Kinematics:
        return Kinematics.of((Rotation.from_rotvec(y[:3]) * Rotation.from_matrix(there.Q)).as_matrix(), y[3:])

    def rate(_s: float, y: np.ndarray) -> np.ndarray:
        twist = -pose(y).jacobian() @ motors
        # from angular velocity to the rate of the rotation vector
        v, angle = y[:3], np.linalg.norm(y[:3])
        if angle < 1e-6:
            return np.concatenate([twist[:3] - np.cross(v, twist[:3]) / 2, twist[3:]])
        b = (1 - angle / 2 / np.tan(angle / 2)) / angle**2
        return np.concatenate(
            [twist[:3] - np.cross(v, twist[:3]) / 2 + b * np.cross(v, np.cross(v, twist[:3])), twist[3:]]
        )

    try:
        found = solve_ivp(rate, (0, 1), np.concatenate([np.zeros(3), there.position]), rtol=1e-9, atol=1e-11)
    except ModelError:
        return None
    # an integrator may step over a singularity, where det N changes its sign
    passed = [pose(y) for y in found.y.T]
    is_regular = found.success and all(p.determinant * there.determinant > 0 for p in passed)
    return passed[-1] if is_regular else None


@given(wide_postures())
@few
def test_the_pose_of_the_motor_angles_is_the_posture_if_it_is_connected(there):
    """By integration back to the symmetric posture; otherwise a sentence, or the pose of the other assembly."""
    back = integrated_home(there)
    is_connected = back is not None and np.abs(back.position - HOME.position).max() < 1e-4
    is_connected = is_connected and np.abs(back.Q - np.eye(3)).max() < 1e-4
    try:
        found = follow_motors(there.motor_angles)
    except ModelError as error:
        refusal = str(error)
    else:
        refusal = ""
    if refusal:
        assert not is_connected
        assert "% of the way" in refusal
        return
    np.testing.assert_allclose(found.kinematics.limbs.slide, there.limbs.slide, atol=1e-12)
    np.testing.assert_allclose(np.exp(1j * found.kinematics.limbs.angle), np.exp(1j * there.limbs.angle), atol=1e-11)
    assert np.all(found.determinants * HOME.determinant > 0)
    assert np.all(np.diff(found.shares) > 0)
    assert (found.shares[0], found.shares[-1]) == (0, 1)
    is_there = np.abs(found.kinematics.position - there.position).max() < 1e-10
    assert is_there == is_connected
    if there.determinant * HOME.determinant < 0:
        assert not is_there


@given(wide_postures())
@few
def test_a_start_close_by_gives_the_posture_in_any_assembly(there):
    near = Posture(there.Q, tuple(there.position + np.array([1e-4, -1e-4, 5e-5])))
    found = follow_motors(there.motor_angles, near)
    np.testing.assert_allclose(found.kinematics.Q, there.Q, atol=1e-10)
    np.testing.assert_allclose(found.kinematics.position, there.position, atol=1e-10)


def test_a_singularity_on_the_way_is_refused():
    """At 86.6 mm sideways the robot is singular: a posture beyond it is in another assembly."""
    beyond = Kinematics.at(Posture(position=(0.12, 0, 0.15)))
    assert beyond.determinant * HOME.determinant < 0
    with pytest.raises(ModelError, match=r"of the way the robot is singular, with the condition number"):
        follow_motors(np.array([0, 0, 0, 0, 60, 60]))
    numbers = analyze_sdelta(posture=Posture(position=(0.12, 0, 0.15)))
    assert numbers["assembly"].startswith("another one")


def test_the_end_of_a_tubes_travel_is_named():
    """Half a side of a base of 0.1 m is 86.6 mm, where 9.07 rad of a pair of motors in opposite directions lead."""
    small = Mechanism(Geometry(base_radius=0.1, platform_radius=0.2))
    with pytest.raises(ModelError, match=r"11\.3 % of the way a tube is at the end of its side"):
        follow_motors(np.array([80.0, -80, 80, -80, 80, -80]), SYMMETRIC, small)
    assert 80 * 0.113 * 0.060 / (2 * np.pi) == pytest.approx(np.sqrt(3) / 2 * 0.1, rel=5e-3)


def test_the_analysis_undoes_that_of_the_robot():
    posture = Posture((10, 5, 8), (0.005, 0.003, 0.155))
    motors = analyze_sdelta(level="rigid", posture=posture)["motor_angles"]
    found = analyze(motors=tuple(motors))
    np.testing.assert_allclose(np.rad2deg(found["rotation"]), posture.rotation, atol=1e-10)
    np.testing.assert_allclose(found["position"], posture.position, atol=1e-13)
    assert found["posture"] == "-p posture.rotation=10,5,8 -p posture.position=0.005,0.003,0.155"
    assert found["assembly"].startswith("that of the symmetric posture")
    ends = [HOME.condition_number, found["condition_number"]]
    np.testing.assert_allclose(found["path_condition_numbers"][[0, -1]], ends, rtol=1e-12)


@pytest.mark.parametrize("motors", [(0.0,) * 5, (0.0,) * 5 + (np.nan,)], ids=["five", "nan"])
def test_motor_angles_that_are_none_are_refused(motors):
    with pytest.raises(ModelError, match="expected six finite numbers"):
        analyze(motors=motors)
