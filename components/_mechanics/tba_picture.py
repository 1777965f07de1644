"""Picture of the accelerometer in its plane: frame, limbs and proof mass at home, and displaced along each axis.

Limb i has two links of length h at angles a1, a2, each a pair of parallel legs, b apart, with a bar between the pairs.
It rises from the middle of a side of the frame to that of the proof mass, whose displacement (x, y) in the frame of
the limb gives, with r and t the length and the angle of (x, sqrt(2) h + y),

    a1 = t + acos(r / (2 h)),    a2 = t - acos(r / (2 h))
"""

import math
from collections.abc import Mapping

import numpy as np

from hfsa.components._mechanics.tba_design import Shape, link_length
from hfsa.components._modelling.drawing import Drawing, Layer, Moving, Panel, Role, columns, departing, named

_SHIFT = 0.25
"""Displacement drawn, relative to the length of a link."""


def sensor_drawing(shape: Shape, limbs: int, title: str) -> Drawing:
    """Return the drawing of a sensor with a number of limbs."""
    reach = _SHIFT * float(link_length(shape, limbs))
    panels = [_panel(shape, limbs, np.zeros(2), "at home")]
    for axis, shift in (("x", np.array([reach, 0.0])), ("y", np.array([0.0, reach]))):
        panels.append(_panel(shape, limbs, shift, f"displaced along {axis}, {1e6 * reach:.4g} um"))
    return Drawing(title, panels)


def sensor_in_motion(shape: Shape, limbs: int) -> Moving:
    """Return the sensor as its proof mass moves in the plane."""
    home = np.zeros(2)
    panel = _panel(shape, limbs, home, "accelerometer")
    at_home = limb_points(shape, limbs, home)

    def displacements(signals: Mapping[str, np.ndarray]) -> list[np.ndarray | None]:
        """Return the displacements of the ends of the legs, and of the proof mass."""
        shifts = columns(signals, "proof_mass.position", 2)
        ends = np.array([(limb_points(shape, limbs, shift) - at_home).reshape(-1, 2) for shift in shifts])
        return [None, ends, ends, np.repeat(shifts[:, None], limbs + 1, axis=1)]

    return Moving(panel, named("proof_mass.position", 2), displacements)


def limb_points(shape: Shape, limbs: int, shift: np.ndarray) -> np.ndarray:
    """Return the ends of the legs at a displacement of the proof mass (2,) [m].

    Shape (limbs, 3, 2, 2): by limb, level (frame, bar, proof mass), leg of the pair, and coordinate along the
    sensor's axes [m].
    """
    h, apart = float(link_length(shape, limbs)), np.array([[-1.0, 0.0], [1.0, 0.0]]) * shape.b / 2
    root = np.array([0.0, -shape.s / (2 * math.tan(math.pi / limbs))])
    found = []
    for i in range(limbs):
        angle = 2 * math.pi * i / limbs
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        end = np.array([0.0, math.sqrt(2) * h]) + turn.T @ shift
        a1 = math.atan2(end[1], end[0]) + math.acos(np.linalg.norm(end) / (2 * h))
        knee = h * np.array([math.cos(a1), math.sin(a1)])
        found.append([(root + at + apart) @ turn.T for at in (np.zeros(2), knee, end)])
    return np.array(found)


def _panel(shape: Shape, limbs: int, shift: np.ndarray, title: str) -> Panel:
    """Return the panel of the sensor at a displacement of the proof mass (2,) [m]."""
    is_moved = bool(np.any(shift))
    layers = [_polygon(shape.s, limbs, np.zeros(2), "mark", "" if is_moved else "frame")]
    if not is_moved:
        layers += _moving(shape, limbs, shift, "body", ("legs", "bars", "proof mass"))
    else:
        rest = _moving(shape, limbs, np.zeros(2), "rest", ("", "", ""))
        moved = _moving(shape, limbs, shift, "moved", ("displaced", "", ""))
        layers += [*rest, *departing(moved, rest)]
    return Panel(layers, axes=("X", "Y"), title=title, kind="displaced" if is_moved else "at_rest")


def _moving(shape: Shape, limbs: int, shift: np.ndarray, role: Role, words: tuple[str, str, str]) -> list[Layer]:
    """Return legs, bars and proof mass; `words` are their entries in the legend."""
    points = limb_points(shape, limbs, shift)
    index = np.arange(points[..., 0].size).reshape(points.shape[:-1])
    legs = np.stack([index[:, :-1], index[:, 1:]], axis=-1).reshape(-1, 2)
    flat = points.reshape(-1, 2)
    return [
        Layer(flat, legs, role, words[0]),
        Layer(flat, index[:, 1], "rest" if role == "body" else role, words[1]),
        _polygon(shape.a, limbs, shift, role, words[2]),
    ]


def _polygon(side: float, sides: int, center: np.ndarray, role: Role, name: str) -> Layer:
    """Return a regular polygon whose first side has its middle at the least y: the frame's edges, a body's faces."""
    radius = side / (2 * math.sin(math.pi / sides))
    angles = -math.pi / 2 - math.pi / sides + 2 * math.pi * np.arange(sides) / sides
    corners = center + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    first = np.arange(sides)
    edges = np.column_stack([first, np.roll(first, -1)])
    if role == "mark":
        return Layer(corners, edges, role, name)
    return Layer(np.vstack([corners, center]), np.column_stack([edges, np.full(sides, sides)]), role, name)
