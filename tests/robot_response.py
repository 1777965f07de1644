"""Frequency response of the robot between lists of its ports, at a posture without symmetry."""

import numpy as np

from hfsa.components import Model
from hfsa.components._mechanics.sdelta_geometry import Posture
from hfsa.components._modelling.linearize import linearize

A = Posture((10, 5, 8), (0.005, 0.003, 0.155))
AXES = range(1, 4)
POSE = [f"platform/{kind}[{i}]" for kind in ("rotation", "position") for i in AXES]
TWIST = [f"platform/{kind}[{i}]" for kind in ("angular_velocity", "velocity") for i in AXES]
ACCELERATION = [f"platform/{kind}[{i}]" for kind in ("angular_acceleration", "acceleration") for i in AXES]
WRENCH = [f"wrench/{kind}[{i}]" for kind in ("torque", "force") for i in AXES]
REACTION = [f"drive[{j}]/{kind}" for j in AXES for kind in ("force", "torque")]
TUBES = [[f"drive[{j}]/{kind}{suffix}" for j in AXES for kind in ("slide", "angle")] for suffix in ("", "_rate")]
TUBE_ACCELERATIONS = [f"drive[{j}]/{kind}_acceleration" for j in AXES for kind in ("slide", "angle")]


class Response:
    """Frequency response of a model, linearised with exact derivatives, between lists of its signals."""

    def __init__(self, model: Model, **values: float):
        self.system = linearize(model, values)

    def __call__(self, s: complex, outputs: list[str], inputs: list[str]) -> np.ndarray:
        system = self.system
        rows = [system.output_labels.index(name) for name in outputs]
        columns = [system.input_labels.index(name) for name in inputs]
        inside = np.linalg.solve(s * np.eye(len(system.A)) - system.A, system.B[:, columns])
        return system.C[rows] @ inside + system.D[np.ix_(rows, columns)]

    def from_pose(self, s: complex, outputs: list[str], tubes_to_pose: np.ndarray) -> np.ndarray:
        """From the pose that the tubes dictate, whose rate moves with it."""
        from_tubes = self(s, outputs, TUBES[0]) + s * self(s, outputs, TUBES[1])
        return from_tubes @ np.linalg.inv(tubes_to_pose)
