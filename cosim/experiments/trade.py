"""Trade of a scene: the cheapest way to its responses or its motion within a tolerance, predicted, then verified.

    found = trade("sdelta_shaker", tolerance=1e-3)
    print(found.sentences[0])
    sweep("sdelta_shaker", tuned=found.path)

The order of work: choose what may be varied (`tradeoff/choices.py`), predict errors and costs (`search.py`), verify
near the front and far from it (`front.py`), and answer in words.
"""

import dataclasses
import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Literal

from hfsa.cosim.assembly.native_loop import chosen_loop
from hfsa.cosim.experiments.arguments import checked
from hfsa.cosim.experiments.selection import find_signals, with_amplitude
from hfsa.cosim.experiments.setup import Warn, default_path, set_up
from hfsa.cosim.experiments.tuning import scene_words
from hfsa.cosim.fidelity.step_judge import with_algorithm
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.results.records import SystemRecord
from hfsa.cosim.results.target import check_new
from hfsa.cosim.results.trade import Trade, TradeRow, write_trade
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.tradeoff.answer import answered
from hfsa.cosim.tradeoff.choices import Choices, choices_of
from hfsa.cosim.tradeoff.configuration import Candidate, Configuration
from hfsa.cosim.tradeoff.costs import Costs
from hfsa.cosim.tradeoff.motion import Motion
from hfsa.cosim.tradeoff.responses import Responses
from hfsa.cosim.tradeoff.search import Search
from hfsa.cosim.tradeoff.sentences import sentences_of
from hfsa.cosim.tradeoff.verification import Verification

SOLVER_TOLERANCE = "solver.relative_tolerance"
"""Setting of the solver inside an FMU."""

Purpose = Literal["response", "motion"]
"""What a scene is run for."""


@checked()
def trade(
    scene: str | Path | Scene,
    parameters: Mapping[str, Any] | None = None,
    *,
    tolerance: float | None = None,
    budget: float | None = None,
    purpose: Purpose | None = None,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    low: float | None = None,
    high: float | None = None,
    amplitude: float | None = None,
    stop_time: float | None = None,
    backend: Literal["c", "python"] = "c",
    path: str | Path | None = None,
    force: bool = False,
    warn: Warn = warnings.warn,
    report: Callable[[float, str], None] | None = None,
) -> Trade:
    """Return the cheapest way to run a scene within a tolerance, and write all that was evaluated to a results file.

    Levels below those of the scene, fused groups, algorithms and steps are varied. Errors are predicted from the FMUs'
    directional derivatives, costs from a short probe; configurations near the front and some far from it are then run.

    Args:
        tolerance: largest relative error (default: the scene's).
        budget: time [s] for verifying runs (default: no limit).
        purpose: `response` to sines, as in `sweep`, or `motion` over time, as in `run` (default: `response` for a scene
            with inputs).
        inputs, outputs: names, full or short, also with ranges (default: the scene's). A motion takes one input.
        low, high: ends of the band of responses [Hz] (default: the scene's). A motion is excited at the lower end.
        stop_time: end of a motion [s] (default: the scene's).
        path: results file (default: `results/SCENE_trade.h5`).

    The other arguments and the errors are those of `sweep`.
    """
    file = Path(path) if path is not None else default_path(scene, "_trade")
    check_new(file, force)
    setup = set_up(scene, parameters, file=None if path is None else file, tolerance=tolerance, stop_time=stop_time)
    for sentence in setup.disagreements:
        warn(sentence)
    show = report or (lambda *_: None)
    asked = _asked(setup.scene, setup.highest, purpose, inputs, outputs, low, high, amplitude)
    wanted: Purpose = purpose or ("response" if asked.inputs else "motion")
    library = chosen_loop(backend, warn)
    choices = choices_of(asked, library, lambda word: show(0.0, word))
    with ExitStack() as stack:
        question = (Responses if wanted == "response" else Motion)(choices.scene, library, stack)
        costs = Costs(question.built, library)
        search = Search(question, costs, asked.tolerance, lambda word: show(0.1, f"predict {word}"))
        search.over(choices.compositions)
        own = _default(setup.scene, asked, choices, search)
        verification = Verification(question, costs, asked.tolerance, budget, lambda word: show(0.5, word))
        answer = answered(search, verification, own, asked.tolerance, lambda word: show(0.9, word))
        candidates = search.candidates
        sentences = sentences_of(
            answer, choices, verification.reference, asked.tolerance, question.unknown, _solvers(setup.highest)
        )
    rows = [_row(candidate, choices) for candidate in candidates]
    best, cheaper, default = (
        None if found is None else candidates.index(found) for found in (answer.best, answer.next, answer.own)
    )
    found = Trade(
        file,
        setup.title,
        wanted,
        asked.tolerance,
        rows,
        best,
        cheaper,
        default,
        verification.reference.sentence,
        verification.reference.uncertainty,
        sentences,
    )
    write_trade(found, SystemRecord(setup.title, scene_words(setup.scene)), force)
    return found


def _asked(
    scene: Scene,
    highest: Assembly,
    purpose: Purpose | None,
    inputs: Sequence[str],
    outputs: Sequence[str],
    low: float | None,
    high: float | None,
    amplitude: float | None,
) -> Scene:
    """Return the scene with the inputs, outputs, band and amplitude that are asked for; `StructureError` for none."""
    connectors = highest.check().connectors
    excited = find_signals(inputs, scene.inputs, connectors, "input") if inputs or scene.inputs else []
    shown = find_signals(outputs, scene.outputs, connectors, "output")
    if purpose == "response" and not excited:
        raise StructureError("the scene has a motion of its own and no input to excite; name one with --input")
    if purpose == "motion":
        excited = excited[:1]
    scene = with_amplitude(scene, amplitude, excited, highest)
    first, last = scene.band
    band = (first if low is None else low, last if high is None else high)
    return dataclasses.replace(scene, inputs=excited, outputs=shown, band=band)


def _solvers(assembly: Assembly) -> dict[str, float]:
    """Return the relative tolerance of the solver in each FMU that states one, by component."""
    found = {}
    for component in assembly.system.components:
        known = assembly.connectors[component.name].get(SOLVER_TOLERANCE)
        if known is not None:
            found[component.name] = float(component.start.get(SOLVER_TOLERANCE, known.start or 0.0))
    return found


def _default(scene: Scene, asked: Scene, choices: Choices, search: Search) -> Candidate | None:
    """Return the default of the scene, `None` where it does not run."""
    chosen = dataclasses.replace(
        choices.own.of(choices.scene), algorithm=scene.algorithm, step_size=scene.step_size, tolerance=asked.tolerance
    )
    decided, _ = with_algorithm(chosen)
    return search.candidate(Configuration(choices.own, decided.algorithm, decided.step_size))


def _row(candidate: Candidate, choices: Choices) -> TradeRow:
    """Return a candidate as a row of the results file."""
    configuration, measured, counts = candidate.configuration, candidate.measured, candidate.counts
    named = {**choices.reference_levels, **dict(configuration.composition.levels)}
    return TradeRow(
        configuration.algorithm,
        configuration.step_size,
        ", ".join(f"{component}={level}" for component, level in named.items()),
        " ".join(configuration.composition.group_words),
        candidate.predicted.error,
        candidate.predicted.place or candidate.predicted.unknown,
        math.nan if measured is None else measured.error,
        "" if measured is None else measured.place,
        candidate.cost,
        math.nan if measured is None else measured.cost,
        counts.steps,
        counts.calls,
        counts.evaluations,
        candidate.margin,
        "" if measured is None else measured.failure,
    )
