"""Invariants of the stiffness matrix of a body on springs: eigenscrews, compliant axes and their root mean squares.

K is symmetric and positive definite, shape (6, 6), in blocks [[K11, K12], [K12^T, K22]], rotation first. The
eigenvalues of K depend on the reference point and mix units; those of GAMMA K, of K22 and of the inverse of the first
block of K^-1 do not. Axes of repeated stiffnesses are along x and y where they can be.
"""

from typing import NamedTuple

import numpy as np

from hfsa.components._mechanics.eigenbasis import AXES, ROTATION_AXES, canonical_eigenvectors
from hfsa.components._mechanics.screws import GAMMA
from hfsa.components._modelling.model import ModelError


class Compliant(NamedTuple):
    """Three compliant axes: stiffnesses in ascending order, shape (3,), and their screws as columns, shape (6, 3)."""

    stiffness: np.ndarray
    screws: np.ndarray


class Indices(NamedTuple):
    """Root mean squares of the eigenstiffnesses [N], translational [N/m] and torsional stiffnesses [N.m/rad]."""

    kappa: float
    kappa_t: float
    kappa_r: float


class Eigenscrews(NamedTuple):
    """The six eigenscrews of a stiffness.

    Attributes:
        stiffness: eigenstiffnesses mu in ascending order, three negative and three positive, shape (6,) [N].
        pitch: their pitches, of the same signs, shape (6,) [m].
        screws: columns of unit rotation, mutually reciprocal, shape (6, 6).
    """

    stiffness: np.ndarray
    pitch: np.ndarray
    screws: np.ndarray


def eigenscrews(K: np.ndarray) -> Eigenscrews:
    """Return the solutions of GAMMA K k = mu k (eq 3.35).

    They are computed from the symmetric K^1/2 GAMMA K^1/2 and so are real and reciprocal even for repeated mu. K is
    their sum of mu / (2 pitch) (GAMMA k)(GAMMA k)^T (eq 3.37, where GAMMA is missing).
    """
    root, inverse_root = roots(K)
    mu, Y = np.linalg.eigh(root @ GAMMA @ root)
    screws = canonical_eigenvectors(mu, inverse_root @ Y, [ROTATION_AXES])
    screws /= np.linalg.norm(screws[:3], axis=0)
    return Eigenscrews(mu, np.sum(screws[:3] * screws[3:], axis=0), screws)


def wrench_compliant_axes(K: np.ndarray) -> Compliant:
    """Return the axes along which a force moves the body only parallel to itself, stiffnesses in [N/m].

    K22 e = alpha e with the screws [e; K12 e / alpha].
    """
    alpha, e = np.linalg.eigh(K[3:, 3:])
    e = canonical_eigenvectors(alpha, e, [AXES])
    return Compliant(alpha, np.vstack([e, K[:3, 3:] @ e / alpha]))


def twist_compliant_axes(K: np.ndarray) -> Compliant:
    """Return the axes about which a moment rotates the body only about itself, stiffnesses in [N.m/rad].

    With C = K^-1, C11 e = e / beta with the screws [e; beta C12^T e].
    """
    C = np.linalg.inv(K)
    inverse, e = np.linalg.eigh(C[:3, :3])
    inverse, e = inverse[::-1], canonical_eigenvectors(inverse[::-1], e[:, ::-1], [AXES])
    return Compliant(1 / inverse, np.vstack([e, C[3:, :3] @ e / inverse]))


def indices(K: np.ndarray) -> Indices:
    """Return the indices of a stiffness from traces, without its eigenvalues.

    The sum of squared eigenvalues is the trace of the squared matrix: of GAMMA K, of K22, and of the inverse of the
    first block of K^-1, which is K11 - K12 K22^-1 K12^T.
    """
    swapped, torsional = GAMMA @ K, K[:3, :3] - K[:3, 3:] @ np.linalg.solve(K[3:, 3:], K[3:, :3])
    squares = np.trace(swapped @ swapped) / 6, np.sum(K[3:, 3:] ** 2) / 3, np.sum(torsional**2) / 3
    return Indices(*(float(np.sqrt(square)) for square in squares))


def roots(A: np.ndarray, name: str = "stiffness") -> tuple[np.ndarray, np.ndarray]:
    """Return the symmetric square root of A and its inverse; `ModelError` unless A is positive definite."""
    values, V = np.linalg.eigh(A)
    if not values[0] > 0:
        raise ModelError(f"{name} matrix has the eigenvalue {values[0]:.4g}, expected positive ones only")
    return V * np.sqrt(values) @ V.T, V / np.sqrt(values) @ V.T
