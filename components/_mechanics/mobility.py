"""Mobility of an elastic joint: how many freedoms its compliance has, of which type, and where their axes lie.

C is symmetric and positive definite, shape (6, 6), displacements (translation, rotation) by loads (force, moment), made
dimensionless with a stated length and stiffness.

    1. centre of compliance r: (tr(C_rr) 1 - C_rr) r = v with skew(v) = C_tr - C_tr^T; there C_tr is symmetric
    2. eigenvalues of C there, in descending order, and their eigenvectors (v; w)
    3. cut at the largest ratio of neighbours: the freedoms are those before it; there are none to speak of if it is
       below 10
    4. each freedom has the pitch v.w / w.w, the axis through w x v / w.w from the centre, and is a translation T if
       |w| < 0.1 |v|, else a rotation R if |pitch| < 0.1, else a helix H

Nothing of it depends on the axes or the reference point that C is given for: the centre belongs to the body, and a
turn of the axes turns the eigenvectors. It does depend on the length, which weighs rotation against translation.

Of freedoms that are equally compliant every mixture is an eigenvector. They are told apart by how much they rotate,
then by pitch, both independent of axes, and then by the axes of C, so that those of a symmetric joint lie along them.
"""

from typing import Literal, NamedTuple

import numpy as np

from hfsa.components._mechanics.beam_assembly import at_point
from hfsa.components._mechanics.screws import GAMMA

CLEAR = 10.0
"""Smallest ratio of neighbouring eigenvalues that separates freedoms from constraints."""
NO_ROTATION = 0.1
"""Of a translation, the largest rotation by translation."""
NO_PITCH = 0.1
"""Largest pitch of a rotation."""

_EQUAL = 1e-6
_TELL_APART = (
    np.diag([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]),
    GAMMA / 2,
    np.diag([3.0, 2.0, 1.0, 3.0, 2.0, 1.0]),
)
"""Forms of an eigenvector x: x^T F x is w.w, v.w, and a weight of the axes."""


class Freedom(NamedTuple):
    """One freedom; lengths by the one that C is normalised with.

    Attributes:
        type: R, T or H.
        pitch: translation along the axis by rotation; none of a T.
        point: the point of the axis that is closest to the centre of compliance, shape (3,); none of a T.
        direction: unit vector of the axis or of the translation, shape (3,); its largest entry is positive.
    """

    type: Literal["R", "T", "H"]
    pitch: float | None
    point: np.ndarray | None
    direction: np.ndarray


class Mobility(NamedTuple):
    """What a compliance can and cannot do.

    Attributes:
        center: centre of compliance, shape (3,).
        eigenvalues: of C there, in descending order, shape (6,).
        separation: the largest ratio of neighbours among them.
        freedoms: the eigenvectors before the cut, the most compliant first, whether or not the cut is a clear one.
    """

    center: np.ndarray
    eigenvalues: np.ndarray
    separation: float
    freedoms: list[Freedom]

    @property
    def is_clear(self) -> bool:
        """Whether the separation is at least 10; otherwise the joint has no number of freedoms."""
        return self.separation >= CLEAR


def mobility(C: np.ndarray) -> Mobility:
    """Return the freedoms of a compliance, shape (6, 6), given at any reference point along any axes."""
    center = center_of_compliance(C)
    to_center = at_point(center)
    there = to_center @ C @ to_center.T
    values, vectors = np.linalg.eigh((there + there.T) / 2)
    values, vectors = values[::-1], vectors[:, ::-1]
    ratios = values[:-1] / values[1:]
    cut = int(np.argmax(ratios)) + 1
    equal = _groups(np.log(values))
    kept = np.hstack([_told_apart(vectors[:, group], _TELL_APART) for group in equal])[:, :cut]
    return Mobility(center, values, float(ratios[cut - 1]), [_freedom(x, center) for x in kept.T])


def center_of_compliance(C: np.ndarray) -> np.ndarray:
    """Return the point where C_tr is symmetric, from the reference point, shape (3,)."""
    C_rr = C[3:, 3:]
    difference = C[:3, 3:] - C[:3, 3:].T
    v = np.array([difference[2, 1], difference[0, 2], difference[1, 0]])
    return np.linalg.solve(np.trace(C_rr) * np.eye(3) - C_rr, v)


def _freedom(x: np.ndarray, center: np.ndarray) -> Freedom:
    """Return the freedom of an eigenvector (v; w), shape (6,), at the centre."""
    v, w = x[:3], x[3:]
    if np.linalg.norm(w) < NO_ROTATION * np.linalg.norm(v):
        return Freedom("T", None, None, _unit(v))
    pitch = float(v @ w / (w @ w))
    kind = "R" if abs(pitch) < NO_PITCH else "H"
    return Freedom(kind, pitch, center + np.cross(w, v) / (w @ w), _unit(w))


def _unit(vector: np.ndarray) -> np.ndarray:
    """Return the vector at length one, its largest entry positive; of equal ones the first."""
    size = np.abs(vector)
    largest = int(np.argmax(size > (1 - _EQUAL) * size.max()))
    return vector / (np.linalg.norm(vector) * np.sign(vector[largest]))


def _told_apart(vectors: np.ndarray, forms: tuple[np.ndarray, ...]) -> np.ndarray:
    """Return other orthonormal columns of the same span, eigenvectors of the forms one after the other.

    Those equal in the first form are told apart by the second, and so on, the largest first.
    """
    if not forms or vectors.shape[1] == 1:
        return vectors
    values, mixture = np.linalg.eigh(vectors.T @ forms[0] @ vectors)
    values, vectors = values[::-1], vectors @ mixture[:, ::-1]
    return np.hstack([_told_apart(vectors[:, group], forms[1:]) for group in _groups(values)])


def _groups(values: np.ndarray) -> list[slice]:
    """Return where values in descending order are the same."""
    ends = [i for i in range(1, len(values)) if values[i - 1] - values[i] > _EQUAL]
    return [slice(first, last) for first, last in zip([0, *ends], [*ends, len(values)], strict=True)]
