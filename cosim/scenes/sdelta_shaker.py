"""The flexible SDelta robot as a shaker: how far its platform follows a small commanded motion, from 1 to 50 Hz.

The reference turns a pose command into the motion of the three tubes, which are moved exactly: there is no drive and
no control, so that what is seen is the elastic robot alone. Every amplitude ratio begins at 1. A vertical command meets
one resonance, 34 dB high at 24.5 Hz; a horizontal one meets its resonance at 23.6 Hz and an antiresonance at 31.8 Hz,
and turns the platform as well.

`auto` takes `gauss_seidel_linear`, under which the tubes move over a step and no response errs by more than 0.0021 %.
Held for the step of 50 us they cost 0.45 degrees at 50 Hz and less than 0.001 dB against the exact response (1.35
degrees under `jacobi_plain`). No step is unstable: nothing is fed back.
"""

from typing import Literal

from hfsa.cosim.scenes._posture import SYMMETRIC, Posture
from hfsa.cosim.scenes._scale import robot_pose
from hfsa.cosim.scenes._specimen import SPECIMEN, Payload
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, Connection, System

MOTIONS = ("slide", "angle", "slide_rate", "angle_rate", "slide_acceleration", "angle_acceleration")


def sdelta_shaker(
    *,
    posture: Posture = SYMMETRIC,
    stiffness: Literal["ch3_full", "ch3_rods", "ch4", "ch4_full"] = "ch4",
    payload: Payload = SPECIMEN,
    damping: float = 0.01,
) -> Scene:
    """The robot's six pose responses.

    Args:
        posture: where the robot stands; rotation in degrees, position of S in metres.
        stiffness: preset of the robot.
        payload: what the platform carries; given by its mass alone, a steel cube of that mass.
        damping: damping ratio of every mode.
    """
    reference = Component("reference", "sdelta_reference", "linear", posture.arguments)
    carrying = {**posture.arguments, **payload.arguments, "stiffness": stiffness}
    robot = Component("robot", "sdelta", "cartesian", carrying, {"damping_ratio": damping})
    tubes = [Connection(f"reference.drive[1..3].{motion}", f"robot.drive[1..3].{motion}") for motion in MOTIONS]
    return Scene(
        System([reference, robot], tubes),
        inputs=["reference.command.rotation[1..3]", "reference.command.position[1..3]"],
        outputs=["robot.platform.rotation[1..3]", "robot.platform.position[1..3]"],
        band=(1.0, 50.0),
        amplitude={"rad": 1e-4, "m": 10e-6},
        step_size=50e-6,
        stop_time=5.0,
        scale=robot_pose(),
    )
