"""Cost of a configuration: counts of its work times unit costs, which a short probe measures in this process.

    costs = Costs(built, library)
    seconds, counts = costs.predicted(configuration)        # CPU time per simulated second

A step of an algorithm on given FMUs makes the same calls at every step size. Where ticks or steps
of a solver take place within it, their number depends on the step size: such a system is probed at several step
sizes, with values between by interpolation.
"""

import math
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hfsa.cosim.actions.action import CompositeAction
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.description import SOLVER_STEP, SOLVER_TOLERANCE
from hfsa.cosim.masters.algorithms import open_master
from hfsa.cosim.masters.master import Master
from hfsa.cosim.masters.native.details import detail
from hfsa.cosim.systems.scene import LOCK_IN
from hfsa.cosim.tradeoff.configuration import Composition, Configuration, Counts

_PROBE, _LONG = 0.012, 0.06
"""CPU time [s] of a probe for unit costs, and of a measurement."""

_ROUNDS = 3
"""Number of probes, of which the fastest counts."""

_RATIO = 1.5
"""Largest ratio of a step to the nearest one that was probed, where solvers take steps of their own."""


@dataclass(frozen=True)
class _Unit:
    """Cost [s] of a step, with the FMI calls and right-hand sides in it."""

    seconds: float
    calls: float
    evaluations: float


class Costs:
    """Unit costs of the configurations of one scene, measured when first needed.

    `built` returns the assembly of a configuration with its instruments, `library` is the stepping loop in C, `None`
    for the one in Python.
    """

    def __init__(self, built: Callable[[Configuration], Assembly], library: Path | None):
        self._built, self._library = built, library
        self._units: dict[tuple[Composition, str], dict[float, _Unit]] = {}

    def predicted(self, configuration: Configuration) -> tuple[float, Counts]:
        """Return the CPU time [s] and the work per simulated second; raises as a master that cannot run it."""
        known = self._units.setdefault(configuration.line, {})
        step = configuration.step_size
        nearest = min(known, key=lambda other: abs(math.log(other / step)), default=None)
        if nearest is None or (max(nearest / step, step / nearest) > _RATIO and self._depends_on_step(configuration)):
            known[step] = self._probe(configuration, _PROBE)
        return self._per_second(step, *(self._between(known, step)))

    def measured(self, configuration: Configuration) -> float:
        """Return the CPU time [s] per simulated second, measured over a longer run."""
        return self._probe(configuration, _LONG).seconds / configuration.step_size

    def _depends_on_step(self, configuration: Configuration) -> bool:
        """Whether the cost of a step depends on its size: ticks, or steps of a solver, may take place within it."""
        assembly = self._built(configuration)
        own = {name: d for name, d in assembly.descriptions.items() if name != LOCK_IN}
        has_solver = any(name in d.variables for d in own.values() for name in (SOLVER_TOLERANCE, SOLVER_STEP))
        return has_solver or assembly.is_foreign or any(d.has_sample_time for d in own.values())

    @staticmethod
    def _between(known: dict[float, _Unit], step: float) -> tuple[float, float, float]:
        """Return seconds, calls and evaluations in a step, between the steps that were probed."""
        at = sorted(known)
        rows = np.array([[known[h].seconds, known[h].calls, known[h].evaluations] for h in at])
        found = [float(np.interp(step, at, column)) for column in rows.T]
        return found[0], found[1], found[2]

    @staticmethod
    def _per_second(step: float, seconds: float, calls: float, evaluations: float) -> tuple[float, Counts]:
        """Return cost and counts per simulated second of those in a step [s]."""
        return seconds / step, Counts(1 / step, calls / step, evaluations / step)

    def _probe(self, configuration: Configuration, duration: float) -> _Unit:
        """Return the unit costs of a configuration from steps that take a CPU time [s]."""
        assembly = self._built(configuration)
        with closing(open_master(assembly, configuration.algorithm, configuration.step_size, self._library)) as master:
            master.initialize()
            steps, taken = 16, 0.0
            while taken < duration / 4:
                steps, taken = 4 * steps, _timed(master, 4 * steps)
            steps = max(1, round(steps * duration / taken / _ROUNDS))
            before = dict(master.statistics)
            fastest = min(_timed(master, steps) for _ in range(_ROUNDS)) / steps
            after = master.statistics
            done = {name: (after[name] - before.get(name, 0)) / (_ROUNDS * steps) for name in after}
            passes = done.get("passes", 1.0)
            return _Unit(fastest, _calls(master, passes), done.get("solver_evaluations", 0.0))


def _timed(master: Master, steps: int) -> float:
    """Return the CPU time [s] of a number of steps in this thread."""
    begin = time.thread_time()
    master.advance(steps)
    return max(time.thread_time() - begin, 1e-9)


def _calls(master: Master, passes: float) -> float:
    """Return the number of FMI calls in a step; those of an iterated action are made in each of its passes."""
    return sum(
        len(_inner(action.call)) * (passes if hasattr(action.call, "passes") else 1.0) for action in master.cycle
    )


def _inner(call: object) -> list[object]:
    """Return the FMI calls that an action is made of."""
    if not isinstance(call, CompositeAction):
        return [call]
    return [inner for part in detail(call).calls for inner in _inner(part)]
