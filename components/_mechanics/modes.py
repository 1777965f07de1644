"""Modes of an undamped body on springs: M xdd + K x = 0, M and K symmetric and positive definite."""

from typing import Literal, NamedTuple

import casadi as ca
import numpy as np

from hfsa.components._mechanics.elastostatics import roots

Damping = Literal["modal", "rayleigh"]


class DampingOf(NamedTuple):
    """Damping of the modes of a part.

    Attributes:
        model: which modes have the ratio.
        ratio: damping ratio, a parameter of the part.
    """

    model: Damping
    ratio: ca.SX


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


def cholesky_frequency_matrix(M: np.ndarray, K: np.ndarray) -> np.ndarray:
    """Return L^-1 K L^-T with M = L L^T [rad2/s2] (eq 4.4); its eigenvalues are the squared natural frequencies.

    For a rigid body it is meaningful at the centre of mass only, as `frequency_matrix`.
    """
    inverse_factor = np.linalg.inv(np.linalg.cholesky(M))
    return inverse_factor @ K @ inverse_factor.T


def dynamic_matrix(M: np.ndarray, K: np.ndarray) -> np.ndarray:
    """Return D = M^-1 K (eq 4.3); its eigenvalues are the squared natural frequencies."""
    return np.linalg.solve(M, K)


def damping_rates(omega: np.ndarray, kind: Damping) -> np.ndarray:
    """Return h^T D h of each mass-normalised mode for damping ratio 1, shape (n,) [1/s]; it is linear in the ratio.

    `modal` gives every mode the ratio. `rayleigh`, D = alpha M + beta K, gives it to the first and the fourth mode.
    """
    if kind == "modal":
        return 2 * omega
    first, fourth = omega[0], omega[3]
    return 2 * (first * fourth + omega**2) / (first + fourth)


def damping_matrix(M: np.ndarray, K: np.ndarray, kind: Damping = "modal") -> np.ndarray:
    """Return D for damping ratio 1, D = M H diag(damping_rates) H^T M; it is linear in the ratio."""
    omega, H = modes(M, K)
    return M @ H * damping_rates(omega, kind) @ H.T @ M
