"""The triangular biaxial accelerometer: a proof mass on three limbs of feet and legs, on a moving base.

q is the displacement of the proof mass from home along the sensor's axes, z out of its plane, and f the specific force
due to the motion of the base (`_mechanics/tba_base.py`), along the same axes:

    static      q = (F - Gamma f) / K                                  gain, in the plane; z stays at home
    planar      M q'' + D q' + K q = F - Gamma f                       in the plane; z stays at home
    spatial     the same along three axes
    nonlinear   M(q) q'' + c(q, q') + D q' + n(q) = F - Gamma(q)^T f   all bodies (`tba_limbs.py`), nonlinear f

F is a force on the proof mass along the sensor's axes, as of a static test or of electrodes. The proof mass is a
regular polygon on as many limbs as it has sides (`limbs`), three in the source. M, K and Gamma are those of
`tba_design.py`. The difference between a given mass or stiffness and that of the formulas is constant in `nonlinear`.
At all other levels f is of first order in the motion of the base, and the model is linear.

    damping ratio   D = 2 zeta sqrt(K M), axis by axis
    damping film    D_in = mu A / gap, A = sqrt(3) / 4 a^2          slide film in one gap of gas
                    D_out = 3 mu J / gap^3, J = sqrt(3) / 80 a^4    incompressible squeeze film in it: an upper bound

A and J are those of a triangle; for other polygons they are in `_mechanics/polygon.py`.

Ports: in `base.acceleration` [m/s2], `.angular_velocity` [rad/s], `.angular_acceleration` [rad/s2] and `.rotation`
[rad] from the posture, of the base's reference point along world axes (names as `platform` of a robot); rotation and
lever arm of the mounting transform them to the sensor. In `proof_mass.force` [N], along the sensor's axes. Out, along
the same axes: `proof_mass.position` [m], `voltage[i]` = gain q_i [V], limited at +-`travel`, where `saturated` is 1,
and `acceleration_estimate[i]` = -K / Gamma q_i [m/s2], limited as the voltage. The parameter `gravity` acts along -Z;
with 0, the default, displacements count from the sag.

With `noise` the readings are those of q_i + Gamma / K n_i, n white with one-sided density `noise.density`. The argument
is structural: without it the FMU does not evaluate the noise. Direct feedthrough exists at level `static` only.

For small motion of the base, `nonlinear` converges to `spatial` with a difference of second order. `spatial` equals
`planar` in the plane, and `planar` converges to `static` with the square of the frequency: 1, 5 and 10 % difference at
0.0995, 0.2182 and 0.3015 of the natural frequency.

Bode plot, from the acceleration along x or y to its estimate: 0 dB at low frequency, a resonance of height
1 / (2 zeta), 40 dB at 5818.9 Hz (mems), 40 dB at 881.0 Hz (optimum), 24 dB at 251.9 Hz (rapid_prototype), and -40 dB
per decade with -180 degrees above it. The response of the other axis is 0. From the acceleration along z to the
displacement along z: 1.60e-10 m per m/s2 and one resonance, 28 dB high at 13063.9 Hz (mems). From the force along x to
the displacement along x: 1.87e-4 m/N (mems), 7.59e-6 m/N (rapid_prototype), and the same resonances.

Source: technical report of 2016 on the accelerometer; F, f, Gamma, the films and other numbers of limbs than three are
not in it. Assumed: damping ratios,
gain (5 V at the travel), travel and gap (a quarter and a half of a foot's thickness), noise.
"""

import math
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from hfsa.components import Drawing, Model, ModelError, Moving
from hfsa.components._mechanics import tba_design as designs
from hfsa.components._mechanics import tba_limbs as multibody
from hfsa.components._mechanics.polygon import polygon_area, torsion_constant
from hfsa.components._mechanics.tba_base import (
    Base,
    Mounting,
    Triple,
    base_inputs,
    linear_specific_force,
    specific_force,
)
from hfsa.components._mechanics.tba_design import DESIGNS, LIMBS, Formulas, KOutRule, Shape
from hfsa.components._mechanics.tba_picture import sensor_drawing, sensor_in_motion
from hfsa.components._mechanics.tba_study import design_study
from hfsa.components._modelling.model import one_of
from hfsa.components._modelling.noise import white_noise
from hfsa.components._modelling.study import Study, slopes

