"""The 3-RRR piezo stage: three stacks move a platform in its plane, on nine flexure hinges.

    jacobian            (x, y, yaw) = J0 l
    constant_jacobian   M(l) l'' + c + beta K0 l' + dP/dl = Q + J0^T w - G(l) a_b
    exact               the same equations over the pose, every link at its length, l(pose) in closed form

l are the stacks' elongations, w the wrench on the platform, a_b the acceleration of the base, K0 = d2P/dl2 at rest; T
and P are in `_mechanics/rrr_dynamics.py`. The causality defines Q:

    force    Q = F                                  the stack models its stiffness and outputs its force F
    source   Q = F_b - k l - c l' - m_tip l''       the stage models it; the stack outputs its blocking force F_b

With `force` a stack and the stage exchange the spring force k l, held over each communication step: co-simulation
diverges above the step 2 c / k, c the damping of a mode, and without damping at every step. With `source` the only
signal from the stage to a stack is l', which acts on the charge: co-simulation is stable for every step with `static`
stacks, and for steps below 57 us with `linear` ones.

Ports: in `stack[i].force` or `stack[i].blocking_force` [N], positive along the elongation, `wrench.force` [N] and
`.torque` [N.m] at the platform's centre, `base.acceleration` [m/s2]; out `stack[i].elongation` [m] and
`.elongation_rate`, with `source` also `stack[i].force` on the crank and `.contact_lost`, `platform.position` [m] and
`.rotation` [rad] from rest, `.velocity`, `.angular_velocity`, `.acceleration`, `.angular_acceleration`, and the largest
`hinge.angle` [rad] and `hinge.stress` [Pa] with `hinge.overload`, 1 above 233 MPa. At level `jacobian` the elongations
and their derivatives are inputs, and there are no forces. As the elongations go to zero, `exact` converges to
`constant_jacobian` and both poses to J0 l, with a difference of second order.

A stack can only push. `contact_lost` is 1 while its force + `stack.preload` is a pull of more than a millionth of F0,
larger than rounding and solver errors. The equations remain those of a bonded stack.

In free vibration without damping the FMU loses 4e-11 of its energy per period of 529 Hz, or 2e-12 with
`solver.relative_tolerance` 1e-9 instead of 1e-8.

Bode plot at rest, `source`, from the blocking forces to the pose: equal forces produce a pure rotation, 2.2 urad/N (per
stack) up to one resonance at 2225 Hz, 30 dB high; forces of sum zero produce a pure translation, up to one resonance at
904.7 Hz, 38 dB high. With `force` the resonances are at 1334.7 Hz, 26 dB, and at 529.05 Hz, 34 dB. Above the resonances
-40 dB per decade.

Links, hinges and masses are arguments, by default those of the source. A Jacobian, a stiffness or an inertia that is
measured or computed elsewhere can take the place of theirs, by `_mechanics/rrr_design.py`.

Source: thesis of 2000 on the 3-RRR stage. Assumed: beta, for a damping ratio of 1 % of the translations; damping and
mass of the stacks.
"""

from typing import Any, Literal, NamedTuple, get_args

import casadi as ca
import numpy as np

