"""Finite elements: a second assembly by hand, rigid motions, uniform strain, and a neck of its own."""

import numpy as np
import pytest

pytest.importorskip("gmsh")
pytest.importorskip("skfem")

from scipy.sparse.linalg import spsolve

from hfsa.components import ModelError
from hfsa.components._continuum.boundary import Boundary, arcs, line
from hfsa.components._continuum.elements import Material, corner_stress, matrices, von_mises
from hfsa.components._continuum.meshing import Mesh, mesh

PLATE = Material(101e9, 0.3, 8250.0, 10e-3)
THICK = PLATE._replace(is_thick=True)
T, R, STUB, WIDTH = 0.8e-3, 1e-3, 2e-3, 10e-3


def neck(size: float, stub: float = STUB, width: float = WIDTH) -> Mesh:
    """A neck between two stubs of a width, its axis along x; the ends are `left` and `right`."""
    g, end, half = T / 2 + R, R + stub, width / 2
    upper = arcs((0.0, g), R, [-np.pi / 2, -np.pi], "notch")
    lower = arcs((0.0, -g), R, [np.pi / 2, 0.0], "notch")
    outer = [
        *line((-R, -half), (-R, -g)),
        *lower,
        *line((R, -half), (end, -half)),
        *line((end, half), label="right"),
        *line((R, half), (R, g)),
        *upper,
        *line((-R, half), (-end, half)),
        *line((-end, -half), label="left"),
    ]
    return mesh(Boundary(outer), {"notch": size})


COARSE = neck(0.3e-3)


def by_hand(mesh: Mesh, plate: Material) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass, dense, by shape functions written in area coordinates and a rule of degree five."""
    a, b = 0.445948490915965, 0.091576213509771
    points = [(1 - 2 * p, p) for p in (a, b)] + [(p, p) for p in (a, b)] + [(p, 1 - 2 * p) for p in (a, b)]
    weights = [0.223381589678011, 0.109951743655322] * 3
    E, nu = plate.modulus, plate.poisson
    if plate.is_thick:
        E, nu = E / (1 - nu**2), nu / (1 - nu)
    D = E / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    n = 2 * len(mesh.points)
    K, M = np.zeros((n, n)), np.zeros((n, n))
    for nodes in mesh.triangles:
        x = mesh.points[nodes]
        dofs = np.column_stack([2 * nodes, 2 * nodes + 1]).ravel()
        for (s, t), weight in zip(points, weights, strict=True):
            L = np.array([1 - s - t, s, t])
            dL = np.array([[-1, -1], [1, 0], [0, 1]])
            pairs = [(0, 1), (1, 2), (2, 0)]
            N = np.array([*(L * (2 * L - 1)), *(4 * L[i] * L[j] for i, j in pairs)])
            dN = np.vstack([(4 * L - 1)[:, None] * dL, [4 * (L[i] * dL[j] + L[j] * dL[i]) for i, j in pairs]])
            jacobian = dN.T @ x
            slopes = np.linalg.solve(jacobian, dN.T)
            B = np.zeros((3, 12))
            B[0, ::2], B[1, 1::2] = slopes
            B[2, ::2], B[2, 1::2] = slopes[1], slopes[0]
            area = weight * np.linalg.det(jacobian) / 2 * plate.depth
            K[np.ix_(dofs, dofs)] += area * B.T @ D @ B
            M[np.ix_(dofs, dofs)] += area * plate.density * np.kron(np.outer(N, N), np.eye(2))
    return K, M


@pytest.mark.parametrize("plate", [PLATE, THICK], ids=["stress", "strain"])
def test_a_second_assembly_gives_the_same_matrices(plate):
    """Rules of degree four and five agree to what curved edges leave."""
    K, M = (matrix.toarray() for matrix in matrices(COARSE, plate))
    own_K, own_M = by_hand(COARSE, plate)
    assert np.abs(K - own_K).max() < 2e-5 * np.abs(K).max()
    assert np.abs(M - own_M).max() < 2e-5 * np.abs(M).max()


def test_the_same_rule_gives_the_same_matrices_to_rounding():
    """On straight edges every rule is exact."""
    x = COARSE.points.copy()
    for i, (one, other) in enumerate(((0, 1), (1, 2), (2, 0))):
        x[COARSE.triangles[:, 3 + i]] = (x[COARSE.triangles[:, one]] + x[COARSE.triangles[:, other]]) / 2
    straight = COARSE._replace(points=x)
    for found, own in zip(matrices(straight, PLATE), by_hand(straight, PLATE), strict=True):
        assert np.abs(found.toarray() - own).max() < 1e-11 * np.abs(own).max()


def test_an_inverted_triangle_is_refused():
    """A node of an edge, pulled over the opposite corner."""
    x = COARSE.points.copy()
    corner, middle = COARSE.triangles[0, 2], COARSE.triangles[0, 3]
    x[middle] += 1.5 * (x[corner] - x[middle])
    with pytest.raises(ModelError, match=r"triangles are inverted, the first near .* expected a finer mesh"):
        matrices(COARSE._replace(points=x), PLATE)


def test_rigid_motions_cost_nothing_and_weigh_the_plate():
    K, M = matrices(COARSE, PLATE)
    x, y = COARSE.points.T
    rigid = np.zeros((2 * len(x), 3))
    rigid[::2, 0], rigid[1::2, 1] = 1.0, 1.0
    rigid[::2, 2], rigid[1::2, 2] = -y, x
    assert np.abs(K @ rigid).max() < 1e-10 * abs(K).max()
    # two half circles are cut from the plate; quadratic edges follow them to 1e-5
    plate = (2 * STUB * WIDTH + 2 * R * 2 * (T / 2 + R) - np.pi * R**2) * PLATE.depth * PLATE.density
    weights = (rigid.T @ (M @ rigid))[[0, 1], [0, 1]]
    np.testing.assert_allclose(weights, plate, rtol=2e-5)


@pytest.mark.parametrize("plate", [PLATE, THICK], ids=["stress", "strain"])
def test_uniform_strain_has_uniform_stress(plate):
    """Curved triangles of six nodes hold a linear displacement exactly; Hooke's law gives the stress."""
    strain = np.array([[3e-4, 1e-4], [2e-4, -5e-4]])
    moved = (COARSE.points @ strain.T).ravel()
    stress = corner_stress(COARSE, np.arange(len(COARSE.triangles)), moved, plate)
    E, nu = plate.modulus, plate.poisson
    xx, yy, xy = strain[0, 0], strain[1, 1], strain[0, 1] + strain[1, 0]
    if plate.is_thick:
        scale = E / ((1 + nu) * (1 - 2 * nu))
        expected = [scale * ((1 - nu) * xx + nu * yy), scale * ((1 - nu) * yy + nu * xx), E / (2 * (1 + nu)) * xy]
    else:
        scale = E / (1 - nu**2)
        expected = [scale * (xx + nu * yy), scale * (yy + nu * xx), E / (2 * (1 + nu)) * xy]
    np.testing.assert_allclose(stress, np.broadcast_to(expected, stress.shape), rtol=1e-9)


