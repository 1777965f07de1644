"""What goes into a results file: the plan of a sweep, its points, the system, and the error for a file that fails."""

import enum
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray


class ResultsError(RuntimeError):
    """A results file that cannot be written, read or continued; the message names the file and the reason."""

    exit_code = 2


@dataclass(frozen=True)
class LevelChoice:
    """A level of fidelity that a tolerance chose.

    Attributes:
        level: the chosen one.
        tolerance: largest relative error that was allowed.
        errors: relative error of every level, cheapest first; NaN where it could not be compared. The last level is
            what the others are compared with.
        refusals: why a level cannot take part, by level.
        together: error of all choices of the scene.
    """

    level: str
    tolerance: float
    errors: Mapping[str, float]
    refusals: Mapping[str, str]
    together: float

    @property
    def error(self) -> float:
        """Relative error of the chosen level alone."""
        return self.errors[self.level]

    def sentence(self, instance: str) -> str:
        """Return the choice for an instance on one line, with the errors of all levels."""
        *_, highest = self.errors
        words = {level: self.refusals.get(level) or f"{100 * error:.3g} %" for level, error in self.errors.items()}
        words[highest] = "the reference"
        others = "; ".join(f"{level}: {words[level]}" for level in self.errors if level != self.level)
        joint = "" if self.together in (0.0, self.error) else f", with the other choices {100 * self.together:.3g} %"
        error = "the reference" if self.level == highest else f"error {100 * self.error:.3g} %{joint}"
        return f"{instance}: level {self.level} ({error}; tolerance {100 * self.tolerance:.3g} %); {others}"


@dataclass(frozen=True)
class OrderChoice:
    """An order of steps that was computed (`analysis/order.py`), of the components that step after the sampled ones.

    Attributes:
        order, own: the chosen one, and that of the scene.
        about: what shall err least, `response` or `modes`.
        error, own_error: relative error of the two; infinite where one is unstable.
        compared: orders that were compared; `is_complete` where these are all that differ.
    """

    order: tuple[str, ...]
    own: tuple[str, ...]
    about: str
    error: float
    own_error: float
    compared: int
    is_complete: bool

    @property
    def sentence(self) -> str:
        """The choice on one line, with both errors."""
        how = "all that differ" if self.is_complete else "exchanging two components until none is better"
        compared = f"{self.compared} orders compared, {how}" if self.compared > 1 else "no other makes a difference"
        own = ", the scene's own" if self.order == self.own else f"; in the scene's own {_erring(self.own_error)}"
        found = f"order {', '.join(self.order)}: {self.about} {_erring(self.error)}{own}"
        return f"{found}; {compared}"


@dataclass(frozen=True)
class AlgorithmChoice:
    """An algorithm that `auto` took (`analysis/algorithm_choice.py`): the cheapest whose error is within the tolerance.

    Attributes:
        algorithm: the one taken.
        step_size: at which it was judged [s].
        tolerance: largest relative error that was allowed.
        about: what the errors are of, `response` or `modes`.
        errors: relative error of each that was tried, the cheapest first; infinite where its steps change stability.
        refusals: why one is not offered, by algorithm.
        unknown: why no error is known; empty where one is.
    """

    algorithm: str
    step_size: float
    tolerance: float
    about: str = "response"
    errors: Mapping[str, float] = field(default_factory=dict)
    refusals: Mapping[str, str] = field(default_factory=dict)
    unknown: str = ""

    @property
    def error(self) -> float:
        """Relative error of the algorithm taken, NaN where it is not known."""
        return self.errors.get(self.algorithm, float("nan"))

    @property
    def sentence(self) -> str:
        """The choice on one line, with the errors of all that were tried."""
        if self.unknown:
            return f"algorithm {self.algorithm}; the error of its steps is not known: {self.unknown}"
        others = [f"{name} {_erring(error)}" for name, error in self.errors.items() if name != self.algorithm]
        others += [f"{name} is not offered ({why})" for name, why in self.refusals.items()]
        found = f"algorithm {self.algorithm}: {self.about} {_erring(self.error)} at steps of {self.step_size:.4g} s"
        return "; ".join([f"{found} (tolerance {100 * self.tolerance:.3g} %)", *others])


def _erring(error: float) -> str:
    """Return an error in words."""
    return f"within {100 * error:.3g} %" if error < float("inf") else "unstable"


@dataclass(frozen=True)
class InstanceRecord:
    """What a result depends on of one FMU instance; `start` holds the start values that were set, by variable.

    `choice` says how its level was chosen, where the scene did not name one; `is_foreign`: whether another maker's.
    """

    instance: str
    name: str
    file: str
    sha256: str
    fmi_version: int
    level: str = ""
    solver: str = ""
    start: Mapping[str, float] = field(default_factory=dict)
    choice: LevelChoice | None = None
    is_foreign: bool = False


@dataclass(frozen=True)
class SystemRecord:
    """The system of a result: the scene as text, its FMUs, the states at the operating point by full name.

    `order` says how the order of steps was chosen, where it was computed; `algorithm` which one `auto` took.
    """

    title: str
    scene: str
    instances: Sequence[InstanceRecord] = ()
    operating_point: Mapping[str, float] = field(default_factory=dict)
    order: OrderChoice | None = None
    algorithm: AlgorithmChoice | None = None


@dataclass(frozen=True)
class ErrorEstimate:
    """How far the communication step sets a recorded variable off: at most, in its unit, and `relative` to its size."""

    absolute: float
    relative: float


class Status(enum.IntEnum):
    """What became of a point of a sweep; `LIMITED` was measured while a limit acted, so it is no linear response."""

    PENDING = 0
    DONE = 1
    NOT_SETTLED = 2
    FAILED = 3
    LIMITED = 4


@dataclass(frozen=True)
class Signal:
    """A variable that is excited or measured, by full name; `amplitude` is that of an excited one, in its unit."""

    name: str
    unit: str
    amplitude: float = float("nan")


@dataclass(frozen=True)
class Theory:
    """The linear response that a sweep is expected to find: `response` has shape (frequencies, outputs, inputs)."""

    frequency: NDArray[np.float64]
    response: NDArray[np.complex128]


@dataclass(frozen=True)
class Plan:
    """What a sweep measures and expects: the axes of `/bode`, `settings`, the attributes of `/sweep`, and `/theory`.

    `step_error` is the relative error that its communication steps make, (frequencies, outputs, inputs); `None` where
    that is not known.
    """

    frequency: NDArray[np.float64]
    outputs: Sequence[Signal]
    inputs: Sequence[Signal]
    settings: Mapping[str, Any] = field(default_factory=dict)
    theory: Theory | None = None
    step_error: NDArray[np.float64] | None = None


@dataclass(frozen=True)
class Point:
    """The result at one input and one frequency, by index; arrays have shape (outputs,).

    `response` is output per input, `remaining_transient` the estimated relative error of each entry.
    """

    input: int
    frequency: int
    status: Status
    response: NDArray[np.complex128] | None = None
    harmonic_distortion: NDArray[np.float64] | None = None
    remaining_transient: NDArray[np.float64] | None = None
    wall_time: float = float("nan")
    message: str = ""
