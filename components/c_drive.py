"""A C-drive of the SDelta: two motors on a right- and a left-hand screw slide a tube along its axis and turn it.

    [slide; angle] = J_C [theta_1; theta_2]     all zero at the posture (eq 3.13)
    J_C = [[p / (4 pi), -p / (4 pi)], [1 / (2 iota), 1 / (2 iota)]]

    ideal         the tube moves as commanded, the motors follow from it
    rigid_shaft   M_th thetadd = tau + J_C^T [F; T],   M_th = (J_m + J_psi) 1 + J_C^T diag(m_tube, I_tube) J_C

with motor torques tau and the force F and torque T that the robot exerts on the tube, positive along +slide and +angle.

Ports: in `motor[i].torque` [N.m], `tube.force` [N], `tube.torque` [N.m], and, used by `ideal` only, `command.slide`
[m], `.angle` [rad] with `_rate` and `_acceleration`; out `tube.slide`, `.angle` with `_rate` and `_acceleration`,
the encoder reading `motor[i].angle` [rad] and `motor[i].speed` [rad/s]. J_C is constant, so the drive is the same at
every posture; the constants `..._at_posture` of `sdelta` are its positions there.

The encoder rounds to `encoder.resolution`; 0 disables rounding. Its steps are fixed on the motor and count from the
symmetric posture, where all motor angles are zero; `encoder.offset[i]` is the angle at the posture,

    motor.angle = round((theta + offset) / resolution) resolution - offset

Without rounding the offset has no effect, and the angle keeps all its digits. With `encoder_noise` the encoder adds
white noise of standard deviation `encoder.noise`, a new value in each `encoder.interval`. The argument is structural:
without it the FMU does not evaluate the noise.

Bode plot, `rigid_shaft`, from equal torques on both motors to the angle of either: -40 dB per decade with -180 degrees,
1 / (M_th,11 + M_th,12) rad/s2 per N.m; for opposite torques 1 / (M_th,11 - M_th,12).

Source: Q. Sun, PhD thesis, McGill University, 2023, for J_C; catalogue of the manufacturer for the rotor inertia of the
motor named there; inertia of screws and tube assumed.
"""

from typing import Any, Literal

import casadi as ca
import numpy as np

from hfsa.components import Model
from hfsa.components._mechanics.sdelta_kinematics import DRIVE_MATRIX
from hfsa.components._modelling.model import one_of
from hfsa.components._modelling.noise import white_noise

ROTOR_INERTIA = 0.672e-4
"""J_m, inertia of the rotor of a motor Yaskawa SGMAH-08A [kg.m2] (manufacturer's catalogue)."""
SHAFT_INERTIA = 1.0e-4
"""J_psi, inertia of screw, half of the coupling and nut, on the shaft's angle [kg.m2] (assumed)."""
TUBE_MASS = 1.0
"""m_tube, mass of the tube [kg] (assumed)."""
TUBE_INERTIA = 3.0e-3
"""I_tube, inertia of the tube about the C axis [kg.m2] (assumed)."""

_ANGLE, _SPEED = 1e-2, 1.0
_DERIVATIVES = (("", ""), ("_rate", "/s"), ("_acceleration", "/s2"))


def inertia() -> np.ndarray:
    """Return M_th of one drive on its two motor angles, shape (2, 2) [kg.m2]."""
    tube = DRIVE_MATRIX.T @ np.diag([TUBE_MASS, TUBE_INERTIA]) @ DRIVE_MATRIX
    return (ROTOR_INERTIA + SHAFT_INERTIA) * np.eye(2) + tube


