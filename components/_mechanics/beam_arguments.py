"""Arguments of a beam module: defaults, checks, and their values normalised by the length of one beam.

    values = module_values("tilted", Normalised(radius=0.6), ALUMINIUM, NORMALISED)
    values["tilt"]                                        # 45.0, the default
    geometry_of("tilted", values, count=None), element_of("tilted", values, shortest=1.0)

Source of the defaults: the paper of 2013 on beam modules; outer_radius and outer_spacing are not in it.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from hfsa.components._mechanics.beam import beam, sheet
from hfsa.components._mechanics.beam_kinds import KINDS, Geometry
from hfsa.components._mechanics.beam_section import (
    Elastic,
    Material,
    Section,
    elastic,
    rectangular_section,
    round_section,
    sheet_section,
)
from hfsa.components._modelling.arguments import ArgumentGroup
from hfsa.components._modelling.errors import ModelError

SLENDER = 10.0
"""Smallest ratio of length to thickness of a beam or a sheet."""
LEAST_SLENDERNESS = 12 * SLENDER**2
"""Smallest d = A L^2 / I, that of a square beam."""
DEFAULTS = {
    "radius": 0.6,
    "outer_radius": 1.0,
    "tilt": 45.0,
    "slenderness": 1e4,
    "torsion": 0.7536,
    "thickness": 0.02,
    "width": 0.4,
    "spacing": 1.0,
    "outer_spacing": 2.0,
    "poisson": 0.3,
}
"""Default values, those of the source's examples; that of outer_tilt is the tilt."""

_ELEMENT = {"beam": ("slenderness", "torsion"), "sheet": ("thickness", "width", "poisson")}
_OUTLINE = {"beam": ("diameter", "side"), "sheet": ("thickness", "width")}


@dataclass(frozen=True)
class Normalised(ArgumentGroup):
    """Normalised arguments of a module, lengths divided by that of one beam; arguments of other kinds must be `None`.

    Attributes:
        radius: radius of the circle of tips / L; default 0.6.
        outer_radius: radius of the outer circle of tips / L; default 1.
        tilt: angle beta of the beams [deg]; default 45.
        outer_tilt: angle of the beams on the base of a double_tilted [deg]; default the tilt.
        slenderness: d = A L^2 / I, at least 1200; default 1e4.
        torsion: delta = G J / EI; default 0.7536.
        count: number of beams between two bodies, 3 or more; default 3, of sheets 4.
        length_error: relative length error e of each beam, of length (1 + e) L; beams on the platform first; three
            beams are at 120, 0 and -120 degrees.
        thickness: thickness of a sheet / L; default 0.02.
        width: width of a sheet / L; default 0.4.
        spacing: distance of opposite sheets, centre to centre / L; default 1.
        outer_spacing: distance of the outer sheets / L; default 2.
        poisson: Poisson's ratio of a sheet; default 0.3, with dimensions that of the material.
    """

    radius: float | None = None
    outer_radius: float | None = None
    tilt: float | None = None
    outer_tilt: float | None = None
    slenderness: float | None = None
    torsion: float | None = None
    count: int | None = None
    length_error: tuple[float, ...] | None = None
    thickness: float | None = None
    width: float | None = None
    spacing: float | None = None
    outer_spacing: float | None = None
    poisson: float | None = None


@dataclass(frozen=True)
class Dimensions:
    """Dimensions of a module.

    Attributes:
        length: length of a beam or sheet [m].
        diameter: diameter of a round beam [m].
        side: side of a square beam [m].
        thickness, width: thickness and width of a sheet, or of a rectangular beam [m].
        radius: distance of the beams from the axis at the platform [m].
        outer_radius: distance of the beams from the axis at the base [m].
        spacing: distance of opposite sheets, centre to centre [m].
        outer_spacing: distance of the outer sheets [m].
    """

    length: float | None = None
    diameter: float | None = None
    side: float | None = None
    thickness: float | None = None
    width: float | None = None
    radius: float | None = None
    outer_radius: float | None = None
    spacing: float | None = None
    outer_spacing: float | None = None


AS_PUBLISHED = Normalised()
"""Arguments equal to `DEFAULTS`."""
NORMALISED = Dimensions()
"""No dimensions: the module has a normalised compliance only."""


