"""Scales of recorded variables: their typical sizes; a run stops where a variable is a thousand times as large.

Each is the end of a travel, a force or a measuring range, so that no possible motion of a machine reaches the limit.
"""

ROTATION, POSITION = 0.1, 10e-3
"""Pose of the SDelta's platform [rad], [m]: 6 degrees and 10 mm, beyond the range of its linear model."""
ACCELERATION = 1e3
"""Acceleration of the SDelta's platform [m/s2]: 10 mm at 50 Hz."""

ELONGATION = 12e-6
"""Elongation of a stack on the piezo stage, and its tracking error [m]: the range of the stage."""
FORCE = 833.0
"""Force of a stack [N]: the blocking force at full voltage."""
VOLTAGE = 150.0
"""Voltage of a stack [V]: the full voltage."""
STRESS = 233e6
"""Stress in the hinges of the piezo stage [Pa]: the permissible stress."""
STAGE_POSITION, STAGE_ROTATION = 30e-6, 2e-3
"""Pose of the piezo stage's platform [m], [rad]: one stack at its full voltage, and all three at 12 um."""

READING = 1e4
"""Estimate of an accelerometer [m/s2]: the stiffest design shows 6.5e3 m/s2 at the end of its travel."""
READ_VOLTAGE = 5.0
"""Voltage of an accelerometer [V]: at the end of its travel."""

BEAM_POSITION, BEAM_ROTATION = 5e-3, 0.1
"""Pose of a platform on beams [m], [rad]: a tenth of the beam length of 50 mm, and the corresponding angle."""


def robot_pose() -> dict[str, float]:
    """Return the scale of the robot's pose."""
    return {"robot.platform.rotation[1..3]": ROTATION, "robot.platform.position[1..3]": POSITION}


def stage_pose() -> dict[str, float]:
    """Return the scale of the piezo stage's pose."""
    return {"stage.platform.position[1..2]": STAGE_POSITION, "stage.platform.rotation": STAGE_ROTATION}


def beam_pose(component: str) -> dict[str, float]:
    """Return the scale of the pose of a platform on beams."""
    return {
        f"{component}.platform.position[1..3]": BEAM_POSITION,
        f"{component}.platform.rotation[1..3]": BEAM_ROTATION,
    }


def readings() -> dict[str, float]:
    """Return the scale of the estimates of `sensor` and `ideal`, and of the voltage of `sensor`."""
    estimates = {f"{shown}.acceleration_estimate[1..2]": READING for shown in ("sensor", "ideal")}
    return {**estimates, "sensor.voltage[1..2]": READ_VOLTAGE}