from hfsa.components import Model, ModelError
from hfsa.components._continuum.design import Continuum
from hfsa.components._continuum.dynamics import equations
from hfsa.components._continuum.field import deformed
from hfsa.components._continuum.necks import largest_stress
from hfsa.components._continuum.outline import THESIS_OUTLINE, Outline
from hfsa.components._continuum.results import numbers
from hfsa.components._mechanics import rrr_dynamics as dynamics
from hfsa.components._mechanics.modes import modes
from hfsa.components._mechanics.pzt import PULL_FROM_ROUNDING, STROKE_IN_USE, TOKIN, Stack
from hfsa.components._mechanics.rrr_contact import Bolts, Contact
from hfsa.components._mechanics.rrr_design import Design, Matrix
from hfsa.components._mechanics.rrr_dynamics import Mechanism
from hfsa.components._mechanics.rrr_facts import (
    DAMPING_TIME,
    STACK_COUPLING,
    STACK_STIFFNESS,
    STACK_VOLTAGE,
    STAGE,
)
from hfsa.components._mechanics.rrr_hinge import THESIS_HINGE, Hinge
from hfsa.components._mechanics.rrr_kinematics import (
    AS_NAMED,
    Kinematics,
    LinkChanges,
    LinkSet,
    forward,
    inverse,
    newton,
)
from hfsa.components._mechanics.rrr_limits import hinge_numbers
from hfsa.components._mechanics.rrr_masses import THESIS_MASSES, Masses
from hfsa.components._mechanics.rrr_study import Goals, Objective, design_study
from hfsa.components._modelling.deformation import Deformation
from hfsa.components._modelling.facts import Known
from hfsa.components._modelling.model import one_of
from hfsa.components._modelling.study import Study

Level = Literal["jacobian", "constant_jacobian", "exact", "continuum"]
Causality = Literal["source", "force"]
Triple = tuple[float, float, float]

FACTS = {
    **STAGE,
    DAMPING_TIME: Known("damping_time", levels=("constant_jacobian", "exact")),
    STACK_STIFFNESS: Known("stack.stiffness", when=("causality", "source")),
    STACK_COUPLING: Known("stack.blocking_force", per="stack.full_voltage", of_analysis=True),
    STACK_VOLTAGE: Known("stack.full_voltage", of_analysis=True),
}

# Nominal values of micrometre motion at hundreds of hertz: position, rotation, and their first and second derivatives.
_MOVE = (1e-6, 1e-3, 1.0)
_TURN = (1e-4, 1e-1, 1e2)
_FORCE, _TORQUE = 100.0, 1.0
_STACK_DAMPING = "Damping of each stack"


class _Motion(NamedTuple):
    """Pose, twist and acceleration of the platform, columns of three."""

    pose: ca.SX
    twist: ca.SX
    acceleration: ca.SX


def rrr_stage(
    *,
    level: Level = "constant_jacobian",
    kinematics: Kinematics = "nominal",
    causality: Causality = "source",
    links: LinkChanges = AS_NAMED,
    hinge: Hinge = THESIS_HINGE,
    masses: Masses = THESIS_MASSES,
    jacobian: Matrix | None = None,
    stiffness: Matrix | None = None,
    mass: Matrix | None = None,
    stack: Stack = TOKIN,
    contact: Contact = "stack",
    bolts: Bolts = "pin",
    outline: Outline = THESIS_OUTLINE,
    mesh: float | None = None,
) -> Model:
    """Return the stage about rest.

    Args:
        level: `jacobian` (kinematic), `constant_jacobian`, `exact` or `continuum` (dynamic).
        kinematics: parameter set of the links; `measured` is a Jacobian only, for level `jacobian`.
        causality: whether the stage includes the stacks' stiffness, damping and tip mass (`source`) or not (`force`);
            without effect at level `jacobian`.
        links: lengths [m] and angles [rad] of the links in place of those of the set.
        hinge: dimensions [m] and material [Pa] of the hinges; without effect at level `jacobian`, as `masses`,
            `stiffness`, `mass` and `stack`.
        masses: masses [kg] and moments of inertia [kg.m2] of the links.
        jacobian: Jacobian from elongations to pose in place of that of the links, nine numbers row by row
            [m/m; m/m; rad/m]; not at level `exact`.
        stiffness: stiffness on the elongations at rest in place of that of hinges and links, nine numbers row by row
            [N/m]; the difference is added as constant springs between the stacks.
        mass: inertia on the elongations at rest in place of that of the links, nine numbers row by row [kg]; the
            difference is added as constant masses. What an acceleration of the base acts on is not changed.
        stack: data sheet of the stacks; the defaults of the parameters `stack.stiffness`, `.damping`, `.tip_mass`.
        contact: how a stack holds the end of its lever sideways; at level `continuum`, as `bolts` and `outline`.
        bolts: whether the bolts of the platform are pins or rigid.
        outline: lengths [m] of the plate beside those of links and hinges, Poisson's ratio, density [kg/m3].
        mesh: size of the triangles at the necks [m], at level `continuum` only (default: an eighth of their thickness).

    Raises:
        ModelError: an unknown level, parameter set or causality; `measured` at a dynamic level; dimensions that cannot
            be built; a singular Jacobian; a stiffness or mass that is not symmetric and positive definite.
    """
    _check(level, causality, mesh)
    design = Design(kinematics, links, hinge, masses, jacobian, stiffness, mass)
    m = Model("RrrStage", "3-RRR piezo stage")
    if level == "continuum":
        _outputs(m, _elastic(m, _continuum(design, causality, stack, contact, bolts, outline, mesh)))
        return m
    if level == "jacobian":
        _outputs(m, _kinematic(m, design.jacobian))
        return m
    mechanism = _over_states(m, level, design)
    _outputs(m, _dynamic(m, mechanism, ca.DM(design.rest_stiffness), causality, stack))
    angle = ca.mmax(ca.fabs(mechanism.hinges))
    m.output("hinge.angle", angle, "rad", "Largest angle of a hinge from rest", nominal=1e-3)
    _stress_outputs(m, hinge, hinge.stress_per_angle * angle, "Bending stress in that hinge")
    return m


