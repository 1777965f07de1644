"""The piezo stage at a bias: its stacks at one voltage, their amplifiers, and the stage at rest under them."""

from typing import Literal

from hfsa.cosim.scenes._pzt import Pzt
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Analysis, Component, Connection, System

Level = Literal["constant_jacobian", "exact"]
Kinematics = Literal["nominal", "calibrated"]

FULL_VOLTAGE = 150.0
"""Largest voltage of a stack of which nothing else is said [V]."""


def biased_stage(
    scene: str, stage: Level, kinematics: Kinematics, pzt: Pzt, bias: float, damping_time: float, resistance: float
) -> System:
    """Return the stage, then its three stacks, in the order in which the error of a step is of the second order.

    Args:
        scene: who asks, the beginning of messages.
        stage: level of the stage.
        kinematics: parameter set of the stage's links.
        pzt: the stacks.
        bias: voltage of all stacks [V]; 0 to their full voltage.
        damping_time: of the hinges, beta [s].
        resistance: of the amplifiers' outputs [Ohm].

    Raises:
        StructureError: a bias that the stacks cannot have.
    """
    highest = FULL_VOLTAGE if pzt.full_voltage is None else pzt.full_voltage
    if not 0 <= bias <= highest:
        raise StructureError(f"{scene}: bias is {bias:g} V, expected 0 to {highest:g} V")
    driven = Component(
        "stage",
        "rrr_stage",
        stage,
        {"kinematics": kinematics},
        {"damping_time": damping_time, **pzt.on_stage, **_rest(stage, kinematics, pzt, bias)},
    )
    at_bias = {"command.voltage": bias, "voltage": bias, "amplifier.resistance": resistance}
    stacks = pzt.stacks("linear", at_bias)
    connections = [
        Connection("stack[1..3].stack.blocking_force", "stage.stack[1..3].blocking_force"),
        Connection("stage.stack[1..3].elongation_rate", "stack[1..3].stack.elongation_rate"),
    ]
    return System([driven, *stacks], connections)


def _rest(level: str, kinematics: str, pzt: Pzt, bias: float) -> dict[str, Analysis]:
    """Return the states of the stage at which it rests under the bias."""
    arguments = {"level": level, "kinematics": kinematics, **pzt.arguments, "voltage": [bias] * 3}
    if level == "exact":
        return {
            "center.position[1..2]": Analysis("rrr_stage", "pose_at_voltage[1..2]", arguments),
            "center.rotation": Analysis("rrr_stage", "pose_at_voltage[3]", arguments),
        }
    return {"leg[1..3].elongation": Analysis("rrr_stage", "elongation_at_voltage", arguments)}
