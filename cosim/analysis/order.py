"""The order in which an algorithm steps what is not sampled: which one errs least, before anything runs.

    criterion = ResponseCriterion(problem, excitations, outputs, band=(1.0, 50.0))      # or ModeCriterion(problem, outputs, lowest=1.0)
    choice = best_order(problem, criterion)
    system = in_order(system, choice.order)

Gauss-Seidel hands the newest outputs on to those that wait. What steps before what it feeds thus leads by half a step,
what steps after it lags by half: along a chain, source -> stack -> stage -> sensor, an order that takes turns errs in
the second order of the step, one that goes down the chain in the first.

Only who steps first of two that are joined makes a difference. So orders are compared by that: all that differ where
there are `MOST` or fewer, else those that exchange one such pair, again and again from the system's own order, until
none is better. A stable order goes before an unstable one; of orders as good as each other the one that is nearest to
the system's own stays. What ticks keeps its place: when it ticks, and after whom, is what the system is.

Of each order the one-step matrix is asked (`analysis/stability.py`), on FMUs that are linearised once.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Protocol

import numpy as np

from hfsa.cosim.analysis.stability import CoupledStep, OneStep
from hfsa.cosim.analysis.step_effect import mode_error
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.linear.linearize import linearize, sinusoids
from hfsa.cosim.results.records import OrderChoice
from hfsa.cosim.signals.excitation import logarithmic
from hfsa.cosim.signals.frequency_response import negligible
from hfsa.cosim.signals.response_scale import Scale, near_modes
from hfsa.cosim.systems.connectors import connector
from hfsa.cosim.systems.system import System

MOST = 120
"""Orders up to which all that differ are compared."""

_ALIKE = 0.01
"""Relative difference of errors up to which two orders are as good as each other."""

_POINTS = 40
"""Frequencies over a band; those around modes come on top."""

Before = frozenset[tuple[str, str]]
"""Of each two components that are joined, (who steps first, who steps after it)."""


@dataclass(frozen=True)
class OrderProblem:
    """A system to be stepped; `instances` are of its components, `step_size` in s."""

    system: System
    instances: Mapping[str, Instance]
    algorithm: str
    step_size: float


@dataclass(frozen=True)
class ExcitedSystem:
    """The system of a problem with a sine source at `input` and a lock-in amplifier at the outputs that are asked for.

    `instances` are of all its components, `source` and `lock_in` those two, `amplitude` in the input's unit.
    """

    system: System
    instances: Mapping[str, Instance]
    source: str
    lock_in: str
    input: str
    amplitude: float


class Criterion(Protocol):
    """What of a system shall err least."""

    about: str

    def error(self, order: Sequence[str], own: OneStep) -> float:
        """Return the relative error of an order, whose one-step matrix is `own`."""
        ...


class ResponseCriterion:
    """The responses of outputs to inputs, against the exact ones.

    The error is the largest at any frequency of the band, relative to what the output shows there at most, of whichever
    input, each at its amplitude: a small cross response counts for little. Notches are filled
    (`signals/response_scale.py`).
    """

    about = "response"

    def __init__(
        self,
        problem: OrderProblem,
        excitations: Sequence[ExcitedSystem],
        outputs: Sequence[str],
        band: tuple[float, float],
    ):
        system, instances = problem.system, problem.instances
        columns, orders = sinusoids(system, instances, [excitation.input for excitation in excitations])
        linear = linearize(system, instances, columns, outputs)
        grid = logarithmic(*band, _POINTS)
        self._frequency = np.unique(np.concatenate([grid, near_modes(linear.poles, band)]))
        self._amplitudes = np.array([excitation.amplitude for excitation in excitations])
        self._exact = linear.response(self._frequency, orders) * self._amplitudes
        scale = Scale(grid, np.abs(linear.response(grid, orders)) * self._amplitudes).at(self._frequency, self._exact)
        variables = {name: instance.fmu.variables for name, instance in instances.items()}
        units = [connector(system, variables, name).unit or "1" for name in outputs]
        self._moving = ~negligible(scale, units, np.ones(len(excitations))).all(axis=1)
        self._size = scale.max(axis=2, keepdims=True)
        self._step_size = problem.step_size
        self._coupled_steps = [
            CoupledStep(e.system, e.instances, problem.algorithm, source=e.source, lock_in=e.lock_in)
            for e in excitations
        ]

    def error(self, order: Sequence[str], own: OneStep) -> float:  # noqa: ARG002
        """Return the largest error of the responses."""
        found = [
            coupled.in_order(order).over(self._step_size).response(self._frequency) for coupled in self._coupled_steps
        ]
        difference = np.abs(np.stack(found, axis=2) * self._amplitudes - self._exact) / self._size
        return float(difference[:, self._moving].max(initial=0.0))


class ModeCriterion:
    """The modes of a system that moves by itself, as rates and frequencies, against the exact ones.

    Errors are those of `step_effect.mode_error`, relative to 2 pi `lowest` [Hz] where a mode is slower.
    """

    about = "modes"

    def __init__(self, problem: OrderProblem, outputs: Sequence[str], lowest: float):
        self._poles, self._lowest = linearize(problem.system, problem.instances, [], outputs).poles, lowest

    def error(self, order: Sequence[str], own: OneStep) -> float:  # noqa: ARG002
        """Return the largest error of a mode."""
        return mode_error(self._poles, own, self._lowest)


def best_order(problem: OrderProblem, criterion: Criterion) -> OrderChoice:
    """Return the order of a problem that errs least; raises `StructureError` where a response or modes are not known."""
    descriptions = {c.name: problem.instances[c.name].fmu.description for c in problem.system.components}
    names = [name for name, description in descriptions.items() if not description.is_sampled]
    fixed = {name for name in names if descriptions[name].has_sample_time}
    coupled = CoupledStep(problem.system, problem.instances, problem.algorithm)
    kind = coupled.counting

    def merit(before: Before) -> tuple[float, float]:
        """What an order is worth, the less the better: how fast it grows, 0 where it is stable, and its error."""
        order = order_of(names, before)
        own = coupled.in_order(order).over(problem.step_size)
        return (0.0, criterion.error(order, own)) if own.is_stable(kind) else (own.growth(kind), math.inf)

    own = joined(problem.system, names)
    found = search(own, lambda before: exchanged(before, fixed), merit)
    return OrderChoice(
        order=order_of(names, found.best),
        own=tuple(names),
        about=criterion.about,
        error=found.merits[found.best][1],
        own_error=found.merits[own][1],
        compared=len(found.merits),
        is_complete=found.is_complete,
    )


# Orders that differ ---------------------------------------------------------------------------------------------------


def joined(system: System, names: Sequence[str]) -> Before:
    """Return who of two joined components stands first in the system, among these names in its order."""
    places = {name: i for i, name in enumerate(names)}
    ends = ({system.split(c.start)[0], system.split(c.end)[0]} for c in system.connections)
    pairs = (sorted(pair, key=places.__getitem__) for pair in ends if len(pair) == 2 and pair <= places.keys())
    return frozenset((first, second) for first, second in pairs)


def order_of(names: Sequence[str], before: Before) -> tuple[str, ...]:
    """Return the order that keeps who steps before whom, and else stays next to that of `names`."""
    left, order = list(names), []
    while left:
        waiting = {second for first, second in before if first in left}
        order.append(next(name for name in left if name not in waiting))
        left.remove(order[-1])
    return tuple(order)


def exchanged(before: Before, fixed: Iterable[str]) -> Iterator[Before]:
    """Yield what becomes of it when one joined pair changes places, and nobody else; not of those that are fixed."""
    kept = set(fixed)
    for first, second in sorted(before):
        rest = before - {(first, second)}
        if not {first, second} & kept and second not in _followers(first, rest):
            yield rest | {(second, first)}


def _followers(name: str, before: Before) -> set[str]:
    """Return all that step after a component."""
    found, new = set(), {name}
    while new:
        new = {second for first, second in before if first in new} - found
        found |= new
    return found


@dataclass(frozen=True)
class Search:
    """What a search has come to: the best, the merits of all that were asked, and whether these are all there are."""

    best: Before
    merits: Mapping[Before, tuple[float, float]]
    is_complete: bool


def search(
    own: Before, neighbours: Callable[[Before], Iterator[Before]], merit: Callable[[Before], tuple[float, float]]
) -> Search:
    """Return the best of all that can be reached, or, of more than `MOST`, the best by steps to better neighbours."""
    every = list(islice(_reached(own, neighbours), MOST + 1))
    best, merits = own, {own: merit(own)}
    if len(every) <= MOST:
        for before in every[1:]:
            merits[before] = merit(before)
            best = before if _is_better(merits[before], merits[best]) else best
        return Search(best, merits, True)
    while True:
        here = best
        for before in neighbours(here):
            if before not in merits:
                merits[before] = merit(before)
            best = before if _is_better(merits[before], merits[best]) else best
        if best is here:
            return Search(best, merits, False)


def _reached(own: Before, neighbours: Callable[[Before], Iterator[Before]]) -> Iterator[Before]:
    """Yield all that can be reached by exchanges, the fewest first."""
    seen, new = {own}, [own]
    while new:
        yield from new
        further = dict.fromkeys(before for at in new for before in neighbours(at))
        new = [before for before in further if before not in seen]
        seen.update(new)


def _is_better(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """Whether an order is worth more than another, by more than rounding."""
    for new, old in zip(one, other, strict=True):
        if new != old and not math.isclose(new, old, rel_tol=_ALIKE):
            return new < old
    return False