_ON_POSE = "N/m, N/m, N; N/m, N/m, N; N, N, N.m/rad"

UNITS = {
    "jacobian": "1; 1; rad/m",
    "pose": "m; m; rad",
    "range": "m; m; rad",
    "step": "m; m; rad",
    "hinge_stiffness": "N.m/rad",
    "hinge_angle": "rad",
    "hinge_stress": "Pa",
    "allowed_angle": "rad",
    "allowed_stress": "Pa",
    "hinge_limit": "1",
    "peak_stress": "Pa",
    "peak_stacks": "1",
    "platform_stiffness_free": _ON_POSE,
    "platform_stiffness_bonded": _ON_POSE,
    "platform_stiffness_blocked": _ON_POSE,
    "piece_mass": "kg",
    "reduction_error": "1",
    "mesh": "m",
    "mesh_unknowns": "1",
    "mesh_error": "1",
    "elongation": "m",
    "inertia": "kg",
    "stiffness": "N/m",
    "natural_frequencies_hz": "Hz",
    "natural_frequencies_bonded_hz": "Hz",
    "force": "N",
    "voltage": "V",
    "elongation_at_voltage": "m",
    "pose_at_voltage": "m; m; rad",
    "saturated": "1",
}
"""Units of the results of `analyze`, in the notation of `_modelling/parts.py`."""


