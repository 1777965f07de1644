"""The robot on its motors, free and under control, from the linearised FMUs: resonances, zeros, passivity.

Numbers and laws are those of the elastic robot with motor motion: coordinates [theta; x at C], inertia of the drives
M_th, T from motor angles to the pose of C.
"""

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from published_probes.sdelta_motion import sdelta_free_motors

from hfsa.components import sdelta
from hfsa.components._mechanics.sdelta_robot import Machine
from hfsa.controllers import sdelta_tuning
from hfsa.cosim.assembly.build import build
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.fmi.co_simulation import open_instances
from hfsa.cosim.linear.linearize import Linearization, linearize
from hfsa.cosim.systems.system import System

MOTORS = [f"drive[{j}].motor[{i}]" for j in (1, 2, 3) for i in (1, 2)]


def free_motors(stiffness: str = "ch4", damping: float = 0.0) -> Linearization:
    """Return torques to motor angles, then speeds, without a controller."""
    scene = load_scene("sdelta_hfsa", {"stiffness": stiffness, "damping": str(damping)})
    gone = {"controller", "reference"}
    inner = [c for c in scene.system.connections if not {scene.system.split(e)[0] for e in (c.start, c.end)} & gone]
    system = System([c for c in scene.system.components if c.name not in gone], inner)
    with open_instances(build(system).files) as instances:
        outputs = [f"{motor}.{kind}" for kind in ("angle", "speed") for motor in MOTORS]
        return linearize(system, instances, [f"{motor}.torque" for motor in MOTORS], outputs)


@pytest.fixture(scope="module")
def damped() -> Linearization:
    return free_motors(damping=0.01)


def second_order(linear: Linearization) -> np.ndarray:
    """Return -M^-1 K on [theta; x at C], (12, 12), of an undamped robot."""
    angles = [f"{motor.replace('motor', 'shaft')}.angle" for motor in MOTORS]
    poses = [f"robot.center.{kind}[{i}]" for kind in ("rotation", "position") for i in (1, 2, 3)]
    rates = [name.replace("angle", "speed") for name in angles]
    rates += [n.replace("rotation", "angular_velocity").replace("position", "velocity") for n in poses]
    rows, columns = ([linear.states.index(n) for n in names] for names in (rates, [*angles, *poses]))
    return linear.A[np.ix_(rows, columns)]


