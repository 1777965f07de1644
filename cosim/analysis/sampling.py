"""How slowly a sampled system may tick: the sample time up to which its closed loops are stable.

    found = sampling_limit(scene.system, instances, scene.outputs)
    found.sample_time, found.longest, found.is_stable

All sample times are scaled together. For each scale the FMUs are linearised at their equilibrium, and the multipliers
of one period of the exact sampled system, hold and all (`linearize`), tell whether a mode grows. Going up from the
system's own sample times the limit is where that happens first; where the system is unstable as it is, the limit is the
longest sample time below its own that makes it stable.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from hfsa.cosim.analysis.stability import ROUNDING
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.fmi.description import SAMPLE_TIME
from hfsa.cosim.linear.linearize import linearize, upstream
from hfsa.cosim.systems.system import System

MOST, LEAST = 1e4, 1e-6
"""Scales between which a limit is looked for."""

RATIO = 1.1
"""Ratio of neighbours in the search, below which two changes of stability are taken for none."""

ACCURACY = 1e-4
"""Relative accuracy of a limit."""


@dataclass(frozen=True)
class SamplingLimit:
    """The limit of a sampled system.

    Attributes:
        sample_time: the shortest of the system's own [s].
        longest: what that may be, the others in proportion [s]; infinite where no limit is found up to `MOST` times the
            own, 0 where the system is unstable down to `LEAST` of it.
    """

    sample_time: float
    longest: float

    @property
    def is_stable(self) -> bool:
        """Whether the system is stable at its own sample times."""
        return self.longest > self.sample_time


def sampling_limit(
    system: System,
    instances: Mapping[str, Instance],
    outputs: Sequence[str],
    starts: Mapping[str, float] | None = None,
) -> SamplingLimit | None:
    """Return the limit of what the outputs (full names) follow from, `None` where nothing of that is sampled.

    `starts` holds start values by full name. Instances are left in initialization mode. Raises `StructureError` as
    `linearize`.
    """
    own = sample_times(upstream(system, outputs), instances, starts or {})
    if not own:
        return None

    def is_stable(scale: float) -> bool:
        """Whether no pole grows with all sample times scaled, but for rounding."""
        scaled = {name: scale * value for name, value in own.items()}
        found = linearize(system, instances, [], outputs, {**(starts or {}), **scaled})
        fastest = max((pole.real for pole in found.poles), default=-math.inf)
        return fastest * found.sampled.period <= ROUNDING

    shortest = min(own.values())
    return SamplingLimit(shortest, shortest * _longest(is_stable))


def sample_times(system: System, instances: Mapping[str, Instance], starts: Mapping[str, float]) -> dict[str, float]:
    """Return the sample times [s] of a system by the full names of the parameters; `starts` go before its own."""
    found = {}
    for component in system.components:
        description = instances[component.name].fmu.description
        if description.has_sample_time:
            name = f"{component.name}.{SAMPLE_TIME}"
            own = component.start.get(SAMPLE_TIME, description.variables[SAMPLE_TIME].start)
            found[name] = float(starts.get(name, own))
    return found


def _longest(is_stable: Callable[[float], bool]) -> float:
    """Return the scale at which stability ends, as `SamplingLimit.longest` over the own sample time."""
    if is_stable(1.0):
        low, high = 1.0, RATIO
        while is_stable(high):
            low, high = high, high * RATIO
            if high > MOST:
                return math.inf
    else:
        low, high = 1 / RATIO, 1.0
        while not is_stable(low):
            low, high = low / RATIO, low
            if low < LEAST:
                return 0.0
    while high - low > ACCURACY * low:
        middle = math.sqrt(low * high)
        low, high = (middle, high) if is_stable(middle) else (low, middle)
    return low