def analyze(
    *,
    level: Level = "constant_jacobian",
    kinematics: Kinematics = "nominal",
    causality: Causality = "source",
    links: LinkChanges = AS_NAMED,
    hinge: Hinge = THESIS_HINGE,
    masses: Masses = THESIS_MASSES,
    jacobian: Matrix | None = None,
    stiffness: Matrix | None = None,
    mass: Matrix | None = None,
    stack: Stack = TOKIN,
    contact: Contact = "stack",
    bolts: Bolts = "pin",
    outline: Outline = THESIS_OUTLINE,
    mesh: float | None = None,
    elongation: Triple = (0.0, 0.0, 0.0),
    pose: Triple | None = None,
    voltage: Triple = (0.0, 0.0, 0.0),
    resolution: float = 10e-9,
) -> dict[str, Any]:
    """Return kinematic, static and dynamic properties of the stage, in SI units, in the coordinates of the stacks.

    The arguments are those of `rrr_stage`, with further ones; at level `jacobian` only the first five results are
    returned. `elongation` are the elongations of the stacks [m], or `pose` x, y [m] and yaw [rad]; `voltage` the
    voltages of the stacks for the results `..._at_voltage` [V], limited to 0 and the full voltage, 150 V; `resolution`
    the smallest step of an elongation [m]. `causality` has no effect.

    Returns:
        jacobian: Jacobian from elongations to pose, (3, 3) [m/m, m/m, rad/m].
        pose: x, y [m], yaw [rad], (3,).
        elongation: elongations at that pose, (3,) [m].
        range: ranges of x, y, yaw over elongations from 0 to 12 um, (3,).
        step: least steps of x, y [m] and yaw [rad] by a stack that moves them, at its smallest step, (3,).
        hinge_stiffness: stiffness of each hinge [N.m/rad] (eq 2.3).
        hinge_angle, hinge_stress: angle from rest [rad] and bending stress [Pa] by hinge, A1 to C3 (eqs 2.4, 2.6).
        allowed_angle, allowed_stress: largest angle of a hinge [rad], and its stress [Pa] (eqs 2.6, 3.6).
        hinge_limit: the hinge that bends most, and the elongations from which on it exceeds the allowable angle.
        inertia, stiffness: inertia and stiffness of the stage without stacks, (3, 3) [kg], [N/m].
        natural_frequencies_hz, natural_frequencies_bonded_hz: natural frequencies without and with stacks, ascending,
            (3,) [Hz].
        force: forces of the stacks that hold the elongations, (3,) [N].
        voltage: voltages for these forces, (3,) [V]; not feasible outside 0 to the full voltage.
        elongation_at_voltage: elongations in equilibrium at the argument `voltage`, limited, (3,) [m].
        pose_at_voltage: x, y [m], yaw [rad] in that equilibrium, (3,).
        saturated: 1 for a `voltage` outside 0 to the full voltage, (3,).

    Raises:
        ModelError: as `rrr_stage`; an invalid data sheet; elongations without a pose, a pose out of reach, or both
            given; elongations, a pose or voltages that are not finite.
    """
    _check(level, causality, mesh)
    design = Design(kinematics, links, hinge, masses, jacobian, stiffness, mass)
    for name, values, unit in (
        ("elongation", elongation, "m"),
        ("pose", pose or (), "m, rad"),
        ("voltage", voltage, "V"),
    ):
        _check_finite(name, values, unit)
    if not (np.isfinite(resolution) and resolution > 0):
        raise ModelError(f"rrr_stage: resolution is {resolution:g} m, expected a finite length above 0")
    if pose is not None and any(elongation):
        raise ModelError("rrr_stage: elongation and pose are given; each follows from the other, leave one out")
    applied = np.clip(voltage, 0, stack.full_voltage)
    if level == "continuum":
        elastic = _continuum(design, "source", stack, contact, bolts, outline, mesh)
        at = np.array(elongation) if pose is None else elastic.elongations(np.array(pose))
        saturated = (applied != voltage).astype(int)
        return {"elongation": at, **numbers(elastic, at, applied, resolution), "saturated": saturated}
    if pose is not None:
        elongation = _elongations(level, design, pose)
    box = STROKE_IN_USE * np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
    if level == "jacobian":
        J = design.jacobian
        return {
            "jacobian": J,
            "pose": J @ np.array(elongation),
            "elongation": np.array(elongation),
            "range": np.ptp(box @ J.T, axis=0),
            "step": _steps(J, resolution),
        }
    mechanism = design.mechanism(level, ca.SX.sym("p", 3), ca.SX.sym("v", 3))
    on_stacks = _on_stacks(mechanism)
    reached = forward(design.links, elongation)
    at = reached if level == "exact" else np.array(elongation)
    J, found, inertia, elastic, force, angles = (np.array(value).squeeze() for value in on_stacks(at))
    poses = np.array([np.array(on_stacks(_coordinates(level, design, corner))[1]).ravel() for corner in box.tolist()])
    elongation_at_voltage, pose_at_voltage = _at_voltage(mechanism, stack, applied)
    return {
        "jacobian": J,
        "pose": found,
        "elongation": np.array(elongation),
        "range": np.ptp(poses, axis=0),
        "step": _steps(J, resolution),
        **hinge_numbers(hinge, angles, np.array(elongation)),
        "inertia": inertia,
        "stiffness": elastic,
        "natural_frequencies_hz": _frequencies(inertia, elastic),
        "natural_frequencies_bonded_hz": _frequencies(
            inertia + stack.tip_mass * np.eye(3), elastic + stack.stiffness * np.eye(3)
        ),
        "force": force,
        "voltage": (force + stack.stiffness * np.array(elongation)) / stack.coupling,
        "elongation_at_voltage": elongation_at_voltage,
        "pose_at_voltage": pose_at_voltage,
        "saturated": (applied != voltage).astype(int),
    }


