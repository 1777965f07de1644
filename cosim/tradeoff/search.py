"""Search for cheap configurations: predictions over compositions, algorithms and steps, from long steps to short ones.

    search = Search(question, costs, tolerance, report)
    search.over(choices.compositions)
    search.candidates                       # the cheapest first

Each line, a composition with an algorithm, is followed from the longest step down until its error is far below the
tolerance or its cost far above that of the cheapest sufficient configuration. On the cheapest lines the longest step
within the tolerance is then found.
"""

import math
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import replace
from typing import Protocol

from hfsa.cosim.analysis.step_limits import fitting
from hfsa.cosim.masters.algorithms import LIMITED
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.tradeoff.choices import REFUSALS
from hfsa.cosim.tradeoff.configuration import Candidate, Composition, Configuration, Prediction
from hfsa.cosim.tradeoff.costs import Costs

FAR = 30.0
"""Ratio of an error to the tolerance, either way, within which a line is followed; and of costs."""

MARGIN = 1.05
"""Least ratio of the longest stable step to a step that is offered."""

_ASIDE = 0.95
"""Largest predicted error of an answer, over the tolerance."""

_FINEST = 1000.0
"""Step of the scene over the shortest one that is evaluated."""


_SAMPLED = (4.0, 2.0, 1.0, 0.5, 0.25)
"""Steps of a line whose errors are not predicted, over the step of the scene."""

_REFINED, _BISECTIONS = 4, 5


class Question(Protocol):
    """What a scene is run for: its responses, or a motion."""

    scene: Scene
    longest_step: float
    unknown: str

    def times(self, composition: Composition) -> Collection[float]:
        """Return the sample times [s] of a composition."""
        ...

    def predicted(self, configuration: Configuration) -> Prediction:
        """Return the predicted error of a configuration."""
        ...

    def margin(self, configuration: Configuration) -> float:
        """Return the longest stable step over that of a configuration; NaN where it is not known."""
        ...


