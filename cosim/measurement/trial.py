"""Runs of one system beside each other: each is made, measured by groups of outputs, and thinned for drawing.

    outcome = perform(Trial(plan, path, outputs))
    outcome.groups[0].peak, outcome.limits, outcome.sampling, outcome.failure

A group is the outputs whose names differ in their indices only, `tracking.axis[1..3].error`. Of its members v(t)

    peak    largest |v| over members and time
    rms     largest root mean square of a member over time
    final   largest |v| at the end

A trial that fails says so and when, and keeps what was recorded until then: it is an outcome, not an exception.
"""

import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.sampling import SamplingLimit, sampling_limit
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.measurement.limit_flags import ActiveLimit, active_limits
from hfsa.cosim.measurement.pool import is_stopping
from hfsa.cosim.measurement.run import RunPlan, run
from hfsa.cosim.measurement.verification import shares, verify
from hfsa.cosim.results.files import ErrorEstimate, ResultsError, read_run
from hfsa.cosim.systems.errors import StructureError

CRASHED = "the process ended without a result: an FMU must have crashed"
"""What is said of a trial whose process died."""

_INDEX = re.compile(r"\[(\d+)\]")
_DRAWN = 1500
"""Stretches of time of which a curve keeps the lowest and the highest value."""


@dataclass(frozen=True)
class Trial:
    """A run to be made into the file `path`, with `force` as `run`.

    The `outputs` and further `signals` (full names) are judged, with `verified` their errors as well.
    """

    plan: RunPlan
    path: Path
    outputs: Sequence[str]
    signals: Sequence[str] = ()
    verified: bool = False
    force: bool = False


@dataclass(frozen=True)
class Curve:
    """One output over time [s], thinned: arrays of one shape."""

    output: str
    time: NDArray[np.float64]
    values: NDArray[np.float64]


@dataclass(frozen=True)
class OutputGroup:
    """Outputs that differ in indices only, and what a run made of them.

    Attributes:
        name: theirs without indices, `tracking.axis.error`.
        unit: SI.
        peak, rms, final: as in the module's docstring.
        curves: of the members.
    """

    name: str
    unit: str
    peak: float
    rms: float
    final: float
    curves: tuple[Curve, ...]

    @property
    def key(self) -> tuple[str, str]:
        """What is one group in all runs: its name and unit."""
        return self.name, self.unit

    @property
    def members(self) -> tuple[str, ...]:
        """Full names of the outputs."""
        return tuple(curve.output for curve in self.curves)

    @property
    def label(self) -> str:
        """The members' names as one, `tracking.axis[1..3].error`."""
        indices = [_INDEX.findall(name) for name in self.members]
        spans = iter([sorted(set(map(int, column))) for column in zip(*indices, strict=True)])

        def span(_: re.Match[str]) -> str:
            """An index, or the range of the indices that are there."""
            found = next(spans)
            return f"[{found[0]}]" if len(found) == 1 else f"[{found[0]}..{found[-1]}]"

        return _INDEX.sub(span, self.members[0])


@dataclass(frozen=True)
class Outcome:
    """What became of a trial.

    Attributes:
        path: its results file.
        groups: in the order of the outputs.
        limits: those that acted, the earliest first.
        warnings: of instances, and why there is no sampling limit.
        steps: taken; `stop_time` [s] reached; `wall_time` [s] of the run alone.
        errors: estimates by recorded variable, of a trial that is verified.
        sampling: the sampling limit, `None` where nothing is sampled or none was found.
        failure: why the run ended early, empty where it did not; `failure_time` [s] where that is known.
    """

    path: Path
    groups: tuple[OutputGroup, ...] = ()
    limits: tuple[ActiveLimit, ...] = ()
    warnings: tuple[str, ...] = ()
    steps: int = 0
    stop_time: float = 0.0
    wall_time: float = float("nan")
    errors: Mapping[str, ErrorEstimate] = field(default_factory=dict)
    sampling: SamplingLimit | None = None
    failure: str = ""
    failure_time: float | None = None