def deformation(
    *,
    level: Level = "constant_jacobian",
    kinematics: LinkSet = "nominal",
    links: LinkChanges = AS_NAMED,
    hinge: Hinge = THESIS_HINGE,
    stack: Stack = TOKIN,
    contact: Contact = "stack",
    bolts: Bolts = "pin",
    outline: Outline = THESIS_OUTLINE,
    mesh: float | None = None,
    elongation: Triple = (STROKE_IN_USE, 0.0, 0.0),
    pose: Triple | None = None,
) -> Deformation:
    """Return the stage deformed by elongations [m] of its stacks, or at a pose [m, m, rad]; arguments as of `analyze`.

    Raises:
        ModelError: as `rrr_stage`; another level; elongations or a pose that are not finite.
    """
    if level != "continuum":
        raise ModelError(f"rrr_stage: level {level} has no body to show deformed; expected level continuum")
    _check_finite("elongation", elongation, "m")
    _check_finite("pose", pose or (), "m, rad")
    elastic = _continuum(Design(kinematics, links, hinge), "source", stack, contact, bolts, outline, mesh)
    return deformed(elastic, np.array(elongation) if pose is None else elastic.elongations(np.array(pose)))


def study(
    *,
    objective: Objective = "yaw_range",
    kinematics: LinkSet = "nominal",
    links: LinkChanges = AS_NAMED,
    hinge: Hinge = THESIS_HINGE,
    masses: Masses = THESIS_MASSES,
    stack: Stack = TOKIN,
    stroke: float = STROKE_IN_USE,
    least_yaw: float | None = None,
    least_frequency: float | None = None,
    largest_stress: float | None = None,
) -> Study:
    """Return the design study of ranges, natural frequencies and peak stress at level `constant_jacobian`.

    Args:
        objective: response that an optimisation maximises; `safety` is the yield strength over the peak stress.
        kinematics: parameter set of the links.
        links: lengths [m] and angles [rad] of the links in place of those of the set.
        hinge: dimensions [m] and material [Pa] of the hinges.
        masses: masses [kg] and moments of inertia [kg.m2] of the links; an inertia varies with its mass.
        stack: data sheet of the stacks.
        stroke: elongations go from 0 to it, each of them [m].
        least_yaw: least range of the yaw that an optimisation keeps [rad] (default: none).
        least_frequency: least natural frequency without stacks that it keeps [Hz] (default: none).
        largest_stress: largest peak stress that it keeps [Pa] (default: none).

    Raises:
        ModelError: an unknown objective or parameter set; dimensions that cannot be built; a stroke or goal that
            is not above 0.
    """
    one_of(objective, get_args(Objective), "rrr_stage: objective")
    design = Design(kinematics, links, hinge, masses)
    goals = Goals(stroke, least_yaw, least_frequency, largest_stress)
    return design_study(design, stack, goals, objective, f"rrr_stage, kinematics {kinematics}")


def _check(level: str, causality: str, mesh: float | None) -> None:
    """Raise `ModelError` for an unknown level or causality, and for a mesh at a level without one."""
    one_of(level, get_args(Level), "rrr_stage: level")
    one_of(causality, get_args(Causality), "rrr_stage: causality")
    if mesh is not None and level != "continuum":
        raise ModelError(f"rrr_stage: mesh is {mesh:g} m, but level {level} has none; expected level continuum")


