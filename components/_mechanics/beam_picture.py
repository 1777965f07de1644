"""Pictures of a beam module: the axes of its freedoms, and its motion along each."""

from collections.abc import Sequence

import numpy as np

from hfsa.components._mechanics.beam_module import Module
from hfsa.components._mechanics.beam_shape import at_rest, moved, size_of
from hfsa.components._mechanics.mobility import Freedom, Mobility, mobility
from hfsa.components._modelling.drawing import Drawing, Layer, Panel

_AXIS = 0.8
"""Half the length of an axis, relative to the size of the module."""
_WORDS = {"R": "rotation", "T": "translation", "H": "screw"}


def module_drawing(module: Module, title: str) -> Drawing:
    """Return the drawing of a module: at rest with the axes of its freedoms, then displaced along each of them.

    A module without clear separation is drawn at rest alone.
    """
    found = mobility(module.compliance)
    scale, unit = (1.0, "1") if module.size is None else (module.size.length, "m")
    axes = tuple(f"{name} / L" if module.size is None else name for name in "XYZ")
    size = size_of(module.beams)
    freedoms = found.freedoms if found.is_clear else []
    count = f"{len(freedoms)} freedom{'s' if len(freedoms) > 1 else ''}"
    words = count if freedoms else "no clear separation of freedoms"
    layers = [*at_rest(module.beams, scale, "body"), *_screw_axes(freedoms, found, size, scale)]
    panels = [Panel(layers, unit, axes, words, kind="freedoms")]
    for i, freedom in enumerate(freedoms, 1):
        shown = moved(module.beams, _motion(freedom), size, scale)
        layers = [*at_rest(module.beams, scale, "rest"), *shown, *_screw_axes([freedom], found, size, scale)]
        panels.append(Panel(layers, unit, axes, f"freedom {i}, {_WORDS[freedom.type]}", kind="motions"))
    return Drawing(title, panels)


def _screw_axes(freedoms: Sequence[Freedom], found: Mobility, size: float, scale: float) -> list[Layer]:
    """Return the axes of freedoms as lines, translations through the centre of compliance, and that centre."""
    layers = []
    for freedom in freedoms:
        through = found.center if freedom.point is None else freedom.point
        ends = through + _AXIS * size * np.outer([-1.0, 1.0], freedom.direction)
        pitch = "" if freedom.type != "H" else f", pitch {freedom.pitch:.3g} L"
        texts = ["", f"{freedom.type}{pitch}"]
        layers.append(Layer(scale * ends, np.array([[0, 1]]), "axis", texts=texts))
    center = Layer(scale * found.center[None], np.array([[0]]), "mark", "centre of compliance")
    return [*layers, center]


def _motion(freedom: Freedom) -> np.ndarray:
    """Return the displacement of the reference point along a freedom, shape (6,)."""
    if freedom.point is None or freedom.pitch is None:
        return np.concatenate([freedom.direction, np.zeros(3)])
    slide = freedom.pitch * freedom.direction + np.cross(freedom.point, freedom.direction)
    return np.concatenate([slide, freedom.direction])
