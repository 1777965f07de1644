"""A platform on compliant beams (`beam_module`): loads and a base that moves in, what the platform does out; linear.

    M q'' + D q' + K q = w - M b        D = damping_ratio D_1, D_1 the damping of ratio 1 in every mode

q = (x, y, z, thx, thy, thz) is the displacement of the stage's reference point and the rotation from rest, relative to
the base, along the module's axes: X from base to stage. w = (force, torque) is the wrench at that point, b = (a, alpha)
the acceleration of the point that moves with the base there. K is the module's stiffness (`_beam_module`), and with the
platform's mass m, inertia J about its mass centre and c, from the reference point to there,

    M = [[m 1, -m skew(c)], [m skew(c), J - m skew(c)^2]]

Ports: in `wrench.force` [N], `wrench.torque` [N.m], `base.acceleration` [m/s2], `base.angular_acceleration` [rad/s2];
out `platform.position` [m], `.rotation` [rad], `.velocity`, `.angular_velocity`, and, which loads and base feed through
to, `.acceleration` and `.angular_acceleration`, all relative to the base. `displacement` is the largest entry of q with
translations by the length of a beam, and `displacement_warning` 1 above 0.1, where linear beams end. The beams have no
mass.

Bode plot of three aluminium beams 50 mm long and 2 mm thick on a circle of 30 mm that carry a disc of 0.1 kg and 30 mm:
from `wrench.force[1]` to `platform.position[1]` 7.69e-8 m/N up to one resonance, 34 dB high, at 1815.1 Hz; from
`wrench.torque[1]` to `platform.rotation[1]` 6.06e-2 rad/(N.m) up to one, 34 dB high, at 96.36 Hz; -40 dB per decade
above. From `wrench.force[2]` to `platform.position[2]` 6.42e-5 m/N up to a resonance, 34 dB high, at 62.82 Hz, and -40
dB per decade above; the platform turns about Z with it, 4.27e-6 rad/N at low frequency, with a second resonance at
2569.8 Hz, and moves in no other way. From `base.acceleration[2]` the same for 0.1 N by m/s2.

Source: the paper of 2013 on beam modules. Not in it: the platform, and damping, of which 1 % is assumed.
"""

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from hfsa.components._beam_kinds import KINDS, KindName
from hfsa.components._beam_module import (
    ALUMINIUM,
    NORMALISED,
    Dimensions,
    Material,
    Module,
    Normalised,
    compliant_module,
    without_rounding,
)
from hfsa.components._model import Model, ModelError, one_of
from hfsa.components._modes import modal_damping, modes
from hfsa.components._screws import skew

Triple = tuple[float, float, float]

LENGTH, DIAMETER = 0.05, 2e-3
"""Of a beam, unless said otherwise [m]."""
SMALL = 0.1
"""Largest normalised displacement of linear beams."""

# Sizes of micrometre motion at hundreds of hertz, some centimetres from the axis: displacement, rate, acceleration
_MOVE, _TURN = (1e-6, 1e-3, 1.0), (1e-5, 1e-2, 1e1)


@dataclass(frozen=True)
class Platform:
    """What the module carries; by default a disc of 0.1 kg and 30 mm at the reference point.

    Attributes:
        mass: [kg].
        inertia: about its mass centre along the module's axes, Jxx, Jyy, Jzz [kg.m2].
        center: of mass, from the stage's reference point [m].
    """

    mass: float = 0.1
    inertia: Triple = (4.5e-5, 2.25e-5, 2.25e-5)
    center: Triple = (0.0, 0.0, 0.0)


DISC = Platform()
"""The default."""


def beam_stage(
    *,
    kind: KindName = "three_beam",
    tilt: float | None = None,
    count: int | None = None,
    length_error: tuple[float, ...] | None = None,
    material: Material = ALUMINIUM,
    dimensions: Dimensions = NORMALISED,
    platform: Platform = DISC,
) -> Model:
    """The platform on its module.

    Args:
        kind: of module, see `_beam_kinds`.
        tilt: of the beams [deg]; 45.
        count: beams between two bodies.
        length_error: of each beam, as in `beam_module`.
        material: aluminium.
        dimensions: [m]; a beam is 50 mm long and round, 2 mm thick; the rest as in `beam_module` by its length.
        platform: mass, inertia and mass centre.

    Raises:
        ModelError: as `beam_module`; a platform without mass or inertia.
    """
    module = _module(kind, tilt, count, length_error, material, dimensions)
    M, K = _mass(platform), module.dimensional_stiffness()
    m = Model("BeamStage", "Platform on compliant beams")
    ratio = m.parameter("damping_ratio", 0.01, "1", "Damping ratio of every mode", min=0)
    load, base = _inputs(m)
    position = m.state("center.position[1..3]", "m", "Displacement of the reference point", nominal=_MOVE[0])
    rotation = m.state("center.rotation[1..3]", "rad", "Rotation of the platform", nominal=_TURN[0])
    velocity = m.state("center.velocity[1..3]", "m/s", "Velocity of the reference point", nominal=_MOVE[1])
    turning = m.state("center.angular_velocity[1..3]", "rad/s", "Angular velocity of the platform", nominal=_TURN[1])
    q, rate = ca.vertcat(position, rotation), ca.vertcat(velocity, turning)
    inverse, damping, spring = (
        ca.sparsify(ca.DM(without_rounding(A))) for A in (np.linalg.inv(M), modal_damping(M, K), K)
    )
    acceleration = inverse @ (load - ratio * (damping @ rate) - spring @ q) - base
    m.der[position], m.der[rotation] = velocity, turning
    m.der[velocity], m.der[turning] = acceleration[:3], acceleration[3:]
    _outputs(m, module, q, rate, acceleration)
    return m


