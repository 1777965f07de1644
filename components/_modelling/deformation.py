"""A deformed body, for a picture: its mesh, displacements and stresses."""

from typing import NamedTuple

import numpy as np


class Deformation(NamedTuple):
    """A body of triangles of six nodes: corners counter-clockwise, then the nodes halfway from 1 to 2, 2 to 3, 3 to 1.

    Attributes:
        title: what it is, in words.
        points: positions of the nodes without load, shape (n, 2) [m].
        triangles: nodes of the triangles, shape (m, 6).
        displacement: displacements of the nodes, shape (n, 2) [m].
        stress: von Mises stresses at the corners of the triangles, shape (m, 3) [Pa].
    """

    title: str
    points: np.ndarray
    triangles: np.ndarray
    displacement: np.ndarray
    stress: np.ndarray