class Size(NamedTuple):
    """Scales from normalised to SI units: L [m], and EI of one beam or E' I of one sheet [N.m2]."""

    length: float
    rigidity: float


def given(fields: Any) -> dict[str, Any]:
    """Return the fields of a dataclass that are not `None`."""
    return {name: value for name, value in asdict(fields).items() if value is not None}


def check_names(kind: str, normalised: Normalised, dimensions: Dimensions) -> None:
    """Raise `ModelError` for arguments of another kind and for quantities given twice."""
    chosen = KINDS[kind]
    own = (*chosen.arguments, *_ELEMENT[chosen.element], "length_error")
    for name in given(normalised):
        if name not in own:
            raise ModelError(f"beam module: {kind} has no {name}; it has {', '.join(own)}")
    lengths = ("length", *_OUTLINE[chosen.element], *[n for n in chosen.arguments if hasattr(dimensions, n)])
    for name in given(dimensions):
        if name not in lengths:
            raise ModelError(f"beam module: {kind} has no dimensions.{name}; it has {', '.join(lengths)}")
        if name in given(normalised):
            raise ModelError(
                f"beam module: {name} is given twice, normalised and as dimensions.{name}; give one of them"
            )


def module_values(
    kind: str, normalised: Normalised, material: Material, dimensions: Dimensions
) -> tuple[dict[str, float], Size | None]:
    """Return the normalised values of all arguments by name, and the size of a module with dimensions."""
    stated = {name: _finite(name, value) for name, value in given(normalised).items() if _is_value(name)}
    lengths = {name: _above_zero(f"dimensions.{name}", value, "m") for name, value in given(dimensions).items()}
    if "length" not in lengths:
        if unused := [f"dimensions.{name}" for name in lengths] + [f"material.{name}" for name in given(material)]:
            raise ModelError(f"beam module: {unused[0]} is given without dimensions.length, the length of a beam [m]")
        return _with_defaults(stated), None
    length = lengths.pop("length")
    stated |= {name: value / length for name, value in lengths.items() if _is_value(name)}
    m = elastic(material, "beam module: material")
    if KINDS[kind].element == "sheet":
        values = _with_defaults({"poisson": m.nu} | stated)
        section = sheet_section(
            values["thickness"] * length, values["width"] * length, m._replace(nu=values["poisson"])
        )
        return values, Size(length, section.along_y)
    if "slenderness" in stated or len(sections := lengths.keys() & set(_OUTLINE["beam"])) != 1:
        raise ModelError(
            f"beam module: the slenderness of {kind} with dimensions.length follows from its section, expected one of "
            f"dimensions.diameter and dimensions.side [m] and no slenderness"
        )
    (name,) = sections
    section = beam_section(name, lengths[name], m)
    normal = {"slenderness": section.axial * length**2 / section.along_y, "torsion": section.torsion / section.along_y}
    return _with_defaults(normal | stated), Size(length, section.along_y)


def beam_section(outline: str, size: float, m: Elastic) -> Section:
    """Return the section of a round or square beam: its outline, `diameter` or `side`, and that size [m]."""
    return round_section(size, m) if outline == "diameter" else rectangular_section(size, size, m)


def geometry_of(kind: str, values: Mapping[str, float], count: int | None) -> Geometry:
    """Return the positions of the beams; `ModelError` for positions that are not possible."""
    _check_places(kind, values)
    return geometry(values, _count(kind, count))


def geometry(values: Mapping[str, float], count: int) -> Geometry:
    """Return the positions of the beams from normalised values, of which angles are in degrees."""
    return Geometry(
        radius=values["radius"],
        outer_radius=values["outer_radius"],
        tilt=math.radians(values["tilt"]),
        outer_tilt=math.radians(values["outer_tilt"]),
        spacing=values["spacing"],
        outer_spacing=values["outer_spacing"],
        count=count,
    )


def lengths_of(kind: str, errors: tuple[float, ...] | None, count: int) -> list[float]:
    """Return the length of each beam, divided by L."""
    if errors is None:
        return [1.0] * count
    if len(errors) != count:
        raise ModelError(
            f"beam module: length_error has {len(errors)} values, expected {count}, one per beam of {kind}"
        )
    lengths = [1.0 + error for error in errors]
    for i, length in enumerate(lengths, 1):
        if not (math.isfinite(length) and length > 0):
            raise ModelError(
                f"beam module: the length of beam {i} is {length:g} of L, expected a length_error above -1, found "
                f"{errors[i - 1]:g}"
            )
    return lengths


