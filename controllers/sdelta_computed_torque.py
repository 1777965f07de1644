"""Computed-torque control (CTC) of the SDelta's six motors by a rigid-body model, which ignores the springs.

    motor            theta''_c = theta''_d + Kv (theta'_d - theta') + Kp (theta_d - theta)
    encoder_pose     a_c = a_d + Kv (t_d - t) + Kp [log(Q_d Q^T); c_d - c],   Q, c, t from the encoders
    measured_pose    the same, Q, c, t measured at the platform
    all              tau = limit( M_th theta''_c + T^T (M a_c + [omega x I omega; 0] - w_g) + feed_forward ),
                     a_c = T theta''_c + T' theta'

with Q, c, t = [omega; v] and a of the centre of mass C, the inertia M_th of the motors, M = blkdiag(I, m 1) of the
platform, and T from the rates of the motors to the twist. The model `exact` evaluates all terms at the present pose.
The model `linear` has T, M and I of the posture and omits omega x I omega and T' theta', which are of second order in
the motion. With the model `linear`, `motor` and `encoder_pose` are the same law.

On a rigid robot the error obeys e'' + Kv e' + Kp e = 0. On an elastic robot the encoders are collocated with the
motors, and the continuous loop without delay is stable for every bandwidth. The measured pose is not collocated: at the
symmetric posture with 1 % damping the loop is stable up to a bandwidth of 1.34 Hz. The default gains are those of a
bandwidth of 6 Hz and a damping ratio of 0.7.

    continuous    static map with direct feedthrough
    sampled       evaluated at each tick from the inputs before it and held until the next; with `delay` one tick later;
                  converges to `continuous` as the sample time goes to 0, at first order

Ports: `motor` in `axis[i].reference` [rad], `.reference_rate`, `.reference_acceleration`; the others in
`reference.rotation` [rad], `.position` [m], `.angular_velocity`, `.velocity`, `.angular_acceleration`, `.acceleration`
of S from the posture, world axes, as the robot's `platform`. `motor` and `encoder_pose` in `axis[i].measured` [rad],
`.measured_rate`; `measured_pose` in `measured.rotation`, `.position`, `.angular_velocity`, `.velocity`. All in
`axis[i].feed_forward` [N.m], an alternative to the acceleration of the reference; out `axis[i].command` [N.m] and
`axis[i].saturation`, 1 while the limit acts. Motors are ordered L1, R1, L2, R2, L3, R3. Angles and poses count from the
posture; the FMU's constants `axis[i].angle_at_posture` are the motor angles there.

`exact` computes every difference from small numbers (`_sdelta_inverse.py`): without gravity the relative error of its
command is some 1e-13 for motions of 1 pm as for 1 mm; with gravity the rounding error of the holding torque is some
1e-14 N.m.

Bode plot about rest at the posture, below the limit, `motor`: measured to command flat at -Kp M_rb, measured rate to
command flat at -Kv M_rb, M_rb = M_th + T^T M T; at level `sampled` from tick to tick, `delay` and hold as in `pd`.
"""

from typing import Literal

import casadi as ca
import numpy as np

from hfsa.components import Model
from hfsa.components._mechanics.sdelta_facts import GEAR, GEOMETRY, GRAVITY, LIMBS, PAYLOAD, PITCH, PLATFORM, POSTURE
from hfsa.components._mechanics.sdelta_geometry import SYMMETRIC, Posture
from hfsa.components._mechanics.sdelta_inertia import CUBE, THESIS_PLATFORM, Payload, Platform
from hfsa.components._mechanics.sdelta_kinematics import THESIS, Mechanism, declare_motor_constants
from hfsa.components._mechanics.sdelta_limbs import THESIS_LIMBS, LimbInertia
from hfsa.components._mechanics.sdelta_robot import Machine
from hfsa.components._modelling.facts import Known
from hfsa.components._modelling.model import one_of
from hfsa.controllers._command import Level, execution
from hfsa.controllers._sdelta_inverse import Motion, Robot, RobotModel, robot

FACTS = {
    POSTURE: Known("posture"),
    PAYLOAD: Known("payload"),
    GEOMETRY: Known("geometry"),
    LIMBS: Known("limbs"),
    PLATFORM: Known("platform"),
    GEAR: Known("gear"),
    PITCH: Known("pitch"),
    GRAVITY: Known("gravity", unfed="axis[1].feed_forward"),  # the feed-forward torque includes the weight
}

_BANDWIDTH, _DAMPING = 2 * np.pi * 6, 0.7
_AXES = "axis[1..6]"


