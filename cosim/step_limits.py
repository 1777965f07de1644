"""How long a communication step may be: the limit of every algorithm on a system, before anything runs.

    for found in step_limits(scene.system, instances, scene.step_size):
        print(found.algorithm, found.longest)
    advice = unstable_step(scene.system, instances, "gauss_seidel", 1e-3)     # a sentence, or None where it is stable

The one-step matrix of each algorithm (`stability.py`) is asked at steps from `SHORTEST` to `LONGEST` times the scene's
own, evenly spaced by ratio, and the step at which a mode first begins to grow is bisected. Where parts tick, only steps
that fit their sample times count, and the limit is the longest of those below which all are stable. Where rigid motion
is free, only flexible modes count: an algorithm may make its drift grow slowly at every step.

A fixed point has one more limit: beyond it a step's passes lead away from each other, although the step that they
should lead to is stable. `error_controlled` and `monolithic` choose their steps and have no limit of their own.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from hfsa.cosim._fmi.description import SAMPLE_TIME
from hfsa.cosim.instance import Instance
from hfsa.cosim.stability import NEUTRAL, Cycle, Kind
from hfsa.cosim.system import EXTRAPOLATED, HELD, ITERATED, StructureError, System

LIMITED = (*HELD, *EXTRAPOLATED, *ITERATED)
"""Algorithms whose limit is known."""

SHORTEST, LONGEST, POINTS = 1e-4, 1e4, 33
"""Steps that are asked, over the scene's own, and their number."""

ACCURACY = 1e-5
"""Relative accuracy of a limit that is free."""

_PARTS, _MULTIPLES = (32, 16, 10, 8, 5, 4, 2, 1), (2, 3, 5, 10)
"""Of the shortest sample time, the steps that are asked where parts tick."""

_ADVISED = ("gauss_seidel", "gauss_seidel_linear", "quasi_newton")
"""Algorithms that may be named in place of an unstable one."""


@dataclass(frozen=True)
class StepLimit:
    """The limit of one algorithm.

    Attributes:
        longest: stable step [s] below which all that were asked are stable; 0 where not even the shortest is, infinite
            where the longest that was asked is.
        is_stable: whether the scene's own step is, `None` where it does not fit the algorithm.
        flexible, rigid: fastest growth [1/s] of flexible modes and of rigid motion at the scene's own step, -inf where
            there are none.
        message: why the algorithm is not offered; empty where it is.
    """

    algorithm: str
    longest: float
    is_stable: bool | None = None
    flexible: float = -math.inf
    rigid: float = -math.inf
    message: str = ""


def step_limits(
    system: System,
    instances: Mapping[str, Instance],
    step_size: float,
    algorithms: Iterable[str] = LIMITED,
    starts: Mapping[str, float] | None = None,
) -> Iterator[StepLimit]:
    """Yield the limit of each algorithm about a system's equilibrium; `step_size` [s] is the scene's own.

    `starts` holds start values by full name. Raises `StructureError` as `linearize`.
    """
    kind = counting(Cycle(system, instances, starts=starts), system, instances, step_size, starts)
    for algorithm in algorithms:
        try:
            cycle = Cycle(system, instances, algorithm, starts=starts)
        except StructureError as error:
            yield StepLimit(algorithm, math.nan, message=str(error))
            continue
        candidates = _candidates(system, instances, step_size, starts or {})
        longest = _longest(cycle, candidates, not _sample_times(system, instances, starts or {}), kind)
        try:
            own = cycle.over(step_size)
        except StructureError:  # the step does not fit the sample times
            yield StepLimit(algorithm, longest)
            continue
        is_stable = own.is_stable(kind) and cycle.converges(step_size)
        yield StepLimit(algorithm, longest, is_stable, own.growth("flexible"), own.growth("rigid"))


