"""Modes of a stage on its stacks, and what they leave out: a small model from forces to elongations and pose.

With the stacks' stiffness k and tip mass on the elongations, M Phi = K Phi Lambda^-1, the modes eta obey

    eta'' + 2 zeta omega eta' + omega^2 eta = Phi^T (f - B a)        f: forces on l and q, a: acceleration of the base
    (l, q) = Phi eta + R f - R_a a,   R = K^-1 - Phi Lambda^-1 Phi^T,  R_a likewise

so that static responses are those of all modes. Modes of a pair are never parted.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh

from hfsa.components._continuum.stage import Stage
from hfsa.components._mechanics.eigenbasis import canonical_eigenvectors
from hfsa.components._mechanics.pzt import Stack

_PAIR = 1e-6
"""Largest relative difference of the frequencies of a pair."""


class Reduced(NamedTuple):
    """Modes and residual of a stage.

    Attributes:
        omega: natural frequencies, shape (n,) [rad/s].
        shapes: Phi at l and q, shape (6, n), for modes of mass 1.
        residual: R, shape (6, 6) [m/N; rad/N, rad/(N.m)].
        base: Phi^T B, shape (n, 2).
        base_residual: R_a, shape (6, 2) [s2; rad.s2/m].
    """

    omega: np.ndarray
    shapes: np.ndarray
    residual: np.ndarray
    base: np.ndarray
    base_residual: np.ndarray


def bonded(stage: Stage, stack: Stack) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return stiffness, mass and momentum of a stage with stacks on its elongations."""
    K, M, B = stage.stiffness.copy(), stage.mass.copy(), stage.momentum.copy()
    K[:3, :3] += stack.stiffness * np.eye(3)
    M[:3, :3] += stack.tip_mass * np.eye(3)
    B[:3] += stack.tip_mass * stage.pushes
    return K, M, B


def frequencies(stiffness: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Return all natural frequencies [rad/s], ascending."""
    return np.sqrt(eigh(stiffness, mass, eigvals_only=True))


def reduced(stage: Stage, stack: Stack, count: int) -> Reduced:
    """Return `count` modes of a stage on its stacks, one more where that would part a pair."""
    K, M, B = bonded(stage, stack)
    squares, vectors = eigh(K, M)
    count += int(np.isclose(squares[count], squares[count - 1], rtol=2 * _PAIR, atol=0))
    squares, vectors = squares[:count], vectors[:, :count]
    forms = [_form(vectors, coordinate) for coordinate in (3, 0)]
    vectors = vectors @ canonical_eigenvectors(squares, np.eye(count), forms)
    shapes, base = vectors[:6], vectors.T @ B
    static = np.linalg.solve(K, np.hstack([np.eye(len(K))[:, :6], B]))[:6]
    kept = shapes / squares @ np.hstack([shapes.T, base])
    residual, base_residual = np.hsplit(static - kept, [6])
    return Reduced(np.sqrt(squares), shapes, (residual + residual.T) / 2, base, base_residual)


def _form(vectors: np.ndarray, coordinate: int) -> np.ndarray:
    """Return the form of mode amplitudes that is large where a coordinate moves, normalised."""
    row = vectors[coordinate]
    return np.outer(row, row) / max(float(row @ row), 1e-300)
