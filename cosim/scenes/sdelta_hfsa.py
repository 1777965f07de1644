"""The SDelta robot under control: how far its platform follows a small commanded motion through its motors.

A command becomes motor angles; a controller, by default PD sampled every 0.25 ms on the motors' encoders, drives the
six motors of three C-drives; the tubes move the elastic robot, which pushes back. The design is that of the rigid
robot, 6 Hz with damping 0.7, a quarter of the first natural frequency.

    law             pd               each motor has its own loop and none knows of the others: the vertical motion, the
                                     heaviest, closes at 3.4 Hz with damping 0.40
                    ctc              computed torque: all motions close at 6 Hz with 0.7
                    ctc_cartesian    the same on the error of the pose: one law with ctc by encoders
    feedback        pose             not collocated: at 1 % of damping stable up to a bandwidth of 1.34 Hz (ctc) or
                                     0.51 Hz (pd), no more
    feed_forward    elastic          the inverse of the robot on its springs: what is left is the error of sampling
    execution       continuous       the controller acts at every instant; the response is exact and has no hold

Bode plot, command to vertical position: `pd` 4.5 dB high at 3.1 Hz, -9.6 dB at 10 Hz; `ctc` within 0.7 dB up to 60 Hz,
though 7.5 degrees behind at 10 Hz; `feed_forward=elastic` within 0.05 dB of 1 up to 10 Hz, exactly 1 where the control
is continuous. Horizontal position: `ctc` 0.7 dB at 10 Hz and 7.4 dB at 46 Hz, near the first mode of free motors.

Steps of 0.25 ms / n, n = 1, 2, ..., are stable under all three algorithms with the default control. The error is of the
first order in the step: at 50 us under `gauss_seidel` each motion's response to its own command is off by 0.28 dB and
0.95 degrees at most at the symmetric posture, a small cross response by 30 % (`pd`) and 223 % (`ctc`), so that `auto`
takes `gauss_seidel_linear`, 0.014 and 0.035 %; twice the response at half the step less that at the
whole step is within 0.011 dB and 0.06 degrees everywhere. Without control, the drives free, the flexible modes become
unstable at steps of 62.8 us (`jacobi_plain`), 104.3 us (`jacobi`) and 285 us (`gauss_seidel`), while the rigid motion
is neutral under `jacobi` and grows by 0.058 1/s per us of step under the other two.
"""

from typing import Literal

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
    stiffness: Literal["ch3_full", "ch3_rods", "ch4", "ch4_full"] = "ch4",
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
) -> Scene:
    """The robot's six pose responses under control.

    Args:
        law: `pd`, each motor by itself; `ctc`, computed torque on the motors' errors; `ctc_cartesian`, on the pose's.
        feedback: of the motors' `encoder`s, or of the platform's `pose`, as a sensor would show it.
        execution: of the controller, `sampled` or `continuous`.
        feed_forward: `none` (what the law itself contains), or the torques of the `rigid` robot, or torques and motor
            angles of the `elastic` one.
        posture: where the robot stands; rotation in degrees, position of S in metres.
        stiffness: preset of the robot.
        payload: what the platform carries, for the robot, gains, feed-forward and holding torque; given by its mass
            alone, a steel cube of that mass.
        damping: damping ratio of the robot's modes.
        bandwidth: of the rigid closed loop [Hz].
        control_damping: damping ratio of the rigid closed loop.
        sample_time: of the controller [s].
        delay: whether the torque is put out one sample time late.
        torque_limit: of each motor [N.m]; the peak torque of the motor that the thesis names.
        gravity: gravitational acceleration along -Z [m/s2]; the controller then feeds the holding torque forward.
        encoder_resolution: step of the motors' encoders [rad], 0 for none.
        encoder_noise: standard deviation of their noise [rad], a new value at each tick.
    """
    control = Control(
        law=law,
        feedback=feedback,
        execution=execution,
        feed_forward=feed_forward,
        posture=posture,
        stiffness=stiffness,
        payload=payload,
        damping=damping,
        bandwidth=bandwidth,
        control_damping=control_damping,
        sample_time=sample_time,
        delay=delay,
        torque_limit=torque_limit,
        gravity=gravity,
    )
    noise = {"encoder.noise": encoder_noise, "encoder.interval": sample_time}
    drives = [
        Component(
            f"drive[{j}]",
            "c_drive",
            "rigid_shaft",
            {"encoder_noise": encoder_noise > 0},
            {
                "encoder.offset[1..2]": control.tuned(f"motor_angles[{2 * j - 1}..{2 * j}]"),
                "encoder.resolution": encoder_resolution,
                **(noise | {"encoder.seed": j} if encoder_noise > 0 else {}),
            },
        )
        for j in (1, 2, 3)
    ]
    robot = Component(
        "robot",
        "sdelta",
        "cartesian",
        {**posture.arguments, **payload.arguments, "stiffness": stiffness},
        {"damping_ratio": damping, "gravity": gravity},
    )
    tubes = [Connection(f"drive[1..3].tube.{motion}", f"robot.drive[1..3].{motion}") for motion in MOTIONS]
    loads = [Connection(f"robot.drive[1..3].{load}", f"drive[1..3].tube.{load}") for load in ("force", "torque")]
    return Scene(
        System([*control.components, *drives, robot], [*control.connections, *tubes, *loads]),
        inputs=["reference.command.rotation[1..3]", "reference.command.position[1..3]"],
        outputs=["robot.platform.rotation[1..3]", "robot.platform.position[1..3]"],
        band=(1.0, 50.0),
        amplitude={"rad": 1e-4, "m": 10e-6},
        step_size=50e-6,
        stop_time=5.0,
        scale=robot_pose(),
    )
