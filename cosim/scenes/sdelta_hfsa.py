"""The SDelta robot under control: motion of its platform for a small commanded motion.

The reference converts a command to motor angles; a controller, by default PD sampled every 0.25 ms on the motor
encoders, drives the six motors of three C-drives; the tubes move the elastic robot, whose reaction forces act on them.
The control is designed on the rigid robot, 6 Hz with damping 0.7, a quarter of the first natural frequency.

    law             pd               independent loop of each motor: the vertical motion, the heaviest, has a closed
                                     loop of 3.4 Hz with damping 0.40
                    ctc              computed torque: all closed loops have 6 Hz with damping 0.7
                    ctc_cartesian    the same on the error of the pose; with encoders the same law as ctc
    feedback        pose             not collocated: at 1 % of damping stable up to a bandwidth of 1.34 Hz (ctc) or
                                     0.51 Hz (pd), no more
    feed_forward    elastic          the inverse of the robot on its springs: only the error of sampling remains
    execution       continuous       the controller acts at every instant; the response is exact and has no hold

Bode plot, command to vertical position: `pd` 4.5 dB high at 3.1 Hz, -9.6 dB at 10 Hz; `ctc` within 0.7 dB up to 60 Hz,
with a lag of 7.5 degrees at 10 Hz; `feed_forward=elastic` within 0.05 dB of 1 up to 10 Hz, exactly 1 where the control
is continuous. Horizontal position: `ctc` 0.7 dB at 10 Hz and 7.4 dB at 46 Hz, near the first mode of free motors.

Steps of 0.25 ms / n, n = 1, 2, ..., are stable under all three algorithms with the default control. The error is of
first order in the step: at 50 us under `gauss_seidel` and in the symmetric posture, the error of a motion per its own
command is at most 0.28 dB and 0.95 degrees, that of a small cross response 30 % (`pd`) and 223 % (`ctc`). Therefore
`auto` chooses `gauss_seidel_linear`, within 0.014 and 0.035 %; Richardson extrapolation from two steps is within 0.011
dB and 0.06 degrees. Without control, the drives free, the flexible modes become unstable at steps of 62.8 us
(`jacobi_plain`), 104.3 us (`jacobi`) and 285 us (`gauss_seidel`), while the rigid motion is neutral under `jacobi` and
grows by 0.058 1/s per us of step under the other two.
"""

from typing import Literal

from hfsa.cosim.scenes._machine import THESIS, Machine
from hfsa.cosim.scenes._motion import MotionFile, commanded
from hfsa.cosim.scenes._posture import SYMMETRIC, Posture
from hfsa.cosim.scenes._scale import robot_pose
from hfsa.cosim.scenes._sdelta_control import Control, Execution, Feedback, FeedForward, Law
from hfsa.cosim.scenes._specimen import SPECIMEN, Payload
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, Connection, System

MOTIONS = ("slide", "angle", "slide_rate", "angle_rate", "slide_acceleration", "angle_acceleration")


