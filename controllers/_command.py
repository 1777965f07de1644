"""What sampled controllers do to a command: clip it to what the actuator can do, put it out one tick late."""

import casadi as ca

from hfsa.components._model import Model

ROUNDING = 1e-9
"""Share of the range by which a command may pass a bound before that counts as saturation: 0 V, say, less rounding."""


def clipped(wanted: ca.SX, lowest: ca.SX | float, highest: ca.SX | float) -> tuple[ca.SX, ca.SX]:
    """Return a command within its bounds, and 1 where a bound acts, otherwise 0; shapes as `wanted`.

    At a bound it still follows `wanted`: a command that rests there, 0 V say, has the derivatives of one in between.
    """
    margin = ROUNDING * (highest - lowest)
    acts = ca.logic_or(wanted < lowest - margin, wanted > highest + margin)
    return ca.if_else(wanted < lowest, lowest, ca.if_else(wanted > highest, highest, wanted)), acts


def late(m: Model, each: str, command: ca.SX, unit: str) -> ca.SX:
    """Return the command of the tick before, as of a computer that needs the whole sample time; 0 at the first."""
    last = m.sampled_state(f"{each}.last_command", unit, "Command of the tick before")
    m.next[last] = command
    return last
