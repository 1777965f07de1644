"""Modes of an undamped body on springs: M xdd + K x = 0, M and K symmetric and positive definite."""

from typing import NamedTuple

import numpy as np

from hfsa.components._mechanics.elastostatics import roots


class Modes(NamedTuple):
    """Natural frequencies in ascending order, shape (n,) [rad/s], and mode shapes, columns of H, H^T M H = 1."""

    omega: np.ndarray
    shapes: np.ndarray


def modes(M: np.ndarray, K: np.ndarray) -> Modes:
    """Return the modes of M and K, shape (n, n); `ModelError` with the eigenvalue unless both are positive definite."""
    roots(K)
    _, inverse_root = roots(M, "mass")
    squares, V = np.linalg.eigh(inverse_root @ K @ inverse_root)
    return Modes(np.sqrt(squares), inverse_root @ V)


def frequency_matrix(M: np.ndarray, K: np.ndarray) -> np.ndarray:
    """Return (M^-1/2 K M^-1/2)^1/2 [rad/s] (eq 4.8); its eigenvalues are the natural frequencies (eq 4.11).

    For a rigid body it is meaningful at the centre of mass only, where M is block diagonal; elsewhere the matrix roots
    add rotations to translations.
    """
    _, inverse_root = roots(M, "mass")
    return roots(inverse_root @ K @ inverse_root)[0]


def modal_damping(M: np.ndarray, K: np.ndarray) -> np.ndarray:
    """Return the matrix for damping ratio 1 in every mode, D = M H diag(2 omega) H^T M; D is linear in the ratio."""
    omega, H = modes(M, K)
    return M @ H * (2 * omega) @ H.T @ M
