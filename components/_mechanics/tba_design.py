"""Design formulas of the triangular biaxial accelerometer: masses, stiffnesses and natural frequencies at home.

    h = (s - a) / (2 sqrt(2) tan(pi / n)), sqrt(6) (s - a) / 12 for n = 3      length of a link, two to each of n limbs
    k_in  = E w tm^3 / l                                                       a leg on its two feet
    k_xft = G w tm (w^2 + tm^2) / (12 l),  k_xlt = G w c' (w^2 + c'^2) / (12 e),  c' = c / sqrt(2)
    k_out = 1 / (2 / k_xft - 1 / k_xlt)                                        rule `minus`; `plus`: springs in series
    M_in  = m_pm + n (1/2 m_bar + 3/2 m_leg + 2 I_legz / h^2)                  K_in  = 2 n k_in / h^2       (eq 92)
    M_out = m_pm + n (1/4 m_bar + 5/4 m_leg + (I_legx + I_legy) / h^2 + 1/2 I_barx / h^2),  K_out = 2 n k_out / h^2
    Gamma = m_pm + n (1/2 m_bar + 2 m_leg)                                     mass driven by a moving base

The proof mass is a regular polygon of n sides a in a frame of n sides s; the source has n = 3. By its symmetry, of
order n >= 3, mass and stiffness are isotropic in the plane. c1, c2 of eq 93 are 0 for n > 3: in the plane no tensor of
third order has that symmetry.

Every function accepts numbers and CasADi expressions, for exact sensitivities and for an optimiser. `symbols()` returns
a `Shape` of symbols, `formulas(shape)` evaluates the formulas.

Source: technical report of 2016 on the accelerometer, eqs 89 to 93, tables 1 to 3. Corrected here: the last member of
(90) lacks a factor 2 in k_in, has 12 E for G / 12 in k_out, and drops the polar terms w^2 + t^2; table 2 prints b =
4000 um but computes with b + c; table 3 prints s = 24.96 for 249.6 mm and E = 1.275e11 for 1.275e9 Pa. The rule `minus`
is that of the source and reproduces its K_out; two springs in series, rule `plus`, are 32 % softer. Gamma is not in the
source.
"""

import math
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

import casadi as ca

from hfsa.components._mechanics.polygon import polygon_area
from hfsa.components._modelling.model import ModelError, one_of

KOutRule = Literal["minus", "plus"]
LIMBS = 3
"""Number of limbs of the source, and the least."""

Number = Any
"""A float or a CasADi expression."""


class Shape(NamedTuple):
    """Dimensions [m] and material by the source's letters, numbers or CasADi expressions.

    Attributes:
        a: side of the proof mass, a regular polygon with a limb at each side.
        s: side of the polygon of the frame.
        e: length of a leg.
        b: length of a bar.
        c: width of a leg across its corner; c / sqrt(2) is its thickness.
        d: width of a bar.
        tm: thickness of a foot, the flexure at each end of a leg.
        l: length of a foot.
        w: thickness of the sensor out of the plane.
        E: Young's modulus [Pa].
        nu: Poisson's ratio.
        rho: density [kg/m3].
    """

    a: Number
    s: Number
    e: Number
    b: Number
    c: Number
    d: Number
    tm: Number
    l: Number  # noqa: E741  the source's letter
    w: Number
    E: Number
    nu: Number
    rho: Number


DIMENSIONS = Shape._fields[:9]
"""Names of the lengths."""


class Design(NamedTuple):
    """A published design.

    Attributes:
        shape: dimensions and material.
        damping_ratio: damping ratios in the plane and out of it (assumed).
        stiffness: K along x, y, z by finite elements [N/m]; `None` for that of the formulas.
    """

    shape: Shape
    damping_ratio: tuple[float, float]
    stiffness: tuple[float, float, float] | None = None


def _silicon(*micrometres: float) -> Shape:
    """Return the shape of a silicon sensor from its dimensions [um], in the order of `Shape`."""
    return Shape(*[1e-6 * x for x in micrometres], E=1.618e11, nu=0.222, rho=2330.0)


