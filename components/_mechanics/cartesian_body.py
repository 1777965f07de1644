"""A body on springs that is given by its stiffness and mass matrices: what they have to be, and its centre of mass.

    M = [[I, m skew(c)], [m skew(c)^T, m 1]],    c from the reference point to the centre of mass C

is the mass matrix of a rigid body, rotation first. Other mass matrices, such as those of a platform with the inertia of
its limbs, have no centre of mass.
"""

from collections.abc import Sequence

import numpy as np

from hfsa.components._mechanics.screws import skew
from hfsa.components._modelling.model import ModelError

_PRINTED = 1e-4
"""Largest asymmetry of a matrix, by the mean of its diagonal entries: that of printed digits."""
_RIGID = 1e-4
"""Largest deviation from the mass matrix of a rigid body, by the mean of its diagonal entries."""


def symmetric_matrix(values: Sequence[float], name: str, unit: str) -> np.ndarray:
    """Return a symmetric and positive definite matrix, shape (6, 6), from its 36 entries by rows.

    `name` and `unit`, of the diagonal blocks, are those of messages.

    Raises:
        ModelError: not 36 finite numbers; a matrix that is not symmetric, with the worst pair of entries; one that is
            not positive definite, with the direction in which it is not.
    """
    if len(values) != 36:
        raise ModelError(f"{name} has {len(values)} numbers, expected 36, the rows of a 6 by 6 matrix, rotation first")
    A = np.array(values, dtype=float).reshape(6, 6)
    if not np.all(np.isfinite(A)):
        raise ModelError(f"{name} has entries that are not finite, expected 36 finite numbers")
    if not np.all(np.diag(A) > 0):
        i = int(np.argmin(np.diag(A)))
        raise ModelError(f"{name}[{i + 1},{i + 1}] is {A[i, i]:g}, expected above 0 [{unit}]: positive definite")
    size = np.sqrt(np.outer(np.diag(A), np.diag(A)))
    i, j = np.unravel_index(int(np.argmax(np.abs(A - A.T) / size)), (6, 6))
    if abs(A[i, j] - A[j, i]) > _PRINTED * size[i, j]:
        raise ModelError(
            f"{name} is not symmetric: [{i + 1},{j + 1}] is {A[i, j]:g}, but [{j + 1},{i + 1}] is {A[j, i]:g}"
        )
    A = (A + A.T) / 2
    lowest = float(np.linalg.eigvalsh(A / size)[0])
    if not lowest > 0:
        raise ModelError(
            f"{name} is not positive definite: scaled to a diagonal of 1 it has the eigenvalue {lowest:.4g}, expected "
            f"positive ones only"
        )
    return A


def center_of_mass(M: np.ndarray) -> np.ndarray | None:
    """Return the centre of mass from the reference point, shape (3,) [m]; `None` if M is not that of a rigid body."""
    mass, coupling = np.trace(M[3:, 3:]) / 3, M[:3, 3:]
    c = np.array([coupling[2, 1] - coupling[1, 2], coupling[0, 2] - coupling[2, 0], coupling[1, 0] - coupling[0, 1]])
    c = c / (2 * mass)
    size = np.sqrt(np.outer(np.diag(M), np.diag(M)))
    rigid = np.block([[M[:3, :3], mass * skew(c)], [mass * skew(c).T, mass * np.eye(3)]])
    return c if np.all(np.abs(M - rigid) <= _RIGID * size) else None


def length_of(M: np.ndarray) -> float:
    """Return the size of a body by which its rotations compare with translations: its radius of gyration [m]."""
    return float(np.sqrt(np.trace(M[:3, :3]) / np.trace(M[3:, 3:])))
