"""Plane elasticity on triangles of six nodes: stiffness, mass, and the stress at the corners of the triangles.

    stress = lambda tr(strain) 1 + 2 mu strain,   mu = E / (2 (1 + nu))
    lambda = E nu / (1 - nu^2) in plane stress,  E nu / ((1 + nu) (1 - 2 nu)) in plane strain

The displacement of node i has the places 2 i and 2 i + 1 of a vector. Source of the integrals: scikit-fem, of the extra
`fem`.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from hfsa.components._continuum.extra import library
from hfsa.components._continuum.meshing import Mesh
from hfsa.components._modelling.errors import ModelError

_ORDER = 4
"""Order of the quadrature; exact for mass and stiffness of triangles with straight edges."""
_NODES = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]])
_CORNERS = _NODES[:3]


class Material(NamedTuple):
    """Material and thickness of a plate.

    Attributes:
        modulus: Young's modulus [Pa].
        poisson: Poisson's ratio.
        density: density [kg/m3].
        depth: thickness [m].
        is_thick: whether it keeps its thickness, plane strain, not plane stress.
    """

    modulus: float
    poisson: float
    density: float
    depth: float
    is_thick: bool = False

    @property
    def lame(self) -> tuple[float, float]:
        """The moduli lambda of the plane and mu [Pa]."""
        E, nu = self.modulus, self.poisson
        plane = (1 + nu) * (1 - 2 * nu) if self.is_thick else 1 - nu**2
        return E * nu / plane, E / (2 * (1 + nu))


def matrices(mesh: Mesh, material: Material) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Return stiffness [N/m] and mass [kg] of a mesh, shape (2 n, 2 n); `ModelError` for an inverted triangle."""
    _check_triangles(mesh)
    fem = library("skfem")
    helpers = library("skfem.helpers")
    grid = fem.MeshTri2(mesh.points.T, mesh.triangles.T)
    basis = fem.Basis(grid, fem.ElementVector(fem.ElementTriP2()), intorder=_ORDER)
    first, second = material.lame

    def stiffness(u, v, _):
        strain, virtual = helpers.sym_grad(u), helpers.sym_grad(v)
        return first * helpers.trace(strain) * helpers.trace(virtual) + 2 * second * helpers.ddot(strain, virtual)

    def mass(u, v, _):
        return helpers.dot(u, v)

    place = np.empty(basis.N, dtype=int)
    own = 2 * np.repeat(mesh.triangles.T, 2, axis=0)
    own[1::2] += 1
    place[basis.element_dofs] = own
    by = sparse.csr_array((np.ones(basis.N), (place, np.arange(basis.N))))
    K, M = (by @ fem.BilinearForm(form).assemble(basis) @ by.T for form in (stiffness, mass))
    return sparse.csr_array(material.depth * K), sparse.csr_array(material.depth * material.density * M)


def corner_stress(mesh: Mesh, triangles: np.ndarray, displacement: np.ndarray, material: Material) -> np.ndarray:
    """Return the stresses xx, yy, xy [Pa] at the corners of triangles, shape (m, 3, 3, ...).

    `triangles` are their numbers (m,), `displacement` has the shape (2 n, ...); axis 1 is the corner, axis 2 the
    component.
    """
    nodes = mesh.triangles[triangles]
    slopes = _slopes(_CORNERS)
    jacobians = np.einsum("cia,mib->mcab", slopes, mesh.points[nodes])
    gradients = np.einsum("mcab,cib->mcia", np.linalg.inv(jacobians), slopes)
    moved = displacement.reshape(len(mesh.points), 2, -1)[nodes]
    gradient = np.einsum("mcib,miak->mcabk", gradients, moved)
    xx, yy = gradient[:, :, 0, 0], gradient[:, :, 1, 1]
    xy = gradient[:, :, 0, 1] + gradient[:, :, 1, 0]
    first, second = material.lame
    sphere = first * (xx + yy)
    stress = np.stack([sphere + 2 * second * xx, sphere + 2 * second * yy, second * xy], axis=2)
    return stress.reshape(*stress.shape[:3], *displacement.shape[1:])


def von_mises(stress: np.ndarray, material: Material) -> np.ndarray:
    """Return the von Mises stress [Pa] of stresses xx, yy, xy along the last axis."""
    return np.sqrt(von_mises_squared(stress[..., 0], stress[..., 1], stress[..., 2], material))


def von_mises_squared(xx: Any, yy: Any, xy: Any, material: Material) -> Any:
    """Return the square of the von Mises stress [Pa2], numbers or expressions."""
    zz = material.poisson * (xx + yy) if material.is_thick else 0.0
    return ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2 + 3 * xy**2


def _check_triangles(mesh: Mesh) -> None:
    """Raise `ModelError` where a triangle, or one of its curved edges, is inverted."""
    jacobians = np.einsum("cia,mib->mcab", _slopes(_NODES), mesh.points[mesh.triangles])
    inverted = np.flatnonzero((np.linalg.det(jacobians) <= 0).any(axis=1))
    if len(inverted):
        x, y = 1e3 * mesh.points[mesh.triangles[inverted[0], :3]].mean(axis=0)
        raise ModelError(
            f"{len(inverted)} triangles are inverted, the first near x' = {x:.4g} mm, y' = {y:.4g} mm; expected a "
            "finer mesh"
        )


def _slopes(at: np.ndarray) -> np.ndarray:
    """Return the slopes of the six shape functions at points (k, 2) of the unit triangle, shape (k, 6, 2)."""
    x, y = at.T
    z, zero = 1 - x - y, np.zeros(len(at))
    along_x = [1 - 4 * z, 4 * x - 1, zero, 4 * (z - x), 4 * y, -4 * y]
    along_y = [1 - 4 * z, zero, 4 * y - 1, -4 * x, 4 * x, 4 * (z - y)]
    return np.stack([np.array(along_x).T, np.array(along_y).T], axis=2)
