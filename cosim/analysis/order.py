"""Stepping order of the continuous components: the order with the smallest error, computed before a run.

    criterion = ResponseCriterion(problem, excitations, outputs, band=(1.0, 50.0))
    criterion = ModeCriterion(problem, outputs, lowest=1.0)                # for a system without excitation
    choice = best_order(problem, criterion)
    system = in_order(system, choice.order)

Gauss-Seidel passes the newest outputs on to the components that step later. A connection whose source steps first leads
by half a step, one whose source steps last lags by half. Along a chain, source -> stack -> stage -> sensor, an order
that alternates has an error of second order in the step, an order down the chain one of first order.

Only the order within each connected pair has an effect, so orders that agree on all pairs are equivalent. The search
compares all orders that differ where there are `MOST` or fewer; else it exchanges single pairs, starting from the
system's own order, until no exchange is better. A stable order is better than an unstable one; among equally good
orders the search keeps the one nearest to the system's own. Components with ticks keep their places, because the order
of their ticks is part of the model.

The criterion is evaluated on the one-step matrix of each order (`analysis/stability.py`); FMUs are linearised once.
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
"""Largest number of different orders that are all compared."""

_ALIKE = 0.01
"""Relative difference of errors up to which two orders are equally good."""

_POINTS = 40
"""Number of frequencies over a band, in addition to those around modes."""

Before = frozenset[tuple[str, str]]
"""For each connected pair of components: (the one that steps first, the other)."""


@dataclass(frozen=True)
class OrderProblem:
    """A system to be stepped by an algorithm at a `step_size` [s], and its observed outputs; `instances` by component.

    A component that feeds no other and of which nothing is observed keeps its place, which has no effect.
    """

    system: System
    instances: Mapping[str, Instance]
    algorithm: str
    step_size: float
    observed: Sequence[str]

    @property
    def without_effect(self) -> set[str]:
        """Components whose place has no effect on what is observed."""
        split = self.system.split
        needed = {split(name)[0] for name in (*self.observed, *(c.start for c in self.system.connections))}
        return {component.name for component in self.system.components} - needed


@dataclass(frozen=True)
class ExcitedSystem:
    """The system of a problem with a sine source at `input` and a lock-in amplifier at the outputs of interest.

    `instances` by component, `source` and `lock_in` are the names of the instruments, `amplitude` is in the unit of the
    input.
    """

    system: System
    instances: Mapping[str, Instance]
    source: str
    lock_in: str
    input: str
    amplitude: float


class Criterion(Protocol):
    """Error of an order: of responses, or of modes."""

    about: str

    def error(self, order: Sequence[str], own: OneStep) -> float:
        """Return the relative error of an order, whose one-step matrix is `own`."""
        ...


class ResponseCriterion:
    """Error of the responses of outputs to inputs, compared with the exact responses.

    It is the largest error over the frequencies of the band, relative to the largest response of that output there to
    any input at its amplitude, so that a small cross response has little weight. Notches are filled
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
    """Error of the modes of a system without excitation, compared with the exact modes.

    The error is that of `step_effect.mode_error`, relative to 2 pi `lowest` [Hz] where a mode is slower.
    """

    about = "modes"

    def __init__(self, problem: OrderProblem, outputs: Sequence[str], lowest: float):
        self._poles, self._lowest = linearize(problem.system, problem.instances, [], outputs).poles, lowest

    def error(self, order: Sequence[str], own: OneStep) -> float:  # noqa: ARG002
        """Return the largest error of a mode."""
        return mode_error(self._poles, own, self._lowest)


def best_order(problem: OrderProblem, criterion: Criterion) -> OrderChoice:
    """Return the order with the smallest error; raises `StructureError` as `linearize`."""
    descriptions = {c.name: problem.instances[c.name].fmu.description for c in problem.system.components}
    idle = problem.without_effect
    names = [name for name, description in descriptions.items() if not description.is_sampled and name not in idle]
    fixed = {name for name in names if descriptions[name].has_sample_time}
    coupled = CoupledStep(problem.system, problem.instances, problem.algorithm)
    kind = coupled.counting

    def merit(before: Before) -> tuple[float, float]:
        """Return the merit of an order, smaller is better: (growth rate, 0 where stable; error)."""
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
    """Return each connected pair among `names`, the component that is first in `names` first."""
    places = {name: i for i, name in enumerate(names)}
    ends = ({system.split(c.start)[0], system.split(c.end)[0]} for c in system.connections)
    pairs = (sorted(pair, key=places.__getitem__) for pair in ends if len(pair) == 2 and pair <= places.keys())
    return frozenset((first, second) for first, second in pairs)


def order_of(names: Sequence[str], before: Before) -> tuple[str, ...]:
    """Return the order that satisfies all pairs and is otherwise nearest to that of `names`."""
    left, order = list(names), []
    while left:
        waiting = {second for first, second in before if first in left}
        order.append(next(name for name in left if name not in waiting))
        left.remove(order[-1])
    return tuple(order)


def exchanged(before: Before, fixed: Iterable[str]) -> Iterator[Before]:
    """Yield each result of exchanging a single connected pair without a fixed component."""
    kept = set(fixed)
    for first, second in sorted(before):
        rest = before - {(first, second)}
        if not {first, second} & kept and second not in _followers(first, rest):
            yield rest | {(second, first)}


def _followers(name: str, before: Before) -> set[str]:
    """Return all components that must step after a component."""
    found, new = set(), {name}
    while new:
        new = {second for first, second in before if first in new} - found
        found |= new
    return found


@dataclass(frozen=True)
class Search:
    """Result of a search: the best order, the merits of all compared orders, and whether these are all orders."""

    best: Before
    merits: Mapping[Before, tuple[float, float]]
    is_complete: bool


def search(
    own: Before, neighbours: Callable[[Before], Iterator[Before]], merit: Callable[[Before], tuple[float, float]]
) -> Search:
    """Return the best of all reachable orders, or of more than `MOST`, the end of a descent over neighbours."""
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
    """Yield all orders reachable by exchanges, those with the fewest exchanges first."""
    seen, new = {own}, [own]
    while new:
        yield from new
        further = dict.fromkeys(before for at in new for before in neighbours(at))
        new = [before for before in further if before not in seen]
        seen.update(new)


def _is_better(one: tuple[float, float], other: tuple[float, float]) -> bool:
    """Whether a merit is better than another by more than `_ALIKE`."""
    for new, old in zip(one, other, strict=True):
        if new != old and not math.isclose(new, old, rel_tol=_ALIKE):
            return new < old
    return False
