"""Assembly of beams and sheets between rigid bodies: places, and the compliance of all; normalised as in `beam.py`.

    T = R D(p)                      from the displacement of a body to that of the point p, along the axes of a beam
    K = sum S_i^T K_i S_i           over all beams; S_i q = T_i (q_body - q_root), the displacement across beam i
    C = (K^-1) of the platform      the other bodies are free
    D(p) = [[1, -skew(p)], [0, 1]]  from the displacement of the reference point to that of the point p

Two bodies have K = sum T_i^T K_i T_i, a chain of bodies C = C_inner + J C_outer J^T, as in the source. X is the axis of
a module, from its base to its platform; the reference point is the centre of the beams' tips.

Source: the paper of 2013 on beam modules. Not in it: other networks of bodies.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hfsa.components._mechanics.screws import GAMMA, shift

BASE, PLATFORM = "base", "platform"
"""Names of the body that is at rest and of the one that carries the loads."""

_MIRROR, _HANDED = np.diag([-1.0, 1.0, 1.0]), np.diag([1.0, -1.0, 1.0])
"""Reflection along X, and the change of sign of y that keeps a beam's axes right-handed."""


class Place(NamedTuple):
    """Where a beam is.

    Attributes:
        tip: its end on `body`, from the reference point, shape (3,).
        axes: its axes x, y, z as rows, shape (3, 3); x from `root` to `body`.
        root: name of the body at its other end.
        body: name of the body at its tip.
    """

    tip: np.ndarray
    axes: np.ndarray
    root: str = BASE
    body: str = PLATFORM

    def start(self, length: float) -> np.ndarray:
        """Return the end on `root` of a beam of a length, shape (3,)."""
        return self.tip - length * self.axes[0]


class Placed(NamedTuple):
    """One beam or sheet of a module, normalised.

    Attributes:
        place: its tip, axes and bodies.
        length: its length.
        stiffness: its stiffness in its own axes, shape (6, 6).
        width: width along its z, 0 of a beam that is as wide as thick.
    """

    place: Place
    length: float
    stiffness: np.ndarray
    width: float


def at_point(point: Sequence[float] | np.ndarray, rotation: np.ndarray | None = None) -> np.ndarray:
    """Return R D(p), the matrix from the displacement of the reference point to that of `point` (3,), shape (6, 6).

    The rows of `rotation` (3, 3) are the axes of the result, by default those of the input.
    """
    rotation = np.eye(3) if rotation is None else rotation
    return GAMMA @ shift(-rotation @ np.asarray(point, dtype=float), rotation) @ GAMMA


def compliance(places: Sequence[Place], stiffnesses: Sequence[np.ndarray]) -> np.ndarray:
    """Return the compliance of the platform at the reference point, shape (6, 6).

    `stiffnesses` are those of the beams in their own axes, shape (6, 6) each.
    """
    names, K = _network(places, stiffnesses)
    rows = _rows(names, PLATFORM)
    return np.linalg.inv(K)[rows, rows]


def displacements(
    places: Sequence[Place], stiffnesses: Sequence[np.ndarray], platform: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the displacements of all bodies by name, shape (6,) each, for that of the platform without other loads."""
    names, K = _network(places, stiffnesses)
    rows = _rows(names, PLATFORM)
    others = np.setdiff1d(np.arange(len(K)), np.arange(len(K))[rows])
    free = np.linalg.solve(K[np.ix_(others, others)], -K[others, rows] @ platform)
    q = np.empty(len(K))
    q[rows], q[others] = platform, free
    return {BASE: np.zeros(6), **{name: q[_rows(names, name)] for name in names}}


def _network(places: Sequence[Place], stiffnesses: Sequence[np.ndarray]) -> tuple[list[str], np.ndarray]:
    """Return the names of the free bodies, and the stiffness of their displacements, (6 bodies, 6 bodies)."""
    names = list(dict.fromkeys(name for place in places for name in (place.body, place.root) if name != BASE))
    K = np.zeros((6 * len(names), 6 * len(names)))
    for place, stiffness in zip(places, stiffnesses, strict=True):
        T = at_point(place.tip, place.axes)
        ends = [(name, sign) for name, sign in ((place.body, 1), (place.root, -1)) if name != BASE]
        own = T.T @ stiffness @ T
        for one, sign in ends:
            for other, opposite in ends:
                K[_rows(names, one), _rows(names, other)] += sign * opposite * own
    return names, K


def _rows(names: Sequence[str], name: str) -> slice:
    """Return the rows of a body's displacement."""
    first = 6 * names.index(name)
    return slice(first, first + 6)


# Places of modules ----------------------------------------------------------------------------------------------------


def ring(radius: float, tilt: float, count: int, turn: float = 0.0) -> list[Place]:
    """Return beams with axes R_Y(beta) R_X(-alpha_i) and tips p_i = r (0, sin alpha_i, -cos alpha_i) on a circle.

    alpha_i = turn + 2 pi (1 - i) / n, i = 0 ... n-1: three beams are at 120, 0 and -120 degrees. With `tilt` beta > 0
    [rad] the axes of the beams meet at x = r / tan(beta) in front of the platform. The beams' z is radial without tilt.
    """
    places = []
    tilted = np.array([[math.cos(tilt), 0.0, math.sin(tilt)], [0.0, 1.0, 0.0], [-math.sin(tilt), 0.0, math.cos(tilt)]])
    for i in range(count):
        angle = turn + 2 * math.pi * (1 - i) / count
        s, c = math.sin(angle), math.cos(angle)
        turned = np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
        places.append(Place(np.array([0.0, radius * s, -radius * c]), tilted @ turned))
    return places


def pair(spacing: float) -> list[Place]:
    """Return two sheets at y = spacing / 2 and -spacing / 2, wide along Z."""
    return [Place(np.array([0.0, y, 0.0]), np.eye(3)) for y in (spacing / 2, -spacing / 2)]


def between(places: Sequence[Place], root: str, body: str, ahead: float = 0.0) -> list[Place]:
    """Return the same beams between two other bodies, shifted by `ahead` along X."""
    return [Place(p.tip + np.array([ahead, 0.0, 0.0]), p.axes, root, body) for p in places]


def backwards(places: Sequence[Place]) -> list[Place]:
    """Return the same beams reflected along X."""
    return [p._replace(tip=_MIRROR @ p.tip, axes=_HANDED @ p.axes @ _MIRROR) for p in places]
