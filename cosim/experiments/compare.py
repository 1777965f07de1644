"""Comparison of runs of one scene on the same motion, with different values of some arguments.

    compared = compare("stage_tracking", {"law": ["pd", "ctc"]}, {"actuator": "force"}, jobs=2)
    [run.outcome.groups[0].peak for run in compared.runs]

All runs are prepared and checked before the first begins; a run that fails later does not affect the others.
"""

import contextlib
import dataclasses
import itertools
import os
import re
import warnings
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from hfsa.cosim.assembly import cluster
from hfsa.cosim.assembly.native_loop import chosen_loop
from hfsa.cosim.experiments.arguments import checked
from hfsa.cosim.experiments.run import SineInput, prepare
from hfsa.cosim.experiments.setup import Warn, set_up
from hfsa.cosim.measurement import pool
from hfsa.cosim.measurement.trial import CRASHED, Outcome, Trial, perform, perform_elsewhere
from hfsa.cosim.measurement.verification import check_verifiable
from hfsa.cosim.results.files import AlgorithmChoice, OrderChoice, ResultsError
from hfsa.cosim.results.received import write_received
from hfsa.cosim.results.target import check_new
from hfsa.cosim.signals.prefixes import readable
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.notebook import drawn_by, summarized, summary
from hfsa.cosim.systems.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_UNSAFE = re.compile(r"[^\w.+,=-]+")
_LONGEST_NAME = 150


@dataclass(frozen=True)
class Run:
    """Run of a comparison: values of the compared arguments, as typed, and the outcome.

    Attributes:
        order: computed order of steps; `None` where the order is the scene's.
        algorithm: choice of `auto`; `None` where the scene names the algorithm.
    """

    values: Mapping[str, Any]
    outcome: Outcome
    order: OrderChoice | None = None
    algorithm: AlgorithmChoice | None = None

    @property
    def label(self) -> str:
        """The values with their names, `law=pd, rate=3e-6`."""
        return _words(self.values)


@dataclass(frozen=True)
class Comparison:
    """Runs of a scene: `scene` is its name or path, `over` the values of each compared argument."""

    scene: str
    title: str
    over: Mapping[str, tuple[Any, ...]]
    runs: tuple[Run, ...]

    def plot(self) -> "Figure":
        """Return the figure of all runs; `ResultsError` where none has anything to draw."""
        outcomes = [run.outcome for run in self.runs]
        if not any(outcome.groups for outcome in outcomes):
            raise ResultsError(f"{self.title}: no run has anything to draw")
        return drawn_by("comparison", "comparison_figure")(self.title, [run.label for run in self.runs], outcomes)

    @summarized
    def _repr_html_(self) -> str:
        """Return the largest value of each group of outputs, run by run, or why a run failed."""
        names = list(dict.fromkeys((group.name, group.unit) for run in self.runs for group in run.outcome.groups))
        rows = []
        for run in self.runs:
            peaks = {group.key: readable(group.peak, group.unit) for group in run.outcome.groups}
            rows.append((run.label, *(peaks.get(name, "") for name in names), run.outcome.failure))
        return summary(self.title, {"scene": self.scene}, ["run", *(f">{name}" for name, _ in names), "failure"], rows)


@checked(zero=("amplitude",))
def compare(
    scene: str | Path | Scene,
    over: Mapping[str, Sequence[Any]],
    parameters: Mapping[str, Any] | None = None,
    *,
    input: str | None = None,  # noqa: A002 (name of the public argument)
    frequency: float | None = None,
    amplitude: float | None = None,
    record: Sequence[str] = (),
    step_size: float | None = None,
    stop_time: float | None = None,
    algorithm: str | None = None,
    tolerance: float | None = None,
    fuse: Sequence[str] = (),
    order: str | None = None,
    algebraic_loops: Literal["solve", "refuse"] = "solve",
    backend: Literal["c", "python"] = "c",
    verify: bool = False,
    keep: Literal["needed", "all"] = "needed",
    time_limit: float | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    folder: str | Path = "results",
    file: Path | None = None,
    force: bool = False,
    warn: Warn = warnings.warn,
    report: Callable[[float, str], None] | None = None,
) -> Comparison:
    """Run a scene once for each combination of the values in `over`, into one file each.

    Args:
        over: values of each compared argument, `{"law": ["pd", "ctc"]}`; the same names as in `parameters`.
        time_limit: longest time [s] of each run, which has failed beyond it (default: none).
        jobs: processes (default: one per processor).
        scheduler: address of a scheduler of dask.distributed, whose workers run instead; files are written here.
        folder: folder of the results files, which are named by the scene and the values.
        file: picture that is written later; `StructureError` where it has the name of a signal.

    The other arguments are those of `run`. All runs are prepared before the first begins; a later failure is an outcome
    (`Run.outcome.failure`), not an error. Raises `StructureError` for a scene that cannot run, and `ResultsError` for
    an existing file, unless `force` replaces it.
    """
    parameters = dict(parameters or {})
    _check_compared(over, parameters)
    show = report or (lambda *_: None)
    combinations = [dict(zip(over, values, strict=True)) for values in itertools.product(*over.values())]
    stem = "scene" if isinstance(scene, Scene) else Path(scene).stem
    paths = _paths(Path(folder), stem, combinations)
    for path in paths:
        check_new(path, force, "--force replaces it, -o names a figure in another folder, where the files go too")
    library = chosen_loop(backend, warn)
    sine = SineInput(input, frequency, amplitude)
    trials, title = [], ""
    for values, path in zip(combinations, paths, strict=True):
        show(0.0, f"building FMUs for {_words(values)}")
        setup = set_up(
            scene,
            {**parameters, **values},
            fuse,
            algebraic_loops,
            order,
            file=file,
            record=record,
            step_size=step_size,
            stop_time=stop_time,
            algorithm=algorithm,
            tolerance=tolerance,
        )
        title = setup.title
        warn_of = partial(_warn_of, values, warn)
        for sentence in setup.disagreements:
            warn_of(sentence)
        ready = prepare(setup, sine, library, warn_of, keep)
        if verify:
            check_verifiable(ready)
        names = tuple(setup.scene.outputs), tuple(setup.signals)
        trials.append(Trial(ready, path, *names, verify, force, time_limit))
    with cluster.on(scheduler) as executor:
        outcomes = _perform(trials, jobs or os.cpu_count() or 1, executor, warn, show)
    runs = tuple(
        Run(values, outcomes[trial.path], trial.plan.record.order, trial.plan.record.algorithm)
        for values, trial in zip(combinations, trials, strict=True)
    )
    for run in runs:
        for message in run.outcome.warnings:
            warn(f"{run.label}: {message}")
    return Comparison(str(scene) if stem != "scene" else stem, title, {n: tuple(v) for n, v in over.items()}, runs)


