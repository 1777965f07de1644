"""Numbers of the beam modules that no analysis returns."""

from typing import Any

import numpy as np
from parts_by_name import part

from hfsa.components._mechanics.beam import LENGTH_POWERS, beam
from hfsa.components._mechanics.beam_arguments import Dimensions
from hfsa.components._mechanics.beam_assembly import at_point, compliance, ring
from hfsa.components._mechanics.beam_section import Material

_MODULE = part("beam_module")
_RADIUS, _TILT = 0.6, np.pi / 4
_E, _G = 69e9, 26e9
"""Of the examples [Pa]; G is printed nowhere."""


def beams_to_first_order() -> np.ndarray:
    """Compliance of three beams, the one at (0, 0, -r) 5 % short, with its stiffness to first order in that."""
    K = beam(1e4, 2 * _G / _E)
    short = K * (1 + 0.05 * LENGTH_POWERS)
    return compliance(ring(_RADIUS, 0.0, 3), [K, short, K])


def beams_of_rounded_halves() -> np.ndarray:
    """Compliance of a double tilted module of halves that are rounded to the digits printed of them."""
    inner, outer = (_rounded(_MODULE.analysis(kind=kind)["compliance"]) for kind in ("tilted", "inverted"))
    J = at_point((-(2 * _RADIUS / np.tan(_TILT) + np.cos(_TILT)), 0.0, 0.0))
    return inner + J @ outer @ J.T


def beams_screws() -> dict[str, Any]:
    """Screws that the columns 2 to 6 of a tilted module's compliance are: pitches, distances from the stage, drifts."""
    slides, turns = np.split(_MODULE.analysis(kind="tilted")["compliance"][:, 1:], 2)
    squares = np.sum(turns**2, axis=0)
    radius = np.sqrt(np.sum(slides**2, axis=0) / squares)
    return {
        "pitch": np.sum(slides * turns, axis=0) / squares,
        "radius": radius,
        "drift_by_force": abs(radius[0] - _RADIUS / np.tan(_TILT)),
        "drift_by_moment": abs(radius[4] - _RADIUS / np.tan(_TILT)),
    }


def beams_four_by_three() -> float:
    """Compliance of a double tilted module of four beams by that of three."""
    three, four = (_MODULE.analysis(kind=kind)["compliance"] for kind in ("double_tilted", "double_tilted_four"))
    return float(np.linalg.norm(four) / np.linalg.norm(three))


def beams_round() -> dict[str, Any]:
    """Round beams of L / D = 25 by the constants of the examples and with G from Poisson's ratio: d, delta and C44."""
    usual, by_poisson = (_round_beams(material) for material in (Material(E=_E, G=_G), Material(E=_E, nu=0.33)))
    torsion, other = (1 / C[3, 3] / 3 - 12 * _RADIUS**2 for C in (usual, by_poisson))
    return {
        "slenderness": 1 / (3 * usual[0, 0]),
        "torsion": torsion,
        "by_poisson": other,
        "in_C44": 625 / 3 * torsion,
        "C44_by_poisson": by_poisson[3, 3],
    }


def _round_beams(material: Material) -> np.ndarray:
    """Normalised compliance of three beams of a material."""
    return _MODULE.analysis(dimensions=Dimensions(length=1.0, diameter=0.04), material=material)["compliance"]


def _rounded(C: np.ndarray) -> np.ndarray:
    """Compliance to 1e-6, and to 1e-7 below 1e-4."""
    return np.where(np.abs(C) < 1e-4, np.round(C, 7), np.round(C, 6))