def c_drive(*, level: Literal["ideal", "rigid_shaft"] = "rigid_shaft", encoder_noise: bool = False) -> Model:
    """Return one C-drive, at rest at the posture at the start.

    Args:
        level: `ideal` (moves as commanded) or `rigid_shaft` (inertia of rotors, screws and tube).
        encoder_noise: whether the encoders add noise.

    Raises:
        ModelError: an unknown level.
    """
    levels = {"ideal": _ideal, "rigid_shaft": _rigid_shaft}
    one_of(level, levels, "c_drive: level")
    m = Model("CDrive", "C-drive: two motors slide and turn a tube")
    torque = m.input("motor[1..2].torque", "N.m", "Motor torque (level rigid_shaft)")
    load = ca.vertcat(
        m.input("tube.force", "N", "Force on the tube, positive along +slide (level rigid_shaft)"),
        m.input("tube.torque", "N.m", "Torque on the tube, positive along +angle (level rigid_shaft)"),
    )
    command = [
        ca.vertcat(
            m.input(f"command.slide{word}", f"m{per}", "Commanded slide (level ideal)", nominal=1e-4),
            m.input(f"command.angle{word}", f"rad{per}", "Commanded angle (level ideal)", nominal=1e-3),
        )
        for word, per in _DERIVATIVES
    ]
    motors = levels[level](m, command, torque, load)
    for (word, per), motor in zip(_DERIVATIVES, motors, strict=True):
        tube = ca.DM(DRIVE_MATRIX) @ motor
        m.output(f"tube.slide{word}", tube[0], f"m{per}", "Slide of the tube from the posture", nominal=1e-4)
        m.output(f"tube.angle{word}", tube[1], f"rad{per}", "Angle of the tube from the posture", nominal=1e-3)
    shown = motors[0] + _noise(m) if encoder_noise else motors[0]
    text = "Encoder reading of the motor angle from the posture"
    m.output("motor[1..2].angle", _rounded(m, shown), "rad", text, nominal=_ANGLE)
    m.output("motor[1..2].speed", motors[1], "rad/s", "Motor speed", nominal=_SPEED)
    return m


UNITS = {
    "jacobian": "m/rad; 1",
    "inertia": "kg.m2",
}
"""Units of the results of `analyze`, in the notation of `_modelling/parts.py`."""


def analyze() -> dict[str, Any]:
    """Return Jacobian and inertia of the drive in SI units.

    Returns:
        jacobian: J_C, motor angles to slide and angle, shape (2, 2) [m/rad, 1] (eq 3.13).
        inertia: M_th, shape (2, 2) [kg.m2].
    """
    return {"jacobian": DRIVE_MATRIX, "inertia": inertia()}


def _ideal(_m: Model, command: list[ca.SX], _torque: ca.SX, _load: ca.SX) -> list[ca.SX]:
    """Return the motors' angles, speeds and accelerations, columns of two, from the command."""
    to_motors = ca.DM(np.linalg.inv(DRIVE_MATRIX))
    return [to_motors @ column for column in command]


def _rigid_shaft(m: Model, _command: list[ca.SX], torque: ca.SX, load: ca.SX) -> list[ca.SX]:
    """Add the equations of motion; return the motors' angles, speeds and accelerations, columns of two."""
    angle = m.state("shaft[1..2].angle", "rad", "Motor angle from the posture", nominal=_ANGLE)
    speed = m.state("shaft[1..2].speed", "rad/s", "Motor speed", nominal=_SPEED)
    acceleration = ca.DM(np.linalg.inv(inertia())) @ (torque + ca.DM(DRIVE_MATRIX.T) @ load)
    m.der[angle] = speed
    m.der[speed] = acceleration
    return [angle, speed, acceleration]


def _noise(m: Model) -> ca.SX:
    """Return the noise of both encoders, a column of two [rad]."""
    deviation = m.parameter("encoder.noise", 1e-5, "rad", "Standard deviation of the encoder's noise", min=0)
    interval = m.parameter("encoder.interval", 1e-4, "s", "Time between two values of the noise", min=1e-9)
    seed = m.parameter("encoder.seed", 1.0, "1", "Seed of the noise, a whole number", min=0, max=2**25)
    return deviation * ca.vertcat(*[white_noise(m.time, interval, 2 * seed + i) for i in range(2)])


def _rounded(m: Model, angle: ca.SX) -> ca.SX:
    """Return the angles rounded to steps of the encoder, which are fixed on the motor."""
    resolution = m.parameter("encoder.resolution", 0.0, "rad", "Step of the encoder, 0 for none", min=0, nominal=1e-4)
    offset = m.parameter("encoder.offset[1..2]", 0.0, "rad", "Motor angle at the posture, from the encoder's zero")
    step = ca.if_else(resolution > 0, resolution, 1)
    return ca.if_else(resolution > 0, step * ca.floor((angle + offset) / step + 0.5) - offset, angle)