def analyze(
    *,
    kind: KindName = "three_beam",
    tilt: float | None = None,
    count: int | None = None,
    length_error: tuple[float, ...] | None = None,
    material: Material = ALUMINIUM,
    dimensions: Dimensions = NORMALISED,
    platform: Platform = DISC,
) -> dict[str, Any]:
    """Return the stage's numbers; arguments and errors as `beam_stage`.

    Returns:
        stiffness: at the reference point, translations before rotations, (6, 6) [N/m], [N], [N.m].
        mass: there likewise, (6, 6) [kg], [kg.m], [kg.m2].
        natural_frequencies_hz: ascending, (6,) [Hz].
        shapes: displacements of the modes as columns, their largest entry 1, metres beside radians, (6, 6).
    """
    M, K = _mass(platform), _module(kind, tilt, count, length_error, material, dimensions).dimensional_stiffness()
    found = modes(M, K)
    largest = found.shapes[np.argmax(np.abs(found.shapes), axis=0), range(6)]
    return {
        "stiffness": K,
        "mass": M,
        "natural_frequencies_hz": found.omega / (2 * np.pi),
        "shapes": np.round(found.shapes / largest, 12) + 0.0,
    }


def _module(
    kind: str,
    tilt: float | None,
    count: int | None,
    length_error: tuple[float, ...] | None,
    material: Material,
    dimensions: Dimensions,
) -> Module:
    """Return the module, of beams of the usual length and diameter where nothing is said of them."""
    one_of(kind, KINDS, "beam_stage: kind")
    if dimensions.length is None:
        dimensions = replace(dimensions, length=LENGTH)
    if KINDS[kind].element == "beam" and dimensions.diameter is None and dimensions.side is None:
        dimensions = replace(dimensions, diameter=DIAMETER)
    given = Normalised(tilt=tilt, count=count, length_error=length_error)
    return compliant_module(kind, given, material, dimensions)


def _mass(platform: Platform) -> np.ndarray:
    """Return M at the reference point, shape (6, 6)."""
    values = np.array([platform.mass, *platform.inertia, *platform.center])
    if not (np.all(np.isfinite(values)) and np.all(values[:4] > 0)):
        raise ModelError(
            f"beam_stage: platform has mass {platform.mass:g} kg, inertia {platform.inertia} kg.m2 and center "
            f"{platform.center} m, expected finite numbers, mass and inertia above 0"
        )
    offset = platform.mass * skew(np.array(platform.center))
    inertia = np.diag(platform.inertia) - offset @ skew(np.array(platform.center))
    M = np.block([[platform.mass * np.eye(3), -offset], [offset, inertia]])
    return M + 0.0  # no zero is negative


def _inputs(m: Model) -> tuple[ca.SX, ca.SX]:
    """Declare the wrench and the motion of the base, columns of six."""
    force = m.input("wrench.force[1..3]", "N", "Force on the platform at the reference point", nominal=0.1)
    torque = m.input("wrench.torque[1..3]", "N.m", "Torque on the platform", nominal=1e-2)
    shaken = m.input("base.acceleration[1..3]", "m/s2", "Acceleration of the base at the reference point", nominal=1.0)
    turned = m.input("base.angular_acceleration[1..3]", "rad/s2", "Angular acceleration of the base", nominal=10.0)
    return ca.vertcat(force, torque), ca.vertcat(shaken, turned)


def _outputs(m: Model, module: Module, q: ca.SX, rate: ca.SX, acceleration: ca.SX) -> None:
    kinds = (("position", "rotation"), ("velocity", "angular_velocity"), ("acceleration", "angular_acceleration"))
    units = (("m", "rad"), ("m/s", "rad/s"), ("m/s2", "rad/s2"))
    for order, column in enumerate((q, rate, acceleration)):
        for half, nominal in enumerate((_MOVE[order], _TURN[order])):
            name, unit = kinds[order][half], units[order][half]
            text = f"{name.replace('_', ' ').capitalize()} of the platform, relative to the base"
            m.output(f"platform.{name}[1..3]", column[3 * half : 3 * half + 3], unit, text, nominal=nominal)
    assert module.size is not None
    largest = ca.mmax(ca.fabs(ca.vertcat(q[:3] / module.size.length, q[3:])))
    m.output("displacement", largest, "1", "Largest displacement, translations by the length of a beam", nominal=1e-3)
    m.output("displacement_warning", largest > SMALL, "1", "1 where it is above 0.1 and the beams are not linear")
