"""Meshes: their area, their arcs, equal cuts, and triangles that nothing inverts."""

import subprocess
import sys

import numpy as np
import pytest

pytest.importorskip("gmsh")
pytest.importorskip("skfem")

from continuum_references import SIZE, design

from hfsa.components._continuum.outline import NECKS, centers
from hfsa.components._mechanics.rrr_hinge import Hinge
from hfsa.components._mechanics.rrr_kinematics import NOMINAL
from hfsa.components._mechanics.rrr_outline import Outline


@pytest.fixture(scope="module")
def mesh():
    return design().solved(SIZE).solution.mesh


def test_the_mass_is_that_of_the_outline():
    """0.214112 kg to 1e-5: quadratic edges follow the arcs."""
    assert design().solved(SIZE).solution.piece.weight == pytest.approx(0.214112, rel=1e-5)


def test_no_triangle_is_inverted(mesh):
    """The Jacobian at corners and middles of edges, by the slopes of the six shape functions, is above 0."""
    x = mesh.points[mesh.triangles]
    for s, t in ((0, 0), (1, 0), (0, 1), (0.5, 0), (0.5, 0.5), (0, 0.5)):
        z = 1 - s - t
        along = np.array([1 - 4 * z, 4 * s - 1, 0, 4 * (z - s), 4 * t, -4 * t]) @ x
        across = np.array([1 - 4 * z, 0, 4 * t - 1, -4 * s, 4 * s, 4 * (z - t)]) @ x
        assert (along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]).min() > 0


def test_nodes_of_the_notches_and_holes_are_on_their_arcs(mesh):
    at, r, g = centers(NOMINAL, Hinge(), Outline()), 1e-3, 1.4e-3
    for neck in NECKS:
        center, along = np.array(getattr(at, neck)), np.array([0, 1] if neck == "A" else [1, 0])
        points = mesh.points[mesh.on[neck]] - center
        away = [np.hypot(*(points - side * g * along).T) for side in (1, -1)]
        np.testing.assert_allclose(np.minimum(*away), r, rtol=1e-9)
        assert len(points) >= 2 * (2 * round(np.pi * r / SIZE) + 1)
    np.testing.assert_allclose(np.hypot(*(mesh.points[mesh.on["bolt"]] - at.bolt).T), 2.5e-3, rtol=1e-9)


def test_one_cut_is_the_other_turned(mesh):
    """By 120 degrees, node by node."""
    cut, other = (mesh.points[mesh.on[label]] for label in ("cut", "turned cut"))
    turned = cut @ np.array([[-0.5, -np.sqrt(0.75)], [np.sqrt(0.75), -0.5]]).T
    order = [np.argsort(np.hypot(*points.T)) for points in (turned, other)]
    np.testing.assert_allclose(turned[order[0]], other[order[1]], atol=1e-14)


def test_the_mesher_leaves_signals_and_locale_of_the_process():
    """It resets both as it starts; with SIGPIPE at its default a worker that dies would end its parent."""
    code = (
        "import locale, os, signal\n"
        "from hfsa.components._continuum import meshing\n"
        "before = locale.setlocale(locale.LC_ALL)\n"
        "with meshing._session():\n    pass\n"
        "assert locale.setlocale(locale.LC_ALL) == before\n"
        "end, start = os.pipe()\n"
        "os.close(end)\n"
        "try:\n    os.write(start, b'x')\n"
        "except BrokenPipeError:\n    print('alive')\n"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "alive\n"
