"""Writing of a 3D model as binary glTF 2.0, by pygltflib (extra `cad`).

    write_model(Path("robot.glb"), model_of_drawing(part.drawing()))

glTF has metres, and Y up: every node turns the Z axis of the machine upwards. Lines of bodies are tubes too, as many
CAD viewers show no lines. Single precision gives coordinates to 6e-8 of their size; displacements are stored by
themselves, to the same share of theirs.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from hfsa.cosim.figures.drawing import ROLE_COLOURS
from hfsa.cosim.gltf.model import Animation, Model, Shape
from hfsa.cosim.results.file_kind import TOOL
from hfsa.cosim.results.placement import Bound, write_bounded
from hfsa.cosim.results.records import ResultsError
from hfsa.cosim.results.target import check_model

UPRIGHT = (-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
"""Rotation of every node, a quaternion (x, y, z, w): that of Z to Y."""
LARGEST = Bound(100e6, "model", "a coarser mesh or a shorter stretch of a run")
"""Largest size of a model [bytes]."""

_TUBES = ("body", "moved", "rest")
"""Roles whose lines are tubes too."""
_MOST_TUBES = 2000
_SIDES = 8
_RADIUS = 0.006
"""Radius of a tube, relative to the size of its shape."""
_SHEER = 0.6
"""Opacity of faces without values."""


def write_model(path: Path, model: Model) -> None:
    """Write a 3D model, completely or not at all.

    `ResultsError` without the extra `cad`, for a model larger than `LARGEST`, and for an existing file that is no model
    of hfsa.
    """
    check_model(path)
    write_bounded(path, glb(model), LARGEST, lambda: check_model(path))


def glb(model: Model) -> bytes:
    """Return a 3D model as binary glTF; `ResultsError` without the extra `cad`."""
    try:
        import pygltflib
    except ImportError as error:
        raise ResultsError(f"a 3D model needs pygltflib ({error}): pip install 'hfsa[cad]'") from error
    return _Writer(pygltflib, model).content()


class _Writer:
    """Collects accessors, meshes, nodes and animations of a model."""

    def __init__(self, library: Any, model: Model):
        self._of, self._blob = library, bytearray()
        facts = {"unit": "m", "up": "Y", "up_of_machine": "Z"}
        asset = library.Asset(generator=TOOL, version="2.0", extras={"title": model.title, **facts})
        self._gltf = library.GLTF2(asset=asset, scene=0)
        for shape in model.shapes:
            self._add_shape(shape)
        self._gltf.scenes = [library.Scene(name=name, nodes=list(places)) for name, places in model.scenes]
        self._gltf.animations = [self._animation(animation) for animation in model.animations]

    def content(self) -> bytes:
        """Return the file."""
        self._gltf.buffers = [self._of.Buffer(byteLength=len(self._blob))]
        self._gltf.set_binary_blob(bytes(self._blob))
        return b"".join(self._gltf.save_to_bytes())

    def _add_shape(self, shape: Shape) -> None:
        """Add mesh and node of a shape, which have the same place."""
        material = self._material(shape)
        parts = [(shape.points, shape.cells, shape.targets)]
        if _is_of_rods(shape):
            parts.append(_tubes(shape))
        primitives = [self._primitive(points, cells, targets, shape, material) for points, cells, targets in parts]
        weights = [0.0] * len(shape.targets)
        extras = {"notes": list(shape.notes)} if shape.notes else {}
        mesh = self._of.Mesh(name=shape.name, primitives=primitives, weights=weights or None)
        self._gltf.meshes.append(mesh)
        node = self._of.Node(name=shape.name, mesh=len(self._gltf.meshes) - 1, rotation=list(UPRIGHT), extras=extras)
        self._gltf.nodes.append(node)

    def _primitive(
        self,
        points: NDArray[np.float64],
        cells: NDArray[np.int64],
        targets: Sequence[NDArray[np.float64]],
        shape: Shape,
        material: int,
    ) -> Any:
        """Return points, lines or faces."""
        mode = (self._of.POINTS, self._of.LINES, self._of.TRIANGLES)[cells.shape[1] - 1]
        attributes = self._of.Attributes(POSITION=self._vectors(points))
        if shape.colours is not None and len(points) == len(shape.colours):
            attributes.COLOR_0 = self._vectors(_linear(shape.colours))
        return self._of.Primitive(
            attributes=attributes,
            indices=self._accessor(cells.astype("<u4").ravel(), self._of.ELEMENT_ARRAY_BUFFER),
            mode=mode,
            material=material,
            targets=[self._of.Attributes(POSITION=self._vectors(target)) for target in targets] or None,
        )

    def _material(self, shape: Shape) -> int:
        """Return the place of a new material of the colour of a shape."""
        is_sheer = shape.cells.shape[1] == 3 and shape.colours is None
        colour = np.ones(3) if shape.colours is not None else _linear(np.array(to_rgb(ROLE_COLOURS[shape.role])))
        metal = self._of.PbrMetallicRoughness(
            baseColorFactor=[*map(float, colour), _SHEER if is_sheer else 1.0], metallicFactor=0.1, roughnessFactor=0.6
        )
        look = {"doubleSided": True, "alphaMode": self._of.BLEND if is_sheer else self._of.OPAQUE, "alphaCutoff": None}
        self._gltf.materials.append(self._of.Material(name=shape.role, pbrMetallicRoughness=metal, **look))
        return len(self._gltf.materials) - 1

    def _animation(self, animation: Animation) -> Any:
        """Return an animation."""
        time = self._accessor(animation.time.astype("<f4"), None)
        samplers, channels = [], []
        for place, weights in animation.weights.items():
            output = self._accessor(weights.astype("<f4").ravel(), None)
            target = self._of.AnimationChannelTarget(node=place, path=self._of.WEIGHTS)
            channels.append(self._of.AnimationChannel(sampler=len(samplers), target=target))
            samplers.append(self._of.AnimationSampler(input=time, output=output, interpolation=self._of.ANIM_LINEAR))
        extras = dict(animation.facts)
        return self._of.Animation(name=animation.name, samplers=samplers, channels=channels, extras=extras)

    def _vectors(self, values: NDArray[np.float64]) -> int:
        """Return the place of a new accessor of vectors (n, 3)."""
        return self._accessor(values.astype("<f4"), self._of.ARRAY_BUFFER)

    def _accessor(self, values: NDArray[Any], target: int | None) -> int:
        """Return the place of a new accessor of numbers (n,) or vectors (n, 3), which are of four bytes each."""
        content = values.tobytes()
        view = self._of.BufferView(buffer=0, byteOffset=len(self._blob), byteLength=len(content), target=target)
        self._blob += content
        self._gltf.bufferViews.append(view)
        whole = values.reshape(len(values), -1)
        accessor = self._of.Accessor(
            bufferView=len(self._gltf.bufferViews) - 1,
            componentType=self._of.UNSIGNED_INT if values.dtype.kind == "u" else self._of.FLOAT,
            count=len(values),
            type=self._of.VEC3 if values.ndim == 2 else self._of.SCALAR,
            min=whole.min(axis=0).tolist(),
            max=whole.max(axis=0).tolist(),
        )
        self._gltf.accessors.append(accessor)
        return len(self._gltf.accessors) - 1


def _linear(colours: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return sRGB colours as linear ones."""
    return np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)


