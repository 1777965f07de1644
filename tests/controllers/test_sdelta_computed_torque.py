"""Computed torque on the SDelta: its inverse dynamics against Lagrange's equations, its laws, its Bode sentence."""

from functools import cache

import casadi as ca
import numpy as np
import pytest
import scipy.linalg
from scipy.spatial.transform import Rotation

from hfsa.components import ModelError, sdelta
from hfsa.components._mechanics.modes import damping_matrix
from hfsa.components._mechanics.sdelta_direct import direct_kinematics
from hfsa.components._mechanics.sdelta_geometry import SYMMETRIC, Posture
from hfsa.components._mechanics.sdelta_inertia import CUBE, with_payload
from hfsa.components._mechanics.sdelta_kinematics import Kinematics
from hfsa.components._mechanics.sdelta_robot import Machine
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.linearize import linearize
from hfsa.components._modelling.model import Kind
from hfsa.controllers import sdelta_tuning
from hfsa.controllers._sdelta_inverse import robot
from hfsa.controllers.sdelta_computed_torque import sdelta_computed_torque

TILTED = Posture((10.0, 5.0, 8.0), (0.005, 0.003, 0.155))
BODY = with_payload(CUBE)
HOME = Kinematics.at(TILTED).motor_angles
"""Motor angles at the posture, from where the controller counts."""
M_TH = Machine().drive_inertia
KP, KV = (2 * np.pi * 6) ** 2, 2 * 0.7 * 2 * np.pi * 6


# The rigid robot by its energies, without the controller's own equations ----------------------------------------------


