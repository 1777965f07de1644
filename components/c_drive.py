"""A C-drive of the SDelta: two motors on a right- and a left-hand screw slide a tube along its axis and turn it.

    [slide; angle] = J_C [theta_1; theta_2]     all zero at the posture (eq 3.13)
    J_C = [[p / (4 pi), -p / (4 pi)], [1 / (2 iota), 1 / (2 iota)]]

    ideal             the tube moves as commanded, the motors follow from it
    rotor             J_m thetadd = tau + J_C^T [F; T]
    rigid_shaft       M_th thetadd = tau + J_C^T [F; T],   M_th = (J_m + J_psi) 1 + J_C^T diag(m_tube, I_tube) J_C
    compliant_shaft   J_m thetadd = tau - s,   (M_th - J_m 1) sigmadd = s + J_C^T [F; T],
                      s = k_s (theta - sigma) + d_s (thetad - sigmad),   [slide; angle] = J_C sigma

with motor torques tau and the force F and torque T that the robot exerts on the tube, positive along +slide and +angle.
The shafts have the damping ratio zeta_s, d_s = 2 zeta_s sqrt(k_s J), with the rotor's inertia in series with the mean
one of a screw as J. `compliant_shaft` converges to `rigid_shaft` as k_s grows, with an error ~ 1 / k_s. `rotor` leaves
screw, tube and shaft to the robot at its level `generalized`.

Ports: in `motor[i].torque` [N.m], `tube.force` [N], `tube.torque` [N.m], and, used by `ideal` only, `command.slide`
[m], `.angle` [rad] with `_rate` and `_acceleration`; out `tube.slide`, `.angle` with `_rate` and `_acceleration`,
the encoder reading `motor[i].angle` [rad], `motor[i].speed` [rad/s], and `motor[i].required_torque` [N.m], the torque
that the motion takes: at `ideal` M_th thetadd - J_C^T [F; T], elsewhere that of the motors. J_C is constant, so the
drive is the same at every posture; the constants `..._at_posture` of `sdelta` are its positions there.

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

from typing import Any, Literal, NamedTuple

import casadi as ca
import numpy as np

from hfsa.components import Model
from hfsa.components._mechanics.sdelta_facts import GEAR, LIMBS, PITCH, SHAFTS
from hfsa.components._mechanics.sdelta_kinematics import THESIS_TRANSMISSION, Transmission
from hfsa.components._mechanics.sdelta_limbs import THESIS_LIMBS, LimbInertia
from hfsa.components._mechanics.sdelta_stiffness import RODS_ONLY, THESIS_SHAFTS, Shafts
from hfsa.components._modelling.facts import Known
from hfsa.components._modelling.joins import Join
from hfsa.components._modelling.model import ModelError, one_of
from hfsa.components._modelling.noise import white_noise
from hfsa.components._modelling.rounding import rounded

FACTS = {
    GEAR: Known("gear"),
    PITCH: Known("pitch"),
    LIMBS: Known("limbs"),
    SHAFTS: Known("shafts", levels=("compliant_shaft",)),
}

JOINS = (
    Join(
        "rotor",
        "tube.",
        {"sdelta": ("generalized",)},
        "it has no screw and no tube, which level generalized of the robot has",
    ),
    Join(
        "compliant_shaft",
        "tube.",
        {"sdelta": ("rigid", "cartesian", "nonlinear")},
        "its shafts would count twice",
        {"stiffness": RODS_ONLY},
    ),
)

_ANGLE, _SPEED, _TWIST = 1e-2, 1.0, 1e-5
_DERIVATIVES = (("", ""), ("_rate", "/s"), ("_acceleration", "/s2"))


class _Drive(NamedTuple):
    """What the levels are built from: J_C, M_th, J_m [kg.m2] and k_s [N.m/rad]."""

    J_C: np.ndarray
    inertia: np.ndarray
    rotor: float
    shaft: float


class _Motion(NamedTuple):
    """Angles, speeds and accelerations of the motors, those of the screws, and the motors' torques, columns of two."""

    motors: list[ca.SX]
    screws: list[ca.SX]
    torque: ca.SX


