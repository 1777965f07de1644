"""Equations of a rigid body that are linear in its ten inertia parameters, and rotations of its axes.

In body axes, with the angular velocity w, the angular acceleration b and the acceleration a of a reference point S of
the body, less the gravitational acceleration, the wrench [n; f] exerted on the body about S is Y p,

    p = [m, m cx, m cy, m cz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz]        c = C - S, I about S, entries of the tensor
    Y = [[0, -skew(a), L(b) + skew(w) L(w)], [a, skew(b) + skew(w)^2, 0]]
    L(v) = [[vx, vy, vz, 0, 0, 0], [0, vx, 0, vy, vz, 0], [0, 0, vx, 0, vy, vz]],   L(v) [Ixx, ...] = I v

Without the products of w the equations are linear in the motion, too, and hold for complex responses to sines.
Arrays have the samples first; vectors are rows.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

PARAMETERS = {
    "m": "kg",
    "mcx": "kg.m",
    "mcy": "kg.m",
    "mcz": "kg.m",
    "Ixx": "kg.m2",
    "Ixy": "kg.m2",
    "Ixz": "kg.m2",
    "Iyy": "kg.m2",
    "Iyz": "kg.m2",
    "Izz": "kg.m2",
}
"""Inertia parameters in their order, with their units."""

Vectors = NDArray[Any]
"""Real or complex vectors, (samples, 3)."""


def linear_regressor(acceleration: Vectors, angular_acceleration: Vectors) -> NDArray[Any]:
    """Return Y without the products of the angular velocity, (samples, 6, 10), of real or complex body components."""
    Y = np.zeros((len(acceleration), 6, len(PARAMETERS)), np.result_type(acceleration, angular_acceleration, float))
    Y[:, :3, 1:4] = -skew(acceleration)
    Y[:, :3, 4:] = _tensor_product(angular_acceleration)
    Y[:, 3:, 0] = acceleration
    Y[:, 3:, 1:4] = skew(angular_acceleration)
    return Y


def full_regressor(acceleration: Vectors, angular_acceleration: Vectors, angular_velocity: Vectors) -> NDArray[Any]:
    """Return Y, (samples, 6, 10), of real body components."""
    Y = linear_regressor(acceleration, angular_acceleration)
    turn = skew(angular_velocity)
    Y[:, :3, 4:] += turn @ _tensor_product(angular_velocity)
    Y[:, 3:, 1:4] += turn @ turn
    return Y


def skew(vectors: Vectors) -> NDArray[Any]:
    """Return the matrices of the cross products with vectors, (samples, 3, 3)."""
    matrices = np.zeros((len(vectors), 3, 3), vectors.dtype)
    x, y, z = vectors.T
    matrices[:, 0, 1], matrices[:, 0, 2], matrices[:, 1, 2] = -z, y, -x
    matrices[:, 1, 0], matrices[:, 2, 0], matrices[:, 2, 1] = z, -y, x
    return matrices


def turned(rotation: Vectors) -> NDArray[np.float64]:
    """Return the rotation matrices of rotation vectors [rad] minus the identity, (samples, 3, 3).

    sin(a)/a W + (1 - cos(a))/a^2 W^2 with W = skew(rotation); accurate to all digits for small rotations.
    """
    angle = np.linalg.norm(rotation, axis=1)[:, None, None]
    W = skew(rotation)
    return np.sinc(angle / np.pi) * W + np.sinc(angle / (2 * np.pi)) ** 2 / 2 * (W @ W)


def rates(
    change: NDArray[np.float64], first: NDArray[np.float64], second: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return angular velocity [rad/s] and acceleration [rad/s2], (samples, 3), of moving rotation matrices.

    `change` are the matrices minus the identity, `first` and `second` their derivatives, (samples, 3, 3). The vectors
    are along the axes that the matrices turn to.
    """
    attitude = np.swapaxes(change, 1, 2) + np.eye(3)
    return _axial(first @ attitude), _axial(second @ attitude)


def _axial(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the vectors of the skew parts of matrices, (samples, 3)."""
    parts = (matrices - np.swapaxes(matrices, 1, 2)) / 2
    return np.stack([parts[:, 2, 1], parts[:, 0, 2], parts[:, 1, 0]], axis=1)


def _tensor_product(vectors: Vectors) -> NDArray[Any]:
    """Return L(v), (samples, 3, 6)."""
    L = np.zeros((len(vectors), 3, 6), vectors.dtype)
    x, y, z = vectors.T
    L[:, 0, 0], L[:, 0, 1], L[:, 0, 2] = x, y, z
    L[:, 1, 1], L[:, 1, 3], L[:, 1, 4] = x, y, z
    L[:, 2, 2], L[:, 2, 4], L[:, 2, 5] = x, y, z
    return L
