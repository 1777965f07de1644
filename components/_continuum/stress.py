"""Stress at the necks of the stage: components at the corners of the triangles that meet a notch, by l and q.

The largest von Mises stress of a neck is that at one of these corners, not averaged over the triangles that meet
there. The stress of one load case is linear in l and q; by symmetry the third of leg i has the stress of that of leg 2
with the legs exchanged in turn. A stress that is continuous in truth jumps between triangles: half of the largest jump
at the node of the peak is an estimate of its error.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from hfsa.components._continuum.elements import Material, corner_stress, von_mises
from hfsa.components._continuum.meshing import Mesh
from hfsa.components._continuum.outline import NECKS
from hfsa.components._continuum.piece import COORDINATES, Piece, as_leg_2

_SIZE = len(COORDINATES)


class Peak(NamedTuple):
    """The largest von Mises stress of a neck over load cases.

    Attributes:
        stress: von Mises stress [Pa].
        jump: half of its largest jump between the triangles that meet there [Pa].
        case: number of the load case.
    """

    stress: float
    jump: float
    case: int


class NeckStress(NamedTuple):
    """Stresses xx, yy, xy at the corners of triangles, in the frame of their third.

    Attributes:
        nodes: nodes of the corners, shape (p,).
        by_motion: stresses by l and q, for each of the legs, shape (3, p, 3, 6) [Pa/m, Pa/rad].
        material: the material.
    """

    nodes: np.ndarray
    by_motion: np.ndarray
    material: Material

    def peak(self, leg: int, motions: np.ndarray) -> Peak:
        """Return the peak of a leg (0 to 2) over motions l, q, shape (c, 6)."""
        stress = np.einsum("pkm,cm->pck", self.by_motion[leg], motions)
        equivalent = von_mises(stress, self.material)
        corner, case = np.unravel_index(np.argmax(equivalent), equivalent.shape)
        there = equivalent[self.nodes == self.nodes[corner], case]
        return Peak(float(equivalent[corner, case]), float(np.ptp(there)) / 2, int(case))


def neck_stresses(mesh: Mesh, piece: Piece, material: Material, interface: np.ndarray) -> Mapping[str, NeckStress]:
    """Return the stresses of each neck A to D; `interface` (18, 6) are the interface coordinates by l and q."""
    legs = [interface[rows] for rows in map(as_leg_2, range(3))]
    displacement = piece.shapes @ np.stack(legs, axis=1).reshape(3 * _SIZE, -1)
    found = {}
    for neck in NECKS:
        near = np.flatnonzero(np.isin(mesh.triangles, mesh.on[neck]).any(axis=1))
        stress = corner_stress(mesh, near, displacement, material)
        by_motion = np.moveaxis(stress.reshape(-1, 3, 3, interface.shape[1]), 2, 0)
        found[neck] = NeckStress(mesh.triangles[near, :3].ravel(), by_motion, material)
    return found