def c_drive(
    *,
    level: Literal["ideal", "rotor", "rigid_shaft", "compliant_shaft"] = "rigid_shaft",
    encoder_noise: bool = False,
    transmission: Transmission = THESIS_TRANSMISSION,
    limbs: LimbInertia = THESIS_LIMBS,
    shafts: Shafts = THESIS_SHAFTS,
) -> Model:
    """Return one C-drive, at rest at the posture at the start.

    Args:
        level: `ideal` (moves as commanded), `rotor` (inertia of the rotors alone), `rigid_shaft` (inertia of rotors,
            screws and tube) or `compliant_shaft` (the same, on shafts that twist).
        encoder_noise: whether the encoders add noise.
        transmission: `gear`, motor turns per turn of the tube, and `pitch`, travel of a nut per turn of its motor [m].
        limbs: inertia of rotors, screws and tube.
        shafts: dimensions and material of the shafts; of effect at level `compliant_shaft`.

    Raises:
        ModelError: an unknown level; a dimension that is not above 0; screws and tube without inertia at level
            `compliant_shaft`.
    """
    levels = {"ideal": _ideal, "rotor": _rotor, "rigid_shaft": _rigid_shaft, "compliant_shaft": _compliant_shaft}
    one_of(level, levels, "c_drive: level")
    drive = _Drive(transmission.matrix, limbs.on_motors(transmission), limbs.rotor_inertia, shafts.stiffness)
    m = Model("CDrive", "C-drive: two motors slide and turn a tube")
    torque = m.input("motor[1..2].torque", "N.m", "Motor torque (all levels but ideal)")
    load = ca.vertcat(
        m.input("tube.force", "N", "Force on the tube, positive along +slide (all levels but ideal)"),
        m.input("tube.torque", "N.m", "Torque on the tube, positive along +angle (all levels but ideal)"),
    )
    command = [
        ca.vertcat(
            m.input(f"command.slide{word}", f"m{per}", "Commanded slide (level ideal)", nominal=1e-4),
            m.input(f"command.angle{word}", f"rad{per}", "Commanded angle (level ideal)", nominal=1e-3),
        )
        for word, per in _DERIVATIVES
    ]
    motors, screws, taken = levels[level](m, drive, command, torque, load)
    for (word, per), screw in zip(_DERIVATIVES, screws, strict=True):
        tube = ca.DM(drive.J_C) @ screw
        m.output(f"tube.slide{word}", tube[0], f"m{per}", "Slide of the tube from the posture", nominal=1e-4)
        m.output(f"tube.angle{word}", tube[1], f"rad{per}", "Angle of the tube from the posture", nominal=1e-3)
    shown = motors[0] + _noise(m) if encoder_noise else motors[0]
    text = "Encoder reading of the motor angle from the posture"
    m.output("motor[1..2].angle", _rounded(m, shown), "rad", text, nominal=_ANGLE)
    m.output("motor[1..2].speed", motors[1], "rad/s", "Motor speed", nominal=_SPEED)
    m.output("motor[1..2].required_torque", taken, "N.m", "Torque that the motion takes", nominal=0.1)
    return m


UNITS = {
    "jacobian": "m/rad; 1",
    "inertia": "kg.m2",
    "shaft_stiffness": "N.m/rad",
    "slide_stiffness": "N/m",
    "angle_stiffness": "N.m/rad",
    "shaft_frequencies_hz": "Hz",
}
"""Units of the results of `analyze`, in the notation of `_modelling/parts.py`."""


def analyze(
    *,
    transmission: Transmission = THESIS_TRANSMISSION,
    limbs: LimbInertia = THESIS_LIMBS,
    shafts: Shafts = THESIS_SHAFTS,
) -> dict[str, Any]:
    """Return Jacobian, inertia and shafts of the drive in SI units; the arguments are those of `c_drive`.

    Returns:
        jacobian: J_C, motor angles to slide and angle, shape (2, 2) [m/rad, 1] (eq 3.13).
        inertia: M_th, shape (2, 2) [kg.m2].
        shaft_stiffness: k_s, shaft and coupling in series [N.m/rad] (eq 3.53).
        slide_stiffness: k'_s, the shafts on the slide of the tube [N/m] (eq 3.26c).
        angle_stiffness: the shafts on the angle of the tube, l_j^2 k''_s [N.m/rad] (eq 3.26c).
        shaft_frequencies_hz: natural frequencies of the free drive on its shafts, ascending, (2,) [Hz].
    """
    J_C, inertia = transmission.matrix, limbs.on_motors(transmission)
    slide, angle = shafts.stiffness / (J_C**2).sum(axis=1)
    found = {
        "jacobian": J_C,
        "inertia": inertia,
        "shaft_stiffness": shafts.stiffness,
        "slide_stiffness": slide,
        "angle_stiffness": angle,
    }
    far = np.linalg.eigvalsh(inertia - limbs.rotor_inertia * np.eye(2))[::-1]
    with np.errstate(divide="ignore"):
        found["shaft_frequencies_hz"] = np.sqrt(shafts.stiffness * (1 / limbs.rotor_inertia + 1 / far)) / (2 * np.pi)
    return found


