"""Picture of the links of the 3-RRR stage: cranks, couplers and platform at rest, and moved by the stacks.

Where the links are moved, each hinge has the colour of its bending stress. Its angle is the rotation between its links:
dtheta_i at A_i, dalpha_i - dtheta_i at B_i, and thz - dalpha_i at C_i.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from hfsa.components._mechanics.rrr_hinge import HINGES, Hinge
from hfsa.components._mechanics.rrr_kinematics import Links, corner_motion, forward, legs
from hfsa.components._modelling.drawing import Drawing, Layer, Moving, Panel, Role, columns, departing, named

_SHOWN = 0.15
"""Largest displacement drawn, relative to the radius of the platform."""
_LEAST = 1e-15
"""Least displacement that is drawn, relative to the radius of the platform."""
_WORDS = ("cranks", "couplers", "platform")
_FACE = np.array([[0, 1, 2]])
_BETWEEN = np.arange(6).reshape(2, 3).T
"""Cells of the lines between two rows of three points."""


def links_drawing(links: Links, hinge: Hinge, elongation: Sequence[float], title: str) -> Drawing:
    """Return the drawing of links at rest, and moved by elongations (3,) [m] with the stress of their hinges."""
    rest = [links.base_hinges, links.crank_ends, links.corners]
    panels = [_panel([*_chain(rest, "body", _WORDS), *_names(links)], "at rest", "at_rest")]
    pose = forward(links, elongation)
    moved = moved_hinges(links, pose)
    largest = max(float(np.linalg.norm(b - a, axis=1).max()) for a, b in zip(rest, moved, strict=True))
    if largest > _LEAST * links.radius:
        factor = _SHOWN * links.radius / largest
        shown = [a + factor * (b - a) for a, b in zip(rest, moved, strict=True)]
        words = f"x {1e6 * pose[0]:.4g} um, y {1e6 * pose[1]:.4g} um, yaw {1e3 * pose[2]:.4g} mrad, times {factor:.3g}"
        still = _chain(rest, "rest", ("at rest", "", ""))
        stressed = _stressed(hinge, hinge_angles(links, pose), np.vstack(shown), np.vstack(rest))
        layers = [*still, *departing(_chain(shown, "moved", ("moved", "", "")), still), stressed]
        panel = _panel(layers, words, "displaced")
        panels.append(replace(panel, quantity="bending stress of the hinges", quantity_unit="Pa"))
    return Drawing(title, panels)


def hinge_angles(links: Links, pose: np.ndarray) -> np.ndarray:
    """Return the angles of the nine hinges from rest at a pose (3,) [m, m, rad], in the order of `HINGES` [rad]."""
    symbol = ca.SX.sym("pose", 3)
    turned = legs(links, symbol)
    between = ca.vertcat(turned.crank, turned.coupler - turned.crank, symbol[2] - turned.coupler)
    return np.array(ca.Function("angles", [symbol], [between])(pose)).ravel()


def _stressed(hinge: Hinge, angles: np.ndarray, points: np.ndarray, rest: np.ndarray) -> Layer:
    """Return the hinges (9, 2) [m] with their bending stress at angles (9,) [rad]."""
    stress = hinge.stress_per_angle * np.abs(angles)
    share = stress / hinge.allowed_stress
    notes = [
        f"hinge {name}: {1e3 * angle:.4g} mrad, {1e-6 * size:.4g} MPa, {part:.3g} of the allowable stress"
        for name, angle, size, part in zip(HINGES, angles, stress, share, strict=True)
    ]
    return Layer(points, np.arange(len(points))[:, None], "mark", "hinges", values=stress, notes=notes, rest=rest)


def links_in_motion(links: Links) -> Moving:
    """Return the links as the platform moves."""
    panel = _panel(_chain([links.base_hinges, links.crank_ends, links.corners], "body", _WORDS), "3-RRR stage")
    symbol = ca.SX.sym("pose", 3)
    motion = ca.Function("motion", [symbol], [legs(links, symbol).crank, corner_motion(links, symbol)])

    def displacements(signals: Mapping[str, np.ndarray]) -> list[np.ndarray | None]:
        """Return the displacements of the ends of cranks and couplers, and of the corners."""
        poses = np.column_stack([columns(signals, "platform.position", 2), signals["platform.rotation"]])
        angles, corners = (np.array(part) for part in motion.map(len(poses))(poses.T))
        C = corners.T.reshape(len(poses), 3, 2)
        B = np.stack([_swing(crank, angle) for crank, angle in zip(links.cranks, angles, strict=True)], axis=1)
        return [np.concatenate([np.zeros_like(B), B], axis=1), np.concatenate([B, C], axis=1), C]

    return Moving(panel, [*named("platform.position", 2), "platform.rotation"], displacements)


def moved_hinges(links: Links, pose: np.ndarray) -> list[np.ndarray]:
    """Return the hinges A_i, B_i, C_i at a pose (3,) [m, m, rad], each of shape (3, 2) [m]."""
    symbol = ca.SX.sym("pose", 3)
    found = ca.Function("motion", [symbol], [legs(links, symbol).crank, corner_motion(links, symbol)])
    angles, corners = (np.array(part) for part in found(pose))
    turned = [_rotation(angle) @ crank for angle, crank in zip(angles.ravel(), links.cranks, strict=True)]
    return [links.base_hinges, links.base_hinges + np.array(turned), links.corners + corners.T]


def _chain(hinges: Sequence[np.ndarray], role: Role, words: tuple[str, str, str]) -> list[Layer]:
    """Return cranks, couplers and platform; `words` are their entries in the legend."""
    A, B, C = hinges
    return [
        Layer(np.vstack([A, B]), _BETWEEN, role, words[0]),
        Layer(np.vstack([B, C]), _BETWEEN, "moved" if role == "body" else role, words[1]),
        Layer(C, _FACE, role, words[2]),
    ]


def _names(links: Links) -> list[Layer]:
    """Return the hinges as points with their names."""
    layers = []
    for letter, points in (("A", links.base_hinges), ("B", links.crank_ends), ("C", links.corners)):
        texts = [f"{letter}{i}" for i in (1, 2, 3)]
        layers.append(Layer(points, np.array([[0], [1], [2]]), "mark", texts=texts))
    return layers


def _panel(layers: Sequence[Layer], title: str, kind: str = "") -> Panel:
    """Return a panel of the plane."""
    return Panel(layers, axes=("X", "Y"), title=title, kind=kind)


def _swing(vector: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Return the changes of a vector (2,) turned by angles (rows,), shape (rows, 2), exactly zero at angle zero."""
    less_one, sine = -2 * np.sin(angles / 2)[:, None] ** 2, np.sin(angles)[:, None]
    return less_one * vector + sine * np.array([-vector[1], vector[0]])


def _rotation(angle: float) -> np.ndarray:
    """Return the matrix of a rotation in the plane, shape (2, 2)."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
