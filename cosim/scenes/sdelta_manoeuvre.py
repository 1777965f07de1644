"""The SDelta robot on a manoeuvre of six tones at once: the motion from which its inertia is identified.

Each degree of freedom of the commanded pose has a sine of its own, 7, 9 and 11 Hz for rotations of 10 mrad and 13, 15
and 17 Hz for displacements of 1 mm, ramped up in 0.5 s. The reference converts the pose to the motion of the tubes,
which is ideal, and the elastic robot follows: at 17 Hz the vertical motion is twice the commanded one. Recorded are
pose, twist and acceleration of the platform, the wrench of the limbs on it, motor angles, speeds and the torques that
the motion takes, the deflections of shafts and rods, and the command:

    hfsa run sdelta_manoeuvre -o manoeuvre.h5
    hfsa identify manoeuvre.h5

Acceleration and wrench are outputs of one FMU at one instant, so that the equations of the body hold at every row,
whatever the communication step, also before the free vibration has decayed.

The reference is `linear` or `exact`, the robot linear about its posture, `cartesian`, or in finite motion, `nonlinear`.
"""

from typing import Literal

from hfsa.cosim.scenes._machine import THESIS, Machine
from hfsa.cosim.scenes._motion import MotionFile, commanded
from hfsa.cosim.scenes._posture import SYMMETRIC, Posture
from hfsa.cosim.scenes._scale import robot_manoeuvre
from hfsa.cosim.scenes._specimen import SPECIMEN, Payload
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, Connection, System

Triple = tuple[float, float, float]

_MOTIONS = ("slide", "angle", "slide_rate", "angle_rate", "slide_acceleration", "angle_acceleration")
_ORDERS = {"value": "", "rate": "_rate", "acceleration": "_acceleration"}


def sdelta_manoeuvre(
    *,
    rotation: Triple = (10e-3, 10e-3, 10e-3),
    position: Triple = (1e-3, 1e-3, 1e-3),
    rotation_frequency: Triple = (7.0, 9.0, 11.0),
    position_frequency: Triple = (13.0, 15.0, 17.0),
    reference: Literal["linear", "exact"] = "linear",
    robot: Literal["cartesian", "nonlinear"] = "cartesian",
    posture: Posture = SYMMETRIC,
    payload: Payload = SPECIMEN,
    damping: float = 0.01,
    gravity: float = 0.0,
    machine: Machine = THESIS,
    motion: MotionFile | None = None,
) -> Scene:
    """Return the scene: motion of the platform and wrench of the limbs on it.

    Args:
        rotation: amplitudes of the commanded rotation about X, Y and Z [rad].
        position: amplitudes of the commanded displacement along X, Y and Z [m].
        rotation_frequency: frequencies of the rotation [Hz].
        position_frequency: frequencies of the displacement [Hz].
        reference: level of the reference, `linear` about the posture or `exact` inverse kinematics; `exact` for a
            robot at level `nonlinear`.
        robot: level of the robot.
        posture: posture of the robot; rotation in degrees, position of S in metres.
        payload: payload of the platform; with a mass alone, a steel cube of that mass.
        damping: damping ratio of every mode.
        gravity: gravitational acceleration along -Z [m/s2]; the platform sags from the start.
        machine: dimensions of the robot, the arguments `geometry`, `rods`, `shafts`, `limbs`, `platform`, `gear`,
            `pitch`, `stiffness` and `damping_model` (`_machine.py`).
        motion: path of a CSV file with columns time [s], and x, y, z [m] and rotation_x, rotation_y, rotation_z [rad]
            from the posture, in place of the tones (default: none).
    """
    amplitudes, frequencies = (*rotation, *position), (*rotation_frequency, *position_frequency)
    sides = [f"{kind}{{}}[{i}]" for kind in ("rotation", "position") for i in (1, 2, 3)]
    tones = [
        Component(
            f"tone[{i}]",
            "sine_source",
            None,
            {"unit": "rad" if i <= 3 else "m"},
            {"amplitude": amplitude, "frequency": frequency},
        )
        for i, (amplitude, frequency) in enumerate(zip(amplitudes, frequencies, strict=True), 1)
    ]
    commands = [
        Connection(f"tone[{i}].{output}", f"reference.command.{side.format(order)}")
        for i, side in enumerate(sides, 1)
        for output, order in _ORDERS.items()
    ]
    recorded, stop_time = ("tone[1..3].value", "tone[4..6].value"), 2.0
    if motion is not None:
        tones, commands, _, stop_time = commanded(motion, "sdelta_manoeuvre", stop_time, machine.reach)
        recorded = ("motion.rotation[1..3]", "motion.position[1..3]")
    carrying = {**posture.arguments, **payload.arguments, **machine.elastic}
    level = "exact" if robot == "nonlinear" else reference
    moved = Component("reference", "sdelta_reference", level, {**posture.arguments, **machine.kinematic})
    shaken = Component("robot", "sdelta", robot, carrying, {"damping_ratio": damping, "gravity": gravity})
    drives = [Component(f"drive[{j}]", "c_drive", "ideal", machine.drive) for j in (1, 2, 3)]
    tubes = [Connection(f"reference.drive[1..3].{motion}", f"drive[1..3].command.{motion}") for motion in _MOTIONS]
    tubes += [Connection(f"drive[1..3].tube.{motion}", f"robot.drive[1..3].{motion}") for motion in _MOTIONS]
    tubes += [Connection(f"robot.drive[1..3].{load}", f"drive[1..3].tube.{load}") for load in ("force", "torque")]
    scale = robot_manoeuvre(*recorded)
    return Scene(
        System([*tones, moved, *drives, shaken], [*commands, *tubes]),
        inputs=[],
        outputs=list(scale),
        step_size=0.2e-3,
        stop_time=stop_time,
        scale=scale,
    )
