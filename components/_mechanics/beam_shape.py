"""Shape of a beam module: its beams between their bodies as layers of a drawing, at rest and displaced.

A beam that is clamped to two bodies has the shape of cubic polynomials; with the displacement u of its tip relative to
the body at its start, s from 0 to 1 along it, and its length l:

    x' = s u_x,   y' = (3 s^2 - 2 s^3) u_y + (s^3 - s^2) l u_thz,   z' = (3 s^2 - 2 s^3) u_z - (s^3 - s^2) l u_thy

Bodies are drawn through the ends of their beams. Coordinates are relative to the reference point.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from hfsa.components._mechanics.beam_assembly import BASE, PLATFORM, Placed, at_point, displacements
from hfsa.components._modelling.drawing import Layer, Role

_POINTS = 17
"""Points along a beam."""
_SHIFT = 0.15
"""Largest displacement drawn, relative to the size of the module."""
_FLAT = 1e-6
"""Size of a body across a direction, relative to its largest, below which it is flat."""


def at_rest(beams: Sequence[Placed], scale: float, role: Role) -> list[Layer]:
    """Return beams, sheets and bodies at rest."""
    layers = strips_at_rest(beams, scale, role, "beams" if role == "body" else "")
    for body, points in _ends(beams, [_line(beam) for beam in beams]).items():
        looks: dict[str, Role] = {BASE: "mark", PLATFORM: "body"} if role == "body" else {}
        layers += _hull(scale * points, looks.get(body, "rest"), body if role == "body" else "")
    return layers


def strips_at_rest(beams: Sequence[Placed], scale: float, role: Role = "body", name: str = "") -> list[Layer]:
    """Return beams and sheets at rest: lines, and faces where any are wide, on the same points."""
    widths = [np.tile(beam.width * beam.place.axes[2], (_POINTS, 1)) for beam in beams]
    return _strips([_line(beam) for beam in beams], widths, scale, role, name)


def platform_at_rest(beams: Sequence[Placed], scale: float, role: Role = "body", name: str = "") -> list[Layer]:
    """Return the platform at rest, no layer where a single beam carries it."""
    return _hull(scale * _ends(beams, [_line(beam) for beam in beams])[PLATFORM], role, name)


def moved(beams: Sequence[Placed], platform: np.ndarray, size: float, scale: float) -> list[Layer]:
    """Return beams, sheets and platform after a displacement of the platform (6,), at a visible scale."""
    shifts, ends = strip_shifts(beams, platform), platform_shifts(beams, platform)
    factor = _SHIFT * size / float(np.abs(shifts).max())
    strips = strips_at_rest(beams, scale, "moved", "displaced")
    hull = platform_at_rest(beams, scale, "moved")
    return [
        *(replace(layer, points=layer.points + scale * factor * shifts, rest=layer.points) for layer in strips),
        *(replace(layer, points=layer.points + scale * factor * ends, rest=layer.points) for layer in hull),
    ]


def strip_shifts(beams: Sequence[Placed], platform: np.ndarray) -> np.ndarray:
    """Return the displacements of the points of `strips_at_rest`, (points, 3), for one of the platform (6,)."""
    q = displacements([beam.place for beam in beams], [beam.stiffness for beam in beams], platform)
    sides = []
    for beam in beams:
        along, across = _along(beam, q), beam.width * _turned_width(beam, q) / 2
        sides += [along - across, along + across]
    return np.vstack(sides)


def platform_shifts(beams: Sequence[Placed], platform: np.ndarray) -> np.ndarray:
    """Return the displacements of the ends of the beams at the platform, (ends, 3), for its own displacement (6,)."""
    q = displacements([beam.place for beam in beams], [beam.stiffness for beam in beams], platform)
    return _ends(beams, [_along(beam, q) for beam in beams])[PLATFORM]


def _line(beam: Placed) -> np.ndarray:
    """Return points along a beam at rest, shape (points, 3)."""
    return np.linspace(beam.place.start(beam.length), beam.place.tip, _POINTS)


def _along(beam: Placed, q: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the displacements of points along a beam, shape (points, 3), for those of its bodies."""
    place, s = beam.place, np.linspace(0.0, 1.0, _POINTS)
    u, root = _across(beam, q), q[place.root]
    bend, turn = 3 * s**2 - 2 * s**3, beam.length * (s**3 - s**2)
    own = np.column_stack([s * u[0], bend * u[1] + turn * u[5], bend * u[2] - turn * u[4]]) @ place.axes
    return own + root[:3] + np.cross(root[3:], _line(beam))


