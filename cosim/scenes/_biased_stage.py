"""Piezo stage at a bias voltage: stage, stacks and amplifiers at equilibrium."""

from typing import Literal

from hfsa.cosim.scenes._pzt import Pzt
from hfsa.cosim.scenes._stage import Stage
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Analysis, Component, Connection, System

Level = Literal["constant_jacobian", "exact", "flexible_hinges", "continuum"]

FULL_VOLTAGE = 150.0
"""Full voltage of a stack by default [V]."""


def biased_stage(
    scene: str, level: Level, design: Stage, pzt: Pzt, bias: float, damping_time: float, resistance: float
) -> System:
    """Return the stage and its three stacks, in this order of steps, whose error is of second order in the step.

    Args:
        scene: name of the scene, for messages.
        level: level of the stage.
        design: design of the stage.
        pzt: the stacks.
        bias: voltage of all stacks [V]; 0 to their full voltage.
        damping_time: damping time of the hinges, beta [s].
        resistance: output resistance of the amplifiers [Ohm].

    Raises:
        StructureError: for a bias outside the range of the stacks.
    """
    highest = FULL_VOLTAGE if pzt.full_voltage is None else pzt.full_voltage
    if not 0 <= bias <= highest:
        raise StructureError(f"{scene}: bias is {bias:g} V, expected 0 to {highest:g} V")
    driven = Component(
        "stage",
        "rrr_stage",
        level,
        {**design.itself, **pzt.arguments},
        {**design.damping(level, damping_time), **_rest(level, design, pzt, bias)},
    )
    at_bias = {"command.voltage": bias, "voltage": bias, "amplifier.resistance": resistance}
    stacks = pzt.stacks("linear", at_bias)
    connections = [
        Connection("stack[1..3].stack.blocking_force", "stage.stack[1..3].blocking_force"),
        Connection("stage.stack[1..3].elongation_rate", "stack[1..3].stack.elongation_rate"),
    ]
    return System([driven, *stacks], connections)


def _rest(level: str, design: Stage, pzt: Pzt, bias: float) -> dict[str, Analysis]:
    """Return the states of the stage at equilibrium under the bias."""
    arguments = {"level": level, **design.itself, **pzt.arguments, "voltage": [bias] * 3}
    elongations = {"leg[1..3].elongation": Analysis("rrr_stage", "elongation_at_voltage", arguments)}
    pose = {
        "center.position[1..2]": Analysis("rrr_stage", "pose_at_voltage[1..2]", arguments),
        "center.rotation": Analysis("rrr_stage", "pose_at_voltage[3]", arguments),
    }
    modes = {f"mode[1..{design.modes}].displacement": Analysis("rrr_stage", "mode_at_voltage", arguments)}
    return {"constant_jacobian": elongations, "exact": pose, "flexible_hinges": elongations | pose}.get(level, modes)
