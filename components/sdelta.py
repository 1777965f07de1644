"""The SDelta robot, from the motion of its tubes to that of its platform: a rigid platform on three elastic limbs.

Three C-drives carry the limbs: tube j slides by u_j along its side of the base and turns by phi_j about it. The rods,
and with some presets the shafts of the drives, are elastic. Displacements x = [rotation; translation] of the platform
and deviations dq = [du_1, dphi_1, ...] of the tubes count from the posture. With N, L, K_D of
`_mechanics/sdelta_kinematics.py` and `sdelta_stiffness.py` about the centre of mass C, and w_g = [0; 0, 0, -m g],

    cartesian   M xdd = w + w_g - N^T F                        platform
                F = K_D (N x - L dq) + B (N xd - L dqd)        forces on the limbs, along and across them
                Q = L F                                        force and torque on each tube, along +slide and +angle
    rigid       x = N^-1 L dq,    Q = L N^-T (w + w_g)

so that K = N^T K_D N. B gives every mode the same damping ratio zeta: N^T B N = D = M H diag(2 zeta omega) H^T M; with
`damping_model=rayleigh` D = alpha M + beta K gives it to the first and the fourth mode.

`generalized` includes the inertia of screws, tubes and rods, times `extra_inertia`: twelve degrees of freedom q, the
twists of six shafts and the deflections of six rod tips, M_E and K_q of `_mechanics/sdelta_generalized.py`, or its
modes eta, Phi^T M_E Phi = 1, with the motion of the tubes as the motors dictate it, J_C theta = dq,

    generalized   eta'' + e = W^T (w + w_g),    e = omega^2 (eta - G dq) + D (eta' - G dqd),    x = W eta,    Q = G^T e
                  W = N^-1 D_J Phi,    G = Phi^T M_E [J_L^-1; 0]

It is joined with drives that are rotors only, has shafts that twist whatever the preset, leaves out the weight of the
limbs, and converges to `cartesian` with the shafts (`ch3_full`, `ch4_full`) as `extra_inertia` goes to 0, with an error
of 0.054 `extra_inertia` in the frequencies of the symmetric posture. At 0 it is that level.

`nonlinear` has finite motions: V(Q, a; u, phi) of `_mechanics/sdelta_nonlinear.py`, the energy of springs along the
actual axes of the limbs, about tubes at their actual places, with the inertia I = Q I_body Q^T,

    nonlinear   I alpha + omega x I omega = n + n_w,    m a_C = f + f_w + m g
                [n; f] = -dV - D (t - T dqd),           Q = -dV/d[u; phi] + T^T D (t - T dqd),    T = N^-1 L

with D and T of the posture: the damping is that of small motions. The attitude of the platform is finite, less than a
full turn, and `platform` and `wrench` refer to the moved S. `platform.workspace_left` is 1 where a limb is no longer
than its rod, a tube is beyond the end of its side, or the platform is at or beyond a singular pose; the equations go
on, but describe no machine. As the amplitude A goes to 0 the level tends to `cartesian`: second harmonics and means,
relative to A, are of order A, the change of the fundamental of order A^2. With gravity the preload raises the
frequencies of the symmetric posture, by 0.34 % at most. `sdelta_reference` at level `exact` fits it.

Ports: in `drive[j].slide` [m], `.angle` [rad] from the posture (du_j and dphi_j), their `_rate` and `_acceleration`,
`wrench.torque` [N.m], `.force` [N]; out `drive[j].force` [N], `.torque` [N.m] and the platform's `rotation` [rad] and
`position` [m] from the posture with `angular_velocity`, `velocity`, `angular_acceleration`, `acceleration`, world axes,
and the wrench that the limbs exert on the platform, `limbs.torque` [N.m] and `.force` [N], which is M xdd - w - w_g.
`wrench`, `platform` and `limbs` refer to `reference_point`: S, the centroid of the platform's joints, or C. All are
zero at the posture, so a motion of picometres keeps all its digits. The FMU's constants `drive[j].slide_at_posture` and
`.angle_at_posture` are u_j and phi_j at the posture; `analyze` returns them as well. Out, too, are the twists of the
shafts, screw minus motor, `shaft[i].twist` [rad] in the order L1, R1, L2, R2, L3, R3, and the deflections of the rods'
tips, `rod[j].deflection[1]` along the C axis and `[2]` across the limb [m]; at `rigid` by the static reaction.

At level `rigid` the platform follows the tubes exactly; the loads on the tubes are the static reaction only, while
`limbs` has the inertial one as well. `cartesian` converges to this motion as the stiffness grows, with an error ~
1/stiffness. `cartesian` does not use the tubes' accelerations, `rigid` does not use the damping ratio. With gravity 0,
the default, the posture is the loaded equilibrium. With gravity the weight acts at C about the unloaded posture: the
platform sags, and the tubes carry the weight.

Bode plot, from the rigid-body pose of the tubes, N^-1 L dq, to the pose of S, symmetric posture, preset ch4, damping
1 %: 0 dB at low frequency. Vertical position: one resonance, 34 dB high at 24.5 Hz, and no antiresonance. Horizontal
position, and rotation about a horizontal axis: resonances at 23.6 and 95.9 Hz and an antiresonance between them, at
31.8 Hz for position and 33.1 Hz for rotation. Rotation about the vertical: one resonance, at 161.1 Hz.

Source: Q. Sun, PhD thesis, McGill University, 2023, whose equation numbers are cited. Given there: dimensions, rods,
shafts, masses, specimen. Inferred from its printed results: pitch of the screws, elastic modulus of the rods, height of
the centre of mass, moments of inertia. Assumed: damping ratio.
"""

