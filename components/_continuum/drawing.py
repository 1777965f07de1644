"""Drawing of the whole piece at given elongations: its mesh, its deformation, magnified, and the stress in it."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hfsa.components._continuum.design import Continuum
from hfsa.components._continuum.elements import corner_stress, von_mises
from hfsa.components._continuum.piece import as_leg_2, turn
from hfsa.components._modelling.drawing import Drawing, Layer, Panel

_SHOWN = 0.05
"""Largest displacement as it is drawn, by the size of the piece."""
_WINDOW = 0.04
"""Distance from the largest stress of what its panel shows, by the size of the piece."""
_PARTS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
"""Straight triangles that stand for one of six nodes."""
_EDGES = np.array([[0, 3], [3, 1], [1, 4], [4, 2], [2, 5], [5, 0]])
"""Straight edges that stand for those of a triangle of six nodes."""


class Field(NamedTuple):
    """A deformed piece.

    Attributes:
        points: positions of the nodes without load, shape (n, 2) [m].
        triangles: nodes of the triangles, shape (m, 6).
        displacement: displacements of the nodes, shape (n, 2) [m].
        stress: von Mises stresses at the corners of the triangles, shape (m, 3) [Pa].
        joined: whether a node is on a cut between two thirds, shape (n,).
    """

    points: np.ndarray
    triangles: np.ndarray
    displacement: np.ndarray
    stress: np.ndarray
    joined: np.ndarray


def field(design: Continuum, elongation: Sequence[float]) -> Field:
    """Return the piece at elongations (3,) [m], in the axes of the stage."""
    solved = design.solved(design.size)
    stage, (mesh, piece), material = solved.stage, solved.solution, design.shape.material
    motion = np.concatenate([elongation, stage.statics.jacobian @ elongation])
    interface = stage.statics.interface @ motion
    every = np.arange(len(mesh.triangles))
    points, displacements, stresses = [], [], []
    for leg, push in enumerate(stage.pushes):
        to_stage = turn(np.arctan2(push[0], -push[1]))
        own = piece.shapes @ interface[as_leg_2(leg)]
        points.append(mesh.points @ to_stage.T)
        displacements.append(own.reshape(-1, 2) @ to_stage.T)
        stresses.append(von_mises(corner_stress(mesh, every, own, material), material))
    triangles = np.vstack([mesh.triangles + leg * len(mesh.points) for leg in range(len(points))])
    on_cut = np.isin(np.arange(len(mesh.points)), [*mesh.on["cut"], *mesh.on["turned cut"]])
    joined = np.tile(on_cut, len(points))
    return Field(np.vstack(points), triangles, np.vstack(displacements), np.vstack(stresses), joined)


def drawing(design: Continuum, elongation: Sequence[float]) -> Drawing:
    """Return the drawing of the piece at elongations (3,) [m]."""
    found = field(design, elongation)
    size = np.ptp(found.points, axis=0).max()
    largest = float(np.linalg.norm(found.displacement, axis=1).max())
    factor = _SHOWN * size / largest if largest else 1.0
    moved = found.points + factor * found.displacement
    rim = _rim(found.triangles, found.joined)
    peak = found.triangles[np.unravel_index(found.stress.argmax(), found.stress.shape)]
    mark = Layer(found.points[[peak]], np.array([[0]]), "mark", "largest stress")
    away = np.abs(found.points[found.triangles[:, :3]] - found.points[peak]).max(axis=(1, 2))
    at = ", ".join(f"{1e6 * value:.4g}" for value in elongation)
    plate = design.plate
    return Drawing(
        f"3-RRR stage, contact {plate.contact}, bolts {plate.bolts}, elongations {at} um",
        [
            _panel([Layer(found.points, _edges(found.triangles), "mark")], f"{len(found.triangles)} triangles", "mesh"),
            _panel(
                [
                    Layer(found.points, rim, "rest", "at rest"),
                    Layer(moved, rim, "moved", "moved", rest=found.points),
                    mark,
                ],
                f"Displacements up to {1e6 * largest:.4g} um, times {factor:.3g}",
                "displaced",
            ),
            _stress(found, away < _WINDOW * size),
        ],
    )


def _panel(layers: Sequence[Layer], title: str, kind: str) -> Panel:
    """Return a panel of the plane."""
    return Panel(layers, axes=("X", "Y"), title=title, kind=kind)


def _stress(found: Field, chosen: np.ndarray) -> Panel:
    """Return the panel of the stress over chosen triangles, linear between the corners of each."""
    title = f"About the largest stress, {found.stress.max() / 1e6:.4g} MPa"
    nodes, stress = found.triangles[chosen], found.stress[chosen]
    values = np.hstack([stress, (stress + np.roll(stress, -1, axis=1)) / 2])
    cells = 6 * np.arange(len(nodes))[:, None, None] + _PARTS
    layer = Layer(found.points[nodes.ravel()], cells.reshape(-1, 3), values=values.ravel())
    stress = {"quantity": "von Mises stress", "quantity_unit": "Pa"}
    return Panel([layer], axes=("X", "Y"), title=title, kind="stress", **stress)


def _edges(triangles: np.ndarray) -> np.ndarray:
    """Return the straight parts of the edges of triangles, each once, shape (k, 2)."""
    return np.unique(np.sort(triangles[:, _EDGES].reshape(-1, 2), axis=1), axis=0)


def _rim(triangles: np.ndarray, joined: np.ndarray) -> np.ndarray:
    """Return those that one triangle alone has and that are on no cut."""
    pairs, counts = np.unique(np.sort(triangles[:, _EDGES].reshape(-1, 2), axis=1), axis=0, return_counts=True)
    return pairs[(counts == 1) & ~joined[pairs].all(axis=1)]
