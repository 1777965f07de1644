"""Cross-sections of beams and sheets, and their materials: rigidities in SI units.

    section    A            I                            J
    round      pi D^2 / 4   pi D^4 / 64                  2 I
    square     T^2          T^4 / 12                     0.14058 T^4
    rectangle  t w          w t^3 / 12, t w^3 / 12       w t^3 (1/3 - 64 / pi^5 t / w sum tanh(n pi w / (2 t)) / n^5)
    sheet      t w          w t^3 / 12, t w^3 / 12       w t^3 / 3

with n = 1, 3, 5, ... (Saint-Venant). The thickness t is along the beam's y, the width w along its z. A sheet is so wide
that its bending about the wide side is that of a plate, E I / (1 - nu^2); a rectangle is a beam, E I.

Source of the sheet: the paper of 2013 on beam modules, eq A.1. Not in it: the rectangle.
"""

import math
from dataclasses import asdict, dataclass
from typing import NamedTuple

from hfsa.components._modelling.errors import ModelError

_TERMS = range(1, 40, 2)
"""Terms of the series of the torsion constant: the rest is below rounding."""


@dataclass(frozen=True)
class Material:
    """Material; E and either G or nu define the others. By default E 69 GPa, G 26 GPa.

    Attributes:
        E: Young's modulus [Pa].
        G: shear modulus [Pa].
        nu: Poisson's ratio.
    """

    E: float | None = None
    G: float | None = None
    nu: float | None = None


ALUMINIUM = Material()
"""The default material."""


class Elastic(NamedTuple):
    """Elastic constants E, G [Pa] and nu of a material."""

    E: float
    G: float
    nu: float


class Section(NamedTuple):
    """Rigidities of a beam: axial EA [N], torsional GJ and bending EI along y and along z [N.m2]."""

    axial: float
    torsion: float
    along_y: float
    along_z: float


def elastic(material: Material, label: str) -> Elastic:
    """Return the constants of a material; the missing one of G and nu follows from the other two.

    Raises `ModelError`, which begins with `label`, for a constant that is missing or not above 0.
    """
    stated = {name: value for name, value in asdict(material).items() if value is not None}
    for name, value in stated.items():
        if not (math.isfinite(value) and value > 0) and not (name == "nu" and value == 0):
            raise ModelError(f"{label}.{name} is {value:g}, expected above 0")
    if not stated.get("nu", 0.0) < 0.5:
        raise ModelError(f"{label}.nu is {stated['nu']:g}, expected below 0.5")
    if not stated:
        stated = {"E": 69e9, "G": 26e9}
    if "E" not in stated or len(stated) == 1:
        raise ModelError(f"{label} has {', '.join(stated)}, expected E and one of G and nu")
    E = stated["E"]
    G = stated.get("G", E / (2 * (1 + stated.get("nu", 0.0))))
    return Elastic(E, G, stated.get("nu", E / (2 * G) - 1))


def round_section(diameter: float, m: Elastic) -> Section:
    """Return the rigidities of a round section of a diameter [m]."""
    moment = math.pi / 64 * diameter**4
    return Section(m.E * math.pi / 4 * diameter**2, m.G * 2 * moment, m.E * moment, m.E * moment)


def rectangular_section(thickness: float, width: float, m: Elastic) -> Section:
    """Return the rigidities of a rectangular section [m], square where both are equal."""
    soft, stiff = width * thickness**3 / 12, thickness * width**3 / 12
    return Section(m.E * thickness * width, m.G * torsion_constant(thickness, width), m.E * soft, m.E * stiff)


def sheet_section(thickness: float, width: float, m: Elastic) -> Section:
    """Return the rigidities of a sheet [m] (eq A.1)."""
    beam = rectangular_section(thickness, width, m)
    return beam._replace(torsion=m.G * width * thickness**3 / 3, along_y=beam.along_y / (1 - m.nu**2))


def torsion_constant(thickness: float, width: float) -> float:
    """Return J of a rectangle [m4], of sides in any order."""
    t, w = sorted((thickness, width))
    series = sum(math.tanh(n * math.pi * w / (2 * t)) / n**5 for n in _TERMS)
    return w * t**3 * (1 / 3 - 64 / math.pi**5 * t / w * series)
