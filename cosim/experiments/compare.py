"""One scene, run once for each value of some of its arguments, on the same motion: what the runs make of it.

    compared = compare("stage_tracking", {"law": ["pd", "ctc"]}, {"actuator": "force"}, jobs=2)
    [run.outcome.groups[0].peak for run in compared.runs]

All runs are prepared, and whatever is wrong with one is refused, before the first begins; one that fails later leaves
the others alone.
"""

import contextlib
import dataclasses
import itertools
import os
import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

from hfsa.cosim.assembly.native_loop import chosen_loop
from hfsa.cosim.experiments.run import SineInput, prepare
from hfsa.cosim.experiments.setup import Warn, set_up
from hfsa.cosim.measurement import pool
from hfsa.cosim.measurement.trial import CRASHED, Outcome, Trial, perform
from hfsa.cosim.measurement.verification import check_verifiable
from hfsa.cosim.results.files import AlgorithmChoice, OrderChoice
from hfsa.cosim.results.target import check_new
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene

_UNSAFE = re.compile(r"[^\w.+,=-]+")
_LONGEST_NAME = 150


@dataclass(frozen=True)
class Run:
    """One run of a comparison: the compared arguments' values, as they were typed, and what became of it.

    `order` says how the order of its steps was computed, where it was, `algorithm` what `auto` took.
    """

    values: Mapping[str, Any]
    outcome: Outcome
    order: OrderChoice | None = None
    algorithm: AlgorithmChoice | None = None

    @property
    def words(self) -> str:
        """The values with their names, `law=pd, rate=3e-6`."""
        return _words(self.values)


@dataclass(frozen=True)
class Comparison:
    """A scene's runs: `scene` is its name or path, `over` the values of each compared argument."""

    scene: str
    title: str
    over: Mapping[str, tuple[Any, ...]]
    runs: tuple[Run, ...]


def parse_over(words: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Return values by name from words NAME=VALUES, separated by commas, or by semicolons where there is one.

    `StructureError` for a word without `=`, a name given twice, a value that is empty or given twice.
    """
    over: dict[str, tuple[str, ...]] = {}
    for word in words:
        name, equals, text = word.partition("=")
        if not (name and equals):
            raise StructureError(f"--over {word!r} is not of the form NAME=VALUES, such as law=pd,ctc")
        if name in over:
            raise StructureError(f"--over {name} is given twice; write all its values at once")
        values = [value.strip() for value in text.split(";" if ";" in text else ",")]
        if not all(values):
            raise StructureError(f"--over {word!r} has an empty value; expected values between commas or semicolons")
        seen: dict[Any, str] = {}
        for value in values:
            if other := seen.get(_sense(value)):
                raise StructureError(f"--over {name} has the value {value} twice{f', as {other}' * (other != value)}")
            seen[_sense(value)] = value
        over[name] = tuple(values)
    return over


def compare(
    scene: str | Path | Scene,
    over: Mapping[str, Sequence[Any]],
    parameters: Mapping[str, Any] | None = None,
    *,
    input: str | None = None,  # noqa: A002 (the user's word)
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
    jobs: int | None = None,
    folder: str | Path = "results",
    file: Path | None = None,
    force: bool = False,
    warn: Warn = warnings.warn,
    report: Callable[[float, str], None] | None = None,
) -> Comparison:
    """Run a scene once for each combination of the values in `over`, into one file each.

    Args:
        over: values of each compared argument, `{"law": ["pd", "ctc"]}`; whatever `parameters` may hold.
        jobs: processes (default: one per processor).
        folder: folder of the results files, which are named by the scene and the values.
        file: a picture to be written later; `StructureError` where it has the name of a signal.

    The other arguments are as of `run`. All runs are prepared before the first begins; one that fails later is an
    outcome (`Run.outcome.failure`), no error. Raises `StructureError` for what cannot run as it is described,
    `ResultsError` for a file that is there already, unless `force` replaces it.
    """
    parameters = dict(parameters or {})
    for name in over:
        if name in parameters:
            raise StructureError(f"{name} is given with -p and with --over; expected one of them")
    tell = report or (lambda *_: None)
    combinations = [dict(zip(over, values, strict=True)) for values in itertools.product(*over.values())]
    stem = "scene" if isinstance(scene, Scene) else Path(scene).stem
    paths = _paths(Path(folder), stem, combinations)
    for path in paths:
        check_new(path, force, "--force replaces it, -o names a figure in another folder, where the files go too")
    library = chosen_loop(backend, warn)
    sine = SineInput(input, frequency, amplitude)
    trials, title = [], ""
    for values, path in zip(combinations, paths, strict=True):
        tell(0.0, f"building FMUs for {_words(values)}")
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
        ready = prepare(setup, sine, library, warn_of)
        if verify:
            check_verifiable(ready)
        trials.append(Trial(ready, path, tuple(setup.scene.outputs), tuple(setup.signals), verify, force))
    outcomes = _perform(trials, jobs or os.cpu_count() or 1, warn, tell)
    runs = tuple(
        Run(values, outcomes[trial.path], trial.ready.record.order, trial.ready.record.algorithm)
        for values, trial in zip(combinations, trials, strict=True)
    )
    for run in runs:
        for message in run.outcome.warnings:
            warn(f"{run.words}: {message}")
    return Comparison(str(scene) if stem != "scene" else stem, title, {n: tuple(v) for n, v in over.items()}, runs)


def _warn_of(values: Mapping[str, Any], warn: Callable[[str], None], sentence: str) -> None:
    """Warn of the run with these values."""
    warn(f"{_words(values)}: {sentence}")


def _perform(
    trials: Sequence[Trial], jobs: int, warn: Callable[[str], None], tell: Callable[[float, str], None]
) -> dict[Path, Outcome]:
    """Return the outcomes by file; after Ctrl-C, say what is finished."""
    outcomes: dict[Path, Outcome] = {}

    def word() -> str:
        """How many runs are finished."""
        return f"{len(outcomes)} of {len(trials)} runs"

    def within(part: float) -> None:
        """Tell the progress with a part of the present run."""
        tell((len(outcomes) + part) / len(trials), word())

    is_foreign = any(trial.ready.assembly.is_foreign for trial in trials)
    apart = is_foreign or min(jobs, len(trials)) > 1
    # only what runs in this process can tell how far it is
    work = perform if apart else partial(perform, report=within)
    within(0.0)
    try:
        # a run whose process died has left a file behind
        again = partial(dataclasses.replace, force=True)
        with contextlib.closing(pool.results(work, trials, jobs, apart=is_foreign, again=again)) as results:
            for trial, outcome in results:
                outcomes[trial.path] = outcome or Outcome(trial.path, failure=CRASHED)
                within(0.0)
    except KeyboardInterrupt:
        finished = ", ".join(str(path) for path, outcome in outcomes.items() if not outcome.failure)
        warn(f"{word()} are finished{f': {finished}' if finished else ''}")
        raise
    return outcomes


def _paths(folder: Path, stem: str, combinations: Sequence[Mapping[str, Any]]) -> list[Path]:
    """Return a file for each combination, named by its values as far as file names allow."""
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


def _sense(value: str) -> Any:
    """Return what makes two values the same: numbers by size."""
    try:
        return float(value)
    except ValueError:
        return value


def _words(values: Mapping[str, Any]) -> str:
    """Return values with their names, `law=pd, rate=3e-6`."""
    return ", ".join(f"{name}={value}" for name, value in values.items())
