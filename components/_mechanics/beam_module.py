"""Beam modules from their arguments: checks, normalised compliance, and SI units if dimensions are given.

    module = compliant_module("tilted", Normalised(radius=0.6, tilt=45.0))
    module.compliance                                   normalised, (6, 6), order as in `beam.py`
    module = compliant_module("tilted", AS_PUBLISHED, ALUMINIUM, Dimensions(length=0.05, diameter=2e-3, radius=0.03))
    module.dimensional_stiffness()                      SI, at the stage's reference point

With the length L and the bending stiffness EI of one beam, and S = diag(1/L, 1/L, 1/L, 1, 1, 1):

    K = EI / L S K_normalised S,   translations [m] and forces [N] before rotations [rad] and moments [N.m]

Source: the paper of 2013 on beam modules.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from hfsa.components._mechanics.beam import beam, sheet
from hfsa.components._mechanics.beam_assembly import unequal
from hfsa.components._mechanics.beam_kinds import KINDS, Geometry
from hfsa.components._modelling.model import ModelError, one_of

SLENDER = 10.0
"""Smallest ratio of length to thickness of a beam or a sheet."""
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
"""Default values, those of the source's examples; outer_radius and outer_spacing are not in the source."""

_ELEMENT = {"beam": ("slenderness", "torsion"), "sheet": ("thickness", "width", "poisson")}
_OUTLINE = {"beam": ("diameter", "side"), "sheet": ("thickness", "width")}
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Normalised:
    """Normalised arguments of a module, lengths divided by that of one beam; arguments of other kinds must be `None`.

    Attributes:
        radius, outer_radius: radii of the circles of tips.
        tilt: angle of the beams against the axis [deg].
        slenderness, torsion: d = A L^2 / I and delta = G J / EI of a beam.
        count: number of beams between two bodies.
        length_error: relative length error e of each beam, of length 1 + e; beams on the stage first.
        thickness, width: section of a sheet.
        spacing, outer_spacing: distances of opposite sheets.
        poisson: Poisson's ratio of a sheet.
    """

    radius: float | None = None
    outer_radius: float | None = None
    tilt: float | None = None
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
    """Dimensions [m] of a module: length and section (diameter, side, or thickness and width) of a beam, positions."""

    length: float | None = None
    diameter: float | None = None
    side: float | None = None
    thickness: float | None = None
    width: float | None = None
    radius: float | None = None
    outer_radius: float | None = None
    spacing: float | None = None
    outer_spacing: float | None = None


@dataclass(frozen=True)
class Material:
    """E and G [Pa] and Poisson's ratio; E and either G or nu define the others. By default E 69 GPa, G 26 GPa."""

    E: float | None = None
    G: float | None = None
    nu: float | None = None


ALUMINIUM = Material()
"""The default material."""
AS_PUBLISHED = Normalised()
"""Arguments equal to `DEFAULTS`."""
NORMALISED = Dimensions()
"""No dimensions: the module has a normalised compliance only."""


class _Elastic(NamedTuple):
    """Elastic constants E, G [Pa] and nu of a material."""

    E: float
    G: float
    nu: float


class _Section(NamedTuple):
    """Coefficients of a beam's section of thickness T: d / (L / T)^2, delta / (G / E) and I / T^4."""

    slenderness: float
    torsion: float
    moment: float


_SECTIONS = {"diameter": _Section(16.0, 2.0, math.pi / 64), "side": _Section(12.0, 1.687, 1 / 12)}


class Size(NamedTuple):
    """Scales from normalised to SI units: L [m], and EI of one beam or E' I of one sheet [N.m2]."""

    length: float
    rigidity: float