def pose_at(motors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Attitude and position of C."""
    Q, a = direct_kinematics(motors, TILTED)
    return Q, a + Q @ BODY.center


def mass_at(motors: np.ndarray) -> np.ndarray:
    """M_rb, (6, 6)."""
    Q, a = direct_kinematics(motors, TILTED)
    T = Kinematics.of(Q, a).jacobian(Q @ BODY.center)
    return M_TH + T.T @ BODY.matrix(Q) @ T


def slopes(function, at: np.ndarray, h: float = 1e-4) -> list[np.ndarray]:
    """Derivatives with respect to each of six coordinates, to the fourth order in h."""
    steps = h * np.eye(6)
    return [
        (8 * (function(at + e) - function(at - e)) - (function(at + 2 * e) - function(at - 2 * e))) / (12 * h)
        for e in steps
    ]


def lagrange(angle, rate, acceleration, gravity) -> np.ndarray:
    """Torques by d/dt (M theta') - theta'^T M theta' / 2 - m g z."""
    of_mass = slopes(mass_at, angle)
    lift = [slope[2] for slope in slopes(lambda motors: pose_at(motors)[1], angle)]
    moving = sum(r * slope for r, slope in zip(rate, of_mass, strict=True))
    forces = [rate @ slope @ rate / 2 for slope in of_mass]
    return mass_at(angle) @ acceleration + moving @ rate - np.array(forces) + BODY.mass * gravity * np.array(lift)


def motion(seed: int):
    """Motor angles off the posture, rates and accelerations that make centrifugal torques of the weight's size."""
    rng = np.random.default_rng(seed)
    home = Kinematics.at(TILTED).motor_angles
    return home + 0.05 * rng.standard_normal(6), 20 * rng.standard_normal(6), 20 * rng.standard_normal(6)


@cache
def inverse_dynamics(model: str) -> ca.Function:
    """(angle, rate, acceleration, gravity) -> torques; angles are absolute here, and count from the posture there."""
    it = robot(model, TILTED, CUBE, Machine(), "test")
    angle, rate, acceleration, gravity = *(ca.SX.sym(name, 6) for name in "abc"), ca.SX.sym("g")
    at = it.at_motors(angle - HOME, rate)
    torque = it.torques(at, acceleration, it.platform_of(at, acceleration), gravity)
    return ca.Function("torque", [angle, rate, acceleration, gravity], [torque])


@pytest.mark.parametrize("seed", range(2))
def test_the_exact_inverse_dynamics_are_lagranges(seed):
    """Tdot, gyroscopic moment and weight included, away from the posture they are written about."""
    angle, rate, acceleration = motion(seed)
    expected = lagrange(angle, rate, acceleration, 9.81)
    found = np.array(inverse_dynamics("exact")(angle, rate, acceleration, 9.81)).ravel()
    np.testing.assert_allclose(found, expected, atol=1e-7 * np.abs(expected).max())
    without = lagrange(angle, 0 * rate, acceleration, 9.81)
    assert np.abs(expected - without).max() > 0.05 * np.abs(expected).max()  # velocities matter here


def test_the_linear_model_is_the_exact_one_to_second_order():
    """The difference from the posture's torque falls with the square of the motion."""
    angle, rate, acceleration = motion(0)
    home = Kinematics.at(TILTED).motor_angles
    error = []
    for size in 0.1 / 2 ** np.arange(4):
        at = (home + size * (angle - home), size * rate, size * acceleration, 0.0)
        exact, linear = (np.array(inverse_dynamics(model)(*at)) for model in ("exact", "linear"))
        error.append(np.abs(exact - linear).max())
    np.testing.assert_allclose(np.log2(np.divide(error[:-1], error[1:])), 2, atol=0.15)


# The laws -------------------------------------------------------------------------------------------------------------


def command(inputs: dict[str, np.ndarray], **arguments) -> np.ndarray:
    """Torques of a continuous controller at inputs by name, ranges as arrays; gravity 9.81. Angles are absolute."""
    model = sdelta_computed_torque(level="continuous", posture=TILTED, **arguments)
    model.set_start("gravity", 9.81)
    values = {q.name: q.start for q in model.of(Kind.INPUT)}
    for name, column in inputs.items():
        stem, tail = name.split("*")
        column = column - HOME if tail in (".measured", ".reference") else column
        values |= {f"{stem}[{i}]{tail}": value for i, value in enumerate(column, 1)}
    out = functions(model).out(0.0, [], [], list(values.values()), [q.start for q in model.of(Kind.PARAMETER)])
    return np.array(out).ravel()[:6]


def in_motors(seed: int) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Inputs of the law on motors, and the accelerations that it demands."""
    (angle, rate, acceleration), rng = motion(seed), np.random.default_rng(seed + 100)
    error, error_rate = 0.1 * rng.standard_normal(6), rng.standard_normal(6)
    inputs = {
        "axis*.measured": angle,
        "axis*.measured_rate": rate,
        "axis*.reference": angle + error,
        "axis*.reference_rate": rate + error_rate,
        "axis*.reference_acceleration": acceleration,
    }
    return inputs, acceleration + KV * error_rate + KP * error


def test_on_motors_a_linear_error_is_left_of_the_rigid_robot():
    inputs, demanded = in_motors(1)
    expected = lagrange(inputs["axis*.measured"], inputs["axis*.measured_rate"], demanded, 9.81)
    np.testing.assert_allclose(command(inputs, model="exact"), expected, rtol=1e-7, atol=1e-8)


@pytest.mark.parametrize("feedback", ["encoder_pose", "measured_pose"])
def test_on_poses_a_linear_error_is_left_of_the_rigid_robot(feedback):
    """Errors of 20 degrees and 5 mm, rotations not about one axis; motion and demand of C worked out here."""
    angle, rate, _ = motion(2)
    rng = np.random.default_rng(7)
    Q0, (Q, c) = TILTED.matrix, pose_at(angle)
    offset = Q @ BODY.center
    S = c - offset
    now = Kinematics.of(Q, S)
    t_S = now.jacobian() @ rate
    t = now.jacobian(offset) @ rate
    error, error_rate = np.array([0.2, -0.25, 0.1, 5e-3, -2e-3, 1e-3]), 0.1 * rng.standard_normal(6)
    wanted_Q = Rotation.from_rotvec(error[:3]).as_matrix() @ Q
    arm, wanted_t = wanted_Q @ BODY.center, t + error_rate
    wanted_S = c + error[3:] - arm
    acceleration = rng.standard_normal(6)  # of S
    omega, alpha = wanted_t[:3], acceleration[:3]
    of_C = acceleration + np.r_[0, 0, 0, np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm))]
    demanded = of_C + KV * error_rate + KP * error

    def rotation(attitude: np.ndarray) -> np.ndarray:
        return Rotation.from_matrix(attitude @ Q0.T).as_rotvec()

    inputs = {
        "reference.rotation*": rotation(wanted_Q),
        "reference.position*": wanted_S - np.array(TILTED.position),
        "reference.angular_velocity*": omega,
        "reference.velocity*": wanted_t[3:] - np.cross(omega, arm),
        "reference.angular_acceleration*": alpha,
        "reference.acceleration*": acceleration[3:],
    }
    if feedback == "encoder_pose":
        inputs |= {"axis*.measured": angle, "axis*.measured_rate": rate}
    else:
        inputs |= {
            "measured.rotation*": rotation(Q),
            "measured.position*": S - np.array(TILTED.position),
            "measured.angular_velocity*": t_S[:3],
            "measured.velocity*": t_S[3:],
        }
    bias = sum(r * s for r, s in zip(rate, slopes(lambda m: twist_at(m, rate), angle), strict=True))
    motors = np.linalg.solve(now.jacobian(offset), demanded - bias)
    expected = lagrange(angle, rate, motors, 9.81)
    np.testing.assert_allclose(command(inputs, model="exact", feedback=feedback), expected, rtol=1e-6, atol=1e-7)


def twist_at(motors: np.ndarray, rate: np.ndarray) -> np.ndarray:
    """Twist of C, (6,)."""
    Q, a = direct_kinematics(motors, TILTED)
    return Kinematics.of(Q, a).jacobian(Q @ BODY.center) @ rate


def test_motors_and_poses_are_one_law_where_the_model_is_linear():
    inputs, _ = in_motors(3)
    now = Kinematics.at(TILTED)
    T, home = now.jacobian(), now.motor_angles

    def of_pose(terminal: str) -> dict[str, np.ndarray]:
        """A motion of the motors as one of S."""
        words = [("rotation", "position"), ("angular_velocity", "velocity"), ("angular_acceleration", "acceleration")]
        found = {}
        for (turn, move), order in zip(words, ("", "_rate", "_acceleration"), strict=True):
            if (column := inputs.get(f"axis*.{terminal}{order}")) is not None:
                pose = T @ (column if order else column - home)
                found |= {f"{terminal}.{turn}*": pose[:3], f"{terminal}.{move}*": pose[3:]}
        return found

    expected = command(inputs)
    encoders = {name: column for name, column in inputs.items() if "measured" in name}
    collocated = command({**encoders, **of_pose("reference")}, feedback="encoder_pose")
    measured = command({**of_pose("measured"), **of_pose("reference")}, feedback="measured_pose")
    np.testing.assert_allclose(collocated, expected, rtol=1e-10)
    np.testing.assert_allclose(measured, expected, rtol=1e-10)


def test_bode_sentence():
    """Flat at -Kp M_rb and -Kv M_rb; and the weight is held at rest."""
    system = linearize(sdelta_computed_torque(level="continuous", posture=TILTED))
    tuning = sdelta_tuning.analyze(posture=TILTED)
    rows = [system.output_labels.index(f"axis[{i}]/command") for i in range(1, 7)]
    assert system.nstates == 0
    for signal, gain in (("measured", -KP), ("measured_rate", -KV), ("reference_acceleration", 1.0)):
        columns = [system.input_labels.index(f"axis[{i}]/{signal}") for i in range(1, 7)]
        expected = gain * tuning["motor_inertia"]
        np.testing.assert_allclose(
            np.asarray(system.D)[np.ix_(rows, columns)], expected, atol=1e-12 * np.abs(expected).max()
        )
    for model in ("linear", "exact"):
        np.testing.assert_allclose(command({}, model=model), tuning["holding_torque"], rtol=1e-9)


def test_why_a_measured_pose_bears_so_little():
    """In every mode of free motors, v = [theta; x] with v^T M v = 1, theta^T M_rb T^-1 x is -1.

    So the loop takes 2 z w_c from each mode's damping 2 zeta_k omega_k, and the first to lose all of it is at 47.7 Hz.
    """
    numbers, tuning = sdelta.analyze(), sdelta_tuning.analyze()
    offset = BODY.center
    T = Kinematics.at(SYMMETRIC).jacobian(offset)
    M, K = numbers["mass_C"], numbers["stiffness_C"]
    join = np.hstack([-T, np.eye(6)])
    squares, modes = scipy.linalg.eigh(join.T @ K @ join, scipy.linalg.block_diag(M_TH, M))
    flexible = squares > 1.0
    omega, (theta, x) = np.sqrt(squares[flexible]), np.vsplit(modes[:, flexible], 2)
    products = np.einsum("ik,ij,jk->k", theta, tuning["motor_inertia"] @ np.linalg.inv(T), x)
    np.testing.assert_allclose(products, -1, rtol=1e-9)
    damping = join.T @ (0.01 * damping_matrix(M, K)) @ join
    ratios = np.einsum("ik,ij,jk->k", modes[:, flexible], damping, modes[:, flexible]) / (2 * omega)
    np.testing.assert_allclose(omega[[0, 2, 3, 5]] / (2 * np.pi), [47.70929, 95.00686, 129.88789, 164.05113], atol=1e-5)
    np.testing.assert_allclose(ratios[[0, 2, 3, 5]], [0.019613, 0.038707, 0.015205, 0.010184], atol=1e-6)
    assert (ratios * omega).min() / 0.7 / (2 * np.pi) == pytest.approx(1.33676, abs=1e-5)


def test_mistakes_are_named():
    with pytest.raises(ModelError, match="sdelta_computed_torque: feedback is 'pose'; did you mean"):
        sdelta_computed_torque(feedback="pose")  # type: ignore[arg-type]
    with pytest.raises(ModelError, match="sdelta_computed_torque: model is 'liner'; did you mean linear"):
        sdelta_computed_torque(model="liner")  # type: ignore[arg-type]
    with pytest.raises(ModelError, match="is singular"):
        sdelta_computed_torque(posture=Posture((90.0, 0.0, 0.0)))
    with pytest.raises(ModelError, match="delay is one sample time"):
        sdelta_computed_torque(level="continuous", delay=True)