DESIGNS: Mapping[str, Design] = {
    "mems": Design(_silicon(3333, 10398, 700, 1400, 200, 210, 20, 210, 300), (0.005, 0.02)),
    "optimum": Design(
        _silicon(12000, 28383, 2931.5, 4749.22, 749.22, 207.47, 30, 94.051, 300),
        (0.005, 0.02),
        (1530.3, 1531.5, 12333.0),
    ),
    "rapid_prototype": Design(
        Shape(
            80e-3, 249.6e-3, 16.79e-3, 35.12e-3, 8.72e-3, 5.04e-3, 2e-3, 5.04e-3, 13e-3, E=1.275e9, nu=0.3, rho=1150.0
        ),
        (0.03, 0.03),
    ),
}
"""Published designs, of tables 1, 2 and 3."""


class Bodies(NamedTuple):
    """Masses [kg], inertia [kg.m2] of a leg about its own axes and of a bar about x, link length [m], limbs."""

    proof_mass: Number
    bar: Number
    leg: Number
    bar_x: Number
    leg_x: Number
    leg_y: Number
    leg_z: Number
    link: Number
    limbs: int


class Formulas(NamedTuple):
    """Results of the design formulas of a shape.

    Attributes:
        bodies: masses, moments of inertia and the length of a link.
        k_in, k_out: stiffness of a leg with its two feet, in bending in the plane and in torsion [N.m/rad].
        M_in, M_out: generalized masses in the plane and out of it [kg].
        K_in, K_out: stiffnesses in the plane and out of it [N/m].
        driven_mass: Gamma [kg].
    """

    bodies: Bodies
    k_in: Number
    k_out: Number
    M_in: Number
    M_out: Number
    K_in: Number
    K_out: Number
    driven_mass: Number

    @property
    def f_in(self) -> Number:
        """Natural frequency of both modes in the plane [Hz]."""
        return (self.K_in / self.M_in) ** 0.5 / (2 * math.pi)

    @property
    def f_out(self) -> Number:
        """Natural frequency out of the plane [Hz]."""
        return (self.K_out / self.M_out) ** 0.5 / (2 * math.pi)


def symbols() -> Shape:
    """Return a shape of CasADi symbols."""
    return Shape(*[ca.SX.sym(name) for name in Shape._fields])


def formulas(shape: Shape, rule: str = "minus", limbs: int = LIMBS) -> Formulas:
    """Return masses, stiffnesses and frequencies of a shape; `rule` combines the torsion of feet and leg to k_out."""
    bodies = _bodies(shape, limbs)
    k_in, k_out = shape.E * shape.w * shape.tm**3 / shape.l, _leg_torsion(shape, rule)
    _, bar, leg, bar_x, leg_x, leg_y, leg_z, h, n = bodies
    return Formulas(
        bodies,
        k_in,
        k_out,
        M_in=bodies.proof_mass + n * (bar / 2 + 3 / 2 * leg + 2 * leg_z / h**2),
        M_out=bodies.proof_mass + n * (bar / 4 + 5 / 4 * leg + (leg_x + leg_y + bar_x / 2) / h**2),
        K_in=2 * n * k_in / h**2,
        K_out=2 * n * k_out / h**2,
        driven_mass=bodies.proof_mass + n * (bar / 2 + 2 * leg),
    )


def coriolis(bodies: Bodies) -> tuple[Number, Number]:
    """Return c1, c2 [kg/m], the velocity terms at home (eq 93).

    The force is C q', C = [[c1 x' - c2 y', -c2 x' - c1 y', 0], [-c2 x' - c1 y', c2 y' - c1 x', 0], [0, 0, 0]].
    """
    if bodies.limbs > LIMBS:
        return 0.0, 0.0
    scale, h = 3 * math.sqrt(2), bodies.link
    c1 = scale * (bodies.bar + 2 * bodies.leg) / (8 * h)
    return c1, scale * (bodies.bar + bodies.leg) / (8 * h) + scale * bodies.leg_z / (2 * h**3)


