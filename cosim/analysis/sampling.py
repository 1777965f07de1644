"""Sampling limit: the longest sample time at which the closed loops of a sampled system are stable.

    found = sampling_limit(scene.system, instances, scene.outputs)
    found.sample_time, found.longest, found.is_stable

All sample times are scaled together. For each scale the FMUs are linearised at their equilibrium, and the system is
stable where no multiplier of one period of the exact sampled system (`linearize`), holds included, grows. The limit of
a stable system is the first loss of stability above its own sample times; that of an unstable system is the longest
stable sample time below its own.
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
"""Range of scales of the search."""

RATIO = 1.1
"""Ratio of neighbouring scales in the search; two changes of stability within it are not detected."""

ACCURACY = 1e-4
"""Relative accuracy of a limit."""


@dataclass(frozen=True)
class SamplingLimit:
    """The limit of a sampled system.

    Attributes:
        sample_time: shortest sample time of the system [s].
        longest: longest stable value of it [s], the others in proportion; infinite where the system is stable up to
            `MOST` times its own, 0 where it is unstable down to `LEAST` of it.
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
    """Return the limit of the system upstream of the outputs (full names), `None` where nothing there is sampled.

    `starts` holds start values by full name. Instances are left in initialization mode. Raises `StructureError` as
    `linearize`.
    """
    own = sample_times(upstream(system, outputs), instances, starts or {})
    if not own:
        return None

    def is_stable(scale: float) -> bool:
        """Whether no pole grows, except by rounding, with all sample times scaled."""
        scaled = {name: scale * value for name, value in own.items()}
        found = linearize(system, instances, [], outputs, {**(starts or {}), **scaled})
        fastest = max((pole.real for pole in found.poles), default=-math.inf)
        return fastest * found.sampled.period <= ROUNDING

    shortest = min(own.values())
    return SamplingLimit(shortest, shortest * _longest(is_stable))


def sample_times(system: System, instances: Mapping[str, Instance], starts: Mapping[str, float]) -> dict[str, float]:
    """Return the sample times [s] of a system by the full names of the parameters; `starts` override its own."""
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