Level = Literal["static", "planar", "spatial", "nonlinear"]
DesignName = Literal["mems", "optimum", "rapid_prototype"]
Damping = Literal["ratio", "film"]

GRAVITY = 9.80665
"""g, unit of accelerations in `analyze` [m/s2]."""
VISCOSITY = 1.85e-5
"""mu, viscosity of air [Pa.s]."""
PRESSURE = 1.01325e5
"""Pressure of the gas in the gap [Pa]."""

_LEVELS = ("static", "planar", "spatial", "nonlinear")
_OWNER = "tba_accelerometer"
_AT_TRAVEL = 5.0
"""Voltage at the travel [V]."""


@dataclass(frozen=True)
class Dimensions:
    """Dimensions and material that differ from the design's.

    Attributes:
        a: side of the proof mass [m].
        s: side of the frame [m].
        e: length of a leg [m].
        b: length of a bar [m].
        c: width of a leg across its corner [m].
        d: width of a bar [m].
        tm: thickness of a foot [m].
        l: length of a foot [m].
        w: thickness of the sensor out of the plane [m].
        E: Young's modulus [Pa].
        nu: Poisson's ratio.
        rho: density [kg/m3].
    """

    a: float | None = None
    s: float | None = None
    e: float | None = None
    b: float | None = None
    c: float | None = None
    d: float | None = None
    tm: float | None = None
    l: float | None = None  # noqa: E741  the source's letter
    w: float | None = None
    E: float | None = None
    nu: float | None = None
    rho: float | None = None


AS_DESIGNED = Dimensions()
"""The dimensions and material of the design."""
UPRIGHT = Mounting()
"""Mounting at the reference point, with the sensor's axes along those of the world."""


class _Sensor(NamedTuple):
    """Properties of one sensor, arrays along x, y, z.

    Attributes:
        shape: dimensions and material.
        formulas: results of the design formulas.
        mass, stiffness: M [kg], K [N/m].
        driven_mass: Gamma [kg].
        damping_ratio: damping ratios of the design, in the plane and out of it.
        gap: gap of the gas film [m].
    """

    shape: Shape
    formulas: Formulas
    mass: np.ndarray
    stiffness: np.ndarray
    driven_mass: float
    damping_ratio: tuple[float, float]
    gap: float

    @property
    def gain(self) -> np.ndarray:
        """Magnitude of the static displacement / specific force, shape (3,) [s2]."""
        return self.driven_mass / self.stiffness

    @property
    def omega(self) -> np.ndarray:
        """Natural frequencies, shape (3,) [rad/s]."""
        return np.sqrt(self.stiffness / self.mass)

    @property
    def travel(self) -> float:
        """Default measuring range of the displacement [m]."""
        return self.shape.tm / 4

    @property
    def film(self) -> np.ndarray:
        """Damping of the films in one gap / viscosity, shape (3,) [m]."""
        side, sides = self.shape.a, self.formulas.bodies.limbs
        slide = polygon_area(side, sides) / self.gap
        return np.array([slide, slide, 3 * torsion_constant(side, sides) / self.gap**3])