def torsional_stiffnesses(shape: Shape) -> tuple[Number, Number]:
    """Return the torsional stiffnesses k_xft of a foot and k_xlt of a leg [N.m/rad]."""
    modulus, across = shape.E / (2 * (1 + shape.nu)), shape.c / math.sqrt(2)
    foot = modulus * shape.w * shape.tm * (shape.w**2 + shape.tm**2) / (12 * shape.l)
    return foot, modulus * shape.w * across * (shape.w**2 + across**2) / (12 * shape.e)


def checked_shape(shape: Shape, rule: str, usual: Shape, owner: str) -> Shape:
    """Return a shape of numbers after a check that it is feasible.

    Args:
        shape: shape to check.
        rule: as in `formulas`.
        usual: shape of the published design, for messages.
        owner: name of the part, the beginning of messages.

    Raises:
        ModelError: a length, modulus or density not above 0, a Poisson's ratio outside -1 to 0.5, a frame that is not
            larger than the proof mass, or legs too soft for rule `minus`.
    """
    for name, value, right in zip(Shape._fields, shape, usual, strict=True):
        unit = {"E": "Pa", "nu": "1", "rho": "kg/m3"}.get(name, "m")
        low, high = (-1.0, 0.5) if name == "nu" else (0.0, math.inf)
        if not (low < value < high):
            span = f"between {low:g} and {high:g}" if name == "nu" else "above 0"
            raise ModelError(
                f"{owner}: dimensions.{name} is {value:g} {unit}, expected a number {span}; the design has {right:g}"
            )
    if shape.s <= shape.a:
        raise ModelError(
            f"{owner}: dimensions.s is {shape.s:g} m, but the frame must be larger than the proof mass, whose side "
            f"dimensions.a is {shape.a:g} m; the design has s = {usual.s:g}, a = {usual.a:g}"
        )
    if _leg_torsion(shape, rule) <= 0:
        raise ModelError(
            f"{owner}: the legs twist more easily than their feet, for which k_out_rule=minus gives a negative "
            "stiffness; take k_out_rule=plus, thinner or longer feet (tm, l), or thicker or shorter legs (c, e)"
        )
    return shape


def checked_limbs(limbs: int, owner: str) -> int:
    """Return a number of limbs; `ModelError`, beginning with `owner`, for fewer than three."""
    if limbs < LIMBS:
        raise ModelError(f"{owner}: limbs is {limbs}, expected {LIMBS} or more, one at each side of the proof mass")
    return limbs


def link_length(shape: Shape, limbs: int = LIMBS) -> Number:
    """Return h, the length of a link [m]."""
    return (shape.s - shape.a) / (2 * math.sqrt(2) * math.tan(math.pi / limbs))


def _bodies(shape: Shape, limbs: int) -> Bodies:
    """Return the bodies of the sensor: cuboids as in the source (eq 89), the proof mass a regular polygon."""
    a, _, e, b, c, d, _, _, w, _, _, rho = shape
    bar, leg = rho * b * d * w, rho * e * c * w / math.sqrt(2)
    return Bodies(
        proof_mass=rho * polygon_area(a, limbs) * w,
        bar=bar,
        leg=leg,
        bar_x=bar * (d**2 + w**2) / 12,
        leg_x=leg * (e**2 + w**2) / 12,
        leg_y=leg * (w**2 + c**2) / 12,
        leg_z=leg * (e**2 + c**2) / 12,
        link=link_length(shape, limbs),
        limbs=limbs,
    )


def _leg_torsion(shape: Shape, rule: str) -> Number:
    """Return k_out, the torsional stiffness of a leg with its feet [N.m/rad]."""
    one_of(rule, ("minus", "plus"), "tba_accelerometer: k_out_rule")
    foot, leg = torsional_stiffnesses(shape)
    return 1 / (2 / foot + (-1 / leg if rule == "minus" else 1 / leg))
