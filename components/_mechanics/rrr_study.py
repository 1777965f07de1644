"""Design study of the 3-RRR stage: ranges, natural frequencies and peak stress over its dimensions.

All responses are those of level `constant_jacobian`: ranges of the pose over elongations from 0 to a stroke, the lowest
natural frequency at rest without and with stacks, and the largest bending stress of a hinge at the corners of these
elongations, as angles grow with them. By the threefold symmetry M and K have equal elements on the diagonal and equal
ones off it, so that

    (2 pi f)^2 = (K11 + 2 K12) / (M11 + 2 M12)    of the yaw,      (K11 - K12) / (M11 - M12)    of the shifts, twice
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from itertools import product
from typing import Any, Literal, NamedTuple

import casadi as ca
import numpy as np

from hfsa.components._mechanics import rrr_dynamics as dynamics
from hfsa.components._mechanics.pzt import Stack
from hfsa.components._mechanics.rrr_design import Dimensions
from hfsa.components._mechanics.rrr_hinge import bending_stiffness, stress_per_angle
from hfsa.components._mechanics.rrr_symbols import LINKS, LinkSymbols, MassSymbols
from hfsa.components._modelling.model import ModelError
from hfsa.components._modelling.study import Response, Study, Variable

Objective = Literal["yaw_range", "f1", "f1_bonded", "safety"]

RESPONSES = {
    "yaw_range": ("rad", "Range of the yaw"),
    "x_range": ("m", "Range of x"),
    "y_range": ("m", "Range of y"),
    "f1": ("Hz", "Lowest natural frequency without stacks"),
    "f1_bonded": ("Hz", "Lowest natural frequency with stacks"),
    "peak_stress": ("Pa", "Peak stress of the hinges"),
    "safety": ("1", "Yield strength over the peak stress"),
}
"""Responses of a design study with their units."""

_HINGE = {
    "elastic_modulus": ("Pa", "Young's modulus of the hinges"),
    "width": ("m", "Width of the hinges"),
    "thickness": ("m", "Thickness of the necks"),
    "radius": ("m", "Radius of the notches"),
    "yield_strength": ("Pa", "Yield strength of the hinges"),
}
_MASSES = {
    "platform": ("kg", "Mass of the platform"),
    "crank": ("kg", "Mass of a crank"),
    "coupler": ("kg", "Mass of a coupler"),
}


@dataclass(frozen=True)
class Goals:
    """What a design is for.

    Attributes:
        stroke: largest elongation of every stack; the smallest is 0 [m].
        least_yaw: least range of the yaw [rad], or `None`.
        least_frequency: least natural frequency without stacks [Hz], or `None`.
        largest_stress: largest stress of a hinge [Pa], or `None`.

    Raises:
        ModelError: a value that is not finite or not above 0.
    """

    stroke: float
    least_yaw: float | None = None
    least_frequency: float | None = None
    largest_stress: float | None = None

    def __post_init__(self):
        for field in fields(self):
            value = getattr(self, field.name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise ModelError(f"rrr_stage: {field.name} is {value:g}, expected a finite number above 0")

    def requirements(self, found: Mapping[str, ca.SX]) -> dict[str, ca.SX]:
        """Return the relative margins of the goals that are given, by description, of responses by name."""
        margins = {}
        if self.least_yaw is not None:
            name = f"a range of the yaw above {self.least_yaw:g} rad (least_yaw)"
            margins[name] = found["yaw_range"] / self.least_yaw - 1
        if self.least_frequency is not None:
            name = f"a lowest natural frequency above {self.least_frequency:g} Hz (least_frequency)"
            margins[name] = found["f1"] / self.least_frequency - 1
        if self.largest_stress is not None:
            name = f"a peak stress below {self.largest_stress:g} Pa (largest_stress)"
            margins[name] = 1 - found["peak_stress"] / self.largest_stress
        return margins


class _Hinge(NamedTuple):
    """Hinges as expressions."""

    elastic_modulus: ca.SX
    width: ca.SX
    thickness: ca.SX
    radius: ca.SX
    yield_strength: ca.SX

    @property
    def stiffness(self) -> ca.SX:
        """K_b [N.m/rad]."""
        return bending_stiffness(self.elastic_modulus, self.width, self.thickness, self.radius)


def design_study(design: Dimensions, stack: Stack, goals: Goals, objective: Objective, title: str) -> Study:
    """Return the study of a design over its dimensions, with a response to maximise; errors as `Dimensions`."""
    variables = _variables(design)
    symbols = {name: variable.symbol for name, variable in variables.items()}
    links = LinkSymbols(*[symbols[f"links.{name}"] for name in LINKS])
    hinge = _Hinge(*[symbols[f"hinge.{name}"] for name in _HINGE])
    responses = _responses(links, hinge, _masses(design, symbols), stack, goals.stroke)
    conditions = {f"{name} above 0": v.symbol / abs(v.value) for name, v in variables.items() if "psi" not in name}
    conditions |= links.conditions(design.links_at_rest)
    return Study(
        title,
        variables,
        {objective: responses[objective], **responses},
        conditions,
        goals.requirements({name: response.expression for name, response in responses.items()}),
        {},
        ["The dimensions are free within their bounds: nothing is known of necks that touch or links that collide."],
    )


def _variables(design: Dimensions) -> dict[str, Variable]:
    """Return the dimensions of a design by name."""
    parts = (
        ("links", design.links_at_rest, LINKS),
        ("hinge", design.hinge, _HINGE),
        ("masses", design.masses, _MASSES),
    )
    return {
        (name := f"{part}.{field}"): Variable(ca.SX.sym(name), float(getattr(values, field)), unit, text)
        for part, values, texts in parts
        for field, (unit, text) in texts.items()
        if getattr(values, field)
    }


def _masses(design: Dimensions, symbols: Mapping[str, ca.SX]) -> MassSymbols:
    """Return the masses; one that is 0 is not a variable."""
    own = design.masses
    platform, crank, coupler = (symbols.get(f"masses.{name}", ca.SX(0)) for name in _MASSES)
    inertia = crank * (own.crank_inertia / own.crank) if own.crank else ca.SX(own.crank_inertia)
    return MassSymbols(platform, crank, coupler, platform * (own.platform_inertia / own.platform), inertia)


def _responses(links: Any, hinge: Any, masses: Any, stack: Stack, stroke: float) -> dict[str, Response]:
    """Return the responses by name."""
    p = ca.SX.sym("p", 3)
    mechanism = dynamics.constant_jacobian(links, p, ca.SX.sym("v", 3), hinge.stiffness, masses)
    terms = dynamics.terms(mechanism)
    mass, stiffness = ca.substitute([terms.mass, ca.jacobian(terms.elastic, p)], [p], [ca.SX.zeros(3)])
    corners = [stroke * np.array(corner) for corner in product((0, 1), repeat=3)]
    bends = ca.vertcat(*[ca.substitute(mechanism.hinges, p, ca.SX(corner)) for corner in corners[1:]])
    stresses = stress_per_angle(hinge.stiffness, hinge.width, hinge.thickness) * ca.fabs(bends)
    ranges = stroke * ca.sum2(ca.fabs(links.jacobian))
    free, bonded = (_frequencies(mass, stiffness, *added) for added in ((0, 0), (stack.tip_mass, stack.stiffness)))
    safety = hinge.yield_strength / stresses
    found = {
        "yaw_range": (ranges[2], None),
        "x_range": (ranges[0], None),
        "y_range": (ranges[1], None),
        "f1": (ca.mmin(free), free),
        "f1_bonded": (ca.mmin(bonded), bonded),
        "peak_stress": (ca.mmax(stresses), None),
        "safety": (ca.mmin(safety), safety),
    }
    return {name: Response(found[name][0], *RESPONSES[name], found[name][1]) for name in RESPONSES}


def _frequencies(mass: ca.SX, stiffness: ca.SX, tip_mass: float, spring: float) -> ca.SX:
    """Return the natural frequencies of the yaw and of the shifts, (2, 1) [Hz], with mass and spring per stack."""
    yaw = (stiffness[0, 0] + 2 * stiffness[0, 1] + spring) / (mass[0, 0] + 2 * mass[0, 1] + tip_mass)
    shift = (stiffness[0, 0] - stiffness[0, 1] + spring) / (mass[0, 0] - mass[0, 1] + tip_mass)
    return ca.sqrt(ca.vertcat(yaw, shift)) / (2 * math.pi)
