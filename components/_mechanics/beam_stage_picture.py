"""Pictures of a platform on compliant beams: the stage at rest, each mode with its axis, and the stage in motion.

In a mode the platform moves along its mode shape, about the axis of that screw, and the beams bend with it.
"""

from collections.abc import Mapping

import numpy as np

from hfsa.components._mechanics.beam_module import Module
from hfsa.components._mechanics.beam_shape import (
    at_rest,
    moved,
    platform_at_rest,
    platform_shifts,
    size_of,
    strip_shifts,
    strips_at_rest,
)
from hfsa.components._mechanics.cartesian_numbers import axial_modes
from hfsa.components._mechanics.screws import GAMMA, Axis, axis, kind_of
from hfsa.components._modelling.drawing import Drawing, Layer, Moving, Panel, columns, named

_AXIS = 0.8
"""Half the length of an axis, relative to the size of the module."""
_FAR = 3.0
"""Distance of an axis that is drawn, relative to the size of the module."""


def stage_drawing(module: Module, mass: np.ndarray, center: np.ndarray, title: str) -> Drawing:
    """Return the drawing of a module with a platform, at rest and in its six modes.

    `mass` is the mass matrix at the reference point, translations first, (6, 6), and `center` the mass centre (3,) [m].
    """
    beams, length = module.beams, _length(module)
    size = size_of(beams)
    middle = Layer(center[None], np.array([[0]]), "mark", "mass centre")
    panels = [Panel([*at_rest(beams, length, "body"), middle], title="at rest", kind="at_rest")]
    found = axial_modes(GAMMA @ mass @ GAMMA, GAMMA @ module.dimensional_stiffness() @ GAMMA, size * length)
    for i, (omega, screw) in enumerate(zip(found.omega, found.shapes.T, strict=True), 1):
        line, words = _axis(axis(screw, size * length), center, size * length)
        shown = moved(beams, _normalised(module) @ GAMMA @ screw, size, length)
        heading = f"mode {i}: {omega / (2 * np.pi):.4g} Hz, {words}"
        panels.append(Panel([*at_rest(beams, length, "rest"), *shown, *line], title=heading, kind="modes"))
    return Drawing(title, panels)


def _axis(motion: Axis, center: np.ndarray, size: float) -> tuple[list[Layer], str]:
    """Return the axis of a mode, and the mode in words; an axis far from a stage of half diagonal `size` is not drawn.

    A translation is drawn through the mass centre (3,) [m].
    """
    kind = kind_of(motion, size)
    away = float(np.linalg.norm(np.cross(motion.point - center, motion.direction)))
    if kind != "translation" and away > _FAR * size:
        return [], f"{kind} about an axis {away:.3g} m away"
    through = center if kind == "translation" else motion.point
    ends = through + _AXIS * size * np.outer([-1.0, 1.0], motion.direction)
    pitch = f"pitch {1e3 * motion.pitch:.3g} mm" if kind == "screw" else ""
    return [Layer(ends, np.array([[0, 1]]), "axis", texts=["", pitch])], kind


def stage_in_motion(module: Module) -> Moving:
    """Return the module as its platform moves; displacements are small, so each is linear in the platform's."""
    beams, length = module.beams, _length(module)
    base = at_rest(beams, length, "rest")[len(strips_at_rest(beams, length)) :]
    moving = [strips_at_rest(beams, length, "body", "beams"), platform_at_rest(beams, length, "body", "platform")]
    units = _normalised(module)
    slopes = [
        length * np.stack([shifts(beams, column) for column in units.T]) for shifts in (strip_shifts, platform_shifts)
    ]

    def displacements(signals: Mapping[str, np.ndarray]) -> list[np.ndarray | None]:
        """Return the displacements of beams and platform."""
        pose = np.hstack([columns(signals, "platform.position", 3), columns(signals, "platform.rotation", 3)])
        found: list[np.ndarray | None] = [None] * len(base)
        for layers, slope in zip(moving, slopes, strict=True):
            found += [np.einsum("ni,ijk->njk", pose, slope)] * len(layers)
        return found

    layers = [*base, *(layer for some in moving for layer in some)]
    return Moving(
        Panel(layers, title="stage on beams"),
        [*named("platform.position", 3), *named("platform.rotation", 3)],
        displacements,
    )


def _length(module: Module) -> float:
    """Return the length of a beam [m], by which the module's coordinates are divided."""
    assert module.size is not None
    return module.size.length


def _normalised(module: Module) -> np.ndarray:
    """Return the matrix from a displacement, metres and radians, to the module's, shape (6, 6)."""
    return np.diag(np.repeat([1 / _length(module), 1.0], 3))