def _ideal(_m: Model, drive: _Drive, command: list[ca.SX], _torque: ca.SX, load: ca.SX) -> _Motion:
    """Return the motion that is commanded."""
    to_motors = ca.DM(np.linalg.inv(drive.J_C))
    motors = [to_motors @ column for column in command]
    return _Motion(motors, motors, ca.DM(drive.inertia) @ motors[2] - ca.DM(drive.J_C.T) @ load)


def _rotor(m: Model, drive: _Drive, _command: list[ca.SX], torque: ca.SX, load: ca.SX) -> _Motion:
    """Add the equations of motion of the rotors; return their motion."""
    motors = _moved(m, drive.rotor * np.eye(2), torque + ca.DM(drive.J_C.T) @ load)
    return _Motion(motors, motors, torque)


def _rigid_shaft(m: Model, drive: _Drive, _command: list[ca.SX], torque: ca.SX, load: ca.SX) -> _Motion:
    """Add the equations of motion of rotors, screws and tube; return their motion."""
    motors = _moved(m, drive.inertia, torque + ca.DM(drive.J_C.T) @ load)
    return _Motion(motors, motors, torque)


def _compliant_shaft(m: Model, drive: _Drive, _command: list[ca.SX], torque: ca.SX, load: ca.SX) -> _Motion:
    """Add the equations of motion of the rotors, and of screws and tube behind the shafts; return their motion.

    The twist of the shafts, not the angle of the screws, is a state, so that stiff shafts keep all digits.
    """
    far = drive.inertia - drive.rotor * np.eye(2)
    lowest = float(np.linalg.eigvalsh(far)[0])
    if not lowest > 0:
        raise ModelError(
            "c_drive: level compliant_shaft needs limbs.screw_inertia above 0, or both tube_mass and tube_inertia"
        )
    ratio = m.parameter("shaft.damping_ratio", 0.01, "1", "Damping ratio of the shafts (level compliant_shaft)", min=0)
    twist = m.state("shaft[1..2].twist", "rad", "Twist of the shaft, motor minus screw", nominal=_TWIST)
    twist_rate = m.state("shaft[1..2].twist_rate", "rad/s", "Rate of the twist", nominal=_TWIST / _ANGLE * _SPEED)
    series = 1 / (1 / drive.rotor + 1 / np.mean(np.diag(far)))
    through = drive.shaft * twist + ratio * (2 * np.sqrt(drive.shaft * series)) * twist_rate
    motors = _moved(m, drive.rotor * np.eye(2), torque - through)
    screws = ca.DM(np.linalg.inv(far)) @ (through + ca.DM(drive.J_C.T) @ load)
    m.der[twist] = twist_rate
    m.der[twist_rate] = motors[2] - screws
    return _Motion(motors, [motors[0] - twist, motors[1] - twist_rate, screws], torque)


def _moved(m: Model, inertia: np.ndarray, torque: ca.SX) -> list[ca.SX]:
    """Declare motor angles and speeds as states; return angles, speeds and accelerations, columns of two."""
    angle = m.state("shaft[1..2].angle", "rad", "Motor angle from the posture", nominal=_ANGLE)
    speed = m.state("shaft[1..2].speed", "rad/s", "Motor speed", nominal=_SPEED)
    acceleration = ca.DM(np.linalg.inv(inertia)) @ torque
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
    return ca.if_else(resolution > 0, rounded(angle + offset, resolution) - offset, angle)
