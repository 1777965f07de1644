"""How controllers put out a command: clipped to what the actuator can do, at every instant or from tick to tick.

    continuous    a map without memory: outputs follow the inputs at every instant, by direct feedthrough
    sampled       evaluated at each tick from the inputs before it and held until the next; with `delay` put out one
                  tick late, as by a computer that needs the whole sample time

`sampled` tends to `continuous` with the sample time, with an error of the first order in it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import casadi as ca

from hfsa.components import Model, ModelError
from hfsa.components._modelling.model import one_of

Level = Literal["continuous", "sampled"]

ROUNDING = 1e-9
"""Share of the range by which a command may pass a bound before that counts as saturation: 0 V, say, less rounding."""


@dataclass(frozen=True)
class Execution:
    """How the law of a controller is executed.

    Attributes:
        model: of the controller.
        declare: its method that declares an output.
        lateness: how late a command acts on average [s].
        delay: whether it is put out one tick late.
    """

    model: Model
    declare: Callable[..., None]
    lateness: ca.SX | float
    delay: bool = False

    def put_out(self, each: str, wanted: ca.SX, limit: ca.SX, unit: str, description: str) -> None:
        """Declare the outputs `command`, within the limit either way, and `saturation`, columns as `wanted`."""
        command, saturation = clipped(wanted, -limit, limit)
        shown = _late(self.model, each, command, unit) if self.delay else command
        self.declare(f"{each}.command", shown, unit, description)
        self.declare(f"{each}.saturation", saturation, "1", "1 while the limit acts, otherwise 0")


def execution(m: Model, part: str, level: str, sample_time: float, delay: bool) -> Execution:
    """Return how a law is executed at a level, with `sample_time` [s] as the default.

    Raises:
        ModelError: an unknown level, or a delay at one that has no ticks; the message names the `part`.
    """
    levels = {"continuous": _continuous, "sampled": _sampled}
    return levels[one_of(level, levels, f"{part}: level")](m, part, sample_time, delay)


def _continuous(m: Model, part: str, _sample_time: float, delay: bool) -> Execution:
    """The law acts at every instant."""
    if delay:
        raise ModelError(f"{part}: delay is one sample time, and level continuous has none; take level sampled")
    return Execution(m, m.output, 0.0)


def _sampled(m: Model, _part: str, sample_time: float, delay: bool) -> Execution:
    """The law acts at ticks; half a sample time is what holding its command delays it by, a delay adds one."""
    period = m.sample_time(sample_time)
    return Execution(m, m.sampled_output, (1.5 if delay else 0.5) * period, delay)


def clipped(wanted: ca.SX, lowest: ca.SX | float, highest: ca.SX | float) -> tuple[ca.SX, ca.SX]:
    """Return a command within its bounds, and 1 where a bound acts, otherwise 0; shapes as `wanted`.

    At a bound it still follows `wanted`: a command that rests there, 0 V say, has the derivatives of one in between.
    """
    margin = ROUNDING * (highest - lowest)
    acts = ca.logic_or(wanted < lowest - margin, wanted > highest + margin)
    return ca.if_else(wanted < lowest, lowest, ca.if_else(wanted > highest, highest, wanted)), acts


def _late(m: Model, each: str, command: ca.SX, unit: str) -> ca.SX:
    """Return the command of the tick before, 0 at the first."""
    last = m.sampled_state(f"{each}.last_command", unit, "Command of the tick before")
    m.next[last] = command
    return last