def tba_accelerometer(
    *,
    level: Level = "spatial",
    design: DesignName = "mems",
    limbs: int = LIMBS,
    dimensions: Dimensions = AS_DESIGNED,
    k_out_rule: KOutRule = "minus",
    stiffness: Triple | None = None,
    mass: Triple | None = None,
    driven_mass: float | None = None,
    damping: Damping = "ratio",
    gap: float | None = None,
    mounting: Mounting = UPRIGHT,
    noise: bool = False,
) -> Model:
    """Return the accelerometer on its base.

    Args:
        level: `static` (gain), `planar` (two degrees of freedom), `spatial` (three) or `nonlinear` (all bodies).
        design: published dimensions and material; the stiffness of `optimum` is that of finite elements, scaled by the
            formulas for other dimensions.
        limbs: number of limbs, and of sides of the proof mass, 3 or more; other dimensions are the design's.
        dimensions: dimensions and material that differ from the design.
        k_out_rule: rule for the stiffness out of the plane: `minus`, as in the source, or `plus`, springs in series.
        stiffness: K along x, y, z [N/m], instead of that of the design.
        mass: M along x, y, z [kg], instead of that of the formulas.
        driven_mass: Gamma [kg], instead of that of the formulas.
        damping: `ratio` (damping ratios) or `film` (gas film in one gap).
        gap: gap of the film [m]; `None` for half the thickness of a foot.
        mounting: rotation and lever arm of the sensor on its base.
        noise: whether the readings have noise.

    Raises:
        ModelError: an unknown level, design, rule or damping; fewer than three limbs; infeasible dimensions, mass,
            stiffness or gap; a mounting matrix that is no rotation.
    """
    one_of(level, _LEVELS, f"{_OWNER}: level")
    one_of(damping, ("ratio", "film"), f"{_OWNER}: damping")
    sensor = _sensor(design, limbs, dimensions, k_out_rule, stiffness, mass, driven_mass, gap)
    Q, arm = mounting.matrix(_OWNER), mounting.arm(_OWNER)
    m = Model("TbaAccelerometer", "Triangular biaxial accelerometer on a moving base")
    base = base_inputs(m)
    force = m.input("proof_mass.force[1..3]", "N", "Force on the proof mass, sensor axes", nominal=sensor.driven_mass)
    gravity = m.parameter("gravity", 0.0, "m/s2", "Gravitational acceleration along -Z; 0 omits the sag")
    D = _damping(m, sensor, damping)
    if level == "nonlinear":
        position = _nonlinear(m, sensor, D, force, base, Q, arm, gravity)
    else:
        axes = 3 if level == "spatial" else 2
        load = (force - sensor.driven_mass * linear_specific_force(base, Q, arm, gravity))[:axes]
        moved = load / ca.DM(sensor.stiffness[:axes]) if level == "static" else _linear(m, sensor, D, load)
        position = ca.vertcat(moved, ca.SX.zeros(3 - axes))
    _outputs(m, sensor, position, _noise(m, sensor) if noise else 0)
    return m


UNITS = {
    "mass": "kg",
    "driven_mass": "kg",
    "stiffness": "N/m",
    "natural_frequencies_hz": "Hz",
    "bandwidth_hz": "Hz",
    "frequency_ratio": "1",
    "formula_frequency_ratio": "1",
    "static_sensitivity": "m",
    "coriolis_coefficients": "kg/m",
    "cross_axis": "1/m",
    "body_mass": "kg",
    "leg_stiffness": "N.m/rad",
    "formula_stiffness": "N/m",
    "film_damping": "N.s/m",
    "film_damping_ratio": "1",
    "squeeze_number": "1",
    "sensitivity": "1",
}
"""Units of the results of `analyze`, in the notation of `_modelling/parts.py`."""


