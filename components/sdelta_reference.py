"""Reference of the SDelta robot: a commanded pose of the platform becomes the motion of tubes and motors.

The command is the deviation of S from the posture: a rotation vector and a displacement along world axes, each with its
first and second derivative, command = [rotation; position].

    linear   [slide; angle] = [u_0; phi_0] + L^-1 N command
    exact    [slide; angle] = inverse kinematics of the attitude exp(rotation) Q_0 and the position a_0 + position
    both     motor = J_C^-1 [slide - u_sym; angle - phi_sym], so that `linear` has motor = theta_0 + T^-1 command

Tubes are absolute as in `sdelta`; the motors, in the order L1, R1, L2, R2, L3, R3, are zero at the symmetric posture.
Rates and accelerations are the exact derivatives. The robot's level `cartesian` pairs with `linear`: in front of a
linear robot the exact reference invents harmonics.

Bode plot: flat without phase, each output at its entry of L^-1 N or T^-1, from a command to its tube or motor, from its
rate to their rates and from its acceleration to their accelerations; nothing else passes. `exact` has the same about
its posture at rest.
"""

from typing import Literal

import casadi as ca
import numpy as np

from hfsa.components._facts import Known
from hfsa.components._model import Model, one_of
from hfsa.components._screws import exponential
from hfsa.components._sdelta_facts import POSTURE
from hfsa.components._sdelta_geometry import SYMMETRIC, Posture, inverse_kinematics
from hfsa.components._sdelta_kinematics import DRIVES_MATRIX, HOME, Kinematics, by_drive

FACTS = {POSTURE: Known("posture")}

_DERIVATIVES = (
    ("", "", "Commanded"),
    ("_rate", "/s", "First derivative of the commanded"),
    ("_acceleration", "/s2", "Second derivative of the commanded"),
)


def sdelta_reference(*, level: Literal["linear", "exact"] = "linear", posture: Posture = SYMMETRIC) -> Model:
    """The reference at one posture.

    Args:
        level: `linear` (about the posture) or `exact` (inverse kinematics).
        posture: where the command counts from; rotation in degrees, position of S in metres.

    Raises:
        ModelError: a singular posture, with its condition number; an unknown level.
    """
    levels = {"linear": _linear, "exact": _exact}
    one_of(level, levels, "sdelta_reference: level")
    m = Model("SDeltaReference", "Commanded pose of the SDelta robot to motion of its tubes and motors")
    command, rate, acceleration = (
        ca.vertcat(
            m.input(
                f"command.rotation{suffix}[1..3]", f"rad{per}", f"{word} rotation vector of the platform", nominal=1e-3
            ),
            m.input(f"command.position{suffix}[1..3]", f"m{per}", f"{word} displacement of S", nominal=1e-4),
        )
        for suffix, per, word in _DERIVATIVES
    )
    kinematics = Kinematics.at(posture)
    tubes = levels[level](kinematics, command)
    tubes_rate = ca.jtimes(tubes, command, rate)
    tubes_acceleration = ca.jtimes(tubes, command, acceleration) + ca.jtimes(tubes_rate, command, rate)
    home = by_drive(HOME.slide, HOME.angle)
    to_motors = ca.DM(np.linalg.inv(DRIVES_MATRIX))
    columns = (tubes, tubes_rate, tubes_acceleration)
    for (suffix, per, _), column in zip(_DERIVATIVES, columns, strict=True):
        m.output(f"drive[1..3].slide{suffix}", column[0::2], f"m{per}", "Slide of the tube", nominal=1e-4)
        m.output(f"drive[1..3].angle{suffix}", column[1::2], f"rad{per}", "Angle of the tube", nominal=1e-3)
        motors = to_motors @ (column - home if column is tubes else column)
        m.output(f"motor[1..6].angle{suffix}", motors, f"rad{per}", "Motor angle", nominal=1e-2)
    return m


def _linear(kinematics: Kinematics, command: ca.SX) -> ca.SX:
    """Return the tubes by the kinematics' first order about the posture, shape (6, 1)."""
    at = kinematics.limbs
    return by_drive(at.slide, at.angle) + ca.DM(kinematics.rows() / kinematics.lever[:, None]) @ command


def _exact(kinematics: Kinematics, command: ca.SX) -> ca.SX:
    """Return the tubes by inverse kinematics, shape (6, 1)."""
    Q, a = exponential(command[:3]) @ ca.SX(kinematics.Q), ca.SX(kinematics.position) + command[3:]
    slide, _, angle = inverse_kinematics(Q, a, near=kinematics.limbs.angle)
    return by_drive(slide, angle)
