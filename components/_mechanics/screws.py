"""Screws: displacements [rotation; translation], twists and wrenches [moment; force] as columns of six, rotation first.

Displacements, twists and wrenches refer to a reference point; work is wrench . displacement. For two points S and C of
a body:

    x_S = X x_C,  w_C = X^T w_S,  K_C = X^T K_S X,  M_C = X^T M_S X,    X = shift(C - S)
"""

from typing import Literal, NamedTuple

import casadi as ca
import numpy as np

GAMMA = np.kron([[0.0, 1.0], [1.0, 0.0]], np.eye(3))
"""Matrix that swaps the two halves of a screw, shape (6, 6)."""

_TERMS = 16
_LOGARITHM_TERMS = 40


Kind = Literal["rotation", "translation", "screw"]

_NO_PITCH = 1e-6
"""Largest pitch of a rotation, by the length of the body."""


class Axis(NamedTuple):
    """The axis of a screw.

    Attributes:
        direction: unit vector, shape (3,).
        point: point of the axis closest to the reference point, shape (3,) [m]; zero for a translation.
        pitch: translation per rotation [m]; infinite for a pure translation.
    """

    direction: np.ndarray
    point: np.ndarray
    pitch: float


def skew(a: np.ndarray) -> np.ndarray:
    """Return the matrix of the cross product, `skew(a) @ b = a x b`, shape (3, 3)."""
    x, y, z = a
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def shift(offset: np.ndarray, rotation: np.ndarray | None = None) -> np.ndarray:
    """Return the matrix that transforms screws from a new frame to the old one, `x_old = X @ x_new`, shape (6, 6).

    `offset` (3,) is the new origin in old coordinates [m], `rotation` (3, 3) the attitude of the new frame in the old
    one, by default the identity.
    """
    rotation = np.eye(3) if rotation is None else rotation
    return np.block([[rotation, np.zeros((3, 3))], [skew(offset) @ rotation, rotation]])


def unit_screw(screw: np.ndarray, length: float) -> np.ndarray:
    """Return a screw, shape (6,), scaled to unit rotation, or to unit translation if it is a pure translation.

    It is a pure translation if its rotation times `length` [m] is below 1e-9 of its translation. The largest entry of
    the result is positive.
    """
    turn, slide = np.linalg.norm(screw[:3]), np.linalg.norm(screw[3:])
    size = turn if turn * length > 1e-9 * slide else slide
    return screw / (size * np.sign(screw[np.argmax(np.abs(screw))]))


def axis(screw: np.ndarray, length: float) -> Axis:
    """Return the axis of a screw [rotation; translation], shape (6,); `length` as in `unit_screw`."""
    screw = unit_screw(screw, length)
    turn, slide = screw[:3], screw[3:]
    if turn @ turn < 0.5:
        return Axis(slide, np.zeros(3), np.inf)
    return Axis(turn, np.cross(turn, slide), float(turn @ slide))


def kind_of(axis: Axis, length: float) -> Kind:
    """Return what a motion is: a pure rotation, a pure translation, or a screw; `length` as in `unit_screw`."""
    if np.isinf(axis.pitch):
        return "translation"
    return "rotation" if abs(axis.pitch) <= _NO_PITCH * length else "screw"


def seen_from(A: np.ndarray, offset: np.ndarray) -> np.ndarray:
    """Return a stiffness or mass matrix, shape (6, 6), about another point, at `offset` from its own, axes the same."""
    X = shift(offset)
    return X.T @ A @ X


def numbers(matrix: ca.SX) -> np.ndarray:
    """Return a constant CasADi matrix as an array of the same shape."""
    return np.array(ca.evalf(matrix), dtype=float)


def exponential(vector: ca.SX) -> ca.SX:
    """Return the rotation matrix of a rotation vector, shape (3, 1) [rad] to (3, 3)."""
    return ca.SX.eye(3) + expm1(vector)


def expm1(vector: ca.SX) -> ca.SX:
    """Return the rotation matrix of a rotation vector minus the identity, shape (3, 1) [rad] to (3, 3).

    sin(a)/a W + (1 - cos(a))/a^2 W^2 with W = skew(vector), a = |vector|; accurate to all digits for small rotations.
    The two factors are power series in a^2, without a branch or division at zero, so derivatives of every order are
    exact there. With sixteen terms the truncation error is below rounding up to half a turn.
    """
    W, square = ca.skew(vector), ca.sumsqr(vector)
    first, second = 1, 1
    for n in reversed(range(_TERMS)):
        first = 1 - square / ((2 * n + 2) * (2 * n + 3)) * first
        second = 1 - square / ((2 * n + 3) * (2 * n + 4)) * second
    return first * W + second / 2 * (W @ W)


def log1p(change: ca.SX) -> ca.SX:
    """Return the rotation vector of the rotation matrix 1 + `change`, shape (3, 3) to (3, 1) [rad].

    phi / sin(phi) times the skew part, as a power series in y = sin(phi / 2)^2: smooth at zero and accurate to all
    digits for small rotations, as `expm1`. The truncation error is below rounding up to 75 degrees, 1e-7 rad at 110.
    """
    part = ca.vertcat(change[2, 1] - change[1, 2], change[0, 2] - change[2, 0], change[1, 0] - change[0, 1]) / 2
    y, factor = -ca.trace(change) / 4, 1
    for n in reversed(range(1, _LOGARITHM_TERMS)):
        factor = 1 + 2 * n / (2 * n + 1) * y * factor
    return factor * part