def sdelta_computed_torque(
    *,
    level: Level = "sampled",
    feedback: Literal["motor", "encoder_pose", "measured_pose"] = "motor",
    model: RobotModel = "linear",
    posture: Posture = SYMMETRIC,
    payload: Payload = CUBE,
    delay: bool = False,
    mechanism: Mechanism = THESIS,
    limbs: LimbInertia = THESIS_LIMBS,
    platform: Platform = THESIS_PLATFORM,
) -> Model:
    """Return one controller for the six motors.

    Args:
        level: `continuous` or `sampled`.
        feedback: `motor` (errors of the motors), `encoder_pose` (error of the pose, by direct kinematics of the motors)
            or `measured_pose` (error of the measured pose).
        model: model of the robot, `linear` about the posture or `exact`.
        posture: posture of the robot; rotation in degrees, position of S in metres.
        payload: payload of the platform.
        delay: whether the command is delayed by one sample time; at level `sampled` only.
        mechanism: `geometry`, circumradii of the triangles of base and platform [m], `gear`, motor turns per turn of a
            tube, and `pitch`, travel of a nut per turn of its motor [m].
        limbs: inertia of rotors, screws and tubes.
        platform: mass [kg] and moments of inertia [kg.m2] of the platform without payload.

    Raises:
        ModelError: a singular posture; an unknown level, feedback or model; a delay at level `continuous`.
    """
    laws = {"motor": _motor, "encoder_pose": _encoder_pose, "measured_pose": _measured_pose}
    one_of(feedback, laws, "sdelta_computed_torque: feedback")
    m = Model("SDeltaComputedTorque", "Computed-torque controller of the SDelta robot")
    executed = execution(m, "sdelta_computed_torque", level, 0.25e-3, delay)
    kp = m.parameter("proportional_gain", _BANDWIDTH**2, "1/s2", "Gain Kp", min=0, nominal=1e3)
    kv = m.parameter("derivative_gain", 2 * _DAMPING * _BANDWIDTH, "1/s", "Gain Kv", min=0, nominal=10.0)
    gravity = m.parameter("gravity", 0.0, "m/s2", "Gravitational acceleration along -Z, compensated")
    limit = m.parameter(f"{_AXES}.limit", 1e9, "N.m", "Largest command either way", min=0, nominal=1.0)
    feed_forward = m.input(f"{_AXES}.feed_forward", "N.m", "Added to the command before the limit")
    machine = Machine(mechanism, platform=platform, limbs=limbs)
    rigid = robot(model, posture, payload, machine, "sdelta_computed_torque")
    declare_motor_constants(m, rigid.kinematics, "axis")
    motion, motors, acceleration = laws[feedback](m, rigid, kp, kv)
    wanted = feed_forward + rigid.torques(motion, motors, acceleration, gravity)
    executed.output_command(_AXES, wanted, limit, "N.m", "Motor torque")
    return m


def _motor(m: Model, rigid: Robot, kp: ca.SX, kv: ca.SX) -> tuple[Motion, ca.SX, ca.SX]:
    """Return the motion, and the commanded accelerations of the motors and of C, by errors of the motors."""
    reference = m.input(f"{_AXES}.reference", "rad", "Reference angle from the posture", nominal=1e-2)
    reference_rate = m.input(f"{_AXES}.reference_rate", "rad/s", "Rate of the reference")
    reference_acceleration = m.input(f"{_AXES}.reference_acceleration", "rad/s2", "Acceleration of the reference")
    measured, measured_rate = _encoders(m)
    motors = reference_acceleration + kv * (reference_rate - measured_rate) + kp * (reference - measured)
    motion = rigid.at_motors(measured, measured_rate)
    return motion, motors, rigid.platform_of(motion, motors)


def _encoder_pose(m: Model, rigid: Robot, kp: ca.SX, kv: ca.SX) -> tuple[Motion, ca.SX, ca.SX]:
    """Return the motion, and the commanded accelerations of the motors and of C, by the pose from the encoders."""
    return _of_pose(m, rigid, kp, kv, rigid.at_motors(*_encoders(m)))


def _measured_pose(m: Model, rigid: Robot, kp: ca.SX, kv: ca.SX) -> tuple[Motion, ca.SX, ca.SX]:
    """Return the motion, and the commanded accelerations of the motors and of C, by the measured pose."""
    displacement, twist = _pose(m, "measured", "Measured")
    return _of_pose(m, rigid, kp, kv, rigid.at_platform(displacement, twist))


def _of_pose(m: Model, rigid: Robot, kp: ca.SX, kv: ca.SX, motion: Motion) -> tuple[Motion, ca.SX, ca.SX]:
    """Return a motion, and the commanded accelerations of the motors and of C there, columns of six."""
    wanted = rigid.at_platform(*_pose(m, "reference", "Reference"))
    reference_acceleration = ca.vertcat(
        m.input("reference.angular_acceleration[1..3]", "rad/s2", "Reference angular acceleration"),
        m.input("reference.acceleration[1..3]", "m/s2", "Reference acceleration of S"),
    )
    demanded = rigid.acceleration(wanted, reference_acceleration)
    acceleration = demanded + kv * (wanted.twist - motion.twist) + kp * rigid.error(wanted, motion)
    return motion, rigid.motors_of(motion, acceleration), acceleration


def _encoders(m: Model) -> tuple[ca.SX, ca.SX]:
    """Declare the inputs from the encoders; return angles and rates, columns of six."""
    return (
        m.input(f"{_AXES}.measured", "rad", "Motor angle from the posture", nominal=1e-2),
        m.input(f"{_AXES}.measured_rate", "rad/s", "Motor speed"),
    )


def _pose(m: Model, terminal: str, word: str) -> tuple[ca.SX, ca.SX]:
    """Declare inputs for a pose of S from the posture and its twist; return both, columns of six."""
    displacement = ca.vertcat(
        m.input(f"{terminal}.rotation[1..3]", "rad", f"{word} rotation vector from the posture", nominal=1e-3),
        m.input(f"{terminal}.position[1..3]", "m", f"{word} displacement of S from the posture", nominal=1e-4),
    )
    twist = ca.vertcat(
        m.input(f"{terminal}.angular_velocity[1..3]", "rad/s", f"{word} angular velocity"),
        m.input(f"{terminal}.velocity[1..3]", "m/s", f"{word} velocity of S"),
    )
    return displacement, twist