def _turned_width(beam: Placed, q: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the displacement of the direction of the width along a beam by its twist, shape (points, 3)."""
    twist = np.outer(np.linspace(0.0, 1.0, _POINTS), _across(beam, q)[3] * beam.place.axes[0])
    return np.cross(twist + q[beam.place.root][3:], beam.place.axes[2])


def _across(beam: Placed, q: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the displacement across a beam, at its tip and along its axes, shape (6,)."""
    return at_point(beam.place.tip, beam.place.axes) @ (q[beam.place.body] - q[beam.place.root])


def _strips(
    lines: Sequence[np.ndarray], widths: Sequence[np.ndarray], scale: float, role: Role, name: str
) -> list[Layer]:
    """Return layers of lines, and of strips where beams are wide, from points and widths along each, (points, 3)."""
    n = np.arange(_POINTS - 1)
    points, edges, faces = [], [], []
    for k, (line, width) in enumerate(zip(lines, widths, strict=True)):
        first = 2 * k * _POINTS + n
        points += [line - width / 2, line + width / 2]
        edges.append(np.column_stack([first, first + 1]))
        if np.any(width):
            other = first + _POINTS
            edges.append(np.column_stack([other, other + 1]))
            faces += [np.column_stack([first, first + 1, other + 1]), np.column_stack([first, other + 1, other])]
    everything = scale * np.vstack(points)
    layers = [Layer(everything, np.vstack(edges), role, name)]
    return [*layers, Layer(everything, np.vstack(faces), role)] if faces else layers


def _ends(beams: Sequence[Placed], lines: Sequence[np.ndarray]) -> dict[str, np.ndarray]:
    """Return the ends of beams by body, (ends, 3)."""
    ends: dict[str, list[np.ndarray]] = {}
    for beam, line in zip(beams, lines, strict=True):
        ends.setdefault(beam.place.root, []).append(line[0])
        ends.setdefault(beam.place.body, []).append(line[-1])
    return {body: np.array(points) for body, points in ends.items()}


def _hull(points: np.ndarray, role: Role, name: str) -> list[Layer]:
    """Return the hull of points as a layer of faces, of a line where they are on one, and none of a single point."""
    center = points.mean(axis=0)
    _, sizes, directions = np.linalg.svd(points - center)
    rank = int(np.sum(sizes > _FLAT * sizes[0])) if sizes[0] > 0 else 0
    flat = (points - center) @ directions[:rank].T
    if rank == 0:
        return []
    try:
        return [Layer(points, _faces(flat, rank), role, name)]
    except QhullError:  # of a size that rounding hides
        return []


def _faces(flat: np.ndarray, rank: int) -> np.ndarray:
    """Return the faces of the hull of points in `rank` dimensions, by their indices; `QhullError` without a hull."""
    if rank == 1:
        return np.array([[np.argmin(flat), np.argmax(flat)]])
    if rank == 2:
        corners = ConvexHull(flat).vertices
        return np.array([[corners[0], corners[i], corners[i + 1]] for i in range(1, len(corners) - 1)])
    return np.asarray(ConvexHull(flat).simplices, dtype=int)


def size_of(beams: Sequence[Placed]) -> float:
    """Return half the diagonal of the box around the beams."""
    points = np.array([end for beam in beams for end in (beam.place.tip, beam.place.start(beam.length))])
    return float(np.linalg.norm(np.ptp(points, axis=0))) / 2
