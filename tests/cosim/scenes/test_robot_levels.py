"""Levels of the robot in a scene: the FMUs' linear and swept responses against the matrices of the machine."""

import numpy as np
import pytest

from hfsa.components._mechanics.screws import shift
from hfsa.components._mechanics.sdelta_generalized import generalized_modes, mass_matrix
from hfsa.components._mechanics.sdelta_geometry import Geometry, Posture
from hfsa.components._mechanics.sdelta_inertia import CUBE
from hfsa.components._mechanics.sdelta_kinematics import Mechanism, Transmission
from hfsa.components._mechanics.sdelta_robot import Machine, Robot
from hfsa.components._mechanics.sdelta_stiffness import Rods
from hfsa.cosim import sweep

POSTURE = {"posture.rotation": (10, 5, 8), "posture.position": (0.005, 0.003, 0.155)}
OWN = {"geometry.base_radius": 0.48, "rods.diameter": 0.013, "gear": 5.0, "pitch": 0.05}


def by_matrices(frequency: np.ndarray) -> np.ndarray:
    """Response of the pose of S to its command at level `generalized`, (frequencies, 6, 6), in physical coordinates."""
    machine = Machine(Mechanism(Geometry(base_radius=0.48), Transmission(0.05, 5.0)), Rods(diameter=0.013))
    robot = Robot.at(Posture((10, 5, 8), (0.005, 0.003, 0.155)), "ch3_full", CUBE, machine)
    M, K = mass_matrix(robot), np.diag(1 / robot.springs.compliance)
    omega, shapes = generalized_modes(robot, M)
    D = M @ shapes @ np.diag(2 * 0.01 * omega) @ shapes.T @ M
    motors = np.vstack([np.linalg.inv(robot.kinematics.jacobian()), np.zeros((6, 6))])
    to_S = shift(-robot.offset)
    found = []
    for s in 2j * np.pi * frequency:
        relative = np.linalg.solve(M * s**2 + D * s + K, -(s**2) * M @ motors)
        found.append(np.linalg.inv(to_S) @ robot.of_limbs @ (relative + motors))
    return np.array(found)


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    folder = tmp_path_factory.mktemp("levels")
    arguments = {**POSTURE, **OWN, "robot": "generalized", "stiffness": "ch3_full"}

    def swept(method: str, **options):
        options = {"low": 2.0, "high": 120.0, "points": 8, "warn": lambda _: None, **options}
        return sweep("sdelta_shaker", arguments, method=method, path=folder / f"{method}.h5", **options)

    return swept


def test_the_linear_response_of_the_fmus_is_the_matrix_formula(measured):
    bode = measured("linear")
    exact = by_matrices(bode.frequency)
    error = np.abs(bode.response - exact).max(axis=0) / np.abs(exact).max(axis=0)
    assert error.max() < 1e-9


def test_the_swept_response_errs_little_at_a_small_step(measured):
    bode = measured("stepped", inputs=["command.position[1]"], low=5.0, high=60.0, points=4)
    exact = by_matrices(bode.frequency)[:, :, 3:4]
    size = np.abs(exact).max(axis=1, keepdims=True)
    assert np.abs((bode.response - exact) / size).max() < 2e-4
