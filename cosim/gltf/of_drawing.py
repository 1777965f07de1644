"""3D model of a part's drawing: the machine, which moves as its panels show, and a scene for the marks of each panel.

Layers of several panels that move from the same place are one shape with a target each: an animation per panel lets it
swing to what the panel shows and to the other side, +1 and -1 times. The first scene has the machine and what stands
still in the first panel, the others what a panel adds.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.colors import Normalize
from numpy.typing import NDArray

from hfsa.cosim.figures.drawing import VALUE_COLOURS, Drawing, Layer, Panel
from hfsa.cosim.gltf.model import Animation, Model, Shape, metres, notes_of, solid

PERIOD = 2.0
"""Time of one swing as animated [s]."""
_FRAMES = 33
"""Number of key frames of a swing."""


def model_of_drawing(drawing: Drawing) -> Model:
    """Return the 3D model of a drawing; `ResultsError` for a panel whose coordinates are no lengths."""
    shapes: list[Shape] = []
    places: dict[Any, int] = {}
    shown: list[list[int]] = []
    moved: list[dict[int, int]] = []
    for number, panel in enumerate(drawing.panels, 1):
        factor, title = metres(panel), panel.title or f"panel {number}"
        shown.append([])
        moved.append({})
        # what moves comes first: what lies at rest in its place is the same shape
        for layer in sorted(panel.layers, key=lambda layer: layer.rest is None):
            if not layer.cells.size:
                continue
            shape = _shape(layer, panel, factor, title)
            place = places.setdefault(_key(shape), len(shapes))
            if place == len(shapes):
                shapes.append(shape)
            if layer.rest is not None:
                target = solid(layer.points - layer.rest, factor)
                moved[-1][place] = len(shapes[place].targets)
                shapes[place] = replace(shapes[place], targets=[*shapes[place].targets, target])
            shown[-1].append(place)
    return Model(drawing.title, shapes, _scenes(drawing, shown, moved), _swings(drawing, shapes, moved))


def _shape(layer: Layer, panel: Panel, factor: float, title: str) -> Shape:
    """Return the shape of a layer at rest, without targets."""
    at = layer.points if layer.rest is None else layer.rest
    name = layer.name or f"{title}: {layer.role}"
    role = "body" if layer.rest is not None else layer.role
    return Shape(name, solid(at, factor), layer.cells, role, _colours(layer, panel), notes=notes_of(layer))


def _colours(layer: Layer, panel: Panel) -> NDArray[np.float64] | None:
    """Return the colours of a layer with values, on the scale of its panel."""
    if layer.values is None or not layer.values.size:
        return None
    values = np.concatenate([one.values for one in panel.layers if one.values is not None])
    return VALUE_COLOURS(Normalize(values.min(), values.max())(layer.values))[:, :3]


def _key(shape: Shape) -> Any:
    """Return what equal shapes have in common: places and cells, and the colours of values."""
    colours = b"" if shape.colours is None else shape.colours.tobytes()
    return shape.points.round(12).tobytes(), shape.cells.tobytes(), shape.cells.shape, colours


def _scenes(
    drawing: Drawing, shown: Sequence[Sequence[int]], moved: Sequence[dict[int, int]]
) -> list[tuple[str, list[int]]]:
    """Return the scenes: the machine with the first panel, and the machine with what each further panel adds."""
    machine = {place for panel in moved for place in panel}
    first = sorted(machine | set(shown[0]))
    scenes = [(drawing.title, first)]
    for number, (panel, places) in enumerate(zip(drawing.panels[1:], shown[1:], strict=True), 2):
        if not set(places) <= set(first):
            scenes.append((panel.title or f"panel {number}", sorted(machine | set(places))))
    return scenes


def _swings(drawing: Drawing, shapes: Sequence[Shape], moved: Sequence[dict[int, int]]) -> list[Animation]:
    """Return an animation for each panel in which something moves."""
    time = np.linspace(0.0, PERIOD, _FRAMES)
    swing = np.sin(2 * math.pi * time / PERIOD)
    found = []
    for number, (panel, targets) in enumerate(zip(drawing.panels, moved, strict=True), 1):
        weights = {}
        for place, shape in enumerate(shapes):
            if shape.targets:
                weights[place] = np.zeros((_FRAMES, len(shape.targets)))
                if place in targets:
                    weights[place][:, targets[place]] = swing
        if targets:
            found.append(Animation(panel.title or f"panel {number}", time, weights))
    return found
