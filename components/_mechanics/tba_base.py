"""Specific force on an accelerometer on a moving base, in the sensor's axes.

    f = S^T (a + w' x p + w x (w x p) + 2 w x (S q') - g),   S = R(theta) Q,   p = R(theta) r + S q

a is the acceleration of the base's reference point, w and w' its angular velocity and acceleration, theta its rotation
vector, all along world axes; g = (0, 0, -gravity); q the displacement of the proof mass along the sensor's axes. The
mounting defines Q, from the sensor's axes to the world's at theta = 0, and r, from the reference point to the sensor.

To first order in the motion of the base, with the proof mass at rest in the sensor:

    f = Q^T (a + w' x r + theta x g - g)
"""

from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np

from hfsa.components._modelling.model import Model, ModelError

Triple = tuple[float, float, float]
Nine = tuple[float, float, float, float, float, float, float, float, float]

_ROUNDING = 1e-6
"""Largest error of unit lengths and right angles in the columns of a mounting matrix."""
_SMALL = 1e-3
"""Angle [rad] below which a rotation is computed from its series, exact to the last bit."""


@dataclass(frozen=True)
class Mounting:
    """Attitude and position of the sensor on its base.

    Attributes:
        rotation: Q by rows, from the sensor's axes to the world's at the base's posture; its columns are the sensor's
            x, y and z. Rounding errors below 1e-6 are removed.
        lever: r, from the base's reference point to the sensor, world axes at the posture [m].
    """

    rotation: Nine = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    lever: Triple = (0.0, 0.0, 0.0)

    def matrix(self, owner: str) -> np.ndarray:
        """Return Q, shape (3, 3); `ModelError`, beginning with `owner`, unless it is a rotation matrix."""
        Q = np.array(self.rotation, dtype=float).reshape(3, 3)
        off = np.abs(Q.T @ Q - np.eye(3)).max()
        if not off <= _ROUNDING:
            raise ModelError(
                f"{owner}: mounting.rotation is no rotation: its columns, the sensor's axes, deviate from unit length "
                f"or right angles by {off:.3g}, expected below {_ROUNDING:g}{_nearest(Q)}"
            )
        if np.linalg.det(Q) < 0:
            raise ModelError(
                f"{owner}: mounting.rotation is a reflection, determinant -1, expected +1: "
                "change the sign of one of its columns, the sensor's axes"
            )
        return Q @ (3 * np.eye(3) - Q.T @ Q) / 2

    def arm(self, owner: str) -> np.ndarray:
        """Return r, shape (3,) [m]; `ModelError`, beginning with `owner`, unless it is finite."""
        if not np.all(np.isfinite(self.lever)):
            raise ModelError(f"{owner}: mounting.lever is {self.lever} m, expected three finite numbers")
        return np.array(self.lever, dtype=float)


class Base(NamedTuple):
    """Motion of the base's reference point, world axes, each (3, 1)."""

    acceleration: ca.SX
    angular_velocity: ca.SX
    angular_acceleration: ca.SX
    rotation: ca.SX


def base_inputs(m: Model) -> Base:
    """Declare the motion of the base as inputs."""
    about = "of the base, world axes"
    return Base(
        m.input("base.acceleration[1..3]", "m/s2", f"Acceleration of the reference point {about}", nominal=1.0),
        m.input("base.angular_velocity[1..3]", "rad/s", f"Angular velocity {about} (level nonlinear)", nominal=1e-3),
        m.input("base.angular_acceleration[1..3]", "rad/s2", f"Angular acceleration {about}", nominal=0.1),
        m.input("base.rotation[1..3]", "rad", "Rotation vector of the base from its posture", nominal=1e-5),
    )


def linear_specific_force(base: Base, Q: np.ndarray, arm: np.ndarray, gravity: ca.SX) -> ca.SX:
    """Return f to first order, sensor axes, shape (3, 1) [m/s2]."""
    g = ca.vertcat(0, 0, -gravity)
    return ca.DM(Q.T) @ (
        base.acceleration + ca.cross(base.angular_acceleration, ca.DM(arm)) + ca.cross(base.rotation, g) - g
    )


def specific_force(base: Base, Q: np.ndarray, arm: np.ndarray, gravity: ca.SX, position: ca.SX, rate: ca.SX) -> ca.SX:
    """Return f, shape (3, 1) [m/s2], at a displacement and rate of the proof mass, (3, 1) each, all in sensor axes."""
    turned = _rotation(base.rotation)
    axes, w = turned @ ca.DM(Q), base.angular_velocity
    at = turned @ ca.DM(arm) + axes @ position
    seen = base.acceleration + ca.cross(base.angular_acceleration, at) + ca.cross(w, ca.cross(w, at))
    return axes.T @ (seen + 2 * ca.cross(w, axes @ rate) + ca.vertcat(0, 0, gravity))


def _rotation(vector: ca.SX) -> ca.SX:
    """Return the matrix of a rotation vector, shape (3, 3), differentiable at zero too."""
    square = ca.sumsqr(vector)
    small = square < _SMALL**2
    angle = ca.sqrt(ca.if_else(small, 1, square))
    first = ca.if_else(small, 1 - square / 6, ca.sin(angle) / angle)
    second = ca.if_else(small, 0.5 - square / 24, 2 * (ca.sin(angle / 2) / angle) ** 2)
    cross = ca.skew(vector)
    return ca.SX.eye(3) + first * cross + second * cross @ cross


def _nearest(Q: np.ndarray) -> str:
    """Return the part of a message with the nearest rotation matrix, empty if Q is not finite."""
    if not np.all(np.isfinite(Q)):
        return ""
    U, _, V = np.linalg.svd(Q)
    right = U @ np.diag([1, 1, np.linalg.det(U @ V)]) @ V
    return f"; the nearest is {','.join(f'{x:.9g}' for x in np.round(right, 9).ravel() + 0.0)}"
