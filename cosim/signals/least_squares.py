"""Weighted linear least squares with a statement on what the equations do not determine.

    found = solve(A / sigma[:, None], b / sigma)
    found.values, found.covariance, found.condition, found.unseen

Columns are scaled to unit length before the singular value decomposition, so that the condition number says how far
columns are from dependent ones, whatever their units.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_NO_COLUMN = 1e-10
"""Length of a column, relative to the longest, below which it is rounding."""
_NO_VALUE = 1e-9
"""Singular value, relative to the largest, below which a combination of columns is rounding."""
_NO_PART = 1e-6
"""Part of a unit vector below which an unknown takes no part in an undetermined combination."""


@dataclass(frozen=True)
class Solution:
    """Solution of weighted equations in p unknowns.

    Attributes:
        values: unknowns, (p,); NaN where the equations do not determine one.
        covariance: covariance for equations of unit variance, (p, p); NaN in the rows and columns of such unknowns.
        condition: ratio of the singular values of the scaled columns; infinite where the rank is below p.
        rank: number of combinations that the equations determine.
        residuals: right-hand sides minus the equations, weighted, (equations,).
        unseen: groups of the indices of unknowns that are not determined; the equations determine unknowns of a group
            of several in combinations only.
    """

    values: NDArray[np.float64]
    covariance: NDArray[np.float64]
    condition: float
    rank: int
    residuals: NDArray[np.float64]
    unseen: tuple[tuple[int, ...], ...]


def solve(A: NDArray[np.float64], b: NDArray[np.float64]) -> Solution:
    """Return the least-squares solution of A x = b, A (equations, p) and b (equations,), rows of equal variance."""
    length = np.linalg.norm(A, axis=0)
    is_rounding = length <= _NO_COLUMN * length.max(initial=0.0)
    scale = np.where(is_rounding, np.inf, length)
    scaled = A / scale
    # the triangular factor has the same singular values and p rows
    Q, R = np.linalg.qr(scaled)
    U, sizes, V = np.linalg.svd(R)
    rank = int(np.sum(sizes > _NO_VALUE * sizes[0])) if len(sizes) and sizes[0] > 0 else 0
    inverse = V[:rank].T / sizes[:rank]
    x = inverse @ (U[:, :rank].T @ (Q.T @ b))
    covariance = inverse @ inverse.T / np.outer(scale, scale)
    groups = _groups(V[rank:])
    values = x / scale
    lost = [i for group in groups for i in group]
    values[lost], covariance[lost], covariance[:, lost] = np.nan, np.nan, np.nan
    full = rank == A.shape[1]
    condition = float(sizes[0] / sizes[-1]) if full else float("inf")
    return Solution(values, covariance, condition, rank, b - scaled @ x, groups)


def _groups(vectors: NDArray[np.float64]) -> tuple[tuple[int, ...], ...]:
    """Return the groups of unknowns that undetermined combinations, orthonormal rows (k, p), join."""
    joined = np.abs(vectors.T @ vectors) > _NO_PART
    left = [i for i in range(vectors.shape[1]) if joined[i, i]]
    groups = []
    while left:
        group, last = {left[0]}, set()
        while group != last:
            last = group
            group = group | {j for i in group for j in left if joined[i, j]}
        groups.append(tuple(sorted(group)))
        left = [i for i in left if i not in group]
    return tuple(groups)
