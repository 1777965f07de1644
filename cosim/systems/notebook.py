"""What a notebook shows of an object: a small table, which never fails, and figures by the name of their module.

    class Result:
        @summarized
        def _repr_html_(self) -> str:
            return summary("sweep", {"file": self.path}, ["output", ">peak"], self.rows)

        def plot(self) -> Figure:
            return drawn_by("bode", "bode_figure")([self])

Figures are made above the rooms of results and systems, which import nothing of them: a method `plot` names its
function, which is loaded when it is called.
"""

import functools
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import import_module
from itertools import islice
from typing import Any, TypeVar

from hfsa.cosim.systems.markup import paragraph, table

T = TypeVar("T")

MOST_ROWS = 12
"""Rows of a table of a summary; of more, their number is stated."""


def summary(
    title: str,
    facts: Mapping[str, object],
    headings: Sequence[str] = (),
    rows: Iterable[Sequence[object]] = (),
) -> str:
    """Return a title, facts in one line, empty ones left out, and at most `MOST_ROWS` rows of a table, in HTML."""
    words = "; ".join(f"{name} {value}" for name, value in facts.items() if str(value))
    taken = iter(rows)
    shown = list(islice(taken, MOST_ROWS))
    more = sum(1 for _ in taken)
    blocks = [table(headings, shown, title) if shown else paragraph(title), paragraph(words) if words else ""]
    return "\n".join([*blocks, paragraph(f"and {more} more")] if more else filter(None, blocks))


def summarized(make: Callable[[T], str]) -> Callable[[T], str]:
    """Return a method that shows why there is no summary where `make` fails: a notebook shows what is broken, too."""

    @functools.wraps(make)
    def shown(self: T) -> str:
        try:
            return make(self)
        except Exception as error:  # a result may be damaged in any way
            return paragraph(f"{type(self).__name__} without a summary: {type(error).__name__}: {error}")

    return shown


def drawn_by(module: str, function: str) -> Callable[..., Any]:
    """Return a function of a module of `figures`, loaded now."""
    return getattr(import_module(f"hfsa.cosim.figures.{module}"), function)