from typing import Any, Literal, get_args

import casadi as ca
import numpy as np

from hfsa.components import Drawing, Model, Moving
from hfsa.components._mechanics.modes import Damping, DampingOf
from hfsa.components._mechanics.screws import shift
from hfsa.components._mechanics.sdelta_calibration import calibration_of
from hfsa.components._mechanics.sdelta_facts import (
    DAMPING_MODEL,
    DAMPING_RATIO,
    GEAR,
    GEOMETRY,
    GRAVITY,
    LIMBS,
    PAYLOAD,
    PITCH,
    PLATFORM,
    POSTURE,
    RODS,
    SHAFTS,
    SPRINGS,
)
from hfsa.components._mechanics.sdelta_geometry import SYMMETRIC, Posture
from hfsa.components._mechanics.sdelta_inertia import CUBE, Payload
from hfsa.components._mechanics.sdelta_kinematics import THESIS, Mechanism, by_drive, declare_tube_constants
from hfsa.components._mechanics.sdelta_levels import (
    MOVE,
    TURN,
    Motion,
    Tubes,
    Wrench,
    cartesian,
    generalized,
    nonlinear,
    rigid,
)
from hfsa.components._mechanics.sdelta_numbers import UNITS as UNITS
from hfsa.components._mechanics.sdelta_numbers import (
    elastodynamic_numbers,
    elastostatic_numbers,
    generalized_numbers,
    kinematic_numbers,
    warned,
)
from hfsa.components._mechanics.sdelta_picture import robot_drawing, robot_in_motion
from hfsa.components._mechanics.sdelta_robot import THESIS_MACHINE, THESIS_STRUCTURE, Machine, Robot, Structure
from hfsa.components._mechanics.sdelta_stiffness import Preset
from hfsa.components._mechanics.sdelta_study import Design, Objective, design_study, path_study
from hfsa.components._modelling.calibration import Calibration
from hfsa.components._modelling.facts import Known
from hfsa.components._modelling.joins import Join
from hfsa.components._modelling.model import ModelError, one_of
from hfsa.components._modelling.study import Study

Level = Literal["rigid", "cartesian", "generalized", "nonlinear"]

LADDER = ("rigid", "cartesian", "nonlinear")
"""Levels of one machine, whose limbs have no inertia; that of `generalized` is assumed, and makes another machine."""

_ELASTIC = ("cartesian", "generalized", "nonlinear")

FACTS = {
    POSTURE: Known("posture"),
    PAYLOAD: Known("payload"),
    PLATFORM: Known("platform"),
    GEOMETRY: Known("geometry"),
    GEAR: Known("gear"),
    PITCH: Known("pitch"),
    RODS: Known("rods", levels=_ELASTIC),
    SHAFTS: Known("shafts", levels=_ELASTIC),
    LIMBS: Known("limbs", levels=("generalized",)),
    SPRINGS: Known("stiffness", levels=("cartesian", "nonlinear")),
    DAMPING_MODEL: Known("damping_model", levels=_ELASTIC),
    DAMPING_RATIO: Known("damping_ratio", levels=_ELASTIC),
    GRAVITY: Known("gravity"),
}

