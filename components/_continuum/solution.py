"""Solved pieces: mesh and reduced matrices of a stage's dimensions, from the cache where it holds them.

An entry is named by a hash of the dimensions, the source of this room and the versions of its two libraries. It appears
complete or not at all; one that cannot be read is made anew.
"""

import hashlib
import io
import zipfile
from dataclasses import astuple
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hfsa.components._continuum.elements import Material
from hfsa.components._continuum.extra import missing
from hfsa.components._continuum.meshing import Mesh, mesh
from hfsa.components._continuum.outline import NECKS, centers, pad, third
from hfsa.components._continuum.piece import Piece, solve
from hfsa.components._mechanics.rrr_hinge import Hinge
from hfsa.components._mechanics.rrr_kinematics import Links
from hfsa.components._mechanics.rrr_outline import Outline
from hfsa.components._modelling.cache import cache_folder, keep

LIBRARIES = ("scikit-fem", "gmsh")
"""Distributions of the extra `fem`."""

_SIZES = {**dict.fromkeys(NECKS, 1.0), "contact": 1.0, "fixed": 3.0, "bolt": 4.0}
"""Size of the triangles at the edges of each label, by that at the necks."""
_FOLDER = "continuum"


class Shape(NamedTuple):
    """Dimensions and material of a piece."""

    links: Links
    hinge: Hinge
    outline: Outline

    @property
    def material(self) -> Material:
        """The material of the piece, with its depth."""
        hinge, outline = self.hinge, self.outline
        is_thick = outline.plane == "strain"
        return Material(hinge.elastic_modulus, outline.poisson, outline.density, hinge.width, is_thick)


class Solution(NamedTuple):
    """A mesh of a third, and the piece that is made of three."""

    mesh: Mesh
    piece: Piece


def solution(shape: Shape, size: float) -> Solution:
    """Return the piece of a shape, with triangles of a size [m] at the necks.

    Raises:
        ModelError: a shape that cannot be built; the extra `fem` is not installed; a cache that cannot be written.
    """
    boundary = third(*shape)
    file = cache_folder() / _FOLDER / f"{_key(shape, size)}.npz"
    kept = _read(file)
    if kept is not None:
        return kept
    made = mesh(boundary, {label: scale * size for label, scale in _SIZES.items()}, {"cut": "turned cut"})
    found = Solution(made, solve(made, shape.material, pad(*shape), centers(*shape).bolt))
    keep(_packed(found), file)
    return found


def _key(shape: Shape, size: float) -> str:
    """Return a hash of all that a solution depends on."""
    try:
        versions = [version(name) for name in LIBRARIES]
    except PackageNotFoundError as error:
        raise missing(error.name, error) from error
    hinge = shape.hinge
    numbers = (
        astuple(shape.links),
        (hinge.elastic_modulus, hinge.width, hinge.thickness, hinge.radius),
        astuple(shape.outline),
        size,
    )
    digest = hashlib.sha256(repr((numbers, versions)).encode())
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.read_bytes() + b"\0")
    return digest.hexdigest()[:32]


def _packed(found: Solution) -> bytes:
    """Return a solution as a file of arrays."""
    on = {f"on {label}": nodes for label, nodes in found.mesh.on.items()}
    arrays = {"points": found.mesh.points, "triangles": found.mesh.triangles, **found.piece._asdict(), **on}
    data = io.BytesIO()
    np.savez(data, allow_pickle=False, **arrays)
    return data.getvalue()


def _read(file: Path) -> Solution | None:
    """Return the solution in a file; `None` where there is none, or a damaged one."""
    try:
        with np.load(file) as data:
            on = {name.removeprefix("on "): data[name] for name in data.files if name.startswith("on ")}
            numbers = {"weight": float, "unknowns": int}
            piece = {name: numbers.get(name, np.asarray)(data[name]) for name in Piece._fields}
            return Solution(Mesh(data["points"], data["triangles"], on), Piece(**piece))
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
