"""Bases of repeated eigenvalues: every linear combination of their eigenvectors is one, so a rule chooses.

A quadratic form F is made diagonal within the span, the largest value first; a second form separates vectors with equal
values of the first, and so on. With the weights 3, 2, 1 of the axes x, y, z a pair in the plane of x and y is along x
and along y.
"""

from collections.abc import Sequence

import numpy as np

AXES = np.diag([3.0, 2.0, 1.0])
"""Form of a vector of three that prefers x to y to z."""
ROTATION_AXES = np.kron(np.diag([1.0, 0.0]), AXES)
"""Form of a screw, rotation first, that prefers rotation about x to y to z."""
TRANSLATION_AXES = np.kron(np.diag([0.0, 1.0]), AXES)
"""Form of a screw that prefers translation along x to y to z."""

EQUAL = 1e-6
"""Largest difference of values of a form that count as equal, for vectors of length near 1."""
_REPEATED = 1e-8
"""Largest difference of repeated eigenvalues, by the largest one."""


def canonical(vectors: np.ndarray, forms: Sequence[np.ndarray]) -> np.ndarray:
    """Return the basis of the same span in which quadratic forms are diagonal, the largest first.

    The columns of `vectors`, shape (n, m), are mixed by an orthogonal matrix; the second form separates vectors with
    equal values of the first, and so on.
    """
    if not forms or vectors.shape[1] == 1:
        return vectors
    values, mixture = np.linalg.eigh(vectors.T @ forms[0] @ vectors)
    values, vectors = values[::-1], vectors @ mixture[:, ::-1]
    return np.hstack([canonical(vectors[:, group], forms[1:]) for group in groups(values, EQUAL)])


def canonical_eigenvectors(values: np.ndarray, vectors: np.ndarray, forms: Sequence[np.ndarray]) -> np.ndarray:
    """Return eigenvectors, columns, with `canonical` ones for repeated eigenvalues; eigenvalues are sorted."""
    equal = groups(values, _REPEATED * float(np.abs(values).max()))
    return np.hstack([canonical(vectors[:, group], forms) for group in equal])


def groups(values: np.ndarray, tolerance: float) -> list[slice]:
    """Return the slices of equal values in a sorted sequence."""
    ends = [i for i in range(1, len(values)) if abs(values[i] - values[i - 1]) > tolerance]
    return [slice(first, last) for first, last in zip([0, *ends], [*ends, len(values)], strict=True)]
