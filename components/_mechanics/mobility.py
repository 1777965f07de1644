"""Mobility of an elastic joint: number, types and axes of the freedoms of its compliance.

C is symmetric and positive definite, shape (6, 6), from loads (force, moment) to displacements (translation, rotation),
dimensionless by a given length and stiffness.

    1. centre of compliance r: (tr(C_rr) 1 - C_rr) r = v with skew(v) = C_tr - C_tr^T; there C_tr is symmetric
    2. eigenvalues of C there, in descending order, and their eigenvectors (v; w)
    3. cut at the largest ratio of neighbouring eigenvalues: the freedoms are the eigenvectors before it; below a ratio
       of 10 their number is undefined
    4. each freedom has the pitch v.w / w.w, the axis through w x v / w.w from the centre, and is a translation T if
       |w| < 0.1 |v|, else a rotation R if |pitch| < 0.1, else a helix H

The result does not depend on the axes or the reference point of C: the centre is fixed in the body, and the
eigenvectors rotate with the axes. It depends on the normalising length, which weighs rotation against translation.

For equal eigenvalues every linear combination of their eigenvectors is one. The basis is chosen by the amount of
rotation, then by pitch, both independent of axes, and then by the axes of C, so the freedoms of a symmetric joint lie
along them.
"""

from typing import Literal, NamedTuple

import numpy as np

from hfsa.components._mechanics.beam_assembly import at_point
from hfsa.components._mechanics.eigenbasis import EQUAL, canonical, groups
from hfsa.components._mechanics.screws import GAMMA

CLEAR = 10.0
"""Smallest ratio of neighbouring eigenvalues that separates freedoms from constraints."""
NO_ROTATION = 0.1
"""Largest ratio of rotation to translation of a translation."""
NO_PITCH = 0.1
"""Largest pitch of a rotation."""

_FORMS = (
    np.diag([0.0, 0.0, 0.0, 1.0, 1.0, 1.0]),
    GAMMA / 2,
    np.diag([3.0, 2.0, 1.0, 3.0, 2.0, 1.0]),
)
"""Quadratic forms F that choose a basis of equal eigenvalues: x^T F x is w.w, v.w, and a weight of the axes."""


class Freedom(NamedTuple):
    """One freedom; lengths are divided by the normalising length of C.

    Attributes:
        type: R, T or H.
        pitch: translation along the axis per rotation; `None` for a T.
        point: point of the axis closest to the centre of compliance, shape (3,); `None` for a T.
        direction: unit vector of the axis or of the translation, shape (3,); its largest entry is positive.
    """

    type: Literal["R", "T", "H"]
    pitch: float | None
    point: np.ndarray | None
    direction: np.ndarray


class Mobility(NamedTuple):
    """Mobility of a compliance.

    Attributes:
        center: centre of compliance, shape (3,).
        eigenvalues: eigenvalues of C there, in descending order, shape (6,).
        eigenvectors: their eigenvectors as columns, shape (6, 6).
        separation: largest ratio of neighbouring eigenvalues.
        freedoms: eigenvectors before the cut, the most compliant first, also for a separation below 10.
    """

    center: np.ndarray
    eigenvalues: np.ndarray
    eigenvectors: np.ndarray
    separation: float
    freedoms: list[Freedom]

    @property
    def is_clear(self) -> bool:
        """Whether the separation is at least 10; otherwise the number of freedoms is undefined."""
        return self.separation >= CLEAR


def mobility(C: np.ndarray) -> Mobility:
    """Return the mobility of a compliance, shape (6, 6), at any reference point and along any axes."""
    center = center_of_compliance(C)
    to_center = at_point(center)
    there = to_center @ C @ to_center.T
    values, vectors = np.linalg.eigh((there + there.T) / 2)
    values, vectors = values[::-1], vectors[:, ::-1]
    ratios = values[:-1] / values[1:]
    cut = int(np.argmax(ratios)) + 1
    equal = groups(np.log(values), EQUAL)
    basis = np.hstack([canonical(vectors[:, group], _FORMS) for group in equal])
    return Mobility(center, values, basis, float(ratios[cut - 1]), [_freedom(x, center) for x in basis.T[:cut]])


def center_of_compliance(C: np.ndarray) -> np.ndarray:
    """Return the point at which C_tr is symmetric, from the reference point, shape (3,)."""
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
    """Return the vector at length one, with its largest entry positive, the first of equal ones."""
    size = np.abs(vector)
    largest = int(np.argmax(size > (1 - EQUAL) * size.max()))
    return vector / (np.linalg.norm(vector) * np.sign(vector[largest]))
