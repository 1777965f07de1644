"""Meshes of plane regions: triangles of six nodes, curved at arcs, small at chosen edges.

    size = min(coarsest, size at an edge + 0.25 distance from it)      over the edges with a size

Source of the triangles: gmsh, of the extra `fem`.
"""

import ctypes
import locale
import math
import signal
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from hfsa.components._continuum.boundary import Boundary, starts
from hfsa.components._continuum.extra import library
from hfsa.components._modelling.errors import ModelError

COARSEST = 2.5e-3
"""Largest size of a triangle [m]."""
_GROWTH = 0.25
_SAMPLES = 100
"""Points of an edge from which distances are taken."""
_MM = 1e3
"""Meshes are made in mm, for which the mesher's absolute tolerances are meant."""
_TRIANGLE = 9
"""Number of the mesher for a triangle of six nodes."""


class Mesh(NamedTuple):
    """Triangles of six nodes: corners counter-clockwise, then the nodes halfway from 1 to 2, 2 to 3 and 3 to 1.

    Attributes:
        points: positions of the nodes, shape (n, 2) [m].
        triangles: nodes of the triangles, shape (m, 6).
        on: nodes on the edges of each label, ascending, shapes (k,).
    """

    points: np.ndarray
    triangles: np.ndarray
    on: Mapping[str, np.ndarray]


def mesh(boundary: Boundary, sizes: Mapping[str, float], turned: Mapping[str, str] | None = None) -> Mesh:
    """Return the mesh of a region with triangles of given sizes [m] at the edges of the labels `sizes`.

    `turned` maps a label to that of the edges which are its edges turned about the origin, in reverse order along the
    loop; their nodes are the same, turned.

    Raises:
        ModelError: the extra `fem` is not installed; the region cannot be meshed.
    """
    with _session() as gmsh:
        by_label = _geometry(gmsh, boundary)
        for label, of in (turned or {}).items():
            for slave, master in zip(reversed(by_label[of]), by_label[label], strict=True):
                gmsh.model.mesh.setPeriodic(1, [slave], [master], _turn(gmsh, master, slave))
        _set_sizes(gmsh, sizes, by_label)
        try:
            gmsh.model.mesh.generate(2)
            gmsh.model.mesh.setOrder(2)
        except Exception as error:  # the mesher raises no other
            wanted = "expected edges that are longer and further apart"
            raise ModelError(f"the outline cannot be meshed: {error}; {wanted}") from error
        return _read(gmsh, by_label)


@contextmanager
def _process_unchanged() -> Iterator[None]:
    """Keep the locale of this process, and that it ignores SIGPIPE: the mesher resets both as it starts.

    Otherwise a worker process that dies would take this one with it, by the pipe between them.
    """
    before = locale.setlocale(locale.LC_ALL)
    try:
        yield
    finally:
        locale.setlocale(locale.LC_ALL, before)
        pipe = getattr(signal, "SIGPIPE", None)  # Windows has none
        if pipe is not None and signal.getsignal(pipe) is signal.SIG_IGN:
            ctypes.CDLL(None).signal(int(pipe), ctypes.c_void_p(int(signal.SIG_IGN)))  # from any thread


@contextmanager
def _session() -> Iterator[Any]:
    """Start the mesher, silent, on a model of its own; end it unless it ran before."""
    gmsh = library("gmsh")
    was_running = bool(gmsh.isInitialized())
    if not was_running:
        with _process_unchanged():
            gmsh.initialize(readConfigFiles=False, run=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.model.add("hfsa")
        yield gmsh
    finally:
        gmsh.model.remove()
        if not was_running:
            gmsh.finalize()


def _geometry(gmsh: Any, boundary: Boundary) -> dict[str, list[int]]:
    """Define the region; return the curves of each label, in the order of the loops."""
    geo, points, by_label, loops = gmsh.model.geo, {}, {}, []

    def point(position: tuple[float, float]) -> int:
        if position not in points:
            points[position] = geo.addPoint(_MM * position[0], _MM * position[1], 0)
        return points[position]

    for loop in boundary.loops:
        curves = []
        for start, edge in starts(loop):
            ends = point(start), point(edge.end)
            tag = geo.addLine(*ends) if edge.center is None else geo.addCircleArc(ends[0], point(edge.center), ends[1])
            curves.append(tag)
            by_label.setdefault(edge.label, []).append(tag)
        loops.append(geo.addCurveLoop(curves))
    geo.addPlaneSurface(loops)
    geo.synchronize()
    return by_label


def _turn(gmsh: Any, first: int, second: int) -> list[float]:
    """Return the rotation about the origin from a line to another one in reverse, shape (16,)."""
    angles = []
    for curve in (first, second):
        ends = [gmsh.model.getValue(0, tag, []) for _, tag in gmsh.model.getBoundary([(1, curve)], oriented=False)]
        x, y, _ = max(ends, key=lambda end: math.hypot(end[0], end[1]))
        angles.append(math.atan2(y, x))
    c, s = math.cos(angles[1] - angles[0]), math.sin(angles[1] - angles[0])
    return [c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]


def _set_sizes(gmsh: Any, sizes: Mapping[str, float], by_label: Mapping[str, list[int]]) -> None:
    """Set the size of the triangles over the region from those at the edges of each label [m]."""
    field = gmsh.model.mesh.field
    growths = []
    for label, size in sizes.items():
        distance, growth = field.add("Distance"), field.add("MathEval")
        field.setNumbers(distance, "CurvesList", by_label[label])
        field.setNumber(distance, "Sampling", _SAMPLES)
        field.setString(growth, "F", f"{_MM * size:.17g} + {_GROWTH} * F{distance}")
        growths.append(growth)
    smallest = field.add("Min")
    field.setNumbers(smallest, "FieldsList", growths)
    field.setAsBackgroundMesh(smallest)
    for option in ("MeshSizeFromPoints", "MeshSizeFromCurvature", "MeshSizeExtendFromBoundary"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)
    gmsh.option.setNumber("Mesh.MeshSizeMax", _MM * COARSEST)


def _read(gmsh: Any, by_label: Mapping[str, list[int]]) -> Mesh:
    """Return the mesh of the mesher, without nodes that no triangle has."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    _, nodes = gmsh.model.mesh.getElementsByType(_TRIANGLE)
    used = np.unique(nodes)
    place = np.full(int(tags.max()) + 1, -1)
    place[used] = np.arange(len(used))
    points = np.empty((len(used), 2))
    is_used = place[tags] >= 0
    points[place[tags[is_used]]] = coordinates.reshape(-1, 3)[is_used, :2] / _MM
    on = {
        label: np.unique(np.concatenate([place[gmsh.model.mesh.getNodes(1, tag, True)[0]] for tag in curves]))
        for label, curves in by_label.items()
        if label
    }
    return Mesh(points, place[nodes].reshape(-1, 6), on)
