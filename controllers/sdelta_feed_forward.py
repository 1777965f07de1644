"""Feed-forward control of the SDelta: motion and torque of its motors for a commanded pose, by an inverse model.

The command is that of `sdelta_reference`, the deviation of S from the posture. With x the command at the centre of mass
C, x_n the rigid-body pose of the motor angles, and T, M_th, M, D, K as in `sdelta_computed_torque` and `sdelta`,

    rigid      x_n = x
    elastic    x_n = x + e,   D e' + K e = M x'' - w_g
    both       motor = T^-1 x_n,   torque = M_th motor'' + T^T (M x'' - w_g)

`elastic` is the inverse of the robot's level `cartesian`, weight and springs included: if the motors follow x_n, or
under collocated control with both outputs fed forward, the platform follows the command exactly. As the stiffness grows
it converges to `rigid`, with an error ~ 1 / stiffness. The inverse requires the third derivative of the command;
without damping it would require the fourth. Errors of its parameters, such as a wrong damping ratio, are not
compensated.

Ports: in `command.rotation` [rad], `.position` [m] with their `_rate`, `_acceleration` and `_jerk` (level elastic); out
`motor[i].angle` [rad] from the posture, `.angle_rate`, `.angle_acceleration`, `.torque` [N.m], ordered L1, R1, L2, R2,
L3, R3, and the poses `platform` (the command) and `nominal` (x_n) of S from the posture, with the ports of the robot's
`platform`. The FMU's constants `motor[i].angle_at_posture` are the motor angles at the posture.

Bode plot, command to nominal pose, symmetric posture, preset ch4: `rigid` 0 dB at all frequencies. `elastic` is the
inverse of the robot's response: 0 dB at low frequency, antiresonances at the resonances of the robot and resonances at
its antiresonances; vertical position -34 dB at 24.5 Hz and 20 dB per decade at high frequency.
"""

from typing import Literal, get_args

import casadi as ca
import numpy as np

from hfsa.components import Model
from hfsa.components._mechanics.modes import Damping, DampingOf, damping_rates, modes
from hfsa.components._mechanics.screws import shift
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
from hfsa.components._mechanics.sdelta_kinematics import declare_motor_constants
from hfsa.components._mechanics.sdelta_robot import THESIS_MACHINE, Machine, Robot
from hfsa.components._mechanics.sdelta_stiffness import PRESETS, Preset
from hfsa.components._modelling.facts import Known
from hfsa.components._modelling.model import one_of

FACTS = {
    POSTURE: Known("posture"),
    PAYLOAD: Known("payload"),
    GEOMETRY: Known("geometry"),
    LIMBS: Known("limbs"),
    PLATFORM: Known("platform"),
    GEAR: Known("gear"),
    PITCH: Known("pitch"),
    RODS: Known("rods", levels=("elastic",)),
    SHAFTS: Known("shafts", levels=("elastic",)),
    SPRINGS: Known("stiffness", levels=("elastic",)),
    DAMPING_MODEL: Known("damping_model", levels=("elastic",)),
    DAMPING_RATIO: Known("damping_ratio", levels=("elastic",)),
    GRAVITY: Known("gravity"),
}

_DERIVATIVES = (
    ("", "", "Commanded"),
    ("_rate", "/s", "First derivative of the commanded"),
    ("_acceleration", "/s2", "Second derivative of the commanded"),
    ("_jerk", "/s3", "Third derivative (level elastic) of the commanded"),
)
_MOTIONS = (
    (("rotation", "rad"), ("position", "m")),
    (("angular_velocity", "rad/s"), ("velocity", "m/s")),
    (("angular_acceleration", "rad/s2"), ("acceleration", "m/s2")),
)
_LEAST_DAMPING = 1e-5
_RADIANS_PER_SECOND = 100.0
"""Angular frequency of the motions that define the nominal values."""


