"""The answer of a trade in words: the cheapest way, what the next cheaper one misses, levels, reference, and doubts."""

import math
from collections.abc import Iterable, Iterator, Mapping

from hfsa.cosim.signals.prefixes import readable
from hfsa.cosim.systems.names import compact
from hfsa.cosim.tradeoff.answer import Answer
from hfsa.cosim.tradeoff.choices import Choices
from hfsa.cosim.tradeoff.configuration import Candidate
from hfsa.cosim.tradeoff.verification import CONFIRMED, Reference

_ANYONE = "{component}"
"""Place of the name of a component in the sentence about its level."""


def sentences_of(
    answer: Answer,
    choices: Choices,
    reference: Reference,
    tolerance: float,
    unknown: str,
    solvers: Mapping[str, float],
    refusals: Iterable[tuple[str, str]],
) -> list[str]:
    """Return the sentences of an answer, the cheapest way first.

    `unknown` is the reason why errors are not predicted, `solvers` the relative tolerance of each solver inside an FMU,
    `refusals` are algorithms that cannot run the scene, with the reason.
    """
    return [
        *_about_best(answer, tolerance),
        *_about_levels(choices),
        *_about_trust(answer, reference, tolerance, unknown),
        *(f"not offered: {algorithm} ({reason})" for algorithm, reason in dict.fromkeys(refusals)),
        *(_about_solvers(solvers, tolerance) if answer.best is None else ()),
    ]


def _about_best(answer: Answer, tolerance: float) -> Iterator[str]:
    """Yield the sentences about the cheapest configuration, the next cheaper one and the default."""
    best, own, cheaper = answer.best, answer.own, answer.next
    goal = f"a tolerance of {100 * tolerance:.3g} %"
    if best is None:
        yield f"no configuration was verified within {goal}"
    else:
        yield (
            f"the cheapest way to {goal} is {best.configuration}: {_cost(best)}{_ratio(best, own)}; "
            f"error {_percent(best.error)}{_at(best)}{_limit(best)}"
        )
    if cheaper is not None:
        error = f"error {_percent(cheaper.error)}{_at(cheaper)}"
        yield f"the next cheaper, {cheaper.configuration}, misses: {_cost(cheaper)}, {error}"
    if own is None:
        yield f"the default of the scene was not run: {answer.own_refusal}"
    if own is not None and own is not best:
        error = f"error {_percent(own.error)}{_at(own)}{_limit(own)}"
        yield f"the default of the scene, {own.configuration}: {_cost(own)}, {error}"


def _about_levels(choices: Choices) -> Iterator[str]:
    """Yield the sentences about levels, and about what cannot be built."""
    by_sentence: dict[str, list[str]] = {}
    for name, choice in choices.levels.items():
        by_sentence.setdefault(choice.sentence(_ANYONE), []).append(name)
    for sentence, names in by_sentence.items():
        for name in compact(names):
            yield f"levels: {sentence.replace(_ANYONE, name)}"
    for what, reason in choices.refusals.items():
        yield f"not possible: {what} ({reason})"


def _about_trust(answer: Answer, reference: Reference, tolerance: float, unknown: str) -> Iterator[str]:
    """Yield the sentences about the reference, and about what is not known."""
    yield f"reference: {reference.sentence}"
    if reference.values is not None and reference.uncertainty > CONFIRMED * tolerance:
        yield f"the references differ by {reference.uncertainty:.2g}, more than a tenth of the tolerance"
    if unknown:
        yield f"errors were not predicted, only measured: {unknown}"
    if not answer.is_complete:
        yield "the budget ended the verification: what was found until then is kept"


def _about_solvers(solvers: Mapping[str, float], tolerance: float) -> Iterator[str]:
    """Yield a sentence about each solver inside an FMU that limits the error."""
    for name, own in solvers.items():
        if own > CONFIRMED * tolerance:
            yield (
                f"the solver inside {name} has a relative tolerance of {own:.2g}, more than a tenth of the tolerance: "
                f"-p {name}.solver.relative_tolerance={CONFIRMED * tolerance:.2g} or less would do"
            )


def _cost(candidate: Candidate) -> str:
    """Return the cost of a candidate in words."""
    return f"{readable(candidate.known_cost, 's', '.3g')} of CPU time per simulated second"


def _ratio(best: Candidate, own: Candidate | None) -> str:
    """Return how much cheaper the best candidate is than the default."""
    if own is None or own is best or math.isnan(own.known_cost):
        return ""
    ratio = own.known_cost / best.known_cost
    return f", {ratio:.3g} times cheaper than the default" if ratio > 1 else f", {1 / ratio:.3g} times the default"


def _limit(candidate: Candidate) -> str:
    """Return how far a step is from the stability limit."""
    if math.isnan(candidate.margin):
        return ""
    if math.isinf(candidate.margin):
        return "; stable at every step that was evaluated"
    return f"; its step is 1/{candidate.margin:.3g} of the longest stable one"


def _percent(error: float) -> str:
    """Return a relative error in words."""
    return "not known" if math.isnan(error) else f"{100 * error:.2g} %"


def _at(candidate: Candidate) -> str:
    """Return the place of an error."""
    place = candidate.predicted.place if candidate.measured is None else candidate.measured.place
    return f" at {place}" if place else ""