def analyze(
    *,
    level: Level = "spatial",
    design: DesignName = "mems",
    limbs: int = LIMBS,
    dimensions: Dimensions = AS_DESIGNED,
    k_out_rule: KOutRule = "minus",
    stiffness: Triple | None = None,
    mass: Triple | None = None,
    driven_mass: float | None = None,
    gap: float | None = None,
) -> dict[str, Any]:
    """Return the properties of the sensor at home, in SI units, arrays along its axes x, y, z.

    The arguments are those of `tba_accelerometer` that define the sensor itself; `level` has no effect.

    Returns:
        mass, stiffness: M [kg] and K [N/m], (3,).
        driven_mass: Gamma [kg].
        natural_frequencies_hz: natural frequencies, (3,) [Hz].
        frequency_ratio: natural frequency along z / that along x.
        static_sensitivity: Gamma g / K, displacement per g = 9.80665 m/s2, `in_plane` and `out_of_plane` [m].
        bandwidth_hz: frequencies up to which the undamped response along x is within 1, 5 and 10 %, (3,) [Hz].
        coriolis_coefficients: c1, c2 (eq 93) [kg/m].
        cross_axis: y / x^2 under a force along x [1/m].
        body_mass: masses of `proof_mass`, one `bar` and one `leg` [kg].
        leg_stiffness: k_in, k_out of a leg on its feet by the formulas, `in_plane` and `out_of_plane` [N.m/rad].
        formula_stiffness: K by the formulas, independent of the argument `stiffness`, (3,) [N/m].
        formula_frequency_ratio: frequency ratio by the formulas.
        film_damping, film_damping_ratio: damping of one gap, `in_plane` and `out_of_plane` [N.s/m], [1].
        squeeze_number: squeeze number of the gap at the natural frequency out of the plane; the gas is incompressible
            for values well below 1.
        sensitivity: d ln(f_out / f_in) / d ln(p) of the formulas, for every dimension p.

    Raises:
        ModelError: as `tba_accelerometer`.
    """
    one_of(level, _LEVELS, f"{_OWNER}: level")
    sensor = _sensor(design, limbs, dimensions, k_out_rule, stiffness, mass, driven_mass, gap)
    found, frequencies = sensor.formulas, sensor.omega / (2 * math.pi)
    film = VISCOSITY * sensor.film
    return {
        "mass": sensor.mass,
        "stiffness": sensor.stiffness,
        "driven_mass": sensor.driven_mass,
        "natural_frequencies_hz": frequencies,
        "frequency_ratio": frequencies[2] / frequencies[0],
        "static_sensitivity": _in_and_out(GRAVITY * sensor.gain),
        "bandwidth_hz": frequencies[0] * np.sqrt(1 - 1 / np.array([1.01, 1.05, 1.1])),
        "coriolis_coefficients": np.array(designs.coriolis(found.bodies)),
        "cross_axis": multibody.cross_axis(found.bodies),
        "body_mass": {name: getattr(found.bodies, name) for name in ("proof_mass", "bar", "leg")},
        "leg_stiffness": {"in_plane": found.k_in, "out_of_plane": found.k_out},
        "formula_stiffness": np.array([found.K_in, found.K_in, found.K_out]),
        "formula_frequency_ratio": found.f_out / found.f_in,
        "film_damping": _in_and_out(film),
        "film_damping_ratio": _in_and_out(film / (2 * sensor.omega * sensor.mass)),
        "squeeze_number": 4 * VISCOSITY * sensor.omega[2] * (sensor.shape.a / sensor.gap) ** 2 / PRESSURE,
        "sensitivity": slopes(design_study(sensor.shape, k_out_rule, _OWNER, limbs), "frequency_ratio"),
    }


def study(
    *,
    design: DesignName = "mems",
    limbs: int = LIMBS,
    dimensions: Dimensions = AS_DESIGNED,
    k_out_rule: KOutRule = "minus",
) -> Study:
    """Return the design study of f3/f1, f_in and f_out as functions of the dimensions, by the formulas.

    Arguments as in `tba_accelerometer`. The finite-element stiffness of `optimum` is not used; the corresponding
    results of `analyze` are `formula_stiffness` and `formula_frequency_ratio`.

    Raises:
        ModelError: an unknown design or rule; infeasible dimensions.
    """
    words = [f"{_OWNER}, design {design}"]
    words += [f"{limbs} limbs"] if limbs != LIMBS else []
    words += [f"{name} = {value:g}" for name in Shape._fields if (value := getattr(dimensions, name)) is not None]
    words += ["springs in series"] if k_out_rule == "plus" else []
    shape = _shape(design, dimensions, k_out_rule)
    return design_study(shape, k_out_rule, ", ".join(words), designs.checked_limbs(limbs, _OWNER))