JOINS = (
    Join(
        "rigid",
        "drive[",
        {"sdelta_reference": None, "c_drive": ("ideal",)},
        "it puts out its static reaction only, because a held inertial reaction diverges at every step",
    ),
    Join(
        "generalized",
        "drive[",
        {"sdelta_reference": None, "c_drive": ("ideal", "rotor")},
        "it has the screws, tubes and shafts itself, which would count twice",
    ),
    Join(
        "nonlinear",
        "drive[",
        {"sdelta_reference": ("exact",), "c_drive": ("ideal", "rigid_shaft", "compliant_shaft")},
        "its motion is finite, and tubes that follow a linear reference deviate from it by terms of second order",
    ),
)

# Nominal values of limb forces and moments.
_FORCE, _TORQUE = 0.1, 0.01


def sdelta(
    *,
    level: Level = "cartesian",
    posture: Posture = SYMMETRIC,
    stiffness: Preset = "ch4",
    payload: Payload = CUBE,
    reference_point: Literal["S", "C"] = "S",
    machine: Machine = THESIS_MACHINE,
    extra_inertia: float = 1.0,
    damping_model: Damping = "modal",
) -> Model:
    """Return the robot at one posture.

    Args:
        level: `rigid` (the platform follows the tubes), `cartesian` (a rigid platform on a 6x6 spring), `generalized`
            (twelve degrees of freedom of shafts and rods with the inertia of the limbs) or `nonlinear` (a rigid
            platform in finite motion, with springs along the actual limbs).
        posture: origin of the displacements; rotation in degrees, position of S in metres.
        stiffness: preset of `_mechanics/sdelta_stiffness.py`; without effect at level `rigid`.
        payload: mass [kg], centre of mass from S [m] and moments of inertia [kg.m2] of the payload.
        reference_point: reference point of `platform` and `wrench`: S, the centroid of the joints, or C, the centre of
            mass.
        machine: dimensions of the robot, the arguments `geometry`, `rods`, `shafts`, `platform`, `limbs`, `gear` and
            `pitch` (`_mechanics/sdelta_robot.py`). Rods and shafts are without effect at level `rigid`, limbs at all
            levels but `generalized`, shafts with presets that leave them out.
        extra_inertia: factor eps of the inertia of screws, tubes and rods at level `generalized`.
        damping_model: `modal`, the same ratio in every mode, or `rayleigh`, this ratio in the first and fourth mode.

    Raises:
        ModelError: a singular posture, with its condition number; an unknown level, preset or reference point;
            dimensions that cannot be built.
    """
    linear = {"rigid": rigid, "cartesian": cartesian, "generalized": generalized}
    one_of(level, get_args(Level), "sdelta: level")
    one_of(reference_point, ("S", "C"), "sdelta: reference_point")
    one_of(damping_model, get_args(Damping), "sdelta: damping_model")
    robot = Robot.at(posture, _preset(stiffness, level), payload, machine, extra_inertia)
    m = Model("SDelta", "SDelta parallel robot from its tubes to its platform")
    damping_ratio = m.parameter("damping_ratio", 0.01, "1", "Damping ratio of the modes (all levels but rigid)", min=0)
    gravity = m.parameter("gravity", 0.0, "m/s2", "Gravitational acceleration along -Z; 0 omits the sag")
    tubes = _tubes(m)
    declare_tube_constants(m, robot.kinematics)
    torque = m.input("wrench.torque[1..3]", "N.m", f"Moment on the platform about {reference_point}", nominal=_TORQUE)
    force = m.input("wrench.force[1..3]", "N", f"Force on the platform at {reference_point}", nominal=_FORCE)
    wrench = Wrench(torque, force, ca.vertcat(0, 0, -robot.mass[5, 5] * gravity))
    damped = DampingOf(damping_model, damping_ratio)
    if level == "nonlinear":
        motion = nonlinear(m, robot, tubes, wrench, damped, reference_point)
    else:
        to_reference = ca.DM(shift(robot.offset)) if reference_point == "S" else ca.DM.eye(6)
        at_center = to_reference.T @ ca.vertcat(torque, force) + ca.vertcat(0, 0, 0, wrench.weight)
        motion = linear[level](m, robot, tubes, at_center, damped).referred(to_reference)
    _outputs(m, motion, reference_point)
    return m


