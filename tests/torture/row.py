"""A line of the table: what was tried, how often, how often it held, and what came where it did not."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self


@dataclass(frozen=True)
class Row:
    """Outcome of trials of one kind.

    Attributes:
        trial: what was tried, and what had to come of it.
        count: number of trials.
        failures: a sentence for each that did not hold, enough to repeat it.
        note: figures that were measured on the way.
    """

    trial: str
    count: int
    failures: tuple[str, ...] = ()
    note: str = ""

    @property
    def held(self) -> int:
        """Number of trials that held."""
        return self.count - len(self.failures)

    @classmethod
    def of(cls, trial: str, outcomes: Iterable[str | None], note: str = "") -> Self:
        """Return the row of outcomes: `None` for a trial that held, else the sentence."""
        every = list(outcomes)
        return cls(trial, len(every), tuple(outcome for outcome in every if outcome), note)