def picture(*, design: DesignName = "mems", limbs: int = LIMBS, dimensions: Dimensions = AS_DESIGNED) -> Drawing:
    """Return frame, limbs and proof mass in the plane, at home and displaced along each axis.

    Arguments and errors as in `tba_accelerometer`.
    """
    shape = _shape(design, dimensions, "plus")
    return sensor_drawing(shape, designs.checked_limbs(limbs, _OWNER), f"Accelerometer, design {design}")


def moving(*, design: DesignName = "mems", limbs: int = LIMBS, dimensions: Dimensions = AS_DESIGNED) -> Moving:
    """Return the sensor in a run, as its proof mass moves in the plane; arguments as in `tba_accelerometer`."""
    return sensor_in_motion(_shape(design, dimensions, "plus"), designs.checked_limbs(limbs, _OWNER))


def _shape(design: str, dimensions: Dimensions, rule: str) -> Shape:
    """Return a design's shape with some dimensions changed; `ModelError` if it is infeasible."""
    published = DESIGNS[one_of(design, DESIGNS, f"{_OWNER}: design")].shape
    changed = {name: value for name in Shape._fields if (value := getattr(dimensions, name)) is not None}
    return designs.checked_shape(published._replace(**changed), rule, published, _OWNER)


def _sensor(
    design: str,
    limbs: int,
    dimensions: Dimensions,
    rule: str,
    stiffness: Triple | None,
    mass: Triple | None,
    driven_mass: float | None,
    gap: float | None,
) -> _Sensor:
    """Return the properties of a sensor; those given as `None` follow from its shape by the formulas."""
    shape, published = _shape(design, dimensions, rule), DESIGNS[design]
    found = designs.formulas(shape, rule, designs.checked_limbs(limbs, _OWNER))
    K = np.array([found.K_in, found.K_in, found.K_out])
    if published.stiffness is not None:
        usual = designs.formulas(published.shape, rule, limbs)
        K *= np.array(published.stiffness) / [usual.K_in, usual.K_in, usual.K_out]
    return _Sensor(
        shape,
        found,
        _above_zero("mass", (found.M_in, found.M_in, found.M_out) if mass is None else mass, "kg"),
        _above_zero("stiffness", K if stiffness is None else stiffness, "N/m"),
        float(_above_zero("driven_mass", found.driven_mass if driven_mass is None else driven_mass, "kg")),
        published.damping_ratio,
        float(_above_zero("gap", shape.tm / 2 if gap is None else gap, "m")),
    )


def _above_zero(name: str, given: ArrayLike, unit: str) -> np.ndarray:
    """Return the given numbers as an array; `ModelError` unless all are finite and above 0."""
    values = np.array(given, dtype=float)
    if not np.all(np.isfinite(values) & (values > 0)):
        raise ModelError(f"{_OWNER}: {name} is {values.tolist()} {unit}, expected above 0")
    return values


def _damping(m: Model, sensor: _Sensor, damping: str) -> ca.SX:
    """Declare the parameters of the damping and return D along x, y, z, shape (3, 1) [N.s/m]."""
    if damping == "film":
        viscosity = m.parameter("film.viscosity", VISCOSITY, "Pa.s", "Viscosity of the gas in the gap", min=0)
        return viscosity * ca.DM(sensor.film)
    inside, out = sensor.damping_ratio
    zeta_in = m.parameter("damping_ratio.in_plane", inside, "1", "Damping ratio in the plane", min=0)
    zeta_out = m.parameter("damping_ratio.out_of_plane", out, "1", "Damping ratio out of the plane", min=0)
    return ca.vertcat(zeta_in, zeta_in, zeta_out) * ca.DM(2 * sensor.omega * sensor.mass)


def _states(m: Model, sensor: _Sensor, axes: int) -> tuple[ca.SX, ca.SX]:
    """Declare displacement and rate along the first axes, each (axes, 1); nominal values for 1 m/s2."""
    moved, speed = float(sensor.gain[0]), float(sensor.gain[0] * sensor.omega[0])
    q = m.state(f"center.position[1..{axes}]", "m", "Displacement of the proof mass from home", nominal=moved)
    v = m.state(f"center.velocity[1..{axes}]", "m/s", "Velocity of the proof mass in the frame", nominal=speed)
    return q, v


