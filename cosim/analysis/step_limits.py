"""Step limits: the longest stable communication step of each algorithm on a system, computed before a run.

    for found in step_limits(scene.system, instances, scene.step_size):
        print(found.algorithm, found.longest)
    sentence = advice(coupled, "gauss_seidel", 1e-3, times)          # warning for a step beyond the limit, else None

The one-step matrix of each algorithm (`analysis/stability.py`) is evaluated at steps from `SHORTEST` to `LONGEST` times
the scene's step, in small ratios near it because stability may be lost and regained. The first step at which a mode
grows is then bisected. With ticks only steps that fit the sample times are possible: the limit is one of them, and the
next longer one is unstable. Where some motion is free only oscillatory modes count, because an algorithm may make drift
grow slowly at every step.

`fixed_point` has a second limit, beyond which its passes diverge although the solution of the step is stable.
`error_controlled`, `monolithic` and `monolithic_dae` choose their steps and have no limit.
"""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hfsa.cosim.analysis.sampling import sample_times
from hfsa.cosim.analysis.stability import CoupledStep
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.masters.algorithms import ALGORITHMS, LIMITED
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import System

SHORTEST, LONGEST, COARSE = 1e-4, 1e4, 2.0
"""Range of the steps that are evaluated, over the scene's step, and their largest ratio."""

NEAR, FAR, FINE = 0.1, 1e3, 1.1
"""Range with the smaller ratio `FINE`; a window of instability narrower than that is not detected."""

ACCURACY = 1e-5
"""Relative accuracy of a limit without ticks."""

_PARTS, _MOST = (32, 16, 10, 8, 5, 4, 2, 1), 1000
"""With ticks: divisors of the shortest sample time, and its largest multiple; other multiples in ratios `FINE`."""

_ADVISED = tuple(name for name, row in ALGORITHMS.items() if row.is_advised)
"""Algorithms that the advice may recommend in place of an unstable one."""


@dataclass(frozen=True)
class StepLimit:
    """The limit of one algorithm.

    Attributes:
        longest: longest step [s] up to which all evaluated steps are stable; 0 where the shortest is unstable, infinite
            where all are stable.
        is_stable: whether the scene's own step is stable, `None` where it does not fit the sample times.
        oscillatory, aperiodic: fastest growth [1/s] of modes of that kind at the scene's own step, -inf without any.
        message: reason why the algorithm cannot run the system; empty where it can.
    """

    algorithm: str
    longest: float
    is_stable: bool | None = None
    oscillatory: float = -math.inf
    aperiodic: float = -math.inf
    message: str = ""


def step_limits(
    system: System,
    instances: Mapping[str, Instance],
    step_size: float,
    algorithms: Iterable[str] = LIMITED,
    starts: Mapping[str, float] | None = None,
) -> Iterator[StepLimit]:
    """Yield the limit of each algorithm at a system's equilibrium; `step_size` [s] is the scene's own.

    `starts` holds start values by full name. Raises `StructureError` as `linearize`.
    """
    own = CoupledStep(system, instances, starts=starts)
    times = sample_times(system, instances, starts or {}).values()
    for algorithm in algorithms:
        try:
            coupled = own.with_algorithm(algorithm)
        except StructureError as error:
            yield StepLimit(algorithm, math.nan, message=str(error))
            continue
        yield _limit(coupled, algorithm, step_size, times)


def advice(base: CoupledStep, algorithm: str, step_size: float, times: Collection[float]) -> str | None:
    """Return a warning for a step [s] beyond the limit of an algorithm, `None` where it is stable.

    `base` is the system's coupled step with any algorithm, `times` are the sample times [s]. Raises as `CoupledStep`.
    """
    coupled = base.with_algorithm(algorithm)
    own = coupled.over(step_size)
    is_growing = not own.is_stable(coupled.counting)
    if not is_growing and coupled.converges(step_size):
        return None
    longest = _longest(coupled, step_size, times)
    others = [
        limit
        for name in _ADVISED
        if name != algorithm and (limit := _limit_of_alternative(coupled, name, step_size, times))
    ]
    grows = f"a mode grows by {own.growth(coupled.counting):.3g} 1/s" if is_growing else "its passes diverge"
    would = [f"a step of {longest:.4g} s or less"] if longest > 0 else []
    if others:
        best = max(others, key=lambda limit: limit.longest)
        would.append(f"the algorithm {best.algorithm}, stable {_seconds(best.longest)}")
    if not would:
        return f"with {algorithm} at a step of {step_size:.4g} s {grows}, as at every step and with every algorithm"
    return f"with {algorithm} at a step of {step_size:.4g} s {grows}; {' or '.join(would)} would do"