class Module(NamedTuple):
    """Compliance of a module at the reference point of its stage.

    Attributes:
        compliance: normalised compliance, shape (6, 6).
        size: length and rigidity of one beam; `None` for a module without dimensions.
    """

    compliance: np.ndarray
    size: Size | None

    def dimensional_compliance(self) -> np.ndarray:
        """Return the compliance in SI units, from loads [N, N.m] to displacements [m, rad], shape (6, 6).

        Raises `ModelError` for a module without dimensions.
        """
        length, rigidity = self._size()
        scale = np.array([length] * 3 + [1.0] * 3)
        return length / rigidity * np.outer(scale, scale) * self.compliance

    def dimensional_stiffness(self) -> np.ndarray:
        """Return the stiffness in SI units, from displacements [m, rad] to loads [N, N.m], shape (6, 6).

        Raises `ModelError` for a module without dimensions.
        """
        length, rigidity = self._size()
        scale = np.array([1 / length] * 3 + [1.0] * 3)
        K = np.linalg.inv(self.compliance)
        return rigidity / length * np.outer(scale, scale) * (K + K.T) / 2

    def _size(self) -> Size:
        """Return length and rigidity of one beam; `ModelError` for a module without dimensions."""
        if self.size is None:
            raise ModelError(
                "a beam module without dimensions.length has no stiffness in SI units, only a normalised one"
            )
        return self.size


def compliant_module(
    kind: str,
    given: Normalised = AS_PUBLISHED,
    material: Material = ALUMINIUM,
    dimensions: Dimensions = NORMALISED,
) -> Module:
    """Return a module; missing values are those of `DEFAULTS`, except the section, which `dimensions.length` requires.

    A quantity is given either normalised or as a dimension. `material` is for modules with `dimensions.length`.

    Raises:
        ModelError: an unknown kind; arguments of another kind, given twice or missing; a length of zero; a beam that is
            not slender; a tilt at which the axes do not meet; a wrong number of length errors.
    """
    one_of(kind, KINDS, "beam module: kind")
    _check_names(kind, given, dimensions)
    chosen = KINDS[kind]
    values = _values(kind, given, material, dimensions)
    geometry = Geometry(
        radius=values["radius"],
        outer_radius=values["outer_radius"],
        tilt=math.radians(values["tilt"]),
        spacing=values["spacing"],
        outer_spacing=values["outer_spacing"],
        count=_count(kind, given.count),
    )
    _check_places(kind, values)
    lengths = _lengths(kind, given.length_error, chosen.layers * geometry.count)
    K = _element(kind, values, min(lengths))
    C = chosen.compliance(geometry, unequal(K, lengths))
    return Module(without_rounding((C + C.T) / 2), _size(kind, values, material, dimensions))


def without_rounding(C: np.ndarray) -> np.ndarray:
    """Return a positive definite matrix with entries at rounding level, relative to their diagonal ones, set to 0."""
    size = np.sqrt(np.diag(C))
    return np.where(np.abs(C) < _ROUNDING * np.outer(size, size), 0.0, C)


# Arguments ------------------------------------------------------------------------------------------------------------


def _given(fields: Any) -> dict[str, Any]:
    """Return the fields of a dataclass that are not `None`."""
    return {name: value for name, value in asdict(fields).items() if value is not None}


def _check_names(kind: str, given: Normalised, dimensions: Dimensions) -> None:
    """Raise `ModelError` for arguments of another kind and for quantities given twice."""
    chosen = KINDS[kind]
    own = (*chosen.arguments, *_ELEMENT[chosen.element], "length_error")
    for name in _given(given):
        if name not in own:
            raise ModelError(f"beam module: {kind} has no {name}; it has {', '.join(own)}")
    lengths = ("length", *_OUTLINE[chosen.element], *[n for n in chosen.arguments if hasattr(dimensions, n)])
    for name in _given(dimensions):
        if name not in lengths:
            raise ModelError(f"beam module: {kind} has no dimensions.{name}; it has {', '.join(lengths)}")
        if name in _given(given):
            raise ModelError(
                f"beam module: {name} is given twice, normalised and as dimensions.{name}; give one of them"
            )