def sdelta_hfsa(
    *,
    law: Law = "pd",
    feedback: Feedback = "encoder",
    execution: Execution = "sampled",
    feed_forward: FeedForward = "none",
    posture: Posture = SYMMETRIC,
    payload: Payload = SPECIMEN,
    damping: float = 0.01,
    bandwidth: float = 6.0,
    control_damping: float = 0.7,
    sample_time: float = 0.25e-3,
    delay: bool = False,
    torque_limit: float = 7.16,
    gravity: float = 0.0,
    encoder_resolution: float = 0.0,
    encoder_noise: float = 0.0,
    robot: Literal["cartesian", "generalized", "nonlinear", "auto"] = "cartesian",
    drive: Literal["rigid_shaft", "compliant_shaft"] = "rigid_shaft",
    machine: Machine = THESIS,
    motion: MotionFile | None = None,
) -> Scene:
    """Return the scene: six responses of the robot's pose under control.

    Args:
        law: `pd`, each motor by itself; `ctc`, computed torque on motor errors; `ctc_cartesian`, on pose errors.
        feedback: `encoder` of each motor, or `pose` of the platform from an ideal sensor.
        execution: execution of the controller, `sampled` or `continuous`.
        feed_forward: `none` (nothing beside the law), torques of the `rigid` robot, or torques and motor angles of the
            `elastic` one.
        posture: posture of the robot; rotation in degrees, position of S in metres.
        payload: payload of the platform, for the robot, gains, feed-forward and holding torque; with a mass alone, a
            steel cube of that mass.
        damping: damping ratio of the modes of the robot.
        bandwidth: bandwidth of the rigid closed loop [Hz].
        control_damping: damping ratio of the rigid closed loop.
        sample_time: sample time of the controller [s].
        delay: whether the torque is delayed by one sample time.
        torque_limit: torque limit of each motor [N.m]; the default is the peak torque of the motor in the thesis.
        gravity: gravitational acceleration along -Z [m/s2]; the controller feeds the holding torque forward.
        encoder_resolution: resolution of the motor encoders [rad], 0 for none.
        encoder_noise: standard deviation of the encoder noise [rad], a new value at each tick.
        robot: level of the robot; `generalized` has the screws, tubes and shafts itself, and the drives are rotors; for
            `nonlinear` the reference is at its level `exact`, for `auto` at `auto`.
        drive: level of the drives of a robot at level `cartesian`; `compliant_shaft` with a preset without shafts.
        machine: dimensions of the robot, the arguments `geometry`, `rods`, `shafts`, `limbs`, `platform`, `gear`,
            `pitch`, `stiffness` and `damping_model` (`_machine.py`).
        motion: path of a CSV file with columns time [s], and x, y, z [m] and rotation_x, rotation_y, rotation_z [rad]
            from the posture, in place of the inputs (default: none).
    """
    control = Control(
        law=law,
        feedback=feedback,
        execution=execution,
        feed_forward=feed_forward,
        posture=posture,
        payload=payload,
        damping=damping,
        bandwidth=bandwidth,
        control_damping=control_damping,
        sample_time=sample_time,
        delay=delay,
        torque_limit=torque_limit,
        gravity=gravity,
        machine=machine,
        robot=robot,
    )
    command = commanded(motion, "sdelta_hfsa", 5.0, machine.reach)
    drive_level = "rotor" if robot == "generalized" else drive
    noise = {"encoder.noise": encoder_noise, "encoder.interval": sample_time}
    drives = [
        Component(
            f"drive[{j}]",
            "c_drive",
            drive_level,
            {"encoder_noise": encoder_noise > 0, **machine.drive},
            {
                "encoder.offset[1..2]": control.tuned(f"motor_angles[{2 * j - 1}..{2 * j}]"),
                "encoder.resolution": encoder_resolution,
                **(noise | {"encoder.seed": j} if encoder_noise > 0 else {}),
            },
        )
        for j in (1, 2, 3)
    ]
    flexible = Component(
        "robot",
        "sdelta",
        robot,
        {**posture.arguments, **payload.arguments, **machine.elastic},
        {"damping_ratio": damping, "gravity": gravity},
    )
    tubes = [Connection(f"drive[1..3].tube.{motion}", f"robot.drive[1..3].{motion}") for motion in MOTIONS]
    loads = [Connection(f"robot.drive[1..3].{load}", f"drive[1..3].tube.{load}") for load in ("force", "torque")]
    errors = [
        Component(f"{kind}_error", "tracking_error", None, {"axes": 3, "unit": unit})
        for kind, unit in (("rotation", "rad"), ("position", "m"))
    ]
    compared = [
        Connection(f"{start}.platform.{kind}[1..3]", f"{kind}_error.axis[1..3].{end}")
        for kind in ("rotation", "position")
        for start, end in (("reference", "reference"), ("robot", "measured"))
    ]
    return Scene(
        System(
            [*command.components, *control.components, *drives, flexible, *errors],
            [*command.connections, *control.connections, *tubes, *loads, *compared],
        ),
        inputs=command.inputs,
        outputs=["robot.platform.rotation[1..3]", "robot.platform.position[1..3]"],
        band=(1.0, 50.0),
        amplitude={"rad": 1e-4, "m": 10e-6},
        step_size=50e-6,
        stop_time=command.stop_time,
        scale=robot_pose(),
        recorded=[
            "rotation_error.axis[1..3].error",
            "position_error.axis[1..3].error",
            "controller.axis[1..6].command",
            "drive[1..3].motor[1..2].speed",
            "robot.rod[1..3].deflection[1]",
            "robot.rod[1..3].deflection[2]",
            "robot.shaft[1..6].twist",
        ],
    )