def analyze(
    *,
    level: Level = "cartesian",
    posture: Posture = SYMMETRIC,
    stiffness: Preset = "ch4",
    payload: Payload = CUBE,
    reference_point: Literal["S", "C"] = "S",
    machine: Machine = THESIS_MACHINE,
    extra_inertia: float = 1.0,
    damping_model: Damping = "modal",
    point: tuple[float, float, float] | None = None,
) -> dict[str, Any]:
    """Return the elastostatic and elastodynamic properties of the robot at a posture, in SI units, rotation first.

    The arguments are those of `sdelta`, and one more. `reference_point` has no effect, because the names of the results
    contain the reference point. At level `rigid` the limbs are not elastic, and only the last group is returned. At
    level `generalized` the frequencies and modal screws are those of twelve degrees of freedom; what is defined for six
    only is left out. At level `nonlinear` all numbers are those of small motions.

    Further arguments:
        point: a further point of reference P, from S in world axes [m].

    Returns:
        Elastostatics, with `_S`, `_C` and, for a given point, `_P`; a vector of each axis is a column, and a point is
        the one of the axis closest to the point of reference. Axes of repeated values are along x and y where possible.

        stiffness, compliance: K and its inverse, (6, 6) [N, m, rad].
        eigenstiffness, eigenpitch: eigenstiffnesses, ascending [N], and pitches of their eigenscrews [m], (6,).
        eigenscrew_directions, eigenscrew_points: axes of the eigenscrews, (3, 6) [1], [m].
        translational_stiffness, torsional_stiffness: stiffnesses of the compliant axes, ascending, (3,) [N/m],
            [N.m/rad].
        wrench_compliant_directions, wrench_compliant_pitches, wrench_compliant_points: axes of the translational
            stiffnesses, (3, 3) [1], (3,) [m], (3, 3) [m]; `twist_compliant_` those of the torsional ones.
        kappa, kappa_r, kappa_t: root mean squares of the eigenstiffnesses [N], torsional [N.m/rad] and translational
            stiffnesses [N/m].
        rod_stiffness, shaft_stiffness: k_r [N/m] and k_s [N.m/rad], infinite for rigid shafts.
        shaft_along, shaft_across: k'_s and k''_s by limb, (3,) [N/m] (eq 3.26c).
        joint_stiffness: K_D, along and across by limb, (6,) [N/m].
        minimum_energy_S: F, twists of the shafts and deflections of the rods' tips per displacement of S, (12, 6)
            (eq 3.24).

        Elastodynamics:

        mass: M, (6, 6) [kg, m].
        dynamic_matrix: M^-1 K, (6, 6) (eq 4.3).
        frequency_matrix_C: frequency matrix, (6, 6) [rad/s] (eq 4.8).
        squared_frequency_matrix_cholesky_C: L^-1 K L^-T with M = L L^T, (6, 6) [rad2/s2] (eq 4.4).
        natural_frequencies_hz: natural frequencies, ascending, (6,) [Hz].
        modal_matrix: H with H^T M H = 1 kg, (6, 6) [rad/m; 1].
        modal_screws_C: columns of H of unit rotation, or of unit translation for a pure translation, (6, 6).
        modal_kinds: `rotation`, `translation` or `screw`, of each mode.
        modal_directions, modal_pitches, modal_points: their axes, (3, 6), (6,) [m], (3, 6) [m].
        tracking_band_hz: frequencies up to which the response of each coordinate of the pose to its own command errs by
            less than 5 %, at 1 % damping, rotations first, (6,) [Hz].
        mode_shapes: at level `generalized` the modes, columns of six shaft twists and six deflections of rod tips,
            along and across by limb, per displacement of a modal mass of 1 kg, (12, 12) [rad/m, 1]; six columns without
            `extra_inertia`.
        generalized_mass: at level `generalized` M_E, (12, 12) [kg.m2, kg.m; kg.m, kg].
        ritz_frequencies_hz, cartesian_frequencies_hz: at level `generalized` frequencies of six degrees of freedom with
            and without the inertia of the limbs, (6,) [Hz].
        ritz_excess, cartesian_excess: their excess over the first six frequencies, relative, (6,).
        relative_damping: damping ratio of each mode over `damping_ratio`, (6,) or (12,).

        Kinematics:

        motor_angles: motor angles at the posture, 0 at the symmetric one, L1, R1, L2, R2, L3, R3, (6,) [rad].
        tube_slides, tube_angles: u_j [m] and phi_j [rad] at the posture, (3,).
        limb_lengths: lengths of the limbs, (3,) [m].
        limb_rows_S, drive_paths: N about S, (6, 6), and D_J, (6, 12) (eqs 3.17, 3.18).
        jacobian: Jacobian from motor angles to the pose of S, (6, 6).
        attitude: rotation matrix of the posture, from platform axes to world axes, (3, 3).
        inertia_parameters_S: inertia of the platform with its payload about S, platform axes: m, m cx, m cy, m cz, Ixx,
            Ixy, Ixz, Iyy, Iyz, Izz, the last six being entries of the tensor, (10,) [kg], [kg.m], [kg.m2].
        condition_number: condition number from platform to tubes, rotations weighted by the platform's radius.
        determinant: det N about S [m3], and `assembly` in words: whether it has the sign of the symmetric posture.
        regularity: `regular`, or a sentence on a posture close to a singularity.

    Raises:
        ModelError: as `sdelta`.
    """
    one_of(level, get_args(Level), "sdelta: level")
    one_of(reference_point, ("S", "C"), "sdelta: reference_point")
    robot = Robot.at(posture, _preset(stiffness, level), payload, machine, extra_inertia)
    one_of(damping_model, get_args(Damping), "sdelta: damping_model")
    place = None if point is None else _point(point)
    elastic = {} if level == "rigid" else elastostatic_numbers(robot, place)
    if level == "generalized":
        elastic |= generalized_numbers(robot, damping_model)
    elif level != "rigid":
        elastic |= elastodynamic_numbers(robot, place, damping_model)
    return warned({**elastic, **kinematic_numbers(robot)})


