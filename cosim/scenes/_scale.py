"""Scales of recorded variables: their typical sizes; a run stops where a variable is a thousand times as large.

Each is the end of a travel, a force or a measuring range, so that no possible motion of a machine reaches the limit.
"""

ROTATION, POSITION = 0.1, 10e-3
"""Pose of the SDelta's platform [rad], [m]: 6 degrees and 10 mm, beyond the range of its linear model."""
ACCELERATION = 1e3
"""Acceleration of the SDelta's platform [m/s2]: 10 mm at 50 Hz."""
ROTATION_RATE, VELOCITY, ANGULAR_ACCELERATION = 30.0, 3.0, 1e4
"""Twist of the SDelta's platform [rad/s], [m/s], and its angular acceleration [rad/s2]: its pose at 50 Hz."""
LIMB_FORCE, LIMB_TORQUE = 5e3, 200.0
"""Wrench of the limbs on the platform [N], [N.m]: 5 kg at its acceleration, 0.02 kg.m2 at its angular one."""
MOTOR_ANGLE, MOTOR_SPEED, MOTOR_TORQUE = 1.5, 500.0, 7.16
"""Motor angle of the SDelta [rad], its speed [rad/s] and torque [N.m]: 10 mm along a tube, 5000 rpm, peak torque."""
SHAFT_TWIST = 2.7e-3
"""Twist of a shaft of the SDelta [rad]: that of the peak torque."""

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


def robot_manoeuvre(rotation: str, position: str) -> dict[str, float]:
    """Return the scale of pose, twist and acceleration, limb wrench and motors of the robot, and of its command."""
    return {
        **robot_pose(),
        "robot.platform.angular_velocity[1..3]": ROTATION_RATE,
        "robot.platform.velocity[1..3]": VELOCITY,
        "robot.platform.angular_acceleration[1..3]": ANGULAR_ACCELERATION,
        "robot.platform.acceleration[1..3]": ACCELERATION,
        "robot.limbs.torque[1..3]": LIMB_TORQUE,
        "robot.limbs.force[1..3]": LIMB_FORCE,
        "robot.shaft[1..6].twist": SHAFT_TWIST,
        **{f"robot.rod[1..3].deflection[{i}]": POSITION for i in (1, 2)},
        "reference.motor[1..6].angle": MOTOR_ANGLE,
        "reference.motor[1..6].angle_rate": MOTOR_SPEED,
        "drive[1..3].motor[1..2].required_torque": MOTOR_TORQUE,
        rotation: ROTATION,
        position: POSITION,
    }


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
