"""Front of candidates, and the answer: the cheapest verified one within a tolerance."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from hfsa.cosim.tradeoff.configuration import Candidate, Configuration
from hfsa.cosim.tradeoff.search import FAR, Search
from hfsa.cosim.tradeoff.verification import OutOfBudgetError, Verification

_NEAR, _FAR_OFF = 4, 3
"""Numbers of candidates that are verified on either side of the tolerance, and far from it."""

_SHORTENED, _ASIDE = 3, 0.8
"""Shorter steps that are tried where errors are not predicted, and their expected error over the tolerance."""

_FEWEST, _EXAGGERATED = 3, 0.5
"""Least number of verified candidates, and the median of measured over predicted errors, for another search."""

_MOST = 12
"""Largest number of offered candidates that are verified in the search of an answer."""


def front(candidates: Iterable[Candidate]) -> list[Candidate]:
    """Return the candidates than which no other is both cheaper and more accurate, the cheapest first."""
    found: list[Candidate] = []
    for candidate in sorted(candidates, key=lambda c: (c.known_cost, c.error)):
        if not math.isnan(candidate.error) and (not found or candidate.error < found[-1].error):
            found.append(candidate)
    return found


@dataclass(frozen=True)
class Answer:
    """Answer to a trade.

    Attributes:
        best: cheapest candidate that was verified within the tolerance, `None` without any.
        next: the next cheaper one on the front, which misses the tolerance, `None` without any.
        own: the default of the scene, with its measurement, `None` where it does not run, for `own_refusal`.
        is_complete: whether the budget sufficed.
    """

    best: Candidate | None
    next: Candidate | None
    own: Candidate | None
    own_refusal: str
    is_complete: bool


def fine_candidates(search: Search, tolerance: float) -> list[Candidate]:
    """Return candidates at reference levels that are accurate enough to confirm a reference, the cheapest first.

    Where no error is predicted they are those of the shortest step.
    """
    fine = [c for c in search.candidates if not c.configuration.composition.levels]
    if fine and all(math.isnan(c.predicted.error) for c in fine):
        shortest = min(c.configuration.step_size for c in fine)
        return [c for c in fine if c.configuration.step_size <= shortest * (1 + 1e-9)]
    return [c for c in fine if c.predicted.error * FAR <= tolerance]


def answered(
    search: Search, verification: Verification, default: Configuration, tolerance: float, report: Callable[[str], None]
) -> Answer:
    """Verify candidates near the predicted front and some far from it, and return the answer.

    `default` is that of the scene. Where errors are not predicted, all candidates are run, the cheapest first.
    """
    own = search.candidate(default)
    offered, planned = _planned(search, tolerance)
    planned = list(dict.fromkeys([*(c for c in (own,) if c), *planned]))
    verification.prepare(planned, fine_candidates(search, tolerance))
    is_complete = True
    try:
        for candidate in offered:
            if verification.verify(candidate).error <= tolerance:
                break
        for candidate in planned:
            verification.verify(candidate)
        for candidate in _reconsidered(search, tolerance):
            if verification.verify(candidate).error <= tolerance:
                break
        for _ in range(_SHORTENED if not offered and verification.reference.values is not None else 0):
            shorter = _shortened(search, tolerance)
            if shorter is None:
                break
            verification.verify(shorter)
    except OutOfBudgetError:
        is_complete = False
    best = _cheapest_within(search, tolerance)
    for candidate in (*front(c for c in search.candidates if c.measured is not None), *(c for c in (own,) if c)):
        report(f"stability of {candidate.configuration}")
        search.is_stable(candidate)
    return Answer(best, _next_cheaper(search.candidates, best), own, search.refusal(default), is_complete)


def _planned(search: Search, tolerance: float) -> tuple[list[Candidate], list[Candidate]]:
    """Return the candidates that are verified until one is within the tolerance, and those verified in any case."""
    known = [c for c in search.candidates if not math.isnan(c.predicted.error)]
    if not known:
        return [], search.candidates
    predicted = front(known)
    cheaper = [c for c in predicted if c.predicted.error > tolerance][-_NEAR:]
    near = [c for c in predicted if c.predicted.error <= tolerance][:_NEAR]
    offered = list(islice(search.offered(), _MOST))
    return offered, [*reversed(cheaper), *near, *_far(known, [*cheaper, *near, *offered[:_NEAR]])]


def _reconsidered(search: Search, tolerance: float) -> list[Candidate]:
    """Return cheaper candidates than the best one, where the measured errors are far below the predicted ones."""
    known = [c for c in search.candidates if c.measured is not None and c.predicted.error > 0 and c.measured.error > 0]
    near = [c.measured.error / c.predicted.error for c in known if c.measured and c.predicted.error < FAR * tolerance]
    if len(near) < _FEWEST or np.median(near) > _EXAGGERATED:
        return []
    best, bias = _cheapest_within(search, tolerance), float(np.median(near))
    cheaper = [
        c
        for c in search.candidates
        if c.measured is None
        and c.predicted.error * bias <= tolerance
        and (best is None or c.cost < best.known_cost)
        and search.is_stable(c)
    ]
    return cheaper[:_MOST]


def _shortened(search: Search, tolerance: float) -> Candidate | None:
    """Return a candidate at a shorter step, by the order of the error of a line; `None` where one is good enough."""
    measured = [c for c in search.candidates if c.measured is not None and c.measured.error > 0]
    if not measured or any(c.error <= tolerance for c in measured):
        return None
    best = min(measured, key=lambda c: c.error * c.known_cost)
    own = sorted((c for c in measured if c.configuration.line == best.configuration.line), key=_step)
    order = 1.0
    if len(own) > 1:
        ratio = math.log(own[1].error / own[0].error) / math.log(_step(own[1]) / _step(own[0]))
        order = min(max(ratio, 0.5), 4.0)
    step = _step(own[0]) * (_ASIDE * tolerance / own[0].error) ** (1 / order)
    return search.candidate(replace(best.configuration, step_size=search.fitting(best.configuration, step)))


def _step(candidate: Candidate) -> float:
    """Return the step [s] of a candidate."""
    return candidate.configuration.step_size


def _cheapest_within(search: Search, tolerance: float) -> Candidate | None:
    """Return the cheapest measured candidate within the tolerance at a step that is not close to its limit."""
    found = (c for c in search.candidates if c.measured is not None and c.measured.error <= tolerance)
    return next((c for c in sorted(found, key=lambda c: c.known_cost) if search.is_stable(c)), None)


def _next_cheaper(candidates: Iterable[Candidate], best: Candidate | None) -> Candidate | None:
    """Return the most accurate measured candidate that is cheaper than the best one."""
    if best is None:
        return None
    cheaper = [
        c
        for c in candidates
        if c.measured is not None and not math.isnan(c.measured.error) and c.known_cost < best.known_cost
    ]
    return min(cheaper, key=lambda c: c.error, default=None)


def _far(candidates: Sequence[Candidate], taken: Sequence[Candidate]) -> list[Candidate]:
    """Return a few candidates far from the front, spread over the costs of all."""
    rest = [c for c in candidates if c not in taken and not math.isnan(c.predicted.error)]
    if not rest:
        return []
    places = np.unique(np.linspace(0, len(rest) - 1, _FAR_OFF + 2).astype(int)[1:-1])
    return [rest[i] for i in places]
