"""Reference motion of the SDelta robot: motion of tubes and motors for a commanded pose of the platform.

The command is the deviation of S from the posture: a rotation vector and a displacement along world axes, each with its
first and second derivative, command = [rotation; position].

    linear   [slide; angle] = L^-1 N command
    exact    [slide; angle] = inverse kinematics of the attitude exp(rotation) Q_0 and the position a_0 + position,
                              minus that of Q_0 and a_0
    both     motor = J_C^-1 [slide; angle], so that `linear` has motor = T^-1 command

Tubes and motors, in the order L1, R1, L2, R2, L3, R3, count from the posture as the command does: all are zero there.
The FMU's constants `drive[j].slide_at_posture`, `.angle_at_posture` and `motor[i].angle_at_posture` are their absolute
values at the posture. The difference in `exact` is computed in closed form (`_mechanics/sdelta_geometry.py`): the
relative error of a command of 1 pm is that of one of 1 mm, some 1e-15 of the largest tube or motor.

Rates and accelerations are the exact derivatives. `linear` fits the robot's level `cartesian`: the exact reference
would excite a linear robot with harmonics.

Bode plot: flat without phase, with the entries of L^-1 N or T^-1, from a command to tubes or motors, from its rate to
their rates and from its acceleration to their accelerations; all other responses are 0. `exact` has the same plot about
its posture at rest.
"""

from typing import Literal

import casadi as ca
import numpy as np

from hfsa.components import Model
from hfsa.components._mechanics.screws import expm1
from hfsa.components._mechanics.sdelta_facts import GEAR, GEOMETRY, PITCH, POSTURE
from hfsa.components._mechanics.sdelta_geometry import SYMMETRIC, Posture, tube_motion
from hfsa.components._mechanics.sdelta_kinematics import (
    THESIS,
    Kinematics,
    Mechanism,
    by_drive,
    declare_motor_constants,
    declare_tube_constants,
)
from hfsa.components._modelling.facts import Known
from hfsa.components._modelling.model import one_of

FACTS = {POSTURE: Known("posture"), GEOMETRY: Known("geometry"), GEAR: Known("gear"), PITCH: Known("pitch")}

_DERIVATIVES = (
    ("", "", "Commanded"),
    ("_rate", "/s", "First derivative of the commanded"),
    ("_acceleration", "/s2", "Second derivative of the commanded"),
)


def sdelta_reference(
    *,
    level: Literal["linear", "exact"] = "linear",
    posture: Posture = SYMMETRIC,
    mechanism: Mechanism = THESIS,
) -> Model:
    """Return the reference at one posture.

    Args:
        level: `linear` (about the posture) or `exact` (inverse kinematics).
        posture: origin of the command; rotation in degrees, position of S in metres.
        mechanism: `geometry`, circumradii of the triangles of base and platform [m], `gear`, motor turns per turn of a
            tube, and `pitch`, travel of a nut per turn of its motor [m].

    Raises:
        ModelError: a singular posture, with its condition number; an unknown level; a dimension that is not above 0.
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
    kinematics = Kinematics.at(posture, mechanism)
    tubes = levels[level](kinematics, command)
    tubes_rate = ca.jtimes(tubes, command, rate)
    tubes_acceleration = ca.jtimes(tubes, command, acceleration) + ca.jtimes(tubes_rate, command, rate)
    declare_tube_constants(m, kinematics)
    declare_motor_constants(m, kinematics, "motor")
    m.output("platform.rotation[1..3]", command[:3], "rad", "Commanded rotation vector", nominal=1e-3)
    m.output("platform.position[1..3]", command[3:], "m", "Commanded displacement of S", nominal=1e-4)
    to_motors = ca.DM(np.linalg.inv(kinematics.mechanism.drives_matrix))
    columns = (tubes, tubes_rate, tubes_acceleration)
    for (suffix, per, _), column in zip(_DERIVATIVES, columns, strict=True):
        slide, angle, motors = column[0::2], column[1::2], to_motors @ column
        m.output(f"drive[1..3].slide{suffix}", slide, f"m{per}", "Slide of the tube from the posture", nominal=1e-4)
        m.output(f"drive[1..3].angle{suffix}", angle, f"rad{per}", "Angle of the tube from the posture", nominal=1e-3)
        m.output(f"motor[1..6].angle{suffix}", motors, f"rad{per}", "Motor angle from the posture", nominal=1e-2)
    return m


def _linear(kinematics: Kinematics, command: ca.SX) -> ca.SX:
    """Return the positions of the tubes by the first-order kinematics about the posture, shape (6, 1)."""
    return ca.DM(kinematics.rows() / kinematics.lever[:, None]) @ command


def _exact(kinematics: Kinematics, command: ca.SX) -> ca.SX:
    """Return the positions of the tubes by inverse kinematics, shape (6, 1)."""
    return by_drive(
        *tube_motion(kinematics.mechanism.geometry, kinematics.Q, kinematics.position, expm1(command[:3]), command[3:])
    )
