"""Balancing of a matrix: powers of two as units of its states, in which rows and columns are of equal size.

The algorithm and its numbers are those of LAPACK's `dgebal` without permutation, which scipy offers as
`matrix_balance`; the matrices are small, and importing scipy's linear algebra takes longer than all else that the
linear response of a scene needs.
"""

import math

import numpy as np
from numpy.typing import NDArray

_RADIX = 2.0
_ENOUGH = 0.95
"""Factor by which the sum of a row and a column must fall for a change of units."""

_SMALLEST = np.finfo(float).tiny / np.finfo(float).eps
_LARGEST = 1 / _SMALLEST


def balance(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the scale s of a square matrix, (n,): A[i, j] s[j] / s[i] is balanced.

    `ValueError` for a matrix that is not finite.
    """
    a = np.array(matrix, dtype=float)
    if not np.isfinite(a).all():
        raise ValueError("array must not contain infs or NaNs")
    scale = np.ones(len(a))
    is_changed = True
    while is_changed:
        is_changed = False
        for i in range(len(a)):
            factor = _factor(a[:, i], a[i])
            if factor == 1.0 or not _SMALLEST < factor * scale[i] < _LARGEST:
                continue
            scale[i] *= factor
            a[i] /= factor
            a[:, i] *= factor
            is_changed = True
    return scale


def _factor(column: NDArray[np.float64], row: NDArray[np.float64]) -> float:
    """Return the power of two that brings a column and a row to the same size; 1 where that gains little."""
    c, r = math.hypot(*column), math.hypot(*row)  # without overflow
    if c == 0.0 or r == 0.0:
        return 1.0
    largest, smallest = float(np.abs(column).max()), float(np.abs(row).max())
    factor, total = 1.0, c + r
    while c < r / _RADIX and max(factor, c, largest) < _LARGEST / _RADIX and min(r, smallest) > _SMALLEST * _RADIX:
        factor, c, largest = factor * _RADIX, c * _RADIX, largest * _RADIX
        r, smallest = r / _RADIX, smallest / _RADIX
    while c / _RADIX >= r and max(r, smallest) < _LARGEST / _RADIX and min(factor, c, largest) > _SMALLEST * _RADIX:
        factor, c, largest = factor / _RADIX, c / _RADIX, largest / _RADIX
        r, smallest = r * _RADIX, smallest * _RADIX
    return factor if c + r < _ENOUGH * total else 1.0
