"""Scales of what scenes record: how large it is in use, and why; a run stops where it is a thousand times as large.

Each is the end of a travel, of a force or of a reading, so that no motion a machine can make comes near the limit.
"""

ROTATION, POSITION = 0.1, 10e-3
"""Of the SDelta's platform [rad], [m]: 6 degrees and 10 mm, more than its linear model is good for."""
ACCELERATION = 1e3
"""Of the SDelta's platform [m/s2]: 10 mm at 50 Hz."""

ELONGATION = 12e-6
"""Of a stack on the piezo stage, and of what it may err by [m]: the range of the stage."""
FORCE = 833.0
"""Of a stack [N]: blocked, at full voltage."""
VOLTAGE = 150.0
"""Of a stack [V]: the full voltage."""
STRESS = 233e6
"""In the hinges of the piezo stage [Pa]: what is allowed."""
STAGE_POSITION, STAGE_ROTATION = 30e-6, 2e-3
"""Of the piezo stage's platform [m], [rad]: one stack at its full voltage, and all three at 12 um."""

READING = 1e4
"""Of an accelerometer's estimate [m/s2]: the stiffest design reads 6.5e3 m/s2 at its travel."""
READ_VOLTAGE = 5.0
"""Of an accelerometer [V]: at its travel."""

BEAM_POSITION, BEAM_ROTATION = 5e-3, 0.1
"""Of a platform on beams [m], [rad]: a tenth of the beams' length of 50 mm, and the angle that comes with it."""


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
    """Return the scale of what the accelerometers `sensor` and `ideal` show, and of the sensor's voltage."""
    estimates = {f"{shown}.acceleration_estimate[1..2]": READING for shown in ("sensor", "ideal")}
    return {**estimates, "sensor.voltage[1..2]": READ_VOLTAGE}