def longest_stable(base: CoupledStep, algorithm: str, step_size: float, times: Collection[float]) -> float:
    """Return `StepLimit.longest` of an algorithm, searched around a step [s]; `times` are the sample times [s].

    Raises `StructureError` where the algorithm cannot run the system.
    """
    return _longest(base.with_algorithm(algorithm), step_size, times)


def fitting(step_size: float, times: Collection[float]) -> float:
    """Return the longest step [s] up to `step_size` that divides each sample time [s], or is a multiple of it."""
    if not times:
        return step_size
    shortest = min(times)
    if step_size < shortest:
        return shortest / math.ceil(shortest / step_size * (1 - 1e-9))
    multiples = range(math.floor(step_size / shortest * (1 + 1e-9)), 0, -1)
    return next((shortest * n for n in multiples if _fits(shortest * n, times)), shortest)


def _limit_of_alternative(
    coupled: CoupledStep, algorithm: str, step_size: float, times: Collection[float]
) -> StepLimit | None:
    """Return the limit of another algorithm; `None` where it is unstable at the step [s] or cannot run the system."""
    try:
        other = coupled.with_algorithm(algorithm)
    except StructureError:
        return None
    return StepLimit(algorithm, _longest(other, step_size, times)) if other.is_stable(step_size) else None


def _limit(coupled: CoupledStep, algorithm: str, step_size: float, times: Collection[float]) -> StepLimit:
    """Return the limit of an algorithm, with its growth rates at the scene's own step [s]."""
    longest = _longest(coupled, step_size, times)
    try:
        own = coupled.over(step_size)
    except StructureError:  # the step does not fit the sample times
        return StepLimit(algorithm, longest)
    is_stable = own.is_stable(coupled.counting) and coupled.converges(step_size)
    return StepLimit(algorithm, longest, is_stable, own.growth("oscillatory"), own.growth("aperiodic"))


def _seconds(longest: float) -> str:
    """Return a limit as text."""
    return "at every step that was evaluated" if math.isinf(longest) else f"up to {longest:.4g} s"


def _longest(coupled: CoupledStep, step_size: float, times: Collection[float]) -> float:
    """Return `StepLimit.longest`; `times` are the sample times [s]."""
    low = 0.0
    for high in _candidates(step_size, times):
        if coupled.is_stable(high):
            low = high
        elif low == 0.0:
            return low
        else:
            return _among(coupled, _between(low, high, times)) if times else _bisected(coupled, low, high)
    return math.inf


def _candidates(step_size: float, times: Collection[float]) -> list[float]:
    """Return the steps [s] to evaluate first, ascending."""
    if not times:
        ends = ((SHORTEST, NEAR, COARSE), (NEAR, FAR, FINE), (FAR, LONGEST, COARSE))
        return [step_size * ratio for low, high, most in ends for ratio in _spaced(low, high, most)]
    shortest, multiples = min(times), [2]
    while multiples[-1] < _MOST:
        multiples.append(max(multiples[-1] + 1, int(FINE * multiples[-1])))
    steps = [*(shortest / n for n in _PARTS), *(shortest * n for n in multiples)]
    return [step for step in steps if _fits(step, times)]


def _spaced(low: float, high: float, ratio: float) -> list[float]:
    """Return ascending values from `low` up to but without `high`, in a ratio of at most `ratio`."""
    return np.geomspace(low, high, math.ceil(math.log(high / low) / math.log(ratio)) + 1)[:-1].tolist()


def _fits(step_size: float, times: Collection[float]) -> bool:
    """Whether a step [s] divides each sample time [s] or is a multiple of it."""
    ratios = [max(time / step_size, step_size / time) for time in times]
    return all(abs(ratio - round(ratio)) <= 1e-9 * ratio for ratio in ratios)


def _between(low: float, high: float, times: Collection[float]) -> list[float]:
    """Return the steps [s] that fit the sample times, ascending from `low` up to but without `high`."""
    shortest = min(times)
    if high > shortest:
        found = [shortest * n for n in range(round(low / shortest), round(high / shortest))]
    else:
        found = [shortest / n for n in range(round(shortest / low), round(shortest / high), -1)]
    return [step for step in found if _fits(step, times)]


def _among(coupled: CoupledStep, steps: Sequence[float]) -> float:
    """Return the longest stable of steps [s], the first of which is stable, by bisection."""
    low, high = 0, len(steps)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if coupled.is_stable(steps[middle]) else (low, middle)
    return steps[low]


def _bisected(coupled: CoupledStep, low: float, high: float) -> float:
    """Return the step [s] between two others at which stability is lost."""
    while high - low > ACCURACY * high:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if coupled.is_stable(middle) else (low, middle)
    return low