class Search:
    """Candidates of a question, with their predictions.

    Attributes:
        candidates: all that were evaluated and are stable, or of unknown error.
        refusals: reason by (composition, algorithm) that cannot run.
    """

    def __init__(self, question: Question, costs: Costs, tolerance: float, report: Callable[[str], None]):
        self._question, self._costs, self._tolerance, self._report = question, costs, tolerance, report
        self._known: dict[Configuration, Candidate | None] = {}
        self.refusals: dict[tuple[Composition, str], str] = {}

    @property
    def candidates(self) -> list[Candidate]:
        """All candidates, the cheapest first."""
        return sorted((c for c in self._known.values() if c is not None), key=lambda c: c.cost)

    def over(self, compositions: Iterable[Composition]) -> None:
        """Follow the line of each composition and algorithm with a prescribed step, and refine the cheapest ones."""
        # groups leave fewer couplings, whose candidates bound the search of the others
        for composition in sorted(compositions, key=lambda c: -sum(map(len, c.fuse))):
            times = self._question.times(composition)
            for algorithm in LIMITED:
                self._report(f"{algorithm}, {composition}")
                (self._sample if self._question.unknown else self._follow)(composition, algorithm, times)
        for line in self._cheapest_lines():
            self._refine(line)

    def candidate(self, configuration: Configuration) -> Candidate | None:
        """Return a configuration with its prediction; `None` where it is unstable or does not run."""
        if configuration not in self._known:
            self._known[configuration] = self._evaluated(configuration)
        return self._known[configuration]

    def refusal(self, configuration: Configuration) -> str:
        """Return the reason why a configuration is no candidate; empty for one."""
        if self.candidate(configuration) is not None:
            return ""
        return self.refusals.get(configuration.line) or self._question.predicted(configuration).place

    def offered(self) -> Iterator[Candidate]:
        """Yield the candidates that are predicted to meet the tolerance at a stable step, the cheapest first."""
        for candidate in self.candidates:
            if candidate.predicted.error <= _ASIDE * self._tolerance and self.is_stable(candidate):
                yield candidate

    def is_stable(self, candidate: Candidate) -> bool:
        """Whether the step of a candidate is not within 5 % of the longest stable one, or that is not known."""
        if math.isnan(candidate.margin):
            candidate.margin = self._question.margin(candidate.configuration)
        return not candidate.margin < MARGIN

    def fitting(self, configuration: Configuration, step_size: float) -> float:
        """Return the longest step [s] up to another that fits the sample times; two digits where there are none."""
        times = self._question.times(configuration.composition)
        return fitting(step_size, times) if times else float(f"{step_size:.2g}")

    def _evaluated(self, configuration: Configuration) -> Candidate | None:
        """Return a new candidate, as `candidate`."""
        predicted = self._question.predicted(configuration)
        if math.isinf(predicted.error):
            return None
        try:
            cost, counts = self._costs.predicted(configuration)
        except REFUSALS as error:
            self.refusals[configuration.line] = str(error)
            return None
        return Candidate(configuration, predicted, cost, counts)

    def _follow(self, composition: Composition, algorithm: str, times: Collection[float]) -> None:
        """Evaluate a line from its longest step down."""
        step, last = self._question.longest_step, None
        while step > self._question.scene.step_size / _FINEST:
            fitted = fitting(step, times)
            if fitted != last:
                last = fitted
                found = self.candidate(Configuration(composition, algorithm, fitted))
                if found is not None and self._is_end(found):
                    break
                if (composition, algorithm) in self.refusals:
                    break
            step = fitted / 2

    def _sample(self, composition: Composition, algorithm: str, times: Collection[float]) -> None:
        """Evaluate a line of unknown errors at steps around that of the scene."""
        longest = min(self._question.longest_step, _SAMPLED[0] * self._question.scene.step_size)
        for ratio in _SAMPLED:
            self.candidate(Configuration(composition, algorithm, fitting(longest * ratio / _SAMPLED[0], times)))
            if (composition, algorithm) in self.refusals:
                break

    def _is_end(self, candidate: Candidate) -> bool:
        """Whether shorter steps of a line are of no use."""
        if math.isnan(candidate.predicted.error):
            return True
        sufficient = [c.cost for c in self._known.values() if c and c.predicted.error <= _ASIDE * self._tolerance]
        is_costly = bool(sufficient) and candidate.cost > 4 * min(sufficient) * (1 if self._has_fine else FAR)
        return candidate.predicted.error * FAR <= self._tolerance or is_costly

    @property
    def _has_fine(self) -> bool:
        """Whether a candidate is accurate enough to confirm a reference."""
        return any(c is not None and c.predicted.error * FAR <= self._tolerance for c in self._known.values())

    def _cheapest_lines(self) -> list[tuple[Composition, str]]:
        """Return the lines with the cheapest sufficient candidates."""
        lines = dict.fromkeys(
            c.configuration.line for c in self.candidates if c.predicted.error <= _ASIDE * self._tolerance
        )
        return list(lines)[:_REFINED]

    def _refine(self, line: tuple[Composition, str]) -> None:
        """Find the longest step of a line within the tolerance, between two that were evaluated."""
        own = sorted(
            (c for c in self.candidates if c.configuration.line == line), key=lambda c: -c.configuration.step_size
        )
        good = next((c for c in own if c.predicted.error <= _ASIDE * self._tolerance), None)
        if good is None or good is own[0]:
            return
        low, high = good.configuration.step_size, own[own.index(good) - 1].configuration.step_size
        for _ in range(_BISECTIONS):
            middle = self.fitting(good.configuration, math.sqrt(low * high))
            if not low * (1 + 1e-6) < middle < high * (1 - 1e-6):
                break
            found = self.candidate(replace(good.configuration, step_size=middle))
            if found is not None and found.predicted.error <= _ASIDE * self._tolerance:
                low = middle
            else:
                high = middle