def perform(trial: Trial, report: Callable[[float], None] | None = None) -> Outcome:
    """Make a run and measure it; a run that cannot go on, or whose file cannot be written, is a failure it tells.

    `report` is called with the part done, 0 to 1.
    """

    def go_on(part: float) -> None:
        """Tell of the part done; end where another process was told to."""
        if is_stopping():
            raise KeyboardInterrupt
        if report is not None:
            report(part)

    first, second = shares(go_on) if trial.verified else (go_on, go_on)
    begin, failure, failure_time = time.perf_counter(), "", None
    warnings: list[str] = []
    try:
        warnings += run(trial.plan, trial.path, first, trial.force).warnings.values()
    except StepError as error:
        failure, failure_time = str(error), error.time
    except ResultsError as error:
        return Outcome(trial.path, failure=str(error))
    wall_time = time.perf_counter() - begin
    values, units = read_run(trial.path)
    judged = (*trial.outputs, *trial.signals)
    reached = np.all([np.isfinite(values[name]) for name in judged], axis=0)
    at = values["time"][reached]
    errors, unsure = _errors(trial, second) if trial.verified and not failure else ({}, ())
    sampling, message = _sampling(trial)
    return Outcome(
        trial.path,
        measure(at, {name: values[name][reached] for name in judged}, units) if len(at) else (),
        tuple(active_limits(values["time"], values)),
        (*warnings, *unsure, *message),
        max(len(at) - 1, 0),
        float(at.max(initial=0.0)),
        wall_time,
        errors,
        sampling,
        failure,
        failure_time,
    )


def _errors(trial: Trial, report: Callable[[float], None]) -> tuple[Mapping[str, ErrorEstimate], tuple[str, ...]]:
    """Return the error estimates of a run that is complete, and what is to be said of them, or why there are none."""
    try:
        verification = verify(trial.plan, trial.path, report)
    except (StepError, ResultsError) as error:
        return {}, (f"no error estimate is known: {error}",)
    sentence = verification.excess(trial.plan.tolerance)
    return verification.errors, (sentence,) if sentence else ()


def measure(
    time: NDArray[np.float64], values: Mapping[str, NDArray[np.float64]], units: Mapping[str, str]
) -> tuple[OutputGroup, ...]:
    """Return groups of outputs, values by full name over time [s], evenly spaced, all of one shape (points,)."""
    members: dict[tuple[str, str], list[str]] = {}
    for name in values:
        members.setdefault((_INDEX.sub("", name), units[name]), []).append(name)
    groups = []
    for (name, unit), names in members.items():
        v = np.array([values[member] for member in names])
        size = np.abs(v)
        with np.errstate(over="ignore"):  # of a run that diverged
            rms = np.sqrt(np.mean(v**2, axis=1)).max()
        curves = tuple(Curve(member, *thinned(time, row)) for member, row in zip(names, v, strict=True))
        groups.append(OutputGroup(name, unit, float(size.max()), float(rms), float(size[:, -1].max()), curves))
    return tuple(groups)


def thinned(
    time: NDArray[np.float64], values: NDArray[np.float64], stretches: int = _DRAWN
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the points at which a curve is lowest and highest in each of so many stretches, its ends included."""
    n = len(values)
    if n <= 2 * stretches:
        return time, values
    length = -(-n // stretches)
    filled = np.concatenate([values, np.full(-n % length, values[-1])]).reshape(-1, length)
    first = length * np.arange(len(filled))
    kept = np.unique(np.concatenate([[0, n - 1], first + filled.argmin(axis=1), first + filled.argmax(axis=1)]))
    kept = kept[kept < n]
    return time[kept], values[kept]


def _sampling(trial: Trial) -> tuple[SamplingLimit | None, tuple[str, ...]]:
    """Return the sampling limit of what runs, or why there is none."""
    assembly = trial.plan.assembly
    with assembly.open() as instances:
        try:
            return sampling_limit(assembly.system, instances, trial.outputs), ()
        except (StructureError, StepError) as error:
            return None, (f"no sampling limit is known: {error}",)