def study(
    *,
    objective: Objective = "f1",
    posture: Posture = SYMMETRIC,
    stiffness: Preset = "ch4",
    payload: Payload = CUBE,
    machine: Structure = THESIS_STRUCTURE,
) -> Study:
    """Return the design study of f1, the indices kappa and the condition number at level `cartesian`.

    Arguments as in `sdelta`; `objective` is the response that an optimisation maximises. Dimensions are the arguments
    that are numbers, with the elements of the posture by place, `posture.position[1]`.

    Raises:
        ModelError: an unknown objective or preset; dimensions that cannot be built.
    """
    one_of(objective, get_args(Objective), "sdelta: objective")
    design = Design(posture, stiffness, payload, machine.with_limbs())
    _ = design.robot()
    return design_study(design, objective, f"sdelta, stiffness {stiffness}")


def trajectory(
    *,
    posture: Posture = SYMMETRIC,
    stiffness: Preset = "ch4",
    payload: Payload = CUBE,
    machine: Structure = THESIS_STRUCTURE,
) -> Study:
    """Return the study along a path of postures x, y, z [m], rz, rx, ry [deg], at level `cartesian`.

    It has the six natural frequencies, the indices kappa, the condition number and the motor angles. Arguments as in
    `sdelta`; what the path does not give is that of `posture`.
    """
    design = Design(posture, stiffness, payload, machine.with_limbs())
    _ = design.robot()
    return path_study(design, f"sdelta, stiffness {stiffness}")


def picture(
    *,
    posture: Posture = SYMMETRIC,
    stiffness: Preset = "ch4",
    payload: Payload = CUBE,
    machine: Structure = THESIS_STRUCTURE,
) -> Drawing:
    """Return the robot at a posture, and each of its six modes at level `cartesian` with the axis of its screw.

    Arguments and errors as in `sdelta`.
    """
    robot = Robot.at(posture, stiffness, payload, machine.with_limbs())
    return robot_drawing(robot, f"SDelta, stiffness {stiffness}")


def moving(
    *,
    posture: Posture = SYMMETRIC,
    payload: Payload = CUBE,
    reference_point: Literal["S", "C"] = "S",
    machine: Structure = THESIS_STRUCTURE,
) -> Moving:
    """Return the robot in a run, as its platform moves; arguments and errors as in `sdelta`."""
    one_of(reference_point, ("S", "C"), "sdelta: reference_point")
    return robot_in_motion(Robot.at(posture, "ch4", payload, machine.with_limbs()), reference_point)


