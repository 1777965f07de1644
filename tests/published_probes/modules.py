"""Numbers of the beam modules that no analysis returns."""

from typing import Any

import numpy as np

from hfsa.components import beam_module
from hfsa.components._beam import LENGTH_POWERS, beam
from hfsa.components._beam_assembly import ring, side_by_side
from hfsa.components._beam_module import Dimensions, Material


def beams_to_first_order() -> dict[str, Any]:
    """Three beams, the one at (0, 0, -r) 5 % short, with its stiffness to first order in that."""
    K = beam(1e4, 0.7536)
    short = K * (1 + 0.05 * LENGTH_POWERS)
    return {"C22": side_by_side([K, short, K], ring(0.6, 0.0, 3))[1, 1]}


def beam_rotation() -> dict[str, Any]:
    """How far from the stage a tilted module turns, by how much it misses r / tan(tilt); four beams by three."""
    C = beam_module.analyze(kind="tilted")["compliance"]
    radius, center = C[1, 1] / abs(C[1, 5]), -C[1, 5] / C[5, 5]
    three, four = (beam_module.analyze(kind=kind)["compliance"] for kind in ("double_tilted", "double_tilted_four"))
    return {
        "radius": radius,
        "drift_by_force": radius - 0.6,
        "drift_by_moment": 0.6 - center,
        "four_by_three": np.linalg.norm(four) / np.linalg.norm(three),
    }


def beam_torsion() -> dict[str, Any]:
    """The torsion delta of a round beam by the constants of the examples, and with G from Poisson's ratio."""
    by_poisson = beam_module.analyze(
        dimensions=Dimensions(length=1.0, diameter=0.04), material=Material(E=69e9, nu=0.33)
    )
    usual = beam_module.analyze(dimensions=Dimensions(length=1.0, diameter=0.04), material=Material(E=69e9, G=26e9))
    found = [1 / C["compliance"][3, 3] / 3 - 12 * 0.6**2 for C in (usual, by_poisson)]
    return {"torsion": found[0], "by_poisson": found[1]}
