"""Sampled position control with feedback of the velocity.

    command = limit( (proportional_gain (reference - position) - derivative_gain velocity) / MOTOR_CONSTANT )

Evaluated at each tick from the inputs before it and held until the next.

Bode plot, reference to command: flat at proportional_gain / MOTOR_CONSTANT from tick to tick.
"""

import casadi as ca

from hfsa.components import Model
from my_machine._sizes import MOTOR_CONSTANT


def position_controller() -> Model:
    """The computer that reads the stage and commands the coil."""
    m = Model("PositionController", "Sampled position control")
    m.sample_time(5e-4)
    kp = m.parameter("proportional_gain", 6e4, "N/m", "Force per position error", min=0)
    kd = m.parameter("derivative_gain", 400.0, "N.s/m", "Force per velocity", min=0)
    limit = m.parameter("limit", 5.0, "A", "Largest current either way", min=0)
    reference = m.input("reference", "m", "Wanted position", nominal=1e-4)
    position = m.input("position", "m", "Measured position", nominal=1e-4)
    velocity = m.input("velocity", "m/s", "Measured velocity", nominal=1e-2)
    wanted = (kp * (reference - position) - kd * velocity) / MOTOR_CONSTANT
    m.sampled_output("command", ca.fmax(-limit, ca.fmin(wanted, limit)), "A", "Commanded current")
    return m
