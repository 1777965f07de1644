"""Verification of candidates: each is run, and its error is measured from a reference that a second one confirms.

The first reference has no communication steps: the linear response, or the monolithic run. The second is a
co-simulation with a predicted error far below the tolerance. Where they differ by more than a tenth of the tolerance, a
co-simulation by another algorithm decides: if it agrees with the second, that is the reference, as of a scene that is
not linear at its amplitude; otherwise no reference is known.

Where errors are not predicted, values are extrapolated to a step of zero (Richardson), by two algorithms, at shorter
and shorter steps until both agree, with one another and with the step before.
"""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

from hfsa.cosim.masters.algorithms import ALGORITHMS
from hfsa.cosim.tradeoff.choices import REFUSALS
from hfsa.cosim.tradeoff.configuration import Candidate, Configuration, Measurement
from hfsa.cosim.tradeoff.costs import Costs
from hfsa.cosim.tradeoff.search import FAR

CONFIRMED = 0.1
"""Largest difference of two references, over the tolerance."""

_PATIENCE = 100.0
"""Longest predicted time [s] of a single run."""

_SHORTENED = 5
"""Number of steps, each half of the one before, at which values are extrapolated."""

_TRIED = 4
"""Number of candidates that are tried as a second reference."""


class Verifiable(Protocol):
    """What candidates are measured by: responses at places, or motions."""

    word: str

    def places(self, configurations: Sequence[Configuration]) -> Any:
        """Return where all configurations are compared."""
        ...

    def duration(self, places: Any) -> float:
        """Return the least simulated time [s] of a run."""
        ...

    def exact(self, places: Any) -> Any:
        """Return the values without communication steps; raises a `REFUSALS` error where they are not known."""
        ...

    def measured(self, configuration: Configuration, places: Any, settled_to: float) -> Any:
        """Return the values of a configuration that is run; raises where it does not run."""
        ...

    def extrapolated(self, fine: Any, coarse: Any) -> Any:
        """Return values without an error of first order, from those of a step and of twice that step."""
        ...

    def error(self, found: Any, reference: Any) -> tuple[float, str]:
        """Return the largest relative error of values from reference values, and where it is, in words."""
        ...


@dataclass(frozen=True)
class Reference:
    """Values that errors are measured from.

    Attributes:
        values: the values; `None` where no reference is known.
        uncertainty: relative difference of the two references; NaN without a second one.
        sentence: what it is, or why there is none.
    """

    values: Any
    uncertainty: float
    sentence: str


class OutOfBudgetError(RuntimeError):
    """End of a verification whose budget is spent."""


class TooLongError(RuntimeError):
    """Refusal of a run that would take too long."""


