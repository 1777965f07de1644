"""A row of the table: what is tried, what must come of it, and what came.

    Row("damping", "mass_on_spring, no damping, ...", Accuracy("position", "cos(omega t)", 1e-13), measure)

`measure` returns a `Found` number for an accuracy, and for a message the text that was given, unless it raises it.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from hfsa.components import ModelError
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.systems.errors import StructureError

_WORDS = 150
"""Most characters of a message in the table."""


class Found(NamedTuple):
    """A relative error, and further numbers in words."""

    error: float
    note: str = ""


class Outcome(NamedTuple):
    """What came of a row, in words, and whether it is as expected."""

    came: str
    is_expected: bool


@dataclass(frozen=True)
class Accuracy:
    """A number near an independent one.

    Attributes:
        of: quantity that is measured.
        against: independent source of its right value.
        bound: largest error, relative to that value or to the scale of the quantity.
    """

    of: str
    against: str
    bound: float

    def __str__(self) -> str:
        return f"{self.of} within {self.bound:.2g} of {self.against}"

    def judge(self, measure: Callable[[], Found]) -> Outcome:
        """Return the measured error; an error that is not a number is not as expected."""
        try:
            found = measure()
        except Exception as error:
            return Outcome(f"{type(error).__name__}: {first_words(str(error))}", False)
        note = f"; {found.note}" if found.note else ""
        return Outcome(f"error {found.error:.2g}{note}", bool(found.error <= self.bound))


@dataclass(frozen=True)
class Message:
    """A clear message: an error of ours that is raised, or a warning that is given.

    Attributes:
        pattern: regular expression that the message contains.
        kind: `an error` or `a warning`.
    """

    pattern: str
    kind: str = "an error"

    def __str__(self) -> str:
        words = re.sub(r" *\.\* *", " ... ", re.sub(r"[\\^$]", "", self.pattern))
        return f"{self.kind}: {words}" if words else f"no {self.kind.split()[-1]}"

    def judge(self, measure: Callable[[], str]) -> Outcome:
        """Return the first words of the message; of an error the pattern must be in a class that is ours."""
        try:
            text, is_ours = str(measure()), self.kind == "a warning"
        except (ModelError, StructureError, StepError) as error:
            text, is_ours = str(error), self.kind == "an error"
        except Exception as error:
            text, is_ours = f"{type(error).__name__}: {error}", False
        matches = re.search(self.pattern, text, re.DOTALL) is not None
        return Outcome(first_words(text) or "no message", is_ours and matches)


@dataclass(frozen=True)
class Row:
    """A row; `measure` fits the kind of `expected`.

    Attributes:
        extreme: the extreme, first column of the table.
        tried: what is tried, with its numbers.
        is_cheap: whether it takes less than about a second once its FMUs are built.
    """

    extreme: str
    tried: str
    expected: Accuracy | Message
    measure: Callable[[], Found | str]
    is_cheap: bool = False

    def run(self) -> Outcome:
        """Run the row."""
        return self.expected.judge(self.measure)  # type: ignore[arg-type]


def first_words(text: str) -> str:
    """Return the beginning of a message on one line, whole words."""
    line = " ".join(text.split())
    return line if len(line) <= _WORDS else f"{line[:_WORDS].rsplit(' ', 1)[0]} ..."
