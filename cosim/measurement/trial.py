"""Trials: runs for a comparison, each evaluated by groups of outputs and thinned for drawing.

    outcome = perform(Trial(plan, path, outputs))
    outcome.groups[0].peak, outcome.limits, outcome.sampling, outcome.failure

A group consists of the outputs whose names differ in their indices only, `tracking.axis[1..3].error`. For its members
v(t)

    peak    largest |v| over members and time
    rms     largest root mean square of a member over time
    final   largest |v| at the end

A failed trial is an outcome, not an exception: it has the message, the time of failure and all values until then.
"""

import re
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.sampling import SamplingLimit, sampling_limit
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.fmi.isolation.waiting import limited
from hfsa.cosim.measurement.limit_flags import ActiveLimit, active_limits, recorded_flags
from hfsa.cosim.measurement.pool import is_stopping
from hfsa.cosim.measurement.run import RunPlan, run
from hfsa.cosim.measurement.verification import shares, verify
from hfsa.cosim.results.files import ErrorEstimate, ResultsError, read_run
from hfsa.cosim.systems.errors import StructureError

CRASHED = "the process ended without a result: an FMU must have crashed"
"""Failure of a trial whose process died."""

_INDEX = re.compile(r"\[(\d+)\]")
_DRAWN = 1500
"""Intervals of a thinned curve, each with its lowest and its highest value."""


@dataclass(frozen=True)
class Trial:
    """A planned run into the file `path`, with `force` as in `run`.

    The `outputs` and further `signals` (full names) are evaluated, and with `verified` their errors as well.
    `time_limit` is the longest time [s] that the run may take, `None` for any.
    """

    plan: RunPlan
    path: Path
    outputs: Sequence[str]
    signals: Sequence[str] = ()
    verified: bool = False
    force: bool = False
    time_limit: float | None = None


@dataclass(frozen=True)
class Curve:
    """One output over time [s], thinned: arrays of equal shape."""

    output: str
    time: NDArray[np.float64]
    values: NDArray[np.float64]


@dataclass(frozen=True)
class OutputGroup:
    """Outputs whose names differ in indices only, evaluated over a run.

    Attributes:
        name: their common name without indices, `tracking.axis.error`.
        unit: SI unit.
        peak, rms, final: as in the docstring of the module.
        curves: thinned curves of the members.
    """

    name: str
    unit: str
    peak: float
    rms: float
    final: float
    curves: tuple[Curve, ...]

    @property
    def key(self) -> tuple[str, str]:
        """Identity of the group in all runs: its name and unit."""
        return self.name, self.unit

    @property
    def members(self) -> tuple[str, ...]:
        """Full names of the outputs."""
        return tuple(curve.output for curve in self.curves)

    @property
    def label(self) -> str:
        """Common name of the members, `tracking.axis[1..3].error`."""
        indices = [_INDEX.findall(name) for name in self.members]
        spans = iter([sorted(set(map(int, column))) for column in zip(*indices, strict=True)])

        def span(_: re.Match[str]) -> str:
            """Return an index, or the range of the existing indices."""
            found = next(spans)
            return f"[{found[0]}]" if len(found) == 1 else f"[{found[0]}..{found[-1]}]"

        return _INDEX.sub(span, self.members[0])


