"""Verification of a run: the error of its communication step, estimated by a second run at half the step.

    check_verifiable(plan)
    run(plan, path)
    verified = verify(plan, path)       # its errors are in the file as well
    verified.excess(plan.tolerance)     # a sentence where one is above the tolerance

For a variable y, recorded with steps H and H / 2, the error of an algorithm of order p is

    max |y_H - y_{H/2}| / (1 - 2^-p)        over the rows of the first run        (Richardson)

and its relative error is that over the largest |y_H|. The errors of the FMUs' own solvers are equal in both runs and
not part of the estimate.
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
from hfsa.cosim.fmi.step_error import check_time
from hfsa.cosim.masters.algorithms import ALGORITHMS, algorithm_named
from hfsa.cosim.measurement.run import RunPlan
from hfsa.cosim.results.files import ErrorEstimate, read_run, write_errors
from hfsa.cosim.signals.prefixes import readable
from hfsa.cosim.systems.errors import StructureError

_BLOCK = 10_000
"""Steps between two reports, each of which may end the verification."""

_ROUNDING = 1e-11
"""Size of a variable that is rounding, relative to its scale and to the largest variable in its unit."""

_MARGIN = 1.1
"""Safety factor of the recommended step on the error."""

_UNLIKE = 0.3
"""Relative error from which on the two runs differ too much for an extrapolation."""


def check_verifiable(plan: RunPlan) -> None:
    """Raise `StructureError` for an algorithm that chooses its steps, and for sample times that half a step misfits."""
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
    """Result of a verification: `errors` by recorded variable, of an algorithm of an `order` at a step [s].

    `order` is lower than that of the algorithm where an FMU accepts no input derivatives.
    """

    errors: Mapping[str, ErrorEstimate]
    algorithm: str
    order: int
    step_size: float

    def excess(self, tolerance: float) -> str:
        """Return a warning about the largest error above a tolerance, with a sufficient step; empty without one."""
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
    """Return the algorithm of the highest order above that of another, of the same family if possible, else `None`."""
    own, family = algorithm_named(name).order or 0, name.partition("_")[0]
    above = [row for row in ALGORITHMS.values() if (row.order or 0) > own]
    alike = max(above, key=lambda row: (row.order or 0, row.name.startswith(family)), default=None)
    return alike.name if alike else None


def verify(plan: RunPlan, path: Path, report: Callable[[float], None] | None = None) -> Verification:
    """Estimate the errors of the run recorded in the file `path`, and write them to the file.

    Limit flags, which are 0 or 1, have no error. `report` receives the completed fraction, 0 to 1, and may raise to end
    the verification. Raises `StepError` where the run at half the step fails; the error is unknown then.
    """
    recorded, units = read_run(path)
    names = [name for name in plan.names if name not in plan.limits]
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
    """Return two reports of the common progress: of a run, and of its verification, which takes twice as long."""
    whole = report or (lambda _: None)
    return lambda part: whole(part / 3), lambda part: whole((1 + 2 * part) / 3)


def _at_half_the_step(
    plan: RunPlan, names: list[str], report: Callable[[float], None] | None
) -> tuple[dict[str, NDArray[np.float64]], int]:
    """Run at half the step; return the values at the points of the first run, and the order of the error."""
    steps, step_size = 2 * plan.steps, plan.step_size / 2
    with closing(plan.open(step_size)) as master:
        recording = master.record(names, rows=plan.steps + 1, every=2)
        recording.watch.limit(plan.scales)
        try:
            master.initialize(stop_time=max(plan.stop_time, plan.end))
            for done in range(0, steps, _BLOCK):
                check_time("the run at half the step", master.time)
                master.advance(min(_BLOCK, steps - done))
                if report is not None:
                    report(min(done + _BLOCK, steps) / steps)
        except StepError as error:
            message = f"in the run at half the step, {readable(step_size, 's')}, so that no error is known"
            words = f"{message}: {error.message}" if error.message else message
            raise StepError(error.instance, error.function, error.status, error.time, words) from error
        assert master.order is not None
        return {name: recording[name][plan.kept] for name in names}, master.order
