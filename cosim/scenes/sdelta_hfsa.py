"""The SDelta robot under sampled control: how far its platform follows a small commanded motion through its motors.

The reference turns a pose command into motor angles; a PD controller, sampled every 0.25 ms, drives the six motors of
three C-drives by encoder feedback; the tubes move the elastic robot, which pushes back. The design is that of the rigid
robot, 6 Hz with damping 0.7, a quarter of the first natural frequency; yet the vertical motion, the heaviest, closes at
3.4 Hz with damping 0.40, because each motor has its own loop and none knows of the others.

Steps of 0.25 ms / n, n = 1, 2, ..., are stable under all three algorithms. The error is of the first order in the step:
at the default, 50 us under `gauss_seidel`, each motion's response to its own command is off by 0.28 dB and 0.95 degrees
at most, a small cross response by more; twice the response at half the step less that at the whole step is within 0.011
dB and 0.06 degrees everywhere. Without control, the drives free, the flexible modes become unstable at steps of 62.8 us
(`jacobi_plain`), 104.3 us (`jacobi`) and 285 us (`gauss_seidel`), while the rigid motion is neutral under `jacobi` and
grows by 0.058 1/s per us of step under the other two.
"""

from typing import Literal

from hfsa.cosim.scenes._posture import SYMMETRIC, Posture
from hfsa.cosim.system import Analysis, Component, Connection, Scene, System

MOTIONS = ("slide", "angle", "slide_rate", "angle_rate", "slide_acceleration", "angle_acceleration")


def sdelta_hfsa(
    *,
    posture: Posture = SYMMETRIC,
    stiffness: Literal["ch3_full", "ch3_rods", "ch4", "ch4_full"] = "ch4",
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
    """The robot's six pose responses under PD control.

    Args:
        posture: where the robot stands; rotation in degrees, position of S in metres.
        stiffness: preset of the robot.
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
    design = {**posture.arguments, "bandwidth": bandwidth, "damping": control_damping, "gravity": gravity}

    def tuned(key: str) -> Analysis:
        return Analysis("sdelta_tuning", key, design)

    noise = {"encoder.noise": encoder_noise, "encoder.interval": sample_time}
    reference = Component("reference", "sdelta_reference", "linear", posture.arguments)
    controller = Component(
        "controller",
        "pd",
        arguments={"axes": 6, "delay": delay},
        start={
            "sample_time": sample_time,
            "axis[1..6].proportional_gain": tuned("proportional_gain"),
            "axis[1..6].derivative_gain": tuned("derivative_gain"),
            "axis[1..6].limit": torque_limit,
            "axis[1..6].feed_forward": tuned("holding_torque"),
        },
    )
    drives = [
        Component(
            f"drive[{j}]",
            "c_drive",
            "rigid_shaft",
            {"encoder_noise": encoder_noise > 0},
            {
                "shaft[1..2].angle": tuned(f"motor_angles[{2 * j - 1}..{2 * j}]"),
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
        {**posture.arguments, "stiffness": stiffness},
        {"damping_ratio": damping, "gravity": gravity},
    )
    return Scene(
        System([reference, controller, *drives, robot], _connections()),
        inputs=["reference.command.rotation[1..3]", "reference.command.position[1..3]"],
        outputs=["robot.platform.rotation[1..3]", "robot.platform.position[1..3]"],
        band=(1.0, 50.0),
        amplitude={"rad": 1e-4, "m": 10e-6},
        step_size=50e-6,
        stop_time=5.0,
    )


def _connections() -> list[Connection]:
    """Motor angles to the controller, torques to the drives, tubes to the robot, and its forces back to the tubes."""
    connections = [
        Connection("reference.motor[1..6].angle", "controller.axis[1..6].reference"),
        Connection("reference.motor[1..6].angle_rate", "controller.axis[1..6].reference_rate"),
    ]
    for j, axes in ((1, "axis[1..2]"), (2, "axis[3..4]"), (3, "axis[5..6]")):
        connections += [
            Connection(f"drive[{j}].motor[1..2].angle", f"controller.{axes}.measured"),
            Connection(f"drive[{j}].motor[1..2].speed", f"controller.{axes}.measured_rate"),
            Connection(f"controller.{axes}.command", f"drive[{j}].motor[1..2].torque"),
        ]
    connections += [Connection(f"drive[1..3].tube.{motion}", f"robot.drive[1..3].{motion}") for motion in MOTIONS]
    connections += [Connection(f"robot.drive[1..3].{load}", f"drive[1..3].tube.{load}") for load in ("force", "torque")]
    return connections