@dataclass(frozen=True)
class Outcome:
    """Outcome of a trial.

    Attributes:
        path: results file.
        groups: groups in the order of the outputs.
        limits: limits that were active, the earliest first.
        warnings: warnings of instances, and the reason where no sampling limit is known.
        steps: number of steps; `stop_time`: reached time [s]; `wall_time`: duration of the run alone [s].
        errors: error estimates by recorded variable, of a verified trial.
        sampling: sampling limit, `None` where nothing is sampled or no limit is known.
        failure: message of a run that ended early, else empty; `failure_time` [s] where it is known.
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
    """Run a trial within its time limit and evaluate it, as `_perform`."""
    with limited(trial.time_limit):
        return _perform(trial, report)


def _perform(trial: Trial, report: Callable[[float], None] | None) -> Outcome:
    """Run a trial and evaluate it; the outcome contains the failure of a step or of writing the file.

    `report` receives the completed fraction, 0 to 1.
    """

    def report_progress(part: float) -> None:
        """Report the completed fraction; end the run after a stop request to this process."""
        if is_stopping():
            raise KeyboardInterrupt
        if report is not None:
            report(part)

    first, second = shares(report_progress) if trial.verified else (report_progress, report_progress)
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
        tuple(active_limits(values["time"], recorded_flags(trial.path, values))),
        (*warnings, *unsure, *message),
        max(len(at) - 1, 0),
        float(at.max(initial=0.0)),
        wall_time,
        errors,
        sampling,
        failure,
        failure_time,
    )


def perform_elsewhere(trial: Trial) -> tuple[Outcome, bytes]:
    """Run a trial on another machine: its outcome, and the content of its file, which is empty where there is none."""
    with tempfile.TemporaryDirectory(prefix="hfsa-", ignore_cleanup_errors=True) as folder:
        path = Path(folder, trial.path.name)
        outcome = perform(replace(trial, path=path))
        return replace(outcome, path=trial.path), path.read_bytes() if path.is_file() else b""


def _errors(trial: Trial, report: Callable[[float], None]) -> tuple[Mapping[str, ErrorEstimate], tuple[str, ...]]:
    """Return the error estimates of a complete run, and warnings about them or the reason why there are none."""
    try:
        verification = verify(trial.plan, trial.path, report)
    except (StepError, ResultsError) as error:
        return {}, (f"no error estimate is known: {error}",)
    sentence = verification.excess(trial.plan.tolerance)
    return verification.errors, (sentence,) if sentence else ()


def measure(
    time: NDArray[np.float64], values: Mapping[str, NDArray[np.float64]], units: Mapping[str, str]
) -> tuple[OutputGroup, ...]:
    """Return groups of outputs; `values` by full name and `time` [s], evenly spaced, have the shape (points,)."""
    members: dict[tuple[str, str], list[str]] = {}
    for name in values:
        members.setdefault((_INDEX.sub("", name), units[name]), []).append(name)
    groups = []
    for (name, unit), names in members.items():
        v = np.array([values[member] for member in names])
        size = np.abs(v)
        with np.errstate(over="ignore"):  # the squares of a diverged run overflow
            rms = np.sqrt(np.mean(v**2, axis=1)).max()
        curves = tuple(Curve(member, *thinned(time, row)) for member, row in zip(names, v, strict=True))
        groups.append(OutputGroup(name, unit, float(size.max()), float(rms), float(size[:, -1].max()), curves))
    return tuple(groups)


def thinned(
    time: NDArray[np.float64], values: NDArray[np.float64], intervals: int = _DRAWN
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lowest and highest points of a curve in each of a number of intervals, and its end points."""
    n = len(values)
    if n <= 2 * intervals:
        return time, values
    length = -(-n // intervals)
    filled = np.concatenate([values, np.full(-n % length, values[-1])]).reshape(-1, length)
    first = length * np.arange(len(filled))
    kept = np.unique(np.concatenate([[0, n - 1], first + filled.argmin(axis=1), first + filled.argmax(axis=1)]))
    kept = kept[kept < n]
    return time[kept], values[kept]


def _sampling(trial: Trial) -> tuple[SamplingLimit | None, tuple[str, ...]]:
    """Return the sampling limit of the trial's system, or the reason why none is known."""
    assembly = trial.plan.assembly
    with assembly.open() as instances:
        try:
            return sampling_limit(assembly.system, instances, trial.outputs), ()
        except (StructureError, StepError) as error:
            return None, (f"no sampling limit is known: {error}",)