def calibration(*, mechanism: Mechanism = THESIS) -> Calibration:
    """Return the calibration of triangles and drives from motor angles motor_L1 to motor_R3 [rad] at postures.

    A table has the columns x, y, z [m], rz, rx, ry [deg] of the postures, and motor angles; what it does not name is
    that of the symmetric posture. `mechanism` are the arguments `geometry`, `gear` and `pitch` to start from.
    """
    return calibration_of(mechanism)


def _point(point: tuple[float, float, float]) -> np.ndarray:
    """Return a point of reference as an array; `ModelError` unless it is three finite numbers."""
    if len(point) != 3 or not np.all(np.isfinite(point)):
        raise ModelError(f"sdelta: point is {point}, expected three finite numbers")
    return np.array(point, dtype=float)


def _preset(preset: Preset, level: Level) -> str:
    """Return the preset of a level: `generalized` has the shafts in any case; an unknown one is left to be refused."""
    return {"ch3_rods": "ch3_full", "ch4": "ch4_full"}.get(preset, preset) if level == "generalized" else preset


def _tubes(m: Model) -> Tubes:
    """Declare the motion of the tubes as inputs."""
    along, about = "Slide of the tube from the posture along its side of the base", "Angle of the tube about its side"
    slide = m.input("drive[1..3].slide", "m", along, nominal=MOVE[0])
    angle = m.input("drive[1..3].angle", "rad", f"{about} from the posture", nominal=TURN[0])
    slide_rate = m.input("drive[1..3].slide_rate", "m/s", "Velocity of the tube", nominal=MOVE[1])
    angle_rate = m.input("drive[1..3].angle_rate", "rad/s", "Angular velocity of the tube", nominal=TURN[1])
    slide_acceleration = m.input(
        "drive[1..3].slide_acceleration", "m/s2", "Acceleration of the tube (level rigid)", nominal=MOVE[2]
    )
    angle_acceleration = m.input(
        "drive[1..3].angle_acceleration", "rad/s2", "Angular acceleration of the tube (level rigid)", nominal=TURN[2]
    )
    return Tubes(
        by_drive(slide, angle),
        by_drive(slide_rate, angle_rate),
        by_drive(slide_acceleration, angle_acceleration),
    )


def _outputs(m: Model, motion: Motion, point: str) -> None:
    """Declare the loads on the tubes, the deflections of the limbs, the platform's motion and their wrench on it."""
    slide, angle = motion.on_tubes[0::2], motion.on_tubes[1::2]
    m.output("drive[1..3].force", slide, "N", "Force on the tube, positive along +slide", nominal=_FORCE)
    m.output("drive[1..3].torque", angle, "N.m", "Torque on the tube, positive along +angle", nominal=_TORQUE)
    twists, tips = motion.deflections[:6], motion.deflections[6:]
    m.output("shaft[1..6].twist", twists, "rad", "Twist of the shaft, screw minus motor", nominal=TURN[0])
    for i, where in enumerate(("along the C axis", "across the limb")):
        text = f"Deflection of the rod's tip {where}"
        m.output(f"rod[1..3].deflection[{i + 1}]", tips[i::2], "m", text, nominal=MOVE[0])
    x, v, a = motion[:3]
    m.output("platform.rotation[1..3]", x[:3], "rad", "Rotation vector from the posture, world axes", nominal=TURN[0])
    m.output(
        "platform.position[1..3]", x[3:], "m", f"Displacement of {point} from the posture, world axes", nominal=MOVE[0]
    )
    m.output("platform.angular_velocity[1..3]", v[:3], "rad/s", "Angular velocity", nominal=TURN[1])
    m.output("platform.velocity[1..3]", v[3:], "m/s", f"Velocity of {point}", nominal=MOVE[1])
    m.output("platform.angular_acceleration[1..3]", a[:3], "rad/s2", "Angular acceleration", nominal=TURN[2])
    m.output("platform.acceleration[1..3]", a[3:], "m/s2", f"Acceleration of {point}", nominal=MOVE[2])
    moment, force = motion.by_limbs[:3], motion.by_limbs[3:]
    m.output("limbs.torque[1..3]", moment, "N.m", f"Moment of the limbs on the platform about {point}", nominal=_TORQUE)
    m.output("limbs.force[1..3]", force, "N", "Force of the limbs on the platform", nominal=_FORCE)