def _is_of_rods(shape: Shape) -> bool:
    """Whether the lines of a shape are drawn as tubes too: those of a body, of one colour, and not too many."""
    is_plain = shape.role in _TUBES and shape.colours is None
    return shape.cells.shape[1] == 2 and is_plain and len(shape.cells) <= _MOST_TUBES


def _tubes(shape: Shape) -> tuple[NDArray[np.float64], NDArray[np.int64], list[NDArray[np.float64]]]:
    """Return tubes around the lines of a shape: points, faces and targets; a ring moves as its end of the line."""
    ends = shape.points[shape.cells]
    angles = 2 * math.pi * np.arange(_SIDES) / _SIDES
    u, v = _across(ends[:, 1] - ends[:, 0])
    circle = np.cos(angles)[:, None] * u[:, None] + np.sin(angles)[:, None] * v[:, None]
    radius = _RADIUS * float(np.ptp(shape.points, axis=0).max())
    rings = ends[:, :, None] + radius * circle[:, None]
    around = np.arange(_SIDES)
    following = np.roll(around, -1)
    sides = [[around, following, around + _SIDES], [following, following + _SIDES, around + _SIDES]]
    faces = np.concatenate([np.column_stack(corners) for corners in sides])
    first = 2 * _SIDES * np.arange(len(ends))[:, None, None]
    moved = [np.repeat(target[shape.cells], _SIDES, axis=1).reshape(-1, 3) for target in shape.targets]
    return rings.reshape(-1, 3), (first + faces).reshape(-1, 3), moved


def _across(along: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return two unit vectors across each of several directions (lines, 3), zero for one without length."""
    other = np.eye(3)[np.abs(along).argmin(axis=1)]
    u = np.cross(along, other)
    u = u / np.maximum(np.linalg.norm(u, axis=1, keepdims=True), np.finfo(float).tiny)
    v = np.cross(along, u)
    return u, v / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), np.finfo(float).tiny)
