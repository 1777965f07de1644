"""The piezo stage at a bias: its stacks at one voltage, their amplifiers, and the stage at rest under them."""

from typing import Literal

from hfsa.cosim.system import Analysis, Component, Connection, StructureError, System

Level = Literal["constant_jacobian", "exact"]
Kinematics = Literal["nominal", "calibrated"]

FULL_VOLTAGE = 150.0
"""Largest voltage of a stack [V]."""


def biased_stage(
    scene: str, stage: Level, kinematics: Kinematics, bias: float, damping_time: float, resistance: float
) -> System:
    """Return the stage, then its three stacks, in the order in which the error of a step is of the second order.

    Args:
        scene: who asks, the beginning of messages.
        stage: level of the stage.
        kinematics: parameter set of the stage's links.
        bias: voltage of all stacks [V]; 0 to 150.
        damping_time: of the hinges, beta [s].
        resistance: of the amplifiers' outputs [Ohm].

    Raises:
        StructureError: a bias that the stacks cannot have.
    """
    if not 0 <= bias <= FULL_VOLTAGE:
        raise StructureError(f"{scene}: bias is {bias:g} V, expected 0 to {FULL_VOLTAGE:g} V")
    driven = Component(
        "stage",
        "rrr_stage",
        stage,
        {"kinematics": kinematics},
        {"damping_time": damping_time, **_rest(stage, kinematics, bias)},
    )
    stacks = [
        Component(
            f"stack[{i}]",
            "pzt_stack",
            "linear",
            start={"command.voltage": bias, "voltage": bias, "amplifier.resistance": resistance},
        )
        for i in (1, 2, 3)
    ]
    connections = [
        Connection("stack[1..3].stack.blocking_force", "stage.stack[1..3].blocking_force"),
        Connection("stage.stack[1..3].elongation_rate", "stack[1..3].stack.elongation_rate"),
    ]
    return System([driven, *stacks], connections)


def _rest(level: str, kinematics: str, bias: float) -> dict[str, Analysis]:
    """Return the states of the stage at which it rests under the bias."""
    arguments = {"level": level, "kinematics": kinematics, "voltage": [bias] * 3}
    if level == "exact":
        return {
            "center.position[1..2]": Analysis("rrr_stage", "pose_at_voltage[1..2]", arguments),
            "center.rotation": Analysis("rrr_stage", "pose_at_voltage[3]", arguments),
        }
    return {"leg[1..3].elongation": Analysis("rrr_stage", "elongation_at_voltage", arguments)}
