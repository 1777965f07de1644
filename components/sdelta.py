"""The SDelta robot, from the motion of its tubes to that of its platform: a rigid platform on three elastic limbs.

Three C-drives carry the limbs: tube j slides by u_j along its side of the base and turns by phi_j about it. The rods,
and with some presets the shafts of the drives, are elastic. Displacements x = [rotation; translation] of the platform
and deviations dq = [du_1, dphi_1, ...] of the tubes count from the posture. With N, L, K_D of
`_mechanics/sdelta_kinematics.py` and `sdelta_stiffness.py` about the centre of mass C, and w_g = [0; 0, 0, -m g],

    cartesian   M xdd = w + w_g - N^T F                        platform
                F = K_D (N x - L dq) + B (N xd - L dqd)        forces on the limbs, along and across them
                Q = L F                                        force and torque on each tube, along +slide and +angle
    rigid       x = N^-1 L dq,    Q = L N^-T (w + w_g)

so that K = N^T K_D N. B gives every mode the same damping ratio zeta: N^T B N = M H diag(2 zeta omega) H^T M.

Ports: in `drive[j].slide` [m], `.angle` [rad] from the posture (du_j and dphi_j), their `_rate` and `_acceleration`,
`wrench.torque` [N.m], `.force` [N]; out `drive[j].force` [N], `.torque` [N.m] and the platform's `rotation` [rad] and
`position` [m] from the posture with `angular_velocity`, `velocity`, `angular_acceleration`, `acceleration`, world axes,
and the wrench that the limbs exert on the platform, `limbs.torque` [N.m] and `.force` [N], which is M xdd - w - w_g.
`wrench`, `platform` and `limbs` refer to `reference_point`: S, the centroid of the platform's joints, or C. All are
zero at the posture, so a motion of picometres keeps all its digits. The FMU's constants `drive[j].slide_at_posture` and
`.angle_at_posture` are u_j and phi_j at the posture; `analyze` returns them as well.

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

from typing import Any, Literal, NamedTuple

import casadi as ca
import numpy as np

from hfsa.components import Model
from hfsa.components._mechanics.elastostatics import eigenscrews, rms, twist_compliant_axes, wrench_compliant_axes
from hfsa.components._mechanics.modes import frequency_matrix, modal_damping, modes
from hfsa.components._mechanics.screws import shift, unit_screw
from hfsa.components._mechanics.sdelta_facts import DAMPING_RATIO, GRAVITY, PAYLOAD, POSTURE, SPRINGS
from hfsa.components._mechanics.sdelta_geometry import PLATFORM_RADIUS, SYMMETRIC, Posture
from hfsa.components._mechanics.sdelta_inertia import CUBE, Payload, with_payload
from hfsa.components._mechanics.sdelta_kinematics import Kinematics, by_drive, declare_tube_constants
from hfsa.components._mechanics.sdelta_stiffness import PRESETS, Preset, limb_stiffness
from hfsa.components._mechanics.sdelta_stiffness import stiffness as stiffness_matrix
from hfsa.components._modelling.facts import Known
from hfsa.components._modelling.joins import Join
from hfsa.components._modelling.model import one_of

FACTS = {
    POSTURE: Known("posture"),
    PAYLOAD: Known("payload"),
    SPRINGS: Known("stiffness", levels=("cartesian",)),
    DAMPING_RATIO: Known("damping_ratio", levels=("cartesian",)),
    GRAVITY: Known("gravity"),
}

JOINS = (
    Join(
        "rigid",
        "drive[",
        {"sdelta_reference": None, "c_drive": ("ideal",)},
        "it puts out its static reaction only, because a held inertial reaction diverges at every step",
    ),
)

# Nominal values of micrometre motion at tens of hertz: rotation, position, and their first and second derivatives.
_TURN = (1e-5, 1e-3, 1e-1)
_MOVE = (1e-6, 1e-4, 1e-2)
# Nominal values of limb forces and moments.
_FORCE, _TORQUE = 0.1, 0.01


class _Robot(NamedTuple):
    """Matrices of the robot at its posture, with respect to C.

    Attributes:
        kinematics: first-order kinematics.
        offset: C - S, world axes, shape (3,) [m].
        N: rows of the limbs, shape (6, 6).
        K_D: stiffness at the joints, shape (6,) [N/m].
        M: mass matrix, shape (6, 6).
        K: stiffness, shape (6, 6).
    """

    kinematics: Kinematics
    offset: np.ndarray
    N: np.ndarray
    K_D: np.ndarray
    M: np.ndarray
    K: np.ndarray


class _Tubes(NamedTuple):
    """Deviation of the tubes from the posture and its derivatives, columns [slide, angle] by drive, shape (6, 1)."""

    deviation: ca.SX
    rate: ca.SX
    acceleration: ca.SX


class _Motion(NamedTuple):
    """Result of a level: motion of C and forces on the limbs at the platform joints, columns of six."""

    displacement: ca.SX
    twist: ca.SX
    acceleration: ca.SX
    limb_forces: ca.SX


def sdelta(
    *,
    level: Literal["rigid", "cartesian"] = "cartesian",
    posture: Posture = SYMMETRIC,
    stiffness: Preset = "ch4",
    payload: Payload = CUBE,
    reference_point: Literal["S", "C"] = "S",
) -> Model:
    """Return the robot at one posture.

    Args:
        level: `rigid` (the platform follows the tubes) or `cartesian` (a rigid platform on a 6x6 spring).
        posture: origin of the displacements; rotation in degrees, position of S in metres.
        stiffness: preset of `_mechanics/sdelta_stiffness.py`; without effect at level `rigid`.
        payload: mass [kg], centre of mass from S [m] and moments of inertia [kg.m2] of the payload.
        reference_point: reference point of `platform` and `wrench`: S, the centroid of the joints, or C, the centre of
            mass.

    Raises:
        ModelError: a singular posture, with its condition number; an unknown level, preset or reference point.
    """
    levels = {"rigid": _rigid, "cartesian": _cartesian}
    one_of(level, levels, "sdelta: level")
    one_of(reference_point, ("S", "C"), "sdelta: reference_point")
    robot = _robot(posture, stiffness, payload)
    m = Model("SDelta", "SDelta parallel robot from its tubes to its platform")
    damping_ratio = m.parameter("damping_ratio", 0.01, "1", "Damping ratio of every mode (level cartesian)", min=0)
    gravity = m.parameter("gravity", 0.0, "m/s2", "Gravitational acceleration along -Z; 0 omits the sag")
    tubes = _tubes(m)
    declare_tube_constants(m, robot.kinematics)
    to_reference = ca.DM(shift(robot.offset)) if reference_point == "S" else ca.DM.eye(6)
    torque = m.input("wrench.torque[1..3]", "N.m", f"Moment on the platform about {reference_point}", nominal=_TORQUE)
    force = m.input("wrench.force[1..3]", "N", f"Force on the platform at {reference_point}", nominal=_FORCE)
    weight = ca.vertcat(0, 0, 0, 0, 0, -robot.M[5, 5] * gravity)
    wrench = to_reference.T @ ca.vertcat(torque, force) + weight
    motion = levels[level](m, robot, tubes, wrench, damping_ratio)
    _outputs(m, robot, to_reference, motion, wrench, reference_point)
    return m


UNITS = {
    "stiffness_S": "N.m/rad, N; N, N/m",
    "stiffness_C": "N.m/rad, N; N, N/m",
    "mass_C": "kg.m2, kg.m; kg.m, kg",
    "frequency_matrix_C": "rad/s",
    "natural_frequencies_hz": "Hz",
    "modal_screws_C": "1; m",
    "eigenstiffness": "N",
    "eigenpitch": "m",
    "translational_stiffness": "N/m",
    "torsional_stiffness": "N.m/rad",
    "kappa": "N",
    "kappa_t": "N/m",
    "kappa_r": "N.m/rad",
    "motor_angles": "rad",
    "tube_slides": "m",
    "tube_angles": "rad",
    "limb_lengths": "m",
    "jacobian": "1; m/rad",
    "attitude": "1",
    "inertia_parameters_S": "kg; kg.m; kg.m; kg.m; kg.m2; kg.m2; kg.m2; kg.m2; kg.m2; kg.m2",
}
"""Units of the results of `analyze`, in the notation of `_modelling/parts.py`."""


def analyze(
    *,
    level: Literal["rigid", "cartesian"] = "cartesian",
    posture: Posture = SYMMETRIC,
    stiffness: Preset = "ch4",
    payload: Payload = CUBE,
    reference_point: Literal["S", "C"] = "S",
) -> dict[str, Any]:
    """Return the elastostatic and elastodynamic properties of the robot at a posture, in SI units, rotation first.

    The arguments are those of `sdelta`. `reference_point` has no effect, because the names of the results contain the
    reference point. At level `rigid` the limbs are not elastic, and only `motor_angles`, `tube_slides`, `tube_angles`,
    `limb_lengths`, `jacobian`, `attitude` and `inertia_parameters_S` are returned.

    Returns:
        stiffness_S, stiffness_C: stiffness matrices about S and C, (6, 6) [N, m, rad].
        mass_C: mass matrix about C, (6, 6) [kg, m].
        frequency_matrix_C: frequency matrix about C, (6, 6) [rad/s] (eq 4.8).
        natural_frequencies_hz: natural frequencies, ascending, (6,) [Hz].
        modal_screws_C: screws of the modes as columns in the order of the frequencies, of unit rotation, or of unit
            translation for a pure translation, (6, 6); a repeated frequency has an arbitrary basis of its modes.
        eigenstiffness, eigenpitch: eigenstiffnesses, ascending [N], and pitches of their eigenscrews [m], (6,).
        translational_stiffness, torsional_stiffness: stiffnesses of the compliant axes, ascending, (3,) [N/m],
            [N.m/rad].
        kappa, kappa_r, kappa_t: root mean squares of the eigenstiffnesses [N], torsional [N.m/rad] and translational
            stiffnesses [N/m].
        motor_angles: motor angles at the posture, 0 at the symmetric one, L1, R1, L2, R2, L3, R3, (6,) [rad].
        tube_slides, tube_angles: u_j [m] and phi_j [rad] at the posture, (3,).
        limb_lengths: lengths of the limbs, (3,) [m].
        jacobian: Jacobian from motor angles to the pose of S, (6, 6).
        attitude: rotation matrix of the posture, from platform axes to world axes, (3, 3).
        inertia_parameters_S: inertia of the platform with its payload about S, platform axes: m, m cx, m cy, m cz, Ixx,
            Ixy, Ixz, Iyy, Iyz, Izz, the last six being entries of the tensor, (10,) [kg], [kg.m], [kg.m2].

    Raises:
        ModelError: as `sdelta`.
    """
    one_of(level, ("rigid", "cartesian"), "sdelta: level")
    one_of(reference_point, ("S", "C"), "sdelta: reference_point")
    robot = _robot(posture, stiffness, payload)
    limbs = robot.kinematics.limbs
    is_rounding = np.abs(limbs.slide) < np.finfo(float).eps * limbs.length  # exactly 0 at the symmetric posture
    kinematic = {
        "motor_angles": robot.kinematics.motor_angles,
        "tube_slides": np.where(is_rounding, 0.0, limbs.slide),
        "tube_angles": robot.kinematics.limbs.angle,
        "limb_lengths": robot.kinematics.limbs.length,
        "jacobian": robot.kinematics.jacobian(),
        "attitude": posture.matrix,
        "inertia_parameters_S": with_payload(payload).parameters,
    }
    return kinematic if level == "rigid" else {**_elastic_numbers(robot), **kinematic}


def _elastic_numbers(robot: _Robot) -> dict[str, Any]:
    """Return the elastostatic and elastodynamic properties of the platform on its limbs."""
    to_C = shift(-robot.offset)
    K_S = to_C.T @ robot.K @ to_C
    screws = eigenscrews(K_S)
    translational, torsional = wrench_compliant_axes(K_S).stiffness, twist_compliant_axes(K_S).stiffness
    omega, shapes = modes(robot.M, robot.K)
    return {
        "stiffness_S": K_S,
        "stiffness_C": robot.K,
        "mass_C": robot.M,
        "frequency_matrix_C": frequency_matrix(robot.M, robot.K),
        "natural_frequencies_hz": omega / (2 * np.pi),
        "modal_screws_C": np.column_stack([unit_screw(h, PLATFORM_RADIUS) for h in shapes.T]),
        "eigenstiffness": screws.stiffness,
        "eigenpitch": screws.pitch,
        "translational_stiffness": translational,
        "torsional_stiffness": torsional,
        "kappa": rms(screws.stiffness),
        "kappa_t": rms(translational),
        "kappa_r": rms(torsional),
    }


def _robot(posture: Posture, preset: str, payload: Payload) -> _Robot:
    """Return the matrices of the robot at a posture, with a payload and a preset of stiffnesses."""
    springs = PRESETS[one_of(preset, PRESETS, "sdelta: stiffness")]
    kinematics, body = Kinematics.at(posture), with_payload(payload)
    Q = posture.matrix
    offset = Q @ body.center
    return _Robot(
        kinematics,
        offset,
        kinematics.rows(offset),
        limb_stiffness(kinematics, springs),
        body.matrix(Q),
        stiffness_matrix(kinematics, springs, offset),
    )


def _tubes(m: Model) -> _Tubes:
    """Declare the motion of the tubes as inputs."""
    along, about = "Slide of the tube from the posture along its side of the base", "Angle of the tube about its side"
    slide = m.input("drive[1..3].slide", "m", along, nominal=_MOVE[0])
    angle = m.input("drive[1..3].angle", "rad", f"{about} from the posture", nominal=_TURN[0])
    slide_rate = m.input("drive[1..3].slide_rate", "m/s", "Velocity of the tube", nominal=_MOVE[1])
    angle_rate = m.input("drive[1..3].angle_rate", "rad/s", "Angular velocity of the tube", nominal=_TURN[1])
    slide_acceleration = m.input(
        "drive[1..3].slide_acceleration", "m/s2", "Acceleration of the tube (level rigid)", nominal=_MOVE[2]
    )
    angle_acceleration = m.input(
        "drive[1..3].angle_acceleration", "rad/s2", "Angular acceleration of the tube (level rigid)", nominal=_TURN[2]
    )
    return _Tubes(
        by_drive(slide, angle),
        by_drive(slide_rate, angle_rate),
        by_drive(slide_acceleration, angle_acceleration),
    )


def _rigid(_m: Model, robot: _Robot, tubes: _Tubes, wrench: ca.SX, _damping_ratio: ca.SX) -> _Motion:
    """Return the motion of a platform that follows the tubes exactly, with the static forces of the limbs."""
    follow = ca.DM(robot.kinematics.tubes_to_pose(robot.offset))
    carry = ca.DM(np.linalg.inv(robot.N).T)
    return _Motion(follow @ tubes.deviation, follow @ tubes.rate, follow @ tubes.acceleration, carry @ wrench)


def _cartesian(m: Model, robot: _Robot, tubes: _Tubes, wrench: ca.SX, damping_ratio: ca.SX) -> _Motion:
    """Add the equations of a rigid platform on the springs at its joints, six degrees of freedom; return its motion."""
    rotation = m.state("center.rotation[1..3]", "rad", "Rotation of the platform from the posture", nominal=_TURN[0])
    position = m.state("center.position[1..3]", "m", "Displacement of C from the posture", nominal=_MOVE[0])
    angular_velocity = m.state(
        "center.angular_velocity[1..3]", "rad/s", "Angular velocity of the platform", nominal=_TURN[1]
    )
    velocity = m.state("center.velocity[1..3]", "m/s", "Velocity of C", nominal=_MOVE[1])
    x, v = ca.vertcat(rotation, position), ca.vertcat(angular_velocity, velocity)

    inverse = np.linalg.inv(robot.N)
    damping = damping_ratio * ca.DM(inverse.T @ modal_damping(robot.M, robot.K) @ inverse)
    N, L = ca.DM(robot.N), ca.DM(robot.kinematics.lever)
    forces = ca.DM(robot.K_D) * (N @ x - L * tubes.deviation) + damping @ (N @ v - L * tubes.rate)
    acceleration = ca.DM(np.linalg.inv(robot.M)) @ (wrench - N.T @ forces)
    m.der[x] = v
    m.der[v] = acceleration
    return _Motion(x, v, acceleration, forces)


def _outputs(m: Model, robot: _Robot, to_reference: ca.DM, motion: _Motion, wrench: ca.SX, point: str) -> None:
    """Declare the loads on the tubes, the motion of the platform and the wrench of the limbs on it as outputs.

    Motion and wrench of the limbs refer to the reference point; `wrench` is the applied one about C, weight included.
    """
    on_tube = ca.DM(robot.kinematics.lever) * motion.limb_forces
    m.output("drive[1..3].force", on_tube[0::2], "N", "Force on the tube, positive along +slide", nominal=_FORCE)
    m.output("drive[1..3].torque", on_tube[1::2], "N.m", "Torque on the tube, positive along +angle", nominal=_TORQUE)
    x, v, a = (to_reference @ column for column in motion[:3])
    m.output("platform.rotation[1..3]", x[:3], "rad", "Rotation vector from the posture, world axes", nominal=_TURN[0])
    m.output(
        "platform.position[1..3]", x[3:], "m", f"Displacement of {point} from the posture, world axes", nominal=_MOVE[0]
    )
    m.output("platform.angular_velocity[1..3]", v[:3], "rad/s", "Angular velocity", nominal=_TURN[1])
    m.output("platform.velocity[1..3]", v[3:], "m/s", f"Velocity of {point}", nominal=_MOVE[1])
    m.output("platform.angular_acceleration[1..3]", a[:3], "rad/s2", "Angular acceleration", nominal=_TURN[2])
    m.output("platform.acceleration[1..3]", a[3:], "m/s2", f"Acceleration of {point}", nominal=_MOVE[2])
    by_limbs = ca.inv(to_reference).T @ (ca.DM(robot.M) @ motion.acceleration - wrench)
    m.output(
        "limbs.torque[1..3]", by_limbs[:3], "N.m", f"Moment of the limbs on the platform about {point}", nominal=_TORQUE
    )
    m.output("limbs.force[1..3]", by_limbs[3:], "N", "Force of the limbs on the platform", nominal=_FORCE)