def _check_finite(name: str, values: tuple[float, ...], unit: str) -> None:
    """Raise `ModelError` unless an argument has finite numbers."""
    if not np.all(np.isfinite(values)):
        raise ModelError(f"rrr_stage: {name} is {values} {unit}, expected three finite numbers")


def _continuum(
    design: Design,
    causality: str,
    stack: Stack,
    contact: Contact,
    bolts: Bolts,
    outline: Outline,
    mesh: float | None,
) -> Continuum:
    """Return the arguments of level `continuum`; `ModelError` for those of other levels."""
    if causality != "source":
        raise ModelError(
            "rrr_stage: causality is force, but the modes of level continuum are those of a stage on its stacks; "
            "expected source"
        )
    for name, given in (
        ("jacobian", design.given_jacobian),
        ("stiffness", design.given_stiffness),
        ("mass", design.given_mass),
    ):
        if given is not None:
            raise ModelError(
                f"rrr_stage: {name} is given, but follows from the outline at level continuum; leave it out"
            )
    one_of(contact, get_args(Contact), "rrr_stage: contact")
    one_of(bolts, get_args(Bolts), "rrr_stage: bolts")
    return Continuum(design.links, design.hinge, outline, design.masses, contact, bolts, stack, mesh)


def _over_states(m: Model, level: str, design: Design) -> Mechanism:
    """Declare the states of a level, the elongations or the pose and their rates; return the mechanism."""
    if level == "constant_jacobian":
        coordinates = m.state("leg[1..3].elongation", "m", "Elongation of the stack", nominal=_MOVE[0])
        rates = m.state("leg[1..3].elongation_rate", "m/s", "Rate of the elongation", nominal=_MOVE[1])
        return design.mechanism(level, coordinates, rates)
    position = m.state("center.position[1..2]", "m", "Position of the platform's centre from rest", nominal=_MOVE[0])
    rotation = m.state("center.rotation", "rad", "Rotation of the platform from rest", nominal=_TURN[0])
    velocity = m.state("center.velocity[1..2]", "m/s", "Velocity of the platform's centre", nominal=_MOVE[1])
    turning = m.state("center.angular_velocity", "rad/s", "Angular velocity of the platform", nominal=_TURN[1])
    return design.mechanism(level, ca.vertcat(position, rotation), ca.vertcat(velocity, turning))


def _kinematic(m: Model, J: np.ndarray) -> _Motion:
    """Declare the elongations and their derivatives as inputs; return the motion of the platform."""
    words = (
        ("", "", "Elongation"),
        ("_rate", "/s", "Rate of the elongation"),
        ("_acceleration", "/s2", "Acceleration of the elongation"),
    )
    return _Motion(
        *[
            ca.DM(J) @ m.input(f"stack[1..3].elongation{word}", f"m{per}", f"{text} of the stack", nominal=size)
            for (word, per, text), size in zip(words, _MOVE, strict=True)
        ]
    )


def _dynamic(m: Model, mechanism: Mechanism, rest_stiffness: ca.DM, causality: str, stack: Stack) -> _Motion:
    """Add the equations of motion and the outputs of the stacks; return the motion of the platform."""
    beta = m.parameter("damping_time", 6.02e-6, "s", "Damping / stiffness of the hinges, beta", min=0)
    source = causality == "source"
    drive, wrench, base = _loads(m, source)
    p, v, terms = mechanism.coordinates, mechanism.rates, dynamics.terms(mechanism)
    (to_pose, to_stacks), (pose_bias, stack_bias) = ca.vertsplit(terms.slope, 3), ca.vertsplit(terms.bias, 3)
    rate = to_stacks @ v
    k, c, tip = _stack_parameters(m, stack) if source else (0, 0, 0)
    on_cranks = drive - k * mechanism.elongation - c * rate - tip * stack_bias
    force = to_stacks.T @ (on_cranks - beta * rest_stiffness @ rate) + to_pose.T @ wrench
    force -= terms.velocity + terms.elastic + terms.base @ base
    m.der[p] = v
    acceleration = m.motion(v, mass=terms.mass + tip * to_stacks.T @ to_stacks, force=force)

    _stack_outputs(m, mechanism.elongation, rate)
    if source:
        _force_outputs(m, on_cranks - tip * to_stacks @ acceleration)
    return _Motion(mechanism.pose, to_pose @ v, to_pose @ acceleration + pose_bias)


