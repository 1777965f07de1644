"""Calibration of the links of the 3-RRR stage from measured poses, at level `constant_jacobian`.

    pose = J0 l,    J0 of `rrr_kinematics.py`, in axes that are turned by an angle against those of the measurement

J0 depends on three combinations of the links alone: psi1 + psi2, the radius R, and crank sin(psi3) / arm, psi3 the
angle from crank to coupler. The lengths of crank and coupler, and the two angles, are therefore not determined one by
one, by however many poses.

Source: thesis of 2000 on the 3-RRR stage, sec. 2.5, eq 2.23 (objective and weights) and app. B (bounds, turn of the
axes of the measurement).
"""

import math

import casadi as ca

from hfsa.components._mechanics.pzt import STROKE_IN_USE
from hfsa.components._mechanics.rrr_design import Dimensions
from hfsa.components._mechanics.rrr_symbols import LINKS, LinkSymbols
from hfsa.components._modelling.calibration import Calibration
from hfsa.components._modelling.study import Response, Study, Variable

FREE = tuple(f"links.{name}" for name in ("crank", "coupler", "radius", "psi1", "psi2"))
"""Dimensions of the objective of the source."""

_BOUNDS = ((10e-3, 20e-3), (10e-3, 20e-3), (20e-3, 35e-3), (0.6, 2.0), (0.2, 1.5))
_SIZES = {"x": 1e-6, "y": 1e-6, "yaw": 1e-4}
"""Errors that weigh alike: w = 1, 1 of micrometres and 1e4 of radians, squared as in the listing of the source."""
_ELONGATIONS = ("elongation_1", "elongation_2", "elongation_3")


def calibration_of(dimensions: Dimensions, turn: float) -> Calibration:
    """Return the calibration from poses in axes that the stage's are turned against by `turn` [deg]."""
    present, angle = dimensions.links_at_rest, math.radians(turn)
    variables = {
        f"links.{name}": Variable(ca.SX.sym(name), float(getattr(present, name)), unit, text)
        for name, (unit, text) in LINKS.items()
    }
    for i, name in enumerate(_ELONGATIONS, start=1):
        variables[name] = Variable(ca.SX.sym(name), 0.0, "m", f"Elongation of stack {i}")
    links = LinkSymbols(*[variables[f"links.{name}"].symbol for name in LINKS])
    pose = links.jacobian @ ca.vertcat(*[variables[name].symbol for name in _ELONGATIONS])
    x, y = math.cos(angle) * pose[0] + math.sin(angle) * pose[1], math.cos(angle) * pose[1] - math.sin(angle) * pose[0]
    responses = {
        "x": Response(x, "m", "Position of the platform in the axes of the measurement"),
        "y": Response(y, "m", "Position of the platform in the axes of the measurement"),
        "yaw": Response(pose[2], "rad", "Rotation of the platform"),
        "psi1 + psi2": Response(links.psi, "rad", "Direction from B2 to C2"),
        "crank sin(psi3)": Response(links.crank * ca.sin(links.psi3), "m", "Arm of a coupler about its fixed hinge"),
    }
    title = f"rrr_stage, kinematics {dimensions.kinematics}"
    study = Study(title, variables, responses, links.conditions(present), {}, {}, [])
    return Calibration(
        study,
        FREE,
        _SIZES,
        dict(zip(FREE, _BOUNDS, strict=True)),
        (_ELONGATIONS, ("x", "y", "yaw")),
        (0.0, STROKE_IN_USE),
        "kinematics",
    )
