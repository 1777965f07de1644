"""Assembly of beams and sheets: positions, modules in parallel and in series; normalised as in `beam.py`.

    T = R D(p)                      from the displacement of the stage to that of a beam's tip at p, in the beam's frame
    K = sum T_i^T K_i T_i           beams in parallel, between the same two bodies
    C = C_inner + J C_outer J^T     modules in series, J = D(from the outer stage to the inner one)
    D(p) = [[1, -skew(p)], [0, 1]]  from the displacement of the reference point to that of the point p

X is the axis of a module, from its base to its stage; the reference point is the centre of the beams' tips.

Source: the paper of 2013 on beam modules.
"""

import math
from collections.abc import Sequence

import numpy as np

from hfsa.components._mechanics.beam import of_length
from hfsa.components._mechanics.screws import GAMMA, shift

_MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0])
"""Reflection of displacements along X: translations along X and rotations about Y and Z change sign."""


def at_point(point: Sequence[float] | np.ndarray, rotation: np.ndarray | None = None) -> np.ndarray:
    """Return R D(p), the matrix from the displacement of the reference point to that of `point` (3,), shape (6, 6).

    The rows of `rotation` (3, 3) are the axes of the result, by default those of the input.
    """
    rotation = np.eye(3) if rotation is None else rotation
    return GAMMA @ shift(-rotation @ np.asarray(point, dtype=float), rotation) @ GAMMA


def side_by_side(beams: Sequence[np.ndarray], transforms: Sequence[np.ndarray]) -> np.ndarray:
    """Return the compliance of beams in parallel from their stiffnesses K_i and transforms T_i, shape (6, 6)."""
    K = sum(T.T @ K @ T for K, T in zip(beams, transforms, strict=True))
    return np.linalg.inv(K)


def one_on_another(inner: np.ndarray, outer: np.ndarray, offset: float) -> np.ndarray:
    """Return the compliance of an inner module on the stage of an outer one, at the inner stage, shape (6, 6).

    `offset` is the position of the inner stage along X, from the outer one.
    """
    J = at_point((offset, 0.0, 0.0))
    return inner + J @ outer @ J.T


def mirrored(C: np.ndarray) -> np.ndarray:
    """Return the compliance of a module reflected along X, shape (6, 6)."""
    return _MIRROR @ C @ _MIRROR


def unequal(K: np.ndarray, lengths: Sequence[float]) -> list[np.ndarray]:
    """Return the stiffnesses of beams of different lengths, shape (6, 6) each, from K of one beam."""
    return [of_length(K, length) for length in lengths]


def ring(radius: float, tilt: float, count: int) -> list[np.ndarray]:
    """Return the T_i = R_Y(beta) R_X(-alpha_i) D(p_i) of beams with their tips on a circle, shape (6, 6) each.

    alpha_i = 2 pi (1 - i) / n, i = 0 ... n-1: three beams are at 120, 0 and -120 degrees. p_i = (0, r sin alpha_i,
    -r cos alpha_i). With `tilt` beta > 0 [rad] the axes of the beams meet at x = r / tan(beta) in front of the stage.
    """
    transforms = []
    tilted = np.array([[math.cos(tilt), 0.0, math.sin(tilt)], [0.0, 1.0, 0.0], [-math.sin(tilt), 0.0, math.cos(tilt)]])
    for i in range(count):
        angle = 2 * math.pi * (1 - i) / count
        s, c = math.sin(angle), math.cos(angle)
        turned = np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
        transforms.append(at_point((0.0, radius * s, -radius * c), tilted @ turned))
    return transforms


def pair(spacing: float) -> list[np.ndarray]:
    """Return the T_i of two sheets at y = spacing / 2 and -spacing / 2, wide along Z, shape (6, 6) each."""
    return [at_point((0.0, y, 0.0)) for y in (spacing / 2, -spacing / 2)]


def cross(spacing: float) -> list[np.ndarray]:
    """Return the T_i of four sheets at y = s / 2, z = -s / 2, y = -s / 2, z = s / 2, radially wide, shape (6, 6)."""
    return ring(spacing / 2, 0.0, 4)