class Verification:
    """Runs of candidates within a budget [s] of time, `None` without a limit."""

    def __init__(
        self,
        question: Verifiable,
        costs: Costs,
        tolerance: float,
        budget: float | None,
        report: Callable[[str], None],
    ):
        self._question, self._costs, self._tolerance, self._report = question, costs, tolerance, report
        self._end = math.inf if budget is None else time.monotonic() + budget
        self._values: dict[Configuration, Any] = {}
        self._places: Any = None
        self.reference = Reference(None, math.nan, "no reference was computed")

    def prepare(self, planned: Sequence[Candidate], fine: Sequence[Candidate]) -> None:
        """Choose the places for planned candidates, and the reference; `fine` may be second references."""
        compared = [candidate.configuration for candidate in (*planned, *fine[:1])]
        if not compared:  # none runs, for which the answer has the reason
            return
        self._places = self._question.places(compared)
        is_predicted = not all(math.isnan(candidate.predicted.error) for candidate in fine)
        self.reference = self._chosen_reference(fine) if is_predicted else self._extrapolated_reference(fine)

    def verify(self, candidate: Candidate) -> Measurement:
        """Measure a candidate, once; `OutOfBudgetError` where no time is left."""
        if candidate.measured is None:
            try:
                self._check_duration(candidate)
                values = self._run(candidate.configuration)
            except OutOfBudgetError:
                raise
            except (*REFUSALS, RuntimeError) as failure:
                candidate.measured = Measurement(math.nan, failure=str(failure))
                return candidate.measured
            error, place = math.nan, ""
            if self.reference.values is not None:
                error, place = self._question.error(values, self.reference.values)
            candidate.measured = Measurement(error, place, self._costs.measured(candidate.configuration))
        return candidate.measured

    def _run(self, configuration: Configuration) -> Any:
        """Return the values of a configuration; `OutOfBudgetError` where no time is left."""
        if configuration not in self._values:
            if time.monotonic() > self._end:
                raise OutOfBudgetError("the budget is spent")
            self._report(f"run {configuration}")
            settled_to = min(1e-3, CONFIRMED * self._tolerance)
            self._values[configuration] = self._question.measured(configuration, self._places, settled_to)
        return self._values[configuration]

    def _check_duration(self, candidate: Candidate) -> None:
        """Raise `TooLongError` for a run that takes longer than anybody waits."""
        seconds = candidate.cost * self._question.duration(self._places)
        if seconds > _PATIENCE:
            raise TooLongError(f"{candidate.configuration} would take {seconds:.2g} s and was not run")

    def _chosen_reference(self, fine: Sequence[Candidate]) -> Reference:
        """Return the reference, as in the docstring of the module."""
        limit = CONFIRMED * self._tolerance
        try:
            self._report(f"reference: {self._question.word}")
            exact, missing = self._question.exact(self._places), ""
        except REFUSALS as reason:
            exact, missing = None, str(reason)
        word = self._question.word
        runs, algorithms = [], set()
        for candidate in fine:
            if candidate.configuration.algorithm in algorithms:
                continue
            try:
                self._check_duration(candidate)
                runs.append((candidate, self._run(candidate.configuration)))
            except OutOfBudgetError:
                break
            except (*REFUSALS, RuntimeError):
                continue
            algorithms.add(candidate.configuration.algorithm)
            if exact is not None and len(runs) == 1:
                difference, place = self._question.error(runs[0][1], exact)
                if difference <= limit:
                    sentence = f"{word}, which {candidate.configuration} confirms to {difference:.1e}"
                    return Reference(exact, difference, sentence)
                missing = f"{word} and {candidate.configuration} differ by {difference:.2g} ({place})"
            if len(runs) == 2 or len(algorithms) == _TRIED:
                break
        if len(runs) == 2:
            (first, values), (second, other) = runs
            difference, place = self._question.error(other, values)
            if difference <= limit:
                why = f"; {missing}" if missing else ""
                sentence = f"{first.configuration}, which {second.configuration} confirms to {difference:.1e}{why}"
                return Reference(values, difference, sentence)
            missing = (
                f"{missing + '; ' if missing else ''}{first.configuration} and {second.configuration} differ by "
                f"{difference:.2g} ({place})"
            )
        finest = f"no run with a predicted error below {self._tolerance / FAR:.2g} confirms {word}"
        return Reference(None, math.nan, f"no reference is known to {limit:.2g}: {missing or finest}")

    def _extrapolated_reference(self, fine: Sequence[Candidate]) -> Reference:
        """Return the reference of a scene whose errors are not predicted."""
        limit = CONFIRMED * self._tolerance
        simple = [c.configuration for c in fine if ALGORITHMS[c.configuration.algorithm].order == 1][:2]
        sentence = "there are no two algorithms of first order that run"
        try:
            for _ in range(_SHORTENED if len(simple) == 2 else 0):
                before = self._extrapolated(simple[0])
                simple = [_halved(configuration) for configuration in simple]
                first, second = (self._extrapolated(configuration) for configuration in simple)
                difference, place = max(self._question.error(second, first), self._question.error(before, first))
                words = " and ".join(map(str, simple))
                if difference <= limit:
                    return Reference(
                        first, difference, f"{words}, extrapolated to a step of zero, which agree to {difference:.1e}"
                    )
                sentence = f"{words}, extrapolated to a step of zero, differ by {difference:.2g} ({place})"
        except OutOfBudgetError:
            sentence = f"the budget is spent; {sentence}"
        except (*REFUSALS, RuntimeError) as failure:
            sentence = str(failure)
        return Reference(None, math.nan, f"no reference is known to {limit:.2g}: {sentence}")

    def _extrapolated(self, configuration: Configuration) -> Any:
        """Return the values of a configuration, extrapolated from its step and half of it."""
        return self._question.extrapolated(self._run(_halved(configuration)), self._run(configuration))


def _halved(configuration: Configuration) -> Configuration:
    """Return a configuration at half its step."""
    return replace(configuration, step_size=configuration.step_size / 2)