def _linear(m: Model, sensor: _Sensor, D: ca.SX, load: ca.SX) -> ca.SX:
    """Add the linear equations along the axes of a load, (axes, 1) [N], and return the displacement."""
    axes = load.numel()
    q, v = _states(m, sensor, axes)
    m.der[q] = v
    M, K = ca.DM(sensor.mass[:axes]), ca.DM(sensor.stiffness[:axes])
    m.der[v] = (load - D[:axes] * v - K * q) / M
    return q


def _nonlinear(
    m: Model, sensor: _Sensor, D: ca.SX, load: ca.SX, base: Base, Q: np.ndarray, arm: np.ndarray, gravity: ca.SX
) -> ca.SX:
    """Add the equations of all bodies and return the displacement; `load` is the force on the proof mass [N]."""
    q, v = _states(m, sensor, 3)
    bodies = sensor.formulas.bodies
    K = np.array([np.mean(sensor.stiffness[:2])] * 2 + [sensor.stiffness[2]])
    k_in, _, k_out = K * bodies.link**2 / (2 * bodies.limbs)
    terms = multibody.terms(bodies, k_in, k_out, q, v)
    f = specific_force(base, Q, arm, gravity, q, v)
    formula_mass = np.array([sensor.formulas.M_in, sensor.formulas.M_in, sensor.formulas.M_out])
    beyond = sensor.driven_mass - sensor.formulas.driven_mass
    force = load - terms.velocity - D * v - terms.elastic - ca.DM(sensor.stiffness - K) * q
    m.der[q] = v
    m.motion(
        v,
        mass=terms.mass + ca.diag(ca.DM(sensor.mass - formula_mass)),
        force=force - (terms.driven.T + beyond * ca.DM.eye(3)) @ f,
    )
    return q


def _noise(m: Model, sensor: _Sensor) -> ca.SX:
    """Return the noise of the readings in x and y, as displacements, shape (2, 1) [m]."""
    density = m.parameter(
        "noise.density", 1e-8, "m2/s3", "One-sided power spectral density of the noise, as acceleration", min=0
    )
    interval = m.parameter("noise.interval", 1e-5, "s", "Time between two values of the noise", min=1e-9)
    seed = m.parameter("noise.seed", 1.0, "1", "Seed of the noise, a whole number", min=0, max=2**25)
    values = ca.vertcat(*[white_noise(m.time, interval, 2 * seed + i) for i in range(2)])
    return ca.DM(sensor.gain[:2]) * ca.sqrt(density / (2 * interval)) * values


def _outputs(m: Model, sensor: _Sensor, position: ca.SX, noise: ca.SX | int) -> None:
    """Declare the position of the proof mass and the readings, limited to the travel, as outputs."""
    gain = m.parameter("gain", _AT_TRAVEL / sensor.travel, "V/m", "Voltage / displacement")
    travel = m.parameter("travel", sensor.travel, "m", "Measuring range of the displacement", min=0)
    small = float(sensor.gain[0])
    read = position[:2] + noise
    shown = ca.fmax(-travel, ca.fmin(travel, read))
    m.output("proof_mass.position[1..3]", position, "m", "Displacement in the frame, sensor axes", nominal=small)
    m.output("voltage[1..2]", gain * shown, "V", "Reading in x and y", nominal=_AT_TRAVEL / sensor.travel * small)
    estimate = -shown / ca.DM(sensor.gain[:2])
    m.output("acceleration_estimate[1..2]", estimate, "m/s2", "Estimated specific force, sensor axes")
    beyond = ca.mmax(ca.fabs(read)) > travel
    m.output("saturated", beyond, "1", "1 while a displacement is beyond the travel")


def _in_and_out(values: np.ndarray) -> dict[str, float]:
    """Return the entries of an array along x and z, by name."""
    return {"in_plane": float(values[0]), "out_of_plane": float(values[2])}
