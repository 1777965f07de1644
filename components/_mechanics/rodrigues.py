"""Finite rotations by four times the modified Rodrigues parameters, s = 4 tan(angle / 4) axis.

s is the rotation vector but for terms of third order, and regular within a full turn. With q = |s|^2 / 16,

    R - 1 = ((1 - q) [s x] + [s x]^2 / 2) / (1 + q)^2,    sd = (1 - q) w - s x w / 2 + s (s . w) / 8

for an angular velocity w in the axes in which R turns, those of the world. Nothing is a difference of large numbers: a
rotation of 1 prad has all digits.
"""

import casadi as ca

_ARC_TERMS = 12


def turn(s: ca.SX) -> ca.SX:
    """Return R - 1, shape (3, 1) to (3, 3)."""
    square = ca.sumsqr(s)
    q = square / 16
    scale = 1 / (1 + q) ** 2
    half = scale / 2 * s
    return (scale * (1 - q)) * ca.skew(s) + half @ s.T - (scale / 2 * square) * ca.SX.eye(3)


def parameter_rate(s: ca.SX, angular_velocity: ca.SX) -> ca.SX:
    """Return the derivative of s for an angular velocity, columns of three [rad/s]."""
    w = angular_velocity
    return (1 - ca.sumsqr(s) / 16) * w - ca.cross(s / 2, w) + (ca.dot(s, w) / 8) * s


def rotation_vector(s: ca.SX) -> ca.SX:
    """Return the rotation vector, shape (3, 1) [rad], accurate to all digits up to half a turn.

    The angle is 4 atan(y), y = |s| / 4. Two half-angle formulas take y to 0.2 at half a turn, where the power series of
    atan(y) / y is short; it has no branch and no division at zero.
    """
    square, factor = ca.sumsqr(s) / 16, 1
    for _ in range(2):
        half = 1 + ca.sqrt(1 + square)
        square, factor = square / half**2, factor * 2 / half
    series = 1 / (2 * _ARC_TERMS + 1)
    for n in reversed(range(_ARC_TERMS)):
        series = 1 / (2 * n + 1) - square * series
    return (factor * series) * s
