"""The scalar quantities of a model, and names with a range that declare several of them."""

import math
import re
from dataclasses import dataclass
from enum import StrEnum

import casadi as ca

from hfsa.components._modelling.errors import ModelError

_RANGE = re.compile(r"\[1\.\.([1-9]\d*)\]")


class Kind(StrEnum):
    """The kind of a quantity in its model."""

    PARAMETER = "parameter"
    INPUT = "input"
    STATE = "state"
    SAMPLED_STATE = "sampled_state"
    OUTPUT = "output"
    SAMPLED_OUTPUT = "sampled_output"
    CONSTANT = "constant"


@dataclass(frozen=True, eq=False)
class Quantity:
    """A scalar quantity of a model, with the attributes of an FMI variable.

    `expression` is the CasADi symbol of a parameter, input or state, and the value of an output or constant. `fixed`
    parameters can be set only before initialization, the others at any communication point.

    Raises:
        ModelError: a start value that is not finite or outside its bounds; a nominal value that is not positive.
    """

    name: str
    kind: Kind
    unit: str
    description: str
    start: float
    nominal: float
    min: float | None
    max: float | None
    expression: ca.SX
    fixed: bool = False

    def __post_init__(self):
        if not math.isfinite(self.start):
            raise ModelError(f"{self.name} has start value {self.start}, expected a finite number")
        if not (self.nominal > 0 and math.isfinite(self.nominal)):
            raise ModelError(f"{self.name} has nominal value {self.nominal}, expected a positive number")
        low = -math.inf if self.min is None else self.min
        high = math.inf if self.max is None else self.max
        if not low <= self.start <= high:
            raise ModelError(f"{self.name} is {self.start:g} {self.unit}, expected {low:g} to {high:g} {self.unit}")


def expand(name: str) -> list[str]:
    """Return the member names of a range, `drive[1..3].slide` -> [`drive[1].slide`, ...]; [`name`] without a range."""
    match = _RANGE.search(name)
    if match is None:
        return [name]
    return [f"{name[: match.start()]}[{i}]{name[match.end() :]}" for i in range(1, int(match[1]) + 1)]
