"""The whole piece as one elastic body between its contact edges and its bolts: static and fixed-interface modes.

Three thirds, each in its own frame, have the same matrices: leg 1 is leg 2 turned by 120 degrees, leg 3 by -120
degrees, so that symmetry is exact. The nodes on the turned cut of a third are those on the cut of its neighbour. A leg
has six interface coordinates, in its own frame: those of the contact edge, a rigid line, l along the push (-y'), s
along x', phi; and those of the bolt, a rigid disc, u along the push, v along x', theta. With all others free,

    x = Psi m + Phi a       Psi: static modes of the coordinates m (18),  Phi: modes with m = 0 (Craig-Bampton)

so that K, the static stiffness on m, is exact for the mesh, whatever holds the interface. Contact, bolts, platform and
stacks are added to the small matrices alone.
"""

from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from hfsa.components._continuum.boundary import Point
from hfsa.components._continuum.elements import Material, matrices
from hfsa.components._continuum.meshing import Mesh
from hfsa.components._mechanics.rrr_kinematics import OFFSETS

COORDINATES = ("l", "s", "phi", "u", "v", "theta")
"""Interface coordinates of a leg."""
NEIGHBOUR = (2, 0, 1)
"""The leg 120 degrees from each of legs 1 to 3, counter-clockwise."""
MODES = 36
"""Fixed-interface modes that are kept."""


class Piece(NamedTuple):
    """Reduced matrices of the piece, legs 1 to 3 one after the other.

    Attributes:
        stiffness: K on the interface coordinates, shape (18, 18) [N/m; N; N.m].
        mass: mass on interface coordinates and fixed-interface modes, shape (18 + k, 18 + k) [kg, ...].
        omega: frequencies of the fixed-interface modes, shape (k,) [rad/s]; the modes have mass 1.
        momentum: mass times unit velocities of the base along x' and y' of leg 2, shape (18 + k, 2) [kg, ...].
        weight: mass of the whole piece [kg].
        shapes: displacement of the third of leg 2 for each interface coordinate, shape (2 n, 18).
        unknowns: number of free displacements in the mesh of the piece.
    """

    stiffness: np.ndarray
    mass: np.ndarray
    omega: np.ndarray
    momentum: np.ndarray
    weight: float
    shapes: np.ndarray
    unknowns: int


def solve(mesh: Mesh, material: Material, contact: Point, bolt: Point) -> Piece:
    """Return the piece of three thirds with the mesh of one, whose contact edge is about `contact` [m]."""
    K, M = matrices(mesh, material)
    free, held = _constraints(mesh, contact, bolt)
    K, M = (sparse.block_diag([matrix] * 3, format="csr") for matrix in (K, M))
    inner = (free.T @ K @ free).tocsc()
    factors = splu(inner, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    static = held - free @ factors.solve((free.T @ (K @ held)).toarray())
    static = np.asarray(static)
    inner_mass = (free.T @ M @ free).tocsc()
    back = LinearOperator(inner.shape, matvec=factors.solve, dtype=float)  # type: ignore[call-arg]
    squares, vectors = eigsh(inner, MODES, inner_mass, sigma=0.0, OPinv=back, which="LM", v0=np.ones(inner.shape[0]))
    basis = np.hstack([static, free @ vectors])
    heavy = M @ basis
    rigid = _translations(len(mesh.points))
    return Piece(
        stiffness=_alike(_symmetric(static.T @ (K @ static))),
        mass=_symmetric(basis.T @ heavy),
        omega=np.sqrt(squares),
        momentum=heavy.T @ rigid,
        weight=float((rigid.T @ (M @ rigid))[0, 0]),
        shapes=static[2 * len(mesh.points) : 4 * len(mesh.points)],
        unknowns=inner.shape[0],
    )


def _constraints(mesh: Mesh, contact: Point, bolt: Point) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Return the displacements of the nodes of three thirds by free displacements and by interface coordinates."""
    n = len(mesh.points)
    edge, disc, fixed, cut = (mesh.on[label] for label in ("contact", "bolt", "fixed", "cut"))
    other = mesh.on["turned cut"]
    order = [np.hypot(*mesh.points[nodes].T).argsort() for nodes in (cut, other)]
    cut, other = cut[order[0]], other[order[1]]
    is_free = np.ones(n, dtype=bool)
    is_free[np.concatenate([edge, disc, fixed, other])] = False
    own = np.flatnonzero(is_free)
    column = np.full(n, -1)
    column[own] = np.arange(len(own))
    joined = ~np.isin(cut, fixed)
    cut, other = cut[joined], other[joined]
    same = sparse.kron(sparse.csr_array((np.ones(len(own)), (own, column[own])), (n, len(own))), np.eye(2))
    next_one = sparse.kron(sparse.csr_array((np.ones(len(cut)), (other, column[cut])), (n, len(own))), turn(OFFSETS[0]))
    free = sparse.kron(np.eye(3), same) + sparse.kron(np.eye(3)[list(NEIGHBOUR)], next_one)
    leg = np.zeros((n, 2, 6))
    for nodes, center, first in ((edge, contact, 0), (disc, bolt, 3)):
        x, y = (mesh.points[nodes] - center).T
        leg[nodes, 1, first] = -1.0
        leg[nodes, 0, first + 1] = 1.0
        leg[nodes, 0, first + 2], leg[nodes, 1, first + 2] = -y, x
    return free.tocsr(), sparse.csr_array(sparse.kron(np.eye(3), leg.reshape(2 * n, 6)))


def _translations(nodes: int) -> np.ndarray:
    """Return the displacements of the nodes of three thirds, in their frames, for unit ones along x', y' of leg 2."""
    return np.vstack([np.tile(turn(-offset), (nodes, 1)) for offset in OFFSETS])


def as_leg_2(leg: int) -> np.ndarray:
    """Return the places of the interface coordinates that the third of a leg (0 to 2) has in place of that of leg 2."""
    second = NEIGHBOUR[leg]
    order = (second, leg, NEIGHBOUR[second])
    return (len(COORDINATES) * np.array(order)[:, None] + np.arange(len(COORDINATES))).ravel()


def turn(angle: float) -> np.ndarray:
    """Return the matrix of a rotation by an angle [rad], shape (2, 2)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def _symmetric(matrix: np.ndarray) -> np.ndarray:
    """Return the symmetric part of a matrix, which is symmetric but for rounding."""
    return (matrix + matrix.T) / 2


def _alike(matrix: np.ndarray) -> np.ndarray:
    """Return a matrix on the interface coordinates with legs that are alike to all digits, not but for rounding."""
    order = (len(COORDINATES) * np.array(NEIGHBOUR)[:, None] + np.arange(len(COORDINATES))).ravel()
    once = matrix[np.ix_(order, order)]
    return (matrix + once + once[np.ix_(order, order)]) / 3
