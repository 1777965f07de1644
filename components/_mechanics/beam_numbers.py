"""Numbers that define a beam module, as dimensions of a study, and the design of other values of them.

    numbers = numbers_of(Design("tilted"))
    list(numbers.dimensions)                       # radius, tilt, slenderness, torsion
    numbers.design([0.5, 30.0, 1e4, 0.75])         # the Design of these

The numbers of a list of beams are named as in its file: `beam[2].end[1]`, `material.steel.E`.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

from hfsa.components._mechanics.beam_arguments import (
    LEAST_SLENDERNESS,
    SLENDER,
    Dimensions,
    given,
    lengths_of,
    module_values,
    value_names,
)
from hfsa.components._mechanics.beam_kinds import ASSEMBLY, KINDS
from hfsa.components._mechanics.beam_list import BeamList, placed
from hfsa.components._mechanics.beam_module import Design
from hfsa.components._mechanics.beam_section import Elastic, Material, elastic
from hfsa.components._modelling.arguments import read_value
from hfsa.components._modelling.documents import plain
from hfsa.components._modelling.errors import ModelError
from hfsa.components._modelling.sampled_study import Dimension

_WORDS = {
    "radius": "Radius of the circle of tips",
    "outer_radius": "Radius of the outer circle of tips",
    "tilt": "Tilt of the beams",
    "outer_tilt": "Tilt of the beams on the base",
    "slenderness": "d = A L^2 / I of a beam",
    "torsion": "delta = G J / EI of a beam",
    "thickness": "Thickness of a sheet",
    "width": "Width of a sheet",
    "spacing": "Distance of opposite sheets",
    "outer_spacing": "Distance of the outer sheets",
    "poisson": "Poisson's ratio",
    "length": "Length of a beam",
    "diameter": "Diameter of a beam",
    "side": "Side of a square beam",
    "E": "Young's modulus",
    "G": "Shear modulus",
    "nu": "Poisson's ratio",
}
_ANGLES = ("tilt", "outer_tilt")
_SECTIONS = ("diameter", "side")
_LISTED_UNITS = {"E": "Pa", "G": "Pa", "nu": "1", "direction": "1", "wide": "1"}
"""Units of numbers in a list that are no lengths."""
_NEVER = -1.0
"""Margin of a design that is not possible for another reason."""

Margin = Callable[[Design], float]
Path = tuple[str | int, ...]


class Numbers(NamedTuple):
    """Numbers that define a design.

    Attributes:
        dimensions: free dimensions by name.
        design: function that returns the design of other values in this order; `ModelError` where there is none.
        conditions: margins of a design by description, above 0 where it is possible.
    """

    dimensions: Mapping[str, Dimension]
    design: Callable[[Sequence[float]], Design]
    conditions: Mapping[str, Margin]


def numbers_of(design: Design) -> Numbers:
    """Return the numbers of a design that is possible."""
    if design.kind == ASSEMBLY:
        return _listed(design)
    return _normalised(design) if design.dimensions.length is None else _dimensional(design)


def _normalised(design: Design) -> Numbers:
    """Return the normalised numbers of a named kind."""
    values, _ = module_values(design.kind, design.normalised, design.material, design.dimensions)
    names = value_names(design.kind)

    def of(numbers: Sequence[float]) -> Design:
        """The design of other values."""
        changed = dict(zip(names, numbers, strict=True))
        return replace(design, normalised=replace(design.normalised, **changed))

    dimensions = {name: _dimension(values[name], "deg" if name in _ANGLES else "1", _WORDS[name]) for name in names}
    return Numbers(dimensions, of, _conditions(design))


def _dimensional(design: Design) -> Numbers:
    """Return the numbers of a named kind in SI units and degrees."""
    values, size = module_values(design.kind, design.normalised, design.material, design.dimensions)
    assert size is not None
    names = value_names(design.kind)
    places = [name for name in names if name in Dimensions.__dataclass_fields__]
    lengths = {"length": size.length} | {n: v for n, v in given(design.dimensions).items() if n in _SECTIONS}
    lengths |= {name: values[name] * size.length for name in places}
    angles = {name: values[name] for name in names if name in _ANGLES}
    constants = _constants(elastic(design.material, "beam module: material"), KINDS[design.kind].element)
    found = {**lengths, **angles, **constants}
    # a place given relative to the length of a beam is a length of its own here
    rest = replace(design.normalised, **dict.fromkeys(places))

    def of(numbers: Sequence[float]) -> Design:
        """The design of other values."""
        changed = dict(zip(found, numbers, strict=True))
        return replace(
            design,
            dimensions=Dimensions(**{name: changed[name] for name in lengths}),
            normalised=replace(rest, **{name: changed[name] for name in angles}),
            material=Material(**{name: changed[name] for name in constants}),
        )

    units = dict.fromkeys(lengths, "m") | dict.fromkeys(angles, "deg") | {"E": "Pa", "G": "Pa", "nu": "1"}
    dimensions = {name: _dimension(value, units[name], _WORDS[name]) for name, value in found.items()}
    return Numbers(dimensions, of, _conditions(design))


def _listed(design: Design) -> Numbers:
    """Return the numbers of a list of beams."""
    assert design.beams is not None
    table = plain(design.beams)
    leaves = list(_leaves("", (), table))
    length = placed(design.beams, design.material)[1].length

    def of(numbers: Sequence[float]) -> Design:
        """The design of other values."""
        changed = _changed(table, {path: value for (_, path, _), value in zip(leaves, numbers, strict=True)})
        return replace(design, beams=read_value("beam module: beams", BeamList, changed))

    dimensions = {}
    for name, path, value in leaves:
        unit = next((unit for key, unit in _LISTED_UNITS.items() if key in path), "m")
        is_place = isinstance(path[-1], int) and unit == "m"
        dimensions[name] = Dimension(
            value, max(abs(value), length) if is_place else abs(value) or 1.0, unit, "Of the list"
        )
    return Numbers(dimensions, of, {"a list that can be assembled": lambda _: 1.0})


def _dimension(value: float, unit: str, words: str) -> Dimension:
    """Return a dimension of the size of its value."""
    return Dimension(value, abs(value) or 1.0, unit, words)


def _constants(m: Elastic, element: str) -> dict[str, float]:
    """Return the two constants of a material that a beam or a sheet depends on most directly."""
    return {"E": m.E, "G": m.G} if element == "beam" else {"E": m.E, "nu": m.nu}


# Conditions -----------------------------------------------------------------------------------------------------------


def _conditions(design: Design) -> dict[str, Margin]:
    """Return the margins of a named kind."""
    chosen = KINDS[design.kind]
    count = chosen.layers * (design.normalised.count or chosen.count)
    shortest = min(lengths_of(design.kind, design.normalised.length_error, count))
    margins: dict[str, Callable[[Mapping[str, float]], float]] = {}
    if chosen.element == "beam":
        margins[f"beams {SLENDER:g} times as long as thick"] = lambda v: (
            v["slenderness"] * shortest**2 / LEAST_SLENDERNESS - 1 + 1e-9
        )
    else:
        margins[f"sheets {SLENDER:g} times as long as thick"] = lambda v: 1 - SLENDER * v["thickness"] / shortest + 1e-9
        margins["sheets wider than thick"] = lambda v: v["width"] / v["thickness"] - 1
    for name in chosen.arguments:
        if name in _ANGLES:
            margins[f"{name} above 0 and up to 90 degrees"] = partial(_tilt_margin, name)
        if name.startswith("outer_") and name not in _ANGLES:
            inner = name.removeprefix("outer_")
            margins[f"{name} above {inner}"] = partial(_outer_margin, name, inner)
    return {text: partial(_margin, margin) for text, margin in margins.items()}


def _tilt_margin(name: str, values: Mapping[str, float]) -> float:
    """Return the smaller distance of an angle from 0 and from 90 degrees, relative to 90."""
    return min(values[name] / 90, 1 - values[name] / 90 + 1e-9)


def _outer_margin(outer: str, inner: str, values: Mapping[str, float]) -> float:
    """Return by how much an outer position is larger than an inner one."""
    return values[outer] / values[inner] - 1


def _margin(margin: Callable[[Mapping[str, float]], float], design: Design) -> float:
    """Return a margin of a design, of its normalised values."""
    try:
        values, _ = module_values(design.kind, design.normalised, design.material, design.dimensions)
        return margin(values)
    except (ModelError, ZeroDivisionError):
        return _NEVER


# Lists ----------------------------------------------------------------------------------------------------------------


def _leaves(name: str, path: Path, value: Any) -> Iterator[tuple[str, Path, float]]:
    """Yield name, path and value of the numbers in a table."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _leaves(f"{name}.{key}" if name else key, (*path, key), item)
    elif isinstance(value, list):
        for i, item in enumerate(value):
            yield from _leaves(f"{name}[{i + 1}]", (*path, i), item)
    elif isinstance(value, float) and path != ("length",):
        yield name, path, value


def _changed(value: Any, numbers: Mapping[Path, float], path: Path = ()) -> Any:
    """Return a copy of a table with other numbers."""
    if isinstance(value, Mapping):
        return {key: _changed(item, numbers, (*path, key)) for key, item in value.items()}
    if isinstance(value, list):
        return [_changed(item, numbers, (*path, i)) for i, item in enumerate(value)]
    return numbers.get(path, value)
