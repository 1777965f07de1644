"""The accelerometer on the SDelta robot's platform: its estimate for a small commanded motion, from 5 to 50 Hz.

The reference converts a pose command to the motion of the tubes, which is exact, and the platform shakes the sensor,
which is mounted anywhere on it: a chain without feedback. `ideal` is a sensor without dynamics at the same place; its
estimate is the true acceleration there, along the axes of the sensor. The response from true acceleration to the
sensor is the quotient of two recorded responses:

    response.sel(output="sensor.acceleration_estimate[1]") / response.sel(output="ideal.acceleration_estimate[1]")

The response from a command is -omega^2 times that of the platform position. In the symmetric posture a horizontal
command has its resonance at 23.6 Hz, 5.2 m/s2 for 10 um, and its antiresonance at 31.8 Hz; the other axis shows
nothing. With the platform 20 mm off along x it shows 43 dB less at 10 Hz, 5 dB less at 20 Hz. A rotation about the
vertical is measured through the lever arm. The quotient is flat: at 50 Hz it is 0.0006 dB above 1 (mems), 0.35 dB
(rapid_prototype).

`auto` chooses `gauss_seidel_linear`, within 0.0004 %. With held inputs, `gauss_seidel`, the errors are larger: an
acceleration is the force of limbs between tubes and platform, and held inputs set these half a step apart. A mode of
omega_n has a phase error of H omega_n^2 / (2 omega) radians, a lead under `gauss_seidel`, a lag under `jacobi`. At the
step of 5 us these are 0.9 degrees at 5 Hz and 0.2 at 50 Hz for a horizontal command to its own axis, but 0.8 near the
antiresonance, and 4.7 degrees at 5 Hz for the rotation about the vertical. The mean of two sweeps, one with each
algorithm, is of second order: within 0.05 degrees, the lag of the input held by the sensor. The quotient has this lag
only, as the sensor steps first; so has a `robot=rigid`.
"""

from typing import Literal

from hfsa.cosim.scenes._accelerometer import Design, Level, Mounting, accelerometer, ideal
from hfsa.cosim.scenes._machine import THESIS, Machine, reference_level
from hfsa.cosim.scenes._motion import MotionFile, commanded
from hfsa.cosim.scenes._posture import SYMMETRIC, Posture
from hfsa.cosim.scenes._scale import ACCELERATION, readings
from hfsa.cosim.scenes._specimen import SPECIMEN, Payload
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, Connection, System

_TUBES = ("slide", "angle", "slide_rate", "angle_rate", "slide_acceleration", "angle_acceleration")
_PLATFORM = ("acceleration", "angular_velocity", "angular_acceleration", "rotation")


OFF_CENTER = Mounting(lever=(0.03, 0.0, 0.0))
"""Sensor axes along the world axes, 30 mm from the centre of the platform's joints."""


def sdelta_accelerometer(
    *,
    posture: Posture = SYMMETRIC,
    payload: Payload = SPECIMEN,
    robot: Literal["rigid", "cartesian", "generalized", "nonlinear", "auto"] = "cartesian",
    robot_damping: float = 0.01,
    design: Design = "mems",
    sensor: Level = "spatial",
    damping: float | None = None,
    mounting: Mounting = OFF_CENTER,
    machine: Machine = THESIS,
    motion: MotionFile | None = None,
) -> Scene:
    """Return the scene: estimates, true acceleration and voltages per command.

    Args:
        posture: posture of the robot; rotation in degrees, position of S in metres.
        payload: payload of the platform beside the sensor; with a mass alone, a steel cube of that mass.
        robot: level of the robot; for `nonlinear` the reference is at its level `exact`, for `auto` at `auto`.
        robot_damping: damping ratio of its modes.
        design: published dimensions and material of the sensor.
        sensor: level of the sensor.
        damping: damping ratio in the plane of the sensor (default: the design's).
        mounting: mounting of the sensor on the platform, from S.
        machine: dimensions of the robot, the arguments `geometry`, `rods`, `shafts`, `limbs`, `platform`, `gear`,
            `pitch`, `stiffness` and `damping_model` (`_machine.py`).
        motion: path of a CSV file with columns time [s], and x, y, z [m] and rotation_x, rotation_y, rotation_z [rad]
            from the posture, in place of the inputs (default: none).
    """
    command = commanded(motion, "sdelta_accelerometer", 2.0, machine.reach)
    components = [
        accelerometer(sensor, design, mounting.at(posture), damping),  # in this order of steps
        ideal(mounting.at(posture)),
        Component(
            "reference",
            "sdelta_reference",
            reference_level(robot),
            {**posture.arguments, **machine.kinematic},
        ),
        Component(
            "robot",
            "sdelta",
            robot,
            {**posture.arguments, **payload.arguments, **machine.elastic},
            {"damping_ratio": robot_damping},
        ),
    ]
    connections = [Connection(f"reference.drive[1..3].{motion}", f"robot.drive[1..3].{motion}") for motion in _TUBES]
    connections += [
        Connection(f"robot.platform.{motion}[1..3]", f"{shown}.base.{motion}[1..3]")
        for shown in ("sensor", "ideal")
        for motion in _PLATFORM
    ]
    return Scene(
        System([*command.components, *components], [*command.connections, *connections]),
        inputs=command.inputs,
        outputs=[
            "sensor.acceleration_estimate[1..2]",
            "ideal.acceleration_estimate[1..2]",
            "robot.platform.acceleration[3]",
            "sensor.voltage[1..2]",
        ],
        band=(5.0, 50.0),
        amplitude={"rad": 1e-4, "m": 10e-6},
        step_size=5e-6,
        stop_time=command.stop_time,
        scale={**readings(), "robot.platform.acceleration[3]": ACCELERATION},
    )
