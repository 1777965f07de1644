"""What each action hands to its twin in C: the function that performs it there, and the fields of its structure.

    @detail.register
    def _(action: History) -> Detail:
        return Detail("hfsa_remember", "History", {"bus": action.bus, "points": action.points, "n": len(action.bus)})

Fields have the names of the header. Arrays are those that Python's loop uses as well; a header that asks for places
(size_t) is given a copy of them.
"""

from collections.abc import Mapping, Sequence
from functools import singledispatch
from typing import Any, NamedTuple

import numpy as np

from hfsa.cosim.actions import algebraic_loop, iterated
from hfsa.cosim.actions.action import CompositeAction
from hfsa.cosim.actions.algebraic_loop import AlgebraicLoop
from hfsa.cosim.actions.extrapolation import Extrapolate, History
from hfsa.cosim.actions.feed import Ahead
from hfsa.cosim.actions.feedback import Gains, Lines, Rates
from hfsa.cosim.actions.iterated import IteratedStep
from hfsa.cosim.actions.recording import Watch
from hfsa.cosim.actions.schedule import Runnable


class Detail(NamedTuple):
    """How C performs an action.

    Attributes:
        performer: name of the function; `structure` is the name of what it takes, with these `fields`.
        calls: what the action is made of, by index of `failing`.
    """

    performer: str
    structure: str
    fields: Mapping[str, Any]
    calls: Sequence[Runnable] = ()


@singledispatch
def detail(action: CompositeAction) -> Detail:
    """Return how C performs an action."""
    raise TypeError(f"{type(action).__name__} has no twin in C")


@detail.register
def _(action: History) -> Detail:
    return Detail("hfsa_remember", "History", {"bus": action.bus, "points": action.points, "n": len(action.bus)})


@detail.register
def _(action: Extrapolate) -> Detail:
    fields = {
        "history": action.history,
        "places": action.places,
        "weights": np.ascontiguousarray(action.weights),
        "derivatives": action.derivatives,
        "n": len(action.places),
    }
    return Detail("hfsa_extrapolate", "Extrapolate", fields, action.setters)


@detail.register
def _(action: Ahead) -> Detail:
    rows, n = action.block.shape
    return Detail("hfsa_feed", "Feed", {**_named(action, "block", "array", "next"), "rows": rows, "n": n}, action.calls)


@detail.register
def _(action: AlgebraicLoop) -> Detail:
    fields = {
        **_named(action, "bus", "places", "inverse", "scale", "guess", "change"),
        "n": len(action.places),
        "n_inner": len(action.inner),
        "tolerance": algebraic_loop.TOLERANCE,
        "rounding": algebraic_loop.ROUNDING,
        "passes": algebraic_loop.PASSES,
    }
    return Detail("hfsa_solve", "Loop", fields, [it.call for it in (*action.inner, *action.groups)])


@detail.register
def _(action: IteratedStep) -> Detail:
    past = action.past
    fields = {
        "progress": action.progress,
        "past": {**_named(past, "times", "points", "known"), "n": len(action.guess)},
        "bus": action.wiring.bus,
        **_named(action, "guess", "change", "places", "nominal"),
        "n": len(action.places),
        "lines": [{**_named(it, "places", "values", "is_able"), "n": len(it.places)} for it in action.lines],
        "n_lines": len(action.lines),
        "n_instances": len(action.savers),
        "tolerance": iterated.TOLERANCE,
        "rounding": iterated.ROUNDING,
        "reuse": iterated.REUSE,
        "passes": iterated.PASSES[action.method],
        **(_named(action, "inverse") if action.method == "quasi_newton" else {}),
    }
    return Detail("hfsa_converge", "IteratedStep", fields, [*action.savers, *action.restorers, *action.tries])


@detail.register
def _(action: Gains) -> Detail:
    fields = {
        **_named(action, "gains", "derivatives", "entries", "places"),
        "n": len(action.gains),
        "n_entries": len(action.entries),
    }
    return Detail("hfsa_find_gains", "Gains", fields, action.calls)


@detail.register
def _(action: Rates) -> Detail:
    fields = {
        **_named(action, "rates", "feeding", "fed", "places", "result"),
        "n_feeding": len(action.feeding),
        "n": len(action.places),
    }
    return Detail("hfsa_find_rates", "Rates", fields, action.calls)


@detail.register
def _(action: Lines) -> Detail:
    fields = {
        **_named(action, "bus", "before", "rates", "places", "is_known", "slopes", "gains", "own"),
        "n": len(action.places),
        "n_own": len(action.own),
    }
    return Detail("hfsa_lay_lines", "Lines", fields, [action.setter])


def watched(watch: Watch) -> Mapping[str, Any]:
    """Return the fields of a `Watch` of step.h."""
    return {**_named(watch, "values", "low", "high"), "n": len(watch.values)}


def _named(owner: Any, *names: str) -> dict[str, Any]:
    """Return attributes that have the same names in C."""
    return {name: getattr(owner, name) for name in names}
