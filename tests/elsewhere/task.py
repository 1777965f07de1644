"""What a tool is asked to do, for its own environment: it imports numpy and the standard library only."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Task:
    """One FMU with moving inputs, or one package.

    Attributes:
        file: path of the `.fmu` or `.ssp`.
        fmi: version, 2 or 3.
        interface: `CS`, `ME` or `SSP`.
        name, token: model identifier, and GUID or instantiation token.
        inputs, outputs: names of variables; of a package `element.variable`.
        references: value references of inputs and outputs.
        step_size: communication step [s].
        signals: inputs at the communication points, (steps + 1, inputs).
        has_events: whether it has ticks, which are time events in Model Exchange.
    """

    file: str
    fmi: int
    interface: str
    name: str
    token: str
    inputs: list[str]
    outputs: list[str]
    references: dict[str, int]
    step_size: float
    signals: list[list[float]]
    has_events: bool

    @property
    def steps(self) -> int:
        """Number of communication steps."""
        return len(self.signals) - 1

    @property
    def times(self) -> np.ndarray:
        """Communication points [s], (steps + 1,)."""
        return np.arange(self.steps + 1) * self.step_size

    @property
    def values(self) -> np.ndarray:
        """Inputs at the communication points, (steps + 1, inputs)."""
        return np.array(self.signals).reshape(self.steps + 1, len(self.inputs))

    @property
    def table(self) -> np.ndarray:
        """Times and inputs as the structured array of fmpy."""
        columns = [("time", float), *((name, float) for name in self.inputs)]
        return np.array([tuple(row) for row in np.column_stack([self.times, self.values])], dtype=columns)

    def write(self, file: Path) -> None:
        """Write the task as JSON."""
        file.write_text(json.dumps(asdict(self)))


def read_task(file: Path) -> Task:
    """Return a task as `write` wrote it."""
    return Task(**json.loads(file.read_text()))
