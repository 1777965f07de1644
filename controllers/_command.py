"""Execution of control laws: commands within the limits of the actuator, continuous or sampled.

    continuous    static map with direct feedthrough
    sampled       evaluated at each tick from the inputs before it and held until the next; with `delay` one tick later,
                  like a computer that needs the whole sample time

`sampled` converges to `continuous` as the sample time goes to 0, at first order.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import casadi as ca

from hfsa.components import Model, ModelError
from hfsa.components._modelling.model import one_of

Level = Literal["continuous", "sampled"]

ROUNDING = 1e-9
"""Excess over a bound, relative to the range, above which a command is saturated; larger than rounding errors."""


@dataclass(frozen=True)
class Execution:
    """Continuous or sampled execution of a control law.

    Attributes:
        model: model of the controller.
        declare: method of the model that declares an output.
        mean_delay: mean delay of a command by hold and delay [s].
        delay: whether the command is delayed by one tick.
    """

    model: Model
    declare: Callable[..., None]
    mean_delay: ca.SX | float
    delay: bool = False

    def output_command(self, each: str, wanted: ca.SX, limit: ca.SX, unit: str, description: str) -> None:
        """Declare the outputs `command`, limited to +-`limit`, and `saturation`, columns of the shape of `wanted`."""
        command, saturation = clipped(wanted, -limit, limit)
        shown = _delayed(self.model, each, command, unit) if self.delay else command
        self.declare(f"{each}.command", shown, unit, description)
        self.declare(f"{each}.saturation", saturation, "1", "1 while the limit acts, otherwise 0")


def execution(m: Model, part: str, level: str, sample_time: float, delay: bool) -> Execution:
    """Return the execution of a control law at a level, with the default `sample_time` [s].

    Raises:
        ModelError: an unknown level; a delay at level `continuous`. The message begins with the name of the `part`.
    """
    levels = {"continuous": _continuous, "sampled": _sampled}
    return levels[one_of(level, levels, f"{part}: level")](m, part, sample_time, delay)


def _continuous(m: Model, part: str, _sample_time: float, delay: bool) -> Execution:
    """Return the continuous execution; `ModelError` for a delay."""
    if delay:
        raise ModelError(f"{part}: delay is one sample time, and level continuous has none; take level sampled")
    return Execution(m, m.output, 0.0)


def _sampled(m: Model, _part: str, sample_time: float, delay: bool) -> Execution:
    """Return the sampled execution; the hold delays the command by half a sample time, `delay` by another one."""
    period = m.sample_time(sample_time)
    return Execution(m, m.sampled_output, (1.5 if delay else 0.5) * period, delay)


def clipped(wanted: ca.SX, lowest: ca.SX | float, highest: ca.SX | float) -> tuple[ca.SX, ca.SX]:
    """Return a command within its bounds, and 1 while a bound acts, otherwise 0; shapes as `wanted`.

    Exactly at a bound the command is not clipped, so a command at rest there, such as 0 V, has nonzero derivatives.
    """
    margin = ROUNDING * (highest - lowest)
    acts = ca.logic_or(wanted < lowest - margin, wanted > highest + margin)
    return ca.if_else(wanted < lowest, lowest, ca.if_else(wanted > highest, highest, wanted)), acts


def _delayed(m: Model, each: str, command: ca.SX, unit: str) -> ca.SX:
    """Return the command of the previous tick, 0 at the first one."""
    last = m.sampled_state(f"{each}.last_command", unit, "Command of the previous tick")
    m.next[last] = command
    return last