def sdelta_feed_forward(
    *,
    level: Literal["rigid", "elastic"] = "elastic",
    posture: Posture = SYMMETRIC,
    stiffness: Preset = "ch4",
    payload: Payload = CUBE,
    machine: Machine = THESIS_MACHINE,
    damping_model: Damping = "modal",
) -> Model:
    """Return the feed-forward at one posture.

    Args:
        level: `rigid` (the robot as a rigid body) or `elastic` (on its springs).
        posture: origin of the command; rotation in degrees, position of S in metres.
        stiffness: preset of the robot; without effect at level `rigid`.
        payload: payload of the platform.
        machine: dimensions of the robot, the arguments `geometry`, `rods`, `shafts`, `platform`, `limbs`, `gear` and
            `pitch` (`_mechanics/sdelta_robot.py`). Rods and shafts are without effect at level `rigid`, shafts with
            presets that leave them out.
        damping_model: damping of the robot, `modal` or `rayleigh`; without effect at level `rigid`.

    Raises:
        ModelError: a singular posture; an unknown level or preset; dimensions that cannot be built.
    """
    levels = {"rigid": _rigid, "elastic": _elastic}
    one_of(level, levels, "sdelta_feed_forward: level")
    one_of(damping_model, get_args(Damping), "sdelta_feed_forward: damping_model")
    robot = Robot.at(posture, one_of(stiffness, PRESETS, "sdelta_feed_forward: stiffness"), payload, machine)
    m = Model("SDeltaFeedForward", "Commanded pose of the SDelta robot to motion and torque of its motors")
    damping_ratio = m.parameter(
        "damping_ratio", 0.01, "1", "Damping ratio of every mode (level elastic)", min=_LEAST_DAMPING
    )
    gravity = m.parameter("gravity", 0.0, "m/s2", "Gravitational acceleration along -Z")
    offset = robot.offset
    command = _command(m)
    to_C = ca.DM(shift(-offset))
    x = [to_C @ column for column in command]
    M, T = robot.mass, robot.kinematics.jacobian(offset)
    weight = ca.vertcat(0, 0, 0, 0, 0, -robot.body.mass * gravity)
    damping = DampingOf(damping_model, damping_ratio)
    deflections = levels[level](m, M, robot.stiffness, x, weight, damping)
    nominal = [motion + deflection for motion, deflection in zip(x, deflections, strict=False)]
    motors = [ca.DM(np.linalg.inv(T)) @ column for column in nominal]
    for order, ((suffix, per, _), column) in enumerate(zip(_DERIVATIVES, motors, strict=False)):
        size = 1e-2 * _RADIANS_PER_SECOND**order
        m.output(f"motor[1..6].angle{suffix}", column, f"rad{per}", "Motor angle from the posture", nominal=size)
    declare_motor_constants(m, robot.kinematics, "motor")
    torque = ca.DM(machine.drive_inertia) @ motors[2] + ca.DM(T.T) @ (ca.DM(M) @ x[2] - weight)
    m.output("motor[1..6].torque", torque, "N.m", "Motor torque", nominal=0.1)
    to_S = ca.DM(shift(offset))
    _pose(m, "platform", "Commanded", command)
    _pose(m, "nominal", "Nominal (rigid-body)", [to_S @ column for column in nominal])
    return m


def _command(m: Model) -> list[ca.SX]:
    """Declare the command and its derivatives, columns of six."""
    command = []
    for order, (suffix, per, word) in enumerate(_DERIVATIVES):
        size = _RADIANS_PER_SECOND**order
        turn, move = f"{word} rotation vector of the platform", f"{word} displacement of S"
        rotation = m.input(f"command.rotation{suffix}[1..3]", f"rad{per}", turn, nominal=1e-3 * size)
        position = m.input(f"command.position{suffix}[1..3]", f"m{per}", move, nominal=1e-4 * size)
        command.append(ca.vertcat(rotation, position))
    return command


def _rigid(
    _m: Model, _M: np.ndarray, _K: np.ndarray, _x: list[ca.SX], _weight: ca.SX, _damping: DampingOf
) -> list[ca.SX]:
    """Return the deflection of the springs and its derivatives, columns of six: zero for rigid springs."""
    return [ca.SX.zeros(6)] * 3


def _elastic(m: Model, M: np.ndarray, K: np.ndarray, x: list[ca.SX], weight: ca.SX, damping: DampingOf) -> list[ca.SX]:
    """Return the deflection of the springs and its derivatives, columns of six about C.

    The state is the lag of the deflection e behind its static value K^-1 (M x'' - w_g), e = static + lag, so that
    e' = -D^-1 K lag has no direct feedthrough. In co-simulation the inputs may be newer than the state by a step; with
    feedthrough, this difference would appear in e', multiplied by the fast rates of D^-1 K. With the modes H,
    H^T M H = 1 and H^T K H = diag(omega^2), D^-1 K = H diag(omega^2 / d) H^-1, with d = 2 zeta omega of modal damping.
    """
    rotation = m.state("lag.rotation[1..3]", "rad", "Rotation of the springs minus its static value", nominal=1e-6)
    position = m.state("lag.position[1..3]", "m", "Deflection of the springs at C minus its static value", nominal=1e-7)
    lag = ca.vertcat(rotation, position)
    omega, H = modes(M, K)
    decay = ca.DM(H * (omega**2 / damping_rates(omega, damping.model)) @ np.linalg.inv(H)) / damping.ratio
    compliance = ca.DM(np.linalg.inv(K))
    rate = -decay @ lag
    growth = rate - compliance @ ca.DM(M) @ x[3]
    m.der[lag] = growth
    return [compliance @ (ca.DM(M) @ x[2] - weight) + lag, rate, -decay @ growth]


def _pose(m: Model, terminal: str, word: str, motion: list[ca.SX]) -> None:
    """Declare pose, twist and acceleration of S as outputs, from columns of six."""
    for quantities, column in zip(_MOTIONS, motion, strict=False):
        for (name, unit), half in zip(quantities, ca.vertsplit(column, 3), strict=True):
            m.output(f"{terminal}.{name}[1..3]", half, unit, f"{word} {name.replace('_', ' ')} of S, world axes")