def numbers() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return M_th, M and T at the symmetric posture."""
    robot = sdelta.analyze()
    to_S = np.eye(6)
    to_S[3, 1], to_S[4, 0] = -0.12675 / 4.4857, 0.12675 / 4.4857
    T = np.linalg.solve(to_S, robot["jacobian"])
    return Machine().drive_inertia, robot["mass_C"], T


@pytest.mark.parametrize("stiffness", ["ch4", "ch4_full", "ch3_full"])
def test_resonances_with_free_motors(stiffness):
    """Six flexible modes, and six of rigid motion at 0 Hz."""
    squares = np.sort(-np.linalg.eigvals(second_order(free_motors(stiffness))).real)
    assert np.abs(squares[:6]).max() < 1e-6 * squares[6]
    np.testing.assert_allclose(np.sqrt(squares[6:]) / (2 * np.pi), sdelta_free_motors(stiffness, True), rtol=1e-9)


def test_zeros_from_torques_to_motor_angles_are_the_locked_modes(damped):
    A, B, C = damped.A, damped.B, damped.C[:6]
    scale = np.sqrt(np.abs(A).max())
    pencil = np.block([[A / scale, B], [C, np.zeros((6, 6))]])
    zeros = scipy.linalg.eig(pencil, scipy.linalg.block_diag(np.eye(24), np.zeros((6, 6))), right=False)
    # those at infinity come out as very large numbers
    zeros = zeros[np.isfinite(zeros) & (np.abs(zeros) < 1e5 / scale)] * scale
    omega = 2 * np.pi * sdelta.analyze()["natural_frequencies_hz"]
    expected = omega * (-0.01 + 1j * np.sqrt(1 - 0.01**2))
    upper = zeros[zeros.imag > 1]
    assert len(upper) == 6
    upper = upper[np.argsort(upper.imag)]
    np.testing.assert_allclose(upper, expected, rtol=1e-6)


def test_a_flexible_mode_of_free_motors_moves_them_against_the_rigid_body():
    """theta^T M_rb T^-1 x = -1 of every mass-normalised mode, by which a loop over the measured pose takes damping."""
    M_th, M, T = numbers()
    squares, shapes = np.linalg.eig(-second_order(free_motors("ch4")))
    flexible = squares.real > (2 * np.pi) ** 2
    assert flexible.sum() == 6
    inertia = scipy.linalg.block_diag(M_th, M)
    M_rb = M_th + T.T @ M @ T
    modes = shapes[:, flexible].real
    modes, _ = np.linalg.qr(scipy.linalg.sqrtm(inertia).real @ modes)  # within a double frequency any basis will do
    modes = np.linalg.solve(scipy.linalg.sqrtm(inertia).real, modes)
    found = np.sum(modes[:6] * (M_rb @ np.linalg.solve(T, modes[6:])), axis=0)
    np.testing.assert_allclose(found, -1, rtol=1e-6)


def test_motors_and_robot_are_passive(damped):
    """Torques on the motors never give energy back on the whole: the Hermitian part of torque to speed is positive."""
    for f in np.concatenate([np.geomspace(0.1, 1e4, 60), sdelta_free_motors("ch4", True)]):
        G = damped.response(np.array([f]), [(i, -1, -1) for i in range(6)])[0, 6:]
        assert np.linalg.eigvalsh(G + G.conj().T).min() > -1e-9 * np.abs(G).max()


gains = st.lists(st.floats(-3, 4), min_size=6, max_size=6)


@given(proportional=gains, derivative=gains)
@settings(max_examples=60)
def test_continuous_pd_is_stable_whatever_its_gains(damped, proportional, derivative):
    """Collocated and passive; crossing the first resonance only locks the motors."""
    angle, speed = damped.C[:6], damped.C[6:]
    feedback = 10.0 ** np.array(proportional)[:, None] * angle + 10.0 ** np.array(derivative)[:, None] * speed
    poles = np.linalg.eigvals(damped.A - damped.B @ feedback)
    assert poles.real.max() < 1e-12 * np.abs(poles).max()


@pytest.mark.parametrize(
    ("bandwidth", "abscissa", "damping"),
    [(6, -8.57, 0.0145), (23.6, -20.87, 0.0204), (50, -6.80, 0.0184), (100, -2.34, 0.0142), (200, -1.59, 0.0108)],
)
def test_poles_under_continuous_pd(damped, bandwidth, abscissa, damping):
    tuning = sdelta_tuning.analyze(bandwidth=float(bandwidth))
    feedback = tuning["proportional_gain"][:, None] * damped.C[:6] + tuning["derivative_gain"][:, None] * damped.C[6:]
    poles = np.linalg.eigvals(damped.A - damped.B @ feedback)
    assert poles.real.max() == pytest.approx(abscissa, abs=0.006)
    assert (-poles.real / np.abs(poles)).min() == pytest.approx(damping, abs=6e-5)


def test_every_free_flexible_mode_sees_the_rigid_inertia_as_minus_one():
    """theta^T M_rb T^-1 x = -1 for a mode [theta; x] of unit modal mass."""
    M_th, M, T = numbers()
    squares, modes = np.linalg.eig(second_order(free_motors()))
    M_rb = M_th + T.T @ M @ T
    np.testing.assert_allclose(M_rb, sdelta_tuning.analyze()["motor_inertia"], rtol=1e-12, atol=1e-12)
    flexible = np.argsort(squares.real)[:6]
    for mode in modes[:, flexible].T.real:
        theta, x = mode[:6], mode[6:]
        mass = theta @ M_th @ theta + x @ M @ x
        assert theta @ M_rb @ np.linalg.solve(T, x) / mass == pytest.approx(-1, rel=1e-9)
