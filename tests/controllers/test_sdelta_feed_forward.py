"""Feed-forward of the SDelta: the inverse of its model on springs, which tends to that of the rigid robot."""

import numpy as np
import pytest
from robot_response import POSE as PLATFORM
from robot_response import Response

from hfsa.components import ModelError
from hfsa.components._mechanics.sdelta_geometry import Posture
from hfsa.components._mechanics.sdelta_kinematics import Kinematics
from hfsa.components._mechanics.sdelta_robot import Machine
from hfsa.components._mechanics.sdelta_stiffness import Rods
from hfsa.components._modelling.linearize import linearize
from hfsa.components.sdelta import analyze, sdelta
from hfsa.controllers import sdelta_tuning
from hfsa.controllers.sdelta_feed_forward import sdelta_feed_forward

TILTED = Posture((10.0, 5.0, 8.0), (0.005, 0.003, 0.155))
POSE = [f"rotation[{i}]" for i in (1, 2, 3)] + [f"position[{i}]" for i in (1, 2, 3)]
ORDERS = ("", "_rate", "_acceleration", "_jerk")


def response(frequency: float, outputs: list[str], **arguments) -> np.ndarray:
    """Sinusoids at the six commands to outputs, (outputs, 6)."""
    system = linearize(sdelta_feed_forward(**arguments))
    s = 2j * np.pi * frequency
    H = np.atleast_2d(system(s))[[system.output_labels.index(name.replace(".", "/")) for name in outputs]]
    found = np.zeros((len(outputs), 6), complex)
    for order, word in enumerate(ORDERS):
        names = [f"command/{name.replace('[', f'{word}[')}" for name in POSE]
        found += s**order * H[:, [system.input_labels.index(name) for name in names]]
    return found


NOMINAL = [f"nominal.{name}" for name in POSE]
TORQUE = [f"motor[{i}].torque" for i in range(1, 7)]


def test_rigid_feed_forward_is_the_motors_inertia():
    frequency, T = 3.0, Kinematics.at(TILTED).jacobian()
    omega = 2 * np.pi * frequency
    found = response(frequency, TORQUE, level="rigid", posture=TILTED)
    inertia = sdelta_tuning.analyze(posture=TILTED)["motor_inertia"]
    expected = -(omega**2) * inertia @ np.linalg.inv(T)
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_allclose(response(frequency, NOMINAL, level="rigid"), np.eye(6), atol=1e-12)


def test_elastic_feed_forward_tends_to_rigid_with_one_over_stiffness():
    """Both the pose that the motors dictate and their torque."""
    error = []
    for factor in 100.0 * 2 ** np.arange(4):
        rods = Rods(tip_stiffness=factor * 1.778e5)
        elastic, rigid = (
            response(10.0, NOMINAL + TORQUE, level=level, machine=Machine(rods=rods)) for level in ("elastic", "rigid")
        )
        error.append(np.abs(elastic - rigid).max(axis=1))
    orders = np.log2(np.divide(error[:-1], error[1:]))
    np.testing.assert_allclose(orders, 1, atol=0.02)


def test_angles_are_those_of_the_nominal_pose_and_of_its_derivatives():
    s, T = 2j * np.pi * 20.0, Kinematics.at(TILTED).jacobian()
    nominal = response(20.0, NOMINAL, posture=TILTED)
    for order, word in enumerate(("", "_rate", "_acceleration")):
        motors = response(20.0, [f"motor[{i}].angle{word}" for i in range(1, 7)], posture=TILTED)
        expected = s**order * np.linalg.solve(T, nominal)
        np.testing.assert_allclose(motors, expected, atol=1e-9 * np.abs(expected).max())


def test_bode_sentence():
    """0 dB at first, an antiresonance of -34 dB where the platform resonates, 20 dB per decade in the end."""
    levels = {f: 20 * np.log10(np.abs(response(f, ["nominal.position[3]"])[0, 5])) for f in (0.1, 24.545, 3e4, 3e5)}
    assert levels[0.1] == pytest.approx(0, abs=0.01)
    assert levels[24.545] == pytest.approx(-34, abs=0.2)
    assert levels[3e5] - levels[3e4] == pytest.approx(20, abs=0.5)


def test_the_weight_lifts_the_nominal_pose_by_the_sag():
    model = sdelta_feed_forward()
    model.set_start("gravity", 9.81)
    from hfsa.components._modelling.functions import functions
    from hfsa.components._modelling.model import Kind

    columns = [[q.start for q in model.of(kind)] for kind in (Kind.STATE, Kind.INPUT, Kind.PARAMETER)]
    found = np.array(functions(model).out(0.0, columns[0], [], *columns[1:])).ravel()
    out = dict(zip([q.name for q in model.of(Kind.OUTPUT)], found, strict=True))
    assert out["nominal.position[3]"] == pytest.approx(4.4857 * 9.81 / analyze()["stiffness_C"][5, 5], rel=1e-9)
    holding = sdelta_tuning.analyze()["holding_torque"]
    np.testing.assert_allclose([out[name] for name in TORQUE], holding, rtol=1e-9)


def test_mistakes_are_named():
    with pytest.raises(ModelError, match="sdelta_feed_forward: level is 'elastik'; did you mean elastic"):
        sdelta_feed_forward(level="elastik")  # type: ignore[arg-type]
    with pytest.raises(ModelError, match=r"damping_ratio is 0 1, expected 1e-05 to inf"):
        sdelta_feed_forward().set_start("damping_ratio", 0.0)


def test_elastic_feed_forward_inverts_a_robot_with_rayleigh_damping():
    """Its nominal pose, put into the robot of the same damping, gives the command."""
    s, T = 2j * np.pi * 30.0, Kinematics.at(TILTED).tubes_to_pose()
    nominal = response(30.0, NOMINAL, posture=TILTED, damping_model="rayleigh")
    robot = Response(sdelta(posture=TILTED, damping_model="rayleigh"))
    np.testing.assert_allclose(robot.from_pose(s, PLATFORM, T) @ nominal, np.eye(6), atol=1e-9)
