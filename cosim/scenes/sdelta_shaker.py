"""The flexible SDelta robot as a shaker: motion of its platform for a small commanded motion, from 1 to 50 Hz.

The reference converts a pose command to the motion of the three tubes, which is exact: there is neither drive nor
control, so that the response is that of the elastic robot alone. Every amplitude ratio begins at 1. A vertical command
has one resonance, 34 dB high at 24.5 Hz; a horizontal one has its resonance at 23.6 Hz and an antiresonance at 31.8 Hz,
and turns the platform as well.

With `robot=nonlinear` the tubes follow the exact inverse kinematics, and `bode/harmonics` has those of large motions:
a command of 1 mm along x at 20 Hz turns the platform by 24.5 rad/m about y, and about x by 0.28 rad/m in the second
harmonic and 0.81 rad/m in the mean.

`auto` chooses `gauss_seidel_linear`, which extrapolates the tube motion over a step; errors are below 0.0021 %. Inputs
held for the step of 50 us have an error of 0.45 degrees at 50 Hz and less than 0.001 dB (1.35 degrees under
`jacobi_plain`). There is no feedback, so that every step is stable.
"""

from typing import Literal

from hfsa.cosim.scenes._machine import THESIS, Machine, reference_level
from hfsa.cosim.scenes._motion import MotionFile, commanded
from hfsa.cosim.scenes._posture import SYMMETRIC, Posture
from hfsa.cosim.scenes._scale import robot_pose
from hfsa.cosim.scenes._specimen import SPECIMEN, Payload
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, Connection, System

MOTIONS = ("slide", "angle", "slide_rate", "angle_rate", "slide_acceleration", "angle_acceleration")


def sdelta_shaker(
    *,
    posture: Posture = SYMMETRIC,
    payload: Payload = SPECIMEN,
    damping: float = 0.01,
    robot: Literal["rigid", "cartesian", "generalized", "nonlinear", "auto"] = "cartesian",
    machine: Machine = THESIS,
    motion: MotionFile | None = None,
) -> Scene:
    """Return the scene: six responses of the robot's pose.

    Args:
        posture: posture of the robot; rotation in degrees, position of S in metres.
        payload: payload of the platform; with a mass alone, a steel cube of that mass.
        damping: damping ratio of every mode.
        robot: level of the robot; for `nonlinear` the reference is at its level `exact`, for `auto` at `auto`.
        machine: dimensions of the robot, the arguments `geometry`, `rods`, `shafts`, `limbs`, `platform`, `gear`,
            `pitch`, `stiffness` and `damping_model` (`_machine.py`).
        motion: path of a CSV file with columns time [s], and x, y, z [m] and rotation_x, rotation_y, rotation_z [rad]
            from the posture, in place of the inputs (default: none).
    """
    command = commanded(motion, "sdelta_shaker", 5.0, machine.reach)
    reference = Component(
        "reference",
        "sdelta_reference",
        reference_level(robot),
        {**posture.arguments, **machine.kinematic},
    )
    carrying = {**posture.arguments, **payload.arguments, **machine.elastic}
    shaken = Component("robot", "sdelta", robot, carrying, {"damping_ratio": damping})
    tubes = [Connection(f"reference.drive[1..3].{motion}", f"robot.drive[1..3].{motion}") for motion in MOTIONS]
    return Scene(
        System([*command.components, reference, shaken], [*command.connections, *tubes]),
        inputs=command.inputs,
        outputs=["robot.platform.rotation[1..3]", "robot.platform.position[1..3]"],
        band=(1.0, 50.0),
        amplitude={"rad": 1e-4, "m": 10e-6},
        step_size=50e-6,
        stop_time=command.stop_time,
        scale=robot_pose(),
    )
