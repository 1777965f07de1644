"""What a part offers to be calibrated, and what a calibration finds; `fit.py` calibrates."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hfsa.components._modelling.model import ModelError
from hfsa.components._modelling.study import Range, Study

Objective = Literal["least_squares", "largest"]
Table = Mapping[str, NDArray[np.float64]]
"""Columns of a table by name, (rows,) each."""


@dataclass(frozen=True)
class Calibration:
    """What a part offers to be calibrated.

    Attributes:
        study: dimensions and responses.
        free: dimensions that are fitted unless others are named; may be empty.
        sizes: errors that weigh alike, by response; by default the root mean square of the column.
        bounds: usual bounds by dimension; by default none.
        linear: names of the dimensions in which three by three numbers are a Jacobian, and those of the responses.
        stroke: values of these dimensions, lowest and highest, at whose corners a Jacobian is compared.
        document: argument of the part that takes the file of the result; empty for none.
    """

    study: Study
    free: Sequence[str] = ()
    sizes: Mapping[str, float] = field(default_factory=dict)
    bounds: Mapping[str, Range] = field(default_factory=dict)
    linear: tuple[Sequence[str], Sequence[str]] = ((), ())
    stroke: Range = (0.0, 1.0)
    document: str = ""

    @property
    def units(self) -> dict[str, str]:
        """Units of all columns that a table may have."""
        named = {**self.study.variables, **self.study.responses}
        return {name: value.unit for name, value in named.items()}

    def corners(self, jacobian: NDArray[np.float64]) -> Table:
        """Return the table of a Jacobian, shape (responses, dimensions): responses at the corners of the stroke.

        Raises:
            ModelError: a part without such a Jacobian, or one of another shape.
        """
        inputs, outputs = self.linear
        if not inputs:
            raise ModelError(f"{self.study.title} has no Jacobian to calibrate by; give a table with a header")
        if jacobian.shape != (len(outputs), len(inputs)):
            raise ModelError(
                f"the Jacobian has shape {jacobian.shape}, expected {(len(outputs), len(inputs))}: "
                f"{', '.join(outputs)} per {', '.join(inputs)}"
            )
        grid = np.array(np.meshgrid(*[self.stroke] * len(inputs), indexing="ij")).reshape(len(inputs), -1)
        grid = grid[:, np.any(grid != 0, axis=0)]  # a Jacobian says nothing of the origin
        return dict(zip((*inputs, *outputs), (*grid, *(jacobian @ grid)), strict=True))


class Fit(NamedTuple):
    """A calibrated part.

    Attributes:
        task: what was calibrated.
        free: names of the free dimensions.
        measured: names of the measured responses.
        rows: number of rows.
        values: values of the free dimensions by name.
        deviations: their standard deviations, infinite where not determined, NaN where not known.
        at_bound: `lower`, `upper` or empty, by name.
        singular_values: of dr/dp in units of the present values, descending.
        directions: directions that are not determined, by name of the dimension, relative to its present value.
        others: value and standard deviation of each response that is not measured, by name.
        before, after: errors by response, (rows,) each, in SI units, at the start and at the end.
        sizes: errors that weigh alike, by response.
        objective: what was minimised.
        message: how the solver ended.
        is_converged: whether it converged.
    """

    task: Calibration
    free: Sequence[str]
    measured: Sequence[str]
    rows: int
    values: Mapping[str, float]
    deviations: Mapping[str, float]
    at_bound: Mapping[str, str]
    singular_values: NDArray[np.float64]
    directions: Sequence[Mapping[str, float]]
    others: Mapping[str, tuple[float, float]]
    before: Table
    after: Table
    sizes: Mapping[str, float]
    objective: Objective
    message: str
    is_converged: bool

    @property
    def rank(self) -> int:
        """Number of determined directions."""
        return len(self.free) - len(self.directions)

    def weighted(self, errors: Table) -> NDArray[np.float64]:
        """Return the sum of squares of each row, (rows,), in units of the sizes."""
        return sum((errors[name] / self.sizes[name]) ** 2 for name in self.measured)  # type: ignore[return-value]