def _elastic(m: Model, design: Continuum) -> _Motion:
    """Add the modes of an elastic stage, the outputs of stacks and necks; return the motion of the platform."""
    solved = design.solved(design.size)
    small, stack = design.small(solved.stage), design.stack
    damping = m.parameter("damping_ratio", 0.01, "1", "Damping ratio of each mode, without the stacks' damping", min=0)
    drive, wrench, base = _loads(m, True)
    c = m.parameter("stack.damping", stack.damping, "N.s/m", _STACK_DAMPING, min=0)
    modes_ = f"mode[1..{len(small.omega)}]"
    coordinates = m.state(f"{modes_}.displacement", "m", "Largest displacement in the mode", nominal=_MOVE[0])
    rates = m.state(f"{modes_}.velocity", "m/s", "Rate of the displacement", nominal=_MOVE[1])
    forces = ca.vertcat(drive, wrench)
    found = equations(small, design.links.radius, coordinates, rates, forces, base, damping, c)
    m.der[coordinates], m.der[rates] = rates, found.acceleration
    (at, x), (rate, v), (acceleration, a) = (ca.vertsplit(part, 3) for part in found.motion)
    _stack_outputs(m, at, rate)
    inertia = stack.tip_mass * (acceleration + ca.DM(solved.stage.pushes) @ base)
    _force_outputs(m, drive - stack.stiffness * at - c * rate - inertia)
    stress = largest_stress(design, solved, found.motion.place)
    _stress_outputs(m, design.hinge, stress, "Largest von Mises stress in the necks")
    return _Motion(x, v, a)


def _loads(m: Model, source: bool) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Declare forces of the stacks, wrench on the platform and acceleration of the base; return their symbols."""
    drive = m.input(
        "stack[1..3].blocking_force" if source else "stack[1..3].force",
        "N",
        "Blocking force of the stack" if source else "Force of the stack on its crank",
        nominal=_FORCE,
    )
    wrench = ca.vertcat(
        m.input("wrench.force[1..2]", "N", "Force on the platform at its centre", nominal=_FORCE),
        m.input("wrench.torque", "N.m", "Moment on the platform", nominal=_TORQUE),
    )
    base = m.input("base.acceleration[1..2]", "m/s2", "Acceleration of the base", nominal=_MOVE[2])
    return drive, wrench, base


def _stack_parameters(m: Model, stack: Stack) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Declare stiffness, damping and tip mass of the stacks and return their symbols."""
    return (
        m.parameter("stack.stiffness", stack.stiffness, "N/m", "Stiffness of each stack", min=0),
        m.parameter("stack.damping", stack.damping, "N.s/m", _STACK_DAMPING, min=0),
        m.parameter("stack.tip_mass", stack.tip_mass, "kg", "Mass of each stack that moves with its tip", min=0),
    )


def _stack_outputs(m: Model, elongation: ca.SX, rate: ca.SX) -> None:
    """Declare the motion of the stacks as outputs."""
    m.output("stack[1..3].elongation", elongation, "m", "Elongation of the stack", nominal=_MOVE[0])
    m.output("stack[1..3].elongation_rate", rate, "m/s", "Rate of the elongation", nominal=_MOVE[1])


def _force_outputs(m: Model, felt: ca.SX) -> None:
    """Declare the forces of the stacks on their cranks, and whether they would have to pull, as outputs."""
    preload = m.parameter(
        "stack.preload", 0.0, "N", "Force that presses each crank on its stack", min=0, nominal=_FORCE
    )
    m.output("stack[1..3].force", felt, "N", "Force of the stack on its crank", nominal=_FORCE)
    pulls = felt + preload < -PULL_FROM_ROUNDING
    m.output("stack[1..3].contact_lost", pulls, "1", "1 while the stack would have to pull")


