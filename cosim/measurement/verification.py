"""Verification of a run: the error that its communication step makes, from a second run at half the step.

    check_verifiable(plan)
    run(plan, path)
    verified = verify(plan, path)       # its errors are in the file as well
    verified.excess(plan.tolerance)     # a sentence where one is above the tolerance

Of a variable y that was recorded with steps of H, and again with steps of H / 2, an algorithm of order p errs by

    |y_H - y_{H/2}| / (1 - 2^-p)        at most, over the points of the first run        (Richardson)

and relatively to the largest |y_H|. What the FMUs' own solvers err by is in both runs, and not in this.
"""

import math
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.actions.wiring import check_sample_times
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.masters.algorithms import ALGORITHMS, algorithm_named, open_master
from hfsa.cosim.measurement.limit_flags import is_limit
from hfsa.cosim.measurement.run import RunPlan
from hfsa.cosim.results.files import ErrorEstimate, read_run, write_errors
from hfsa.cosim.signals.prefixes import readable
from hfsa.cosim.systems.errors import StructureError

_BLOCK = 10_000
"""Steps between two looks at whether anybody wants an end."""

_ROUNDING = 1e-11
"""Part of its scale, and of the largest variable in its unit, below which the size of a variable is rounding."""

_MARGIN = 1.1
"""Factor by which the step that would do is to be better than the tolerance."""

_UNLIKE = 0.3
"""Relative error from which on the two runs have too little in common for a figure."""


def check_verifiable(plan: RunPlan) -> None:
    """Raise `StructureError` for an algorithm that takes no given step, and for ticks that half the step misses."""
    row = algorithm_named(plan.algorithm)
    if not row.is_limited:
        reason = (
            "takes communication steps of its own choice, as long as --tolerance lets them be"
            if not row.is_model_exchange
            else "takes no communication steps: its step lies between two records"
        )
        raise StructureError(f"--verify halves the communication step, but {plan.algorithm} {reason}")
    try:
        check_sample_times(plan.assembly.system, plan.assembly.connectors, {}, plan.step_size / 2)
    except StructureError as error:
        raise StructureError(f"--verify halves the communication step: {error}") from None


@dataclass(frozen=True)
class Verification:
    """What came out: `errors` by recorded variable, made by an algorithm of an `order` at a step [s].

    `order` is lower than the algorithm's own where inputs could not move as it asks.
    """

    errors: Mapping[str, ErrorEstimate]
    algorithm: str
    order: int
    step_size: float

    def excess(self, tolerance: float) -> str:
        """Return a sentence on the variable that errs most, and what would do; empty where none exceeds a tolerance."""
        above = [name for name, error in self.errors.items() if error.relative > tolerance]
        if not above:
            return ""
        worst = max(above, key=lambda name: self.errors[name].relative)
        error = self.errors[worst].relative
        others = "" if len(above) == 1 else f", and {len(above) - 1} more are above it"
        found = (
            f"{worst} errs by {100 * error:.3g} % at the communication step of {readable(self.step_size, 's')}, above "
            f"the tolerance of {100 * tolerance:.3g} %{others}"
        )
        if error > _UNLIKE:
            return f"{found}: the run at half the step has little in common with it, so that far shorter steps are due"
        parts = math.ceil((_MARGIN * error / tolerance) ** (1 / self.order))
        better = _of_higher_order(self.algorithm)
        other = f", or an algorithm of higher order, such as {better}" if better else ""
        return f"{found}: a step of {readable(self.step_size / parts, 's')} would do{other}"


def _of_higher_order(name: str) -> str | None:
    """Return the algorithm of the highest order above that of another, the most alike by name; `None` if none is."""
    own, family = algorithm_named(name).order or 0, name.partition("_")[0]
    above = [row for row in ALGORITHMS.values() if (row.order or 0) > own]
    alike = max(above, key=lambda row: (row.order or 0, row.name.startswith(family)), default=None)
    return alike.name if alike else None


def verify(plan: RunPlan, path: Path, report: Callable[[float], None] | None = None) -> Verification:
    """Return the errors of what a run has recorded into the file `path`, and write them there as well.

    Limits, which are 0 or 1, have none. `report` is called with the part done, 0 to 1, and may raise to end it.
    `StepError` where the run at half the step cannot go on: the error is not known then.
    """
    recorded, units = read_run(path)
    names = [name for name in plan.names if not is_limit(name)]
    halved, order = _at_half_the_step(plan, names, report)
    size = {name: float(np.abs(recorded[name]).max()) for name in names}
    errors = {}
    for name in names:
        absolute = float(np.abs(recorded[name] - halved[name]).max()) / (1 - 2.0**-order)
        scale = plan.scales[name].size if name in plan.scales else 0.0
        largest = max(size[other] for other in names if units[other] == units[name])
        relative = absolute / max(size[name], _ROUNDING * max(scale, largest)) if absolute else 0.0
        errors[name] = ErrorEstimate(absolute, relative)
    write_errors(path, errors)
    return Verification(errors, plan.algorithm, order, plan.step_size)


def shares(report: Callable[[float], None] | None) -> tuple[Callable[[float], None], Callable[[float], None]]:
    """Return what a run, and then its verification, which takes twice as long, report of their common progress to."""
    tell = report or (lambda _: None)
    return lambda part: tell(part / 3), lambda part: tell((1 + 2 * part) / 3)


def _at_half_the_step(
    plan: RunPlan, names: list[str], report: Callable[[float], None] | None
) -> tuple[dict[str, NDArray[np.float64]], int]:
    """Return values of variables at the points of a run, from one with half its step, and the order of its error."""
    steps, step_size = 2 * plan.steps, plan.step_size / 2
    master = open_master(plan.assembly, plan.algorithm, step_size, plan.library, plan.tolerance)
    with closing(master):
        recording = master.record(names, rows=plan.steps + 1, every=2)
        recording.watch.limit(plan.scales)
        try:
            master.initialize(stop_time=max(plan.stop_time, plan.end))
            for done in range(0, steps, _BLOCK):
                master.advance(min(_BLOCK, steps - done))
                if report is not None:
                    report(min(done + _BLOCK, steps) / steps)
        except StepError as error:
            message = f"in the run at half the step, {readable(step_size, 's')}, so that no error is known"
            words = f"{message}: {error.message}" if error.message else message
            raise StepError(error.instance, error.function, error.status, error.time, words) from error
        assert master.order is not None
        return {name: recording[name].copy() for name in names}, master.order