def _check_compared(over: Mapping[str, Sequence[Any]], parameters: Mapping[str, Any]) -> None:
    """Raise `StructureError` for nothing to compare, and for a name or a value that is given twice."""
    if not over:
        raise StructureError("there is nothing to compare; expected values by name, such as law=pd,ctc")
    for name, values in over.items():
        if name in parameters:
            raise StructureError(f"{name} is given with -p and with --over; expected one of them")
        if not len(values):
            raise StructureError(f"{name} has no values to compare")
        seen: dict[Any, Any] = {}
        for value in values:
            key = _identity_key(value)
            if key in seen:
                same = str(seen[key]) == str(value)
                raise StructureError(f"{name} has the value {value} twice{'' if same else f', as {seen[key]}'}")
            seen[key] = value


def _warn_of(values: Mapping[str, Any], warn: Callable[[str], None], sentence: str) -> None:
    """Warn of the run with some values."""
    warn(f"{_words(values)}: {sentence}")


def _perform(
    trials: Sequence[Trial],
    jobs: int,
    executor: Executor | None,
    warn: Callable[[str], None],
    report: Callable[[float, str], None],
) -> dict[Path, Outcome]:
    """Return the outcomes by file; after Ctrl-C, warn of the finished runs."""
    outcomes: dict[Path, Outcome] = {}

    def progress() -> str:
        """Return the number of finished runs as text."""
        return f"{len(outcomes)} of {len(trials)} runs"

    def report_part(part: float) -> None:
        """Report the progress, with the finished part of the present run."""
        report((len(outcomes) + part) / len(trials), progress())

    is_foreign = any(trial.plan.assembly.is_foreign for trial in trials)
    apart = is_foreign or min(jobs, len(trials)) > 1
    # only a run in this process reports its progress
    work = perform if apart else partial(perform, report=report_part)
    report_part(0.0)
    # a run whose process crashed has left its file
    again = partial(dataclasses.replace, force=True)
    performed = (
        pool.results(work, trials, jobs, apart=is_foreign, again=again)
        if executor is None
        else _performed_elsewhere(trials, executor)
    )
    try:
        with contextlib.closing(performed) as results:
            for trial, outcome in results:
                outcomes[trial.path] = outcome or Outcome(trial.path, failure=CRASHED)
                report_part(0.0)
    except (KeyboardInterrupt, cluster.ClusterError):
        finished = ", ".join(str(path) for path, outcome in outcomes.items() if not outcome.failure)
        warn(f"{progress()} are finished{f': {finished}' if finished else ''}")
        raise
    return outcomes


def _performed_elsewhere(trials: Sequence[Trial], executor: Executor) -> Generator[tuple[Trial, Outcome | None]]:
    """Yield each trial with its outcome from another machine; its file is written here."""
    work = partial(pool.one_at_a_time, perform_elsewhere)
    with contextlib.closing(pool.results(work, trials, executor=executor)) as results:
        for trial, found in results:
            if found is None:
                yield trial, None
                continue
            outcome, content = found
            try:
                if content:
                    write_received(trial.path, content, trial.force)
            except ResultsError as error:
                outcome = Outcome(trial.path, failure=str(error))
            yield trial, outcome


def _paths(folder: Path, stem: str, combinations: Sequence[Mapping[str, Any]]) -> list[Path]:
    """Return a file for each combination, named after its values as far as file names allow."""
    paths: list[Path] = []
    taken: set[str] = set()
    for number, values in enumerate(combinations, 1):
        words = "_".join(f"{name}={value}" for name, value in values.items())
        name = f"{stem}_{_UNSAFE.sub('-', words)}"[:_LONGEST_NAME]
        if name.casefold() in taken:
            name = f"{name}_{number}"
        taken.add(name.casefold())
        paths.append(folder / f"{name}.h5")
    return paths


def _identity_key(value: Any) -> Any:
    """Return the key that identifies equal values: numbers by size."""
    try:
        return float(value)
    except (TypeError, ValueError):
        return str(value)


def _words(values: Mapping[str, Any]) -> str:
    """Return values with their names, `law=pd, rate=3e-6`."""
    return ", ".join(f"{name}={value}" for name, value in values.items())
