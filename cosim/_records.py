"""What goes into a results file: the plan of a sweep, its points, the system, and the error for a file that fails."""

import enum
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray


class ResultsError(RuntimeError):
    """A results file that cannot be written, read or continued; the message names the file and the reason."""


@dataclass(frozen=True)
class InstanceRecord:
    """What a result depends on of one FMU instance; `start` holds the start values that were set, by variable."""

    instance: str
    name: str
    file: str
    sha256: str
    fmi_version: int
    level: str = ""
    solver: str = ""
    start: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class SystemRecord:
    """The system of a result: the scene as text, its FMUs, the states at the operating point by full name."""

    title: str
    scene: str
    instances: Sequence[InstanceRecord] = ()
    operating_point: Mapping[str, float] = field(default_factory=dict)


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
    """What a sweep measures and expects: the axes of `/bode`, `settings`, the attributes of `/sweep`, and `/theory`."""

    frequency: NDArray[np.float64]
    outputs: Sequence[Signal]
    inputs: Sequence[Signal]
    settings: Mapping[str, Any] = field(default_factory=dict)
    theory: Theory | None = None


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