def _stress_outputs(m: Model, hinge: Hinge, stress: ca.SX, description: str) -> None:
    """Declare the largest stress of the hinges, and whether it is allowable, as outputs."""
    allowed = hinge.allowed_stress
    m.output("hinge.stress", stress, "Pa", description, nominal=1e8)
    m.output(
        "hinge.overload", ca.if_else(stress > allowed, 1, 0), "1", f"1 while the stress exceeds {allowed / 1e6:.0f} MPa"
    )


def _outputs(m: Model, motion: _Motion) -> None:
    """Declare the motion of the platform as outputs."""
    (x, v, a) = motion
    m.output("platform.position[1..2]", x[:2], "m", "Position of the centre from rest", nominal=_MOVE[0])
    m.output("platform.rotation", x[2], "rad", "Rotation from rest, counter-clockwise", nominal=_TURN[0])
    m.output("platform.velocity[1..2]", v[:2], "m/s", "Velocity of the centre", nominal=_MOVE[1])
    m.output("platform.angular_velocity", v[2], "rad/s", "Angular velocity", nominal=_TURN[1])
    m.output("platform.acceleration[1..2]", a[:2], "m/s2", "Acceleration of the centre", nominal=_MOVE[2])
    m.output("platform.angular_acceleration", a[2], "rad/s2", "Angular acceleration", nominal=_TURN[2])


def _steps(jacobian: np.ndarray, resolution: float) -> np.ndarray:
    """Return the least steps of the pose by a stack that moves it, (3,) [m, m, rad]; infinite where none does."""
    return resolution * np.abs(np.where(jacobian == 0, np.inf, jacobian)).min(axis=1)


def _on_stacks(mechanism: Mechanism) -> ca.Function:
    """Return the function from coordinates to Jacobian, pose, inertia, stiffness, holding force and hinge angles."""
    p, terms = mechanism.coordinates, dynamics.terms(mechanism)
    to_pose, to_stacks = ca.vertsplit(terms.slope, 3)
    from_stacks = ca.inv(to_stacks)
    force = from_stacks.T @ terms.elastic
    return ca.Function(
        "on_stacks",
        [p],
        [
            to_pose @ from_stacks,
            mechanism.pose,
            from_stacks.T @ terms.mass @ from_stacks,
            ca.jacobian(force, p) @ from_stacks,
            force,
            mechanism.hinges,
        ],
    )


def _coordinates(level: str, design: Design, elongation: Triple | list[float]) -> np.ndarray:
    """Return the mechanism's coordinates at elongations [m], (3,)."""
    return forward(design.links, elongation) if level == "exact" else np.array(elongation)


def _elongations(level: str, design: Design, pose: Triple) -> Triple:
    """Return the elongations of a pose: of the links at level `exact`, else by the Jacobian."""
    if level == "exact":
        return tuple(inverse(design.links, pose, "rrr_stage").tolist())
    return tuple(np.linalg.solve(design.jacobian, pose).tolist())


def _at_voltage(mechanism: Mechanism, stack: Stack, voltage: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return elongations (3,) [m] and pose (3,) [m, m, rad] in equilibrium of hinges and stacks."""
    p, elongation, terms = mechanism.coordinates, mechanism.elongation, dynamics.terms(mechanism)
    pull = ca.inv(terms.slope[3:, :]).T @ terms.elastic + stack.stiffness * elongation
    residual = pull - stack.coupling * ca.DM(voltage)
    balance = newton(p, residual, np.zeros(3), f"rrr_stage: no equilibrium at {voltage} V")
    found = ca.Function("found", [p], [elongation, mechanism.pose])(balance)
    return np.array(found[0]).ravel(), np.array(found[1]).ravel()


def _frequencies(inertia: np.ndarray, stiffness: np.ndarray) -> np.ndarray:
    """Return the natural frequencies [Hz], ascending."""
    return modes(inertia, stiffness).omega / (2 * np.pi)