def element_of(kind: str, values: Mapping[str, float], shortest: float) -> np.ndarray:
    """Return the stiffness of one beam or sheet, shape (6, 6); `ModelError` if the shortest is not slender."""
    if KINDS[kind].element == "beam":
        d = values["slenderness"] * shortest**2
        if not d >= LEAST_SLENDERNESS * (1 - 1e-9):
            raise ModelError(
                f"beam module: slenderness d = A L^2 / I is {d:g}, expected at least {LEAST_SLENDERNESS:g}: a beam is "
                f"{SLENDER:g} times as long as thick, d = 16 (L/D)^2 of a round and 12 (L/T)^2 of a square one"
            )
        _above_zero("torsion", values["torsion"], "")
        return element(kind, values)
    t, u = (_above_zero(name, values[name], "of the length") for name in ("thickness", "width"))
    if not t <= shortest / SLENDER:
        raise ModelError(
            f"beam module: thickness is {t / shortest:g} of the length, expected at most {1 / SLENDER:g}, as of a sheet"
        )
    if not u > t:
        raise ModelError(f"beam module: width is {u:g}, expected more than the thickness {t:g}, as of a sheet")
    if not 0 <= values["poisson"] < 0.5:
        raise ModelError(f"beam module: poisson is {values['poisson']:g}, expected from 0 to below 0.5")
    return element(kind, values)


def element(kind: str, values: Mapping[str, float]) -> np.ndarray:
    """Return the stiffness of one beam or sheet from normalised values, shape (6, 6)."""
    if KINDS[kind].element == "beam":
        return beam(values["slenderness"], values["torsion"])
    return sheet(values["thickness"], values["width"], values["poisson"])


def value_names(kind: str) -> tuple[str, ...]:
    """Return the names of the numbers that define a module of a kind."""
    chosen = KINDS[kind]
    return (*[name for name in chosen.arguments if _is_value(name)], *_ELEMENT[chosen.element])


def _is_value(name: str) -> bool:
    """Whether an argument is a number that is normalised, or an angle."""
    return name in DEFAULTS or name == "outer_tilt"


def _with_defaults(stated: Mapping[str, float]) -> dict[str, float]:
    """Return values with the defaults of those that are not stated."""
    values = {**DEFAULTS, **stated}
    return {"outer_tilt": values["tilt"], **values}


def _count(kind: str, count: int | None) -> int:
    """Return the number of beams between two bodies, by default that of the kind; `ModelError` for fewer than three."""
    if count is None:
        return KINDS[kind].count
    if count < 3:
        raise ModelError(f"beam module: count is {count}, expected three beams or more; two beams form a hinge")
    return count


def _check_places(kind: str, values: Mapping[str, float]) -> None:
    """Raise `ModelError` for positions of beams that are not possible."""
    names = KINDS[kind].arguments
    for name in names:
        if name in DEFAULTS and name != "tilt":
            _above_zero(name, values[name], "of the length of a beam")
    for name in ("tilt", "outer_tilt"):
        if name in names and not 0 < values[name] <= 90:
            raise ModelError(
                f"beam module: {name} is {values[name]:g} degrees, expected above 0 and up to 90: the beams' axes meet "
                f"at r / tan(tilt) from the stage; three_beam has parallel axes, inverted tilts them the other way"
            )
    for name in ("radius", "spacing"):
        inner, outer = values[name], values[f"outer_{name}"]
        if f"outer_{name}" in names and not outer > inner:
            raise ModelError(f"beam module: outer_{name} is {outer:g}, expected more than the {name}, {inner:g}")


def _finite(name: str, value: float) -> float:
    """Return a number; `ModelError` unless it is finite."""
    if not math.isfinite(value):
        raise ModelError(f"beam module: {name} is {value}, expected a finite number")
    return float(value)


def _above_zero(name: str, value: float, unit: str) -> float:
    """Return a number; `ModelError` unless it is finite and above 0."""
    if not (math.isfinite(value) and value > 0):
        raise ModelError(f"beam module: {name} is {value:g} {unit}".rstrip() + ", expected above 0")
    return float(value)
