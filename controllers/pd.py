"""Proportional-derivative (PD) control of any number of axes.

    command_i = limit_i( feed_forward_i + Kp_i (reference_i - measured_i) + Kd_i (reference_rate_i - measured_rate_i) )

    continuous    static map with direct feedthrough
    sampled       evaluated at each tick from the inputs before it and held until the next; with `delay` one tick later,
                  like a computer that needs the whole sample time

`sampled` converges to `continuous` as the sample time goes to 0, at first order. `saturation` is 1 while the limit
acts, otherwise 0.

Ports of axis i: in `axis[i].reference`, `.measured` in `unit`, `.reference_rate`, `.measured_rate`, `.feed_forward` in
`effort`; out `axis[i].command` in `effort`, `axis[i].saturation`.

Bode plot, measured to command below the limit: flat at Kp with 180 degrees, from the measured rate at Kd. The same
holds for level `sampled` from tick to tick; `delay` adds a phase lag of 360 degrees * frequency * sample time, and
between ticks the hold adds sin(pi f T) / (pi f T) and a delay of T / 2.
"""

from hfsa.components import Model, ModelError
from hfsa.controllers._command import Level, execution


def pd(
    *, level: Level = "sampled", axes: int = 1, unit: str = "rad", effort: str = "N.m", delay: bool = False
) -> Model:
    """Return one controller for all axes.

    Args:
        level: `continuous` or `sampled`.
        axes: number of axes.
        unit: unit of reference and measured value.
        effort: unit of the command.
        delay: whether the command is delayed by one sample time; at level `sampled` only.

    Raises:
        ModelError: fewer than one axis; an unknown unit or level; a delay at level `continuous`.
    """
    if axes < 1:
        raise ModelError(f"pd: axes is {axes}, expected 1 or more")
    m = Model("Pd", "Proportional-derivative controller")
    executed = execution(m, "pd", level, 0.25e-3, delay)
    each = f"axis[1..{axes}]"
    kp = m.parameter(f"{each}.proportional_gain", 1.0, f"{effort}/{unit}", "Proportional gain Kp", min=0)
    kd = m.parameter(f"{each}.derivative_gain", 0.0, f"{effort}.s/{unit}", "Derivative gain Kd", min=0, nominal=1.0)
    limit = m.parameter(f"{each}.limit", 1e9, effort, "Largest command either way", min=0, nominal=1.0)
    reference = m.input(f"{each}.reference", unit, "Reference")
    reference_rate = m.input(f"{each}.reference_rate", f"{unit}/s", "Rate of the reference")
    measured = m.input(f"{each}.measured", unit, "Measured value")
    measured_rate = m.input(f"{each}.measured_rate", f"{unit}/s", "Rate of the measured value")
    feed_forward = m.input(f"{each}.feed_forward", effort, "Added to the command before the limit")

    wanted = feed_forward + kp * (reference - measured) + kd * (reference_rate - measured_rate)
    executed.output_command(each, wanted, limit, effort, "Command")
    return m