def test_von_mises_of_simple_states():
    """Tension counts once, shear by the root of three, and equal tension in all directions not at all."""
    assert von_mises(np.array([100.0, 0.0, 0.0]), PLATE) == pytest.approx(100)
    assert von_mises(np.array([0.0, 0.0, 100.0]), PLATE) == pytest.approx(100 * np.sqrt(3))
    assert von_mises(np.array([100.0, 100.0, 0.0]), PLATE) == pytest.approx(100)
    incompressible = THICK._replace(poisson=0.5)
    assert von_mises(np.array([100.0, 100.0, 0.0]), incompressible) == pytest.approx(0, abs=1e-9)


def neck_stiffness(plate: Material, size: float, stub: float = STUB) -> np.ndarray:
    """Stiffness on the displacement and rotation of one end about the neck, the other held, shape (3, 3)."""
    found = neck(size, stub)
    K, _ = matrices(found, plate)
    left, right = found.on["left"], found.on["right"]
    rigid = np.zeros((2 * len(found.points), 3))
    for nodes in (right,):
        x, y = found.points[nodes].T
        rigid[2 * nodes, 0], rigid[2 * nodes + 1, 1] = 1.0, 1.0
        rigid[2 * nodes, 2], rigid[2 * nodes + 1, 2] = -y, x
    held = np.concatenate([[2 * k, 2 * k + 1] for k in (*left, *right)])
    free = np.setdiff1d(np.arange(2 * len(found.points)), held)
    rigid[free] = -spsolve(K[free][:, free].tocsc(), (K @ rigid)[free])
    return rigid.T @ (K @ rigid)


@pytest.mark.parametrize(
    ("plate", "stub", "bending", "across", "along"),
    [(PLATE, 2e-3, 34.54, 73.2, 284), (PLATE, 4e-3, 34.28, 63.3, 234), (THICK, 2e-3, 37.99, 79.7, 319)],
    ids=["stress", "long-stubs", "strain"],
)
def test_a_neck_has_the_reference_stiffnesses(plate, stub, bending, across, along):
    """In bending [N.m/rad], across with the rotation free and along [N/um]; to what is printed of them."""
    C = np.linalg.inv(neck_stiffness(plate, 0.05e-3, stub))
    assert 1 / C[2, 2] == pytest.approx(bending, rel=5e-4)
    assert 1e-6 / C[0, 0] == pytest.approx(along, rel=5e-3)
    assert 1e-6 / C[1, 1] == pytest.approx(across, rel=5e-3)
