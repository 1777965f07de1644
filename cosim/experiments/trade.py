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
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.description import SOLVER_TOLERANCE
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

_OPTIONS = {"low": "--from", "high": "--to", "stop_time": "--stop"}
"""Options of the command line by argument."""

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
    _check_used(setup.scene, purpose, {"inputs": inputs, "high": high, "low": low, "stop_time": stop_time})
    asked = _asked(setup.scene, setup.highest, purpose, inputs, outputs, low, high, amplitude)
    wanted: Purpose = purpose or ("response" if asked.inputs else "motion")
    library = chosen_loop(backend, warn)
    choices = choices_of(asked, library, lambda word: show(0.0, word))
    with ExitStack() as stack:
        question = (Responses if wanted == "response" else Motion)(choices.scene, library, stack)
        costs = Costs(question.built, library)
        search = Search(question, costs, asked.tolerance, lambda word: show(0.1, f"predict {word}"))
        search.over(choices.compositions)
        # the default has the scene's own algorithm and step, at the tolerance that is asked for
        own = dataclasses.replace(choices.scene, algorithm=setup.scene.algorithm)
        default = Configuration(choices.own, question.algorithm(own, choices.own), own.step_size)
        verification = Verification(question, costs, asked.tolerance, budget, lambda word: show(0.5, word))
        answer = answered(search, verification, default, asked.tolerance, lambda word: show(0.9, word))
        candidates = search.candidates
        sentences = sentences_of(
            answer,
            choices,
            verification.reference,
            asked.tolerance,
            question.unknown,
            _solvers(setup.highest),
            [(algorithm, reason) for (_, algorithm), reason in search.refusals.items()],
        )
    rows = [_row(candidate, choices) for candidate in candidates]
    best, cheaper, own_place = (
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
        own_place,
        verification.reference.sentence,
        verification.reference.uncertainty,
        sentences,
    )
    write_trade(found, SystemRecord(setup.title, scene_words(setup.scene)), force)
    return found


def _check_used(scene: Scene, purpose: Purpose | None, options: Mapping[str, Any]) -> None:
    """Raise `StructureError` for an option that the response or the motion of a scene does not use."""
    is_excited = bool(scene.inputs or options["inputs"])
    if purpose == "response" or (purpose is None and is_excited):
        unused = {"stop_time": "a response has no end"}
    elif is_excited:
        unused = {"high": "a motion has one frequency, the lowest of the band"}
        if len(options["inputs"]) > 1:
            raise StructureError(f"a motion takes one input, found {len(options['inputs'])}: name one with --input")
    else:
        unused = dict.fromkeys(("low", "high"), "the scene has a motion of its own")
    for name, reason in unused.items():
        if options[name] is not None:
            raise StructureError(f"{_OPTIONS[name]} would have no effect: {reason}")


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