def _values(kind: str, given: Normalised, material: Material, dimensions: Dimensions) -> dict[str, float]:
    """Return the normalised values of all arguments in `DEFAULTS`, by name."""
    stated = {name: _finite(name, value) for name, value in _given(given).items() if name in DEFAULTS}
    lengths = {name: _above_zero(f"dimensions.{name}", value, "m") for name, value in _given(dimensions).items()}
    if "length" not in lengths:
        if unused := [f"dimensions.{name}" for name in lengths] + [f"material.{name}" for name in _given(material)]:
            raise ModelError(f"beam module: {unused[0]} is given without dimensions.length, the length of a beam [m]")
        return DEFAULTS | stated
    length = lengths.pop("length")
    stated |= {name: value / length for name, value in lengths.items() if name in DEFAULTS}
    elastic = _elastic(material)
    if KINDS[kind].element == "sheet":
        return DEFAULTS | {"poisson": elastic.nu} | stated
    if "slenderness" in stated or len(sections := lengths.keys() & _SECTIONS) != 1:
        raise ModelError(
            f"beam module: the slenderness of {kind} with dimensions.length follows from its section, expected one of "
            f"dimensions.diameter and dimensions.side [m] and no slenderness"
        )
    (name,) = sections
    section = _SECTIONS[name]
    slenderness = section.slenderness * (length / lengths[name]) ** 2
    return DEFAULTS | {"slenderness": slenderness, "torsion": section.torsion * elastic.G / elastic.E} | stated


def _size(kind: str, values: Mapping[str, float], material: Material, dimensions: Dimensions) -> Size | None:
    """Return the size of one beam or sheet from checked dimensions; `None` without `dimensions.length`."""
    length, E = dimensions.length, _elastic(material).E
    if length is None:
        return None
    if KINDS[kind].element == "sheet":
        t, u = values["thickness"] * length, values["width"] * length
        return Size(length, E * u * t**3 / 12 / (1 - values["poisson"] ** 2))
    (thick,) = {name: value for name, value in _given(dimensions).items() if name in _SECTIONS}.items()
    return Size(length, E * _SECTIONS[thick[0]].moment * thick[1] ** 4)


def _elastic(material: Material) -> _Elastic:
    """Return the constants of a material; the missing one of G and nu follows from the other two."""
    stated = {name: _above_zero(f"material.{name}", value, "") for name, value in _given(material).items()}
    if not stated:
        stated = {"E": 69e9, "G": 26e9}
    if "E" not in stated or len(stated) == 1:
        raise ModelError(f"beam module: material has {', '.join(stated)}, expected E and one of G and nu")
    E = stated["E"]
    G = stated.get("G", E / (2 * (1 + stated.get("nu", 0.0))))
    return _Elastic(E, G, stated.get("nu", E / (2 * G) - 1))


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
    if "tilt" in names and not 0 < values["tilt"] <= 90:
        raise ModelError(
            f"beam module: tilt is {values['tilt']:g} degrees, expected above 0 and up to 90: the beams' axes meet at "
            f"r / tan(tilt) from the stage; three_beam has parallel axes, inverted tilts them the other way"
        )
    for name in ("radius", "spacing"):
        inner, outer = values[name], values[f"outer_{name}"]
        if f"outer_{name}" in names and not outer > inner:
            raise ModelError(f"beam module: outer_{name} is {outer:g}, expected more than the {name}, {inner:g}")


def _lengths(kind: str, errors: tuple[float, ...] | None, count: int) -> list[float]:
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


def _element(kind: str, values: Mapping[str, float], shortest: float) -> np.ndarray:
    """Return the stiffness of one beam or sheet, shape (6, 6); `ModelError` if the shortest is not slender."""
    chosen = KINDS[kind].element
    if chosen == "beam":
        d, least = values["slenderness"] * shortest**2, _SECTIONS["side"].slenderness * SLENDER**2
        if not d >= least:
            raise ModelError(
                f"beam module: slenderness d = A L^2 / I is {d:g}, expected at least {least:g}: a beam is {SLENDER:g} "
                f"times as long as thick, d = 16 (L/D)^2 of a round and 12 (L/T)^2 of a square one"
            )
        return beam(values["slenderness"], _above_zero("torsion", values["torsion"], ""))
    t, u = (_above_zero(name, values[name], "of the length") for name in ("thickness", "width"))
    if not t <= shortest / SLENDER:
        raise ModelError(
            f"beam module: thickness is {t / shortest:g} of the length, expected at most {1 / SLENDER:g}, as of a sheet"
        )
    if not u > t:
        raise ModelError(f"beam module: width is {u:g}, expected more than the thickness {t:g}, as of a sheet")
    if not 0 <= values["poisson"] < 0.5:
        raise ModelError(f"beam module: poisson is {values['poisson']:g}, expected from 0 to below 0.5")
    return sheet(t, u, values["poisson"])


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
