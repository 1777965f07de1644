"""Boundary of a plane region: closed loops of lines and circular arcs, each edge with a label."""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from hfsa.components._modelling.errors import ModelError

Point = tuple[float, float]

_CHORDS = 8
"""Chords that stand for an arc where crossings are looked for."""


class Edge(NamedTuple):
    """The edge of a loop that ends at `end`; with a `center` an arc of less than half a turn [m]."""

    end: Point
    center: Point | None = None
    label: str = ""


Loop = Sequence[Edge]
"""A closed loop: each edge starts where the one before ends, the first where the last ends."""


class Boundary(NamedTuple):
    """Outer loop of a region, counter-clockwise, and its holes."""

    outer: Loop
    holes: tuple[Loop, ...] = ()

    @property
    def loops(self) -> tuple[Loop, ...]:
        """All loops, the outer one first."""
        return (self.outer, *self.holes)


def line(*points: Point, label: str = "") -> list[Edge]:
    """Return straight edges to points, one after the other."""
    return [Edge(point, None, label) for point in points]


def arcs(center: Point, radius: float, angles: Iterable[float], label: str) -> list[Edge]:
    """Return arcs about a centre to points at polar angles [rad], from the point where the loop is."""
    return [
        Edge((center[0] + radius * math.cos(angle), center[1] + radius * math.sin(angle)), center, label)
        for angle in angles
    ]


def circle(center: Point, radius: float, label: str) -> list[Edge]:
    """Return a full circle as a loop of four arcs."""
    return arcs(center, radius, np.pi / 2 * np.arange(1, 5), label)


def starts(loop: Loop) -> Iterator[tuple[Point, Edge]]:
    """Iterate over the edges of a loop, each with the point where it starts."""
    return zip([loop[-1].end, *(edge.end for edge in loop[:-1])], loop, strict=True)


def polygon(loop: Loop) -> np.ndarray:
    """Return the vertices of a loop with chords in place of its arcs, shape (n, 2) [m]."""
    points: list[np.ndarray] = []
    for start, edge in starts(loop):
        first, last = np.array(start), np.array(edge.end)
        if edge.center is not None:
            about = np.array(edge.center)
            begin, change = _angles(first - about, last - about)
            turned = begin + change * np.arange(1, _CHORDS) / _CHORDS
            points.extend(about + np.hypot(*(first - about)) * np.column_stack([np.cos(turned), np.sin(turned)]))
        points.append(last)
    return np.array(points)


def check_simple(boundary: Boundary, what: str) -> None:
    """Raise `ModelError` with the place where the boundary of a region touches or crosses itself."""
    corners = [polygon(loop) for loop in boundary.loops]
    a = np.vstack(corners)
    b = np.vstack([np.roll(points, -1, axis=0) for points in corners])
    first, second = np.triu_indices(len(a), 1)
    apart = np.any(a[first] != b[second], axis=1) & np.any(b[first] != a[second], axis=1)
    first, second = first[apart], second[apart]
    meet = (_side(a[first], b[first], a[second]) * _side(a[first], b[first], b[second]) <= 0) & (
        _side(a[second], b[second], a[first]) * _side(a[second], b[second], b[first]) <= 0
    )
    overlap = np.all(
        (np.minimum(a[first], b[first]) <= np.maximum(a[second], b[second]))
        & (np.minimum(a[second], b[second]) <= np.maximum(a[first], b[first])),
        axis=1,
    )
    found = np.flatnonzero(meet & overlap)
    if len(found):
        x, y = 1e3 * (a[first[found[0]]] + b[first[found[0]]]) / 2
        raise ModelError(f"{what} crosses itself near x' = {x:.4g} mm, y' = {y:.4g} mm; expected edges that are apart")


def _angles(start: np.ndarray, end: np.ndarray) -> tuple[float, float]:
    """Return the polar angle of a vector and the change to another one, the shorter way [rad]."""
    change = math.atan2(start[0] * end[1] - start[1] * end[0], float(start @ end))
    return math.atan2(start[1], start[0]), change


def _side(start: np.ndarray, end: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return on which side of lines (n, 2) to (n, 2) points (n, 2) are, above 0 on the left."""
    along, to = end - start, points - start
    return along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0]
