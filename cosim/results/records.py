"""Records of a results file: the plan of a sweep, its points, the system and the choices made for it."""

import enum
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray


class ResultsError(RuntimeError):
    """Error of a results file that cannot be written, read or resumed; the message names the file and the reason."""

    exit_code = 2


@dataclass(frozen=True)
class LevelChoice:
    """Level of fidelity chosen by the tolerance.

    Attributes:
        level: the chosen level.
        tolerance: largest relative error allowed.
        errors: relative error of every level, cheapest first; NaN where it could not be compared. The last level is
            the reference of the others.
        refusals: reason why a level cannot be used, by level.
        together: relative error of all choices of the scene together.
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
    """Computed order of steps (`analysis/order.py`) of the components that step after the sampled ones.

    Attributes:
        order, own: the chosen order, and the order of the scene.
        about: quantity whose error is minimised, `response` or `modes`.
        error, own_error: relative errors of these two orders; infinite for an unstable one.
        compared: number of orders compared.
        is_complete: whether these are all orders with different results.
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
        """The choice in one line, with both errors."""
        how = "all different ones" if self.is_complete else "by exchanging pairs of components"
        compared = f"{self.compared} orders compared, {how}" if self.compared > 1 else "all orders are equivalent"
        own = ", the scene's order" if self.order == self.own else f"; the scene's order {_error_text(self.own_error)}"
        found = f"order {', '.join(self.order)}: {self.about} {_error_text(self.error)}{own}"
        return f"{found}; {compared}"


@dataclass(frozen=True)
class AlgorithmChoice:
    """Algorithm chosen by `auto` (`analysis/algorithm_choice.py`): the cheapest with an error within the tolerance.

    Attributes:
        algorithm: the chosen algorithm.
        step_size: communication step size of the comparison [s].
        tolerance: largest relative error allowed.
        about: quantity that the errors refer to, `response` or `modes`.
        errors: relative error of each compared algorithm, the cheapest first; infinite where steps change stability.
        refusals: reason why an algorithm is not offered, by algorithm.
        unknown: reason why no error is known; empty where one is.
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
        """Relative error of the chosen algorithm, NaN where it is not known."""
        return self.errors.get(self.algorithm, float("nan"))

    @property
    def sentence(self) -> str:
        """The choice in one line, with the errors of all compared algorithms."""
        if self.unknown:
            return f"algorithm {self.algorithm}; the error of its steps is not known: {self.unknown}"
        others = [f"{name} {_error_text(error)}" for name, error in self.errors.items() if name != self.algorithm]
        others += [f"{name} is not offered ({why})" for name, why in self.refusals.items()]
        found = f"algorithm {self.algorithm}: {self.about} {_error_text(self.error)} at steps of {self.step_size:.4g} s"
        return "; ".join([f"{found} (tolerance {100 * self.tolerance:.3g} %)", *others])


def _error_text(error: float) -> str:
    """Return an error as text."""
    return f"within {100 * error:.3g} %" if error < float("inf") else "unstable"


@dataclass(frozen=True)
class InstanceRecord:
    """FMU instance of a result: its file and hash, level and solver.

    Attributes:
        start: start values that were set, by variable.
        choice: choice of its level; `None` where the scene names the level.
        is_foreign: whether the FMU is of another maker.
        sample_time: time between its ticks [s]; `None` where it is not sampled.
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
    sample_time: float | None = None


@dataclass(frozen=True)
class DrivenInput:
    """Input, by full name, that a signal drives: its text for the command line, and a hash of the data behind it."""

    name: str
    signal: str
    sha256: str = ""


@dataclass(frozen=True)
class SystemRecord:
    """System of a result: the scene as text and its FMU instances.

    Attributes:
        operating_point: states at the operating point by full name.
        order: computed order of steps; `None` where the order is the scene's.
        algorithm: choice of `auto`; `None` where the scene names the algorithm.
        left_out: sentence on the states and outputs of the scene that the FMUs do not have; empty where they have all.
        driven: inputs that signals of the user's drive.
    """

    title: str
    scene: str
    instances: Sequence[InstanceRecord] = ()
    operating_point: Mapping[str, float] = field(default_factory=dict)
    order: OrderChoice | None = None
    algorithm: AlgorithmChoice | None = None
    left_out: str = ""
    driven: Sequence[DrivenInput] = ()


@dataclass(frozen=True)
class ErrorEstimate:
    """Largest error of a recorded variable due to the communication step, in its unit and `relative` to its size."""

    absolute: float
    relative: float


class Status(enum.IntEnum):
    """Status of a point of a sweep.

    The response of a `LIMITED` point is not linear, as a limit was active. A point `NOT_EXCITED` is at a line of a
    multisine that belongs to another input, and stays without a response. The response of a point that `DISAGREES` has
    settled, but is not that of the linearised FMUs.
    """

    PENDING = 0
    DONE = 1
    NOT_SETTLED = 2
    FAILED = 3
    LIMITED = 4
    NOT_EXCITED = 5
    DISAGREES = 6


@dataclass(frozen=True)
class Signal:
    """Excited or measured variable by full name; `amplitude` is the amplitude of an excited one, in its unit."""

    name: str
    unit: str
    amplitude: float = float("nan")


@dataclass(frozen=True)
class Theory:
    """Linear response to compare a sweep with: `response` has shape (frequencies, outputs, inputs)."""

    frequency: NDArray[np.float64]
    response: NDArray[np.complex128]


@dataclass(frozen=True)
class Lines:
    """Sines of a multisine: `amplitude`, in the unit of each input, and `phase` [rad] at time 0.

    Both are (frequencies, inputs), NaN where an input is not excited; `crest_factor` is (inputs,), that of each sum.
    """

    amplitude: NDArray[np.float64]
    phase: NDArray[np.float64]
    crest_factor: NDArray[np.float64]


@dataclass(frozen=True)
class Plan:
    """Plan of a sweep: its axes, settings, and expected response.

    Attributes:
        frequency, outputs, inputs: axes of `/bode`; frequency in Hz.
        settings: attributes of `/sweep`.
        theory: linear response for `/theory`, if known.
        step_error: relative error due to the communication steps, (frequencies, outputs, inputs); `None` if unknown.
        has_branches: whether the inputs are swept upwards and downwards.
        lines: sines of a multisine, whose peak is the amplitude of the input; `None` for one sine at a time.
    """

    frequency: NDArray[np.float64]
    outputs: Sequence[Signal]
    inputs: Sequence[Signal]
    settings: Mapping[str, Any] = field(default_factory=dict)
    theory: Theory | None = None
    step_error: NDArray[np.float64] | None = None
    has_branches: bool = False
    lines: Lines | None = None


@dataclass(frozen=True)
class Point:
    """Result at one input and one frequency, given by their indices; arrays have shape (outputs,).

    `response` is output per input, `harmonics` the mean to the third harmonic per input, shape (4, outputs), `None` for
    a method that does not measure them, `remaining_transient` the estimated relative transient left in each entry,
    `steps` the number of communication steps that the point took; `is_downward` marks a point of a downward sweep.
    `warnings` are number and first sentence of the warnings of each instance (`told` of a master).
    """

    input: int
    frequency: int
    status: Status
    response: NDArray[np.complex128] | None = None
    harmonic_distortion: NDArray[np.float64] | None = None
    remaining_transient: NDArray[np.float64] | None = None
    wall_time: float = float("nan")
    message: str = ""
    steps: int = 0
    is_downward: bool = False
    harmonics: NDArray[np.float64] | None = None
    warnings: Mapping[str, tuple[int, str]] = field(default_factory=dict)