def unstable_step(system: System, instances: Mapping[str, Instance], algorithm: str, step_size: float) -> str | None:
    """Return what to say of a step [s] beyond the limit of its algorithm, `None` where nothing is known against it."""
    if algorithm not in LIMITED or not _has_feedback(system):
        return None
    try:
        cycle = Cycle(system, instances, algorithm)
        own = cycle.over(step_size)
        kind = counting(cycle, system, instances, step_size)
        if own.is_stable(kind) and cycle.converges(step_size):
            return None
        found = list(step_limits(system, instances, step_size, dict.fromkeys([algorithm, *_ADVISED])))
    except StructureError:  # no equilibrium, or no derivatives: nothing can be said
        return None
    (chosen,) = (limit for limit in found if limit.algorithm == algorithm)
    others = [limit for limit in found if limit.is_stable and limit.algorithm != algorithm]
    grows = "its passes diverge" if own.is_stable(kind) else f"a mode grows by {own.growth(kind):.3g} 1/s"
    advice = [f"a step of {chosen.longest:.4g} s or less"] if chosen.longest > 0 else []
    if others:
        best = max(others, key=lambda limit: limit.longest)
        advice.append(f"the algorithm {best.algorithm}, stable {_seconds(best.longest)}")
    if not advice:
        return f"with {algorithm} at a step of {step_size:.4g} s {grows}, as at every step and with every algorithm"
    return f"with {algorithm} at a step of {step_size:.4g} s {grows}; {' or '.join(advice)} would do"


def counting(
    cycle: Cycle,
    system: System,
    instances: Mapping[str, Instance],
    step_size: float,
    starts: Mapping[str, float] | None = None,
) -> Kind:
    """Return which modes count: flexible ones alone where a step far below the limit leaves rigid motion neutral."""
    candidates = [step for step in _candidates(system, instances, step_size, starts or {}) if step >= step_size / 50]
    rigid = cycle.over(candidates[0]).growth("rigid")
    return "flexible" if math.isfinite(rigid) and rigid > -NEUTRAL else "all"


def _has_feedback(system: System) -> bool:
    """Whether what a component puts out ever comes back to it."""
    names = {component.name: i for i, component in enumerate(system.components)}
    pairs = [(names[system.split(c.start)[0]], names[system.split(c.end)[0]]) for c in system.connections]
    rows, columns = zip(*pairs, strict=True) if pairs else ((), ())
    graph = csr_matrix((np.ones(len(pairs)), (rows, columns)), shape=(len(names), len(names)))
    count, _ = connected_components(graph, directed=True, connection="strong")
    return count < len(names) or any(i == j for i, j in pairs)


def _seconds(longest: float) -> str:
    """Return a limit in words."""
    return "at every step that was asked" if math.isinf(longest) else f"up to {longest:.4g} s"


def _sample_times(system: System, instances: Mapping[str, Instance], starts: Mapping[str, float]) -> list[float]:
    """Return the sample times [s] of a system."""
    found = []
    for component in system.components:
        description = instances[component.name].fmu.description
        if description.has_sample_time:
            own = component.start.get(SAMPLE_TIME, description.variables[SAMPLE_TIME].start)
            found.append(float(starts.get(f"{component.name}.{SAMPLE_TIME}", own)))
    return found


def _candidates(
    system: System, instances: Mapping[str, Instance], step_size: float, starts: Mapping[str, float]
) -> list[float]:
    """Return the steps [s] to ask, ascending."""
    times = _sample_times(system, instances, starts)
    if not times:
        return list(np.geomspace(SHORTEST * step_size, LONGEST * step_size, POINTS))
    shortest = min(times)
    return [shortest / n for n in _PARTS] + [shortest * n for n in _MULTIPLES]


def _longest(cycle: Cycle, candidates: Sequence[float], is_free: bool, kind: Kind) -> float:
    """Return `StepLimit.longest`."""

    def is_stable(step_size: float) -> bool:
        """Whether no mode that counts grows, and a fixed point is found."""
        return cycle.over(step_size).is_stable(kind) and cycle.converges(step_size)

    low = 0.0
    for step_size in candidates:
        try:
            if is_stable(step_size):
                low = step_size
                continue
        except StructureError:  # it does not fit another sample time
            continue
        high = step_size
        while is_free and low > 0 and high - low > ACCURACY * high:
            middle = math.sqrt(low * high)
            low, high = (middle, high) if is_stable(middle) else (low, middle)
        return low
    return math.inf
