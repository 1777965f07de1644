"""Postures of the robot beside a singularity: refused at a microradian, right at a milliradian."""

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from extreme_rows.bench import free_motion, sentences
from extreme_rows.row import Accuracy, Found, Message, Row
from hfsa.components._mechanics.sdelta_direct import direct_kinematics
from hfsa.components._mechanics.sdelta_kinematics import Kinematics
from hfsa.components.sdelta import Posture
from hfsa.cosim import load_scene
from hfsa.cosim.assembly.build import build
from hfsa.cosim.fmi.co_simulation import open_instances
from hfsa.cosim.linear.linearize import linear_response

SINGULAR = math.radians(-22.61986)
"""Pitch at which the platform cannot be held [rad]."""

QUASI_STATIC = 1e-8
"""Error of a quasi-static response: some roundings of a stiffness, whose condition number is that of the posture
squared, 6e6."""


def rows() -> Iterator[Row]:
    """Yield the rows."""
    for scene in ("sdelta_shaker", "sdelta_hfsa"):
        for distance in (0.0, 1e-6, -1e-6):
            yield Row(
                "posture",
                f"`{scene}`, pitched to {distance:g} rad from a singularity",
                Message("is singular: condition number"),
                partial(sentences, scene, pitched(distance), stop_time=0.01),
                is_cheap=True,
            )
    for distance in (1e-3, -1e-3):
        beside = f"pitched to {distance:g} rad from a singularity"
        yield Row(
            "posture",
            f"pose of the robot {beside} from its motor angles",
            Accuracy("rotation matrix and position", "the pose", 1e-12),
            partial(found_again, distance),
            is_cheap=True,
        )
        yield Row(
            "posture",
            f"`sdelta_shaker` {beside}, response at 1e-06 Hz",
            Accuracy("all six responses", "the identity", QUASI_STATIC),
            partial(still, distance),
        )
        yield Row(
            "posture",
            f"`sdelta_shaker` {beside}, all states released, 4000 steps of 5e-05 s",
            Accuracy("motion", "the exponential of the part's equations", 1e-10),
            partial(free_motion, "sdelta_shaker", pitched(distance), "robot", 5e-5, 4000),
        )


def pitched(distance: float) -> dict[str, tuple[float, float, float]]:
    """Return the arguments of a posture at a distance from the singularity [rad]."""
    return {"posture.rotation": (0.0, math.degrees(SINGULAR + distance), 0.0)}


def found_again(distance: float) -> Found:
    """Return the error of a pose computed from its motor angles [rad, m], from a start half as far again."""
    wanted = Kinematics.at(Posture(rotation=pitched(distance)["posture.rotation"]))
    start = Posture(rotation=pitched(1.5 * distance)["posture.rotation"])
    Q, position = direct_kinematics(wanted.motor_angles, start)
    error = max(np.abs(Q - wanted.Q).max(), np.abs(position - wanted.position).max())
    return Found(float(error), f"condition number {wanted.condition_number:.4g}")


def still(distance: float) -> Found:
    """Return the error of the quasi-static response: the platform follows the command."""
    scene = load_scene("sdelta_shaker", pitched(distance))
    with open_instances(build(scene.system).files) as instances:
        found = linear_response(scene.system, instances, scene.inputs, scene.outputs, [1e-6])[0]
    return Found(float(np.abs(found - np.eye(6)).max()))
