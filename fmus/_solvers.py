"""The solvers of Co-Simulation FMUs: what the page of an FMU says of each, its settings and its counters.

A solver is a file `runtime/NAME.c` that defines `const Solver hfsa_NAME`, which `runtime/model.h` declares, a row here
and its name in `components/_modelling/model.py`, where models choose.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple


class Setting(NamedTuple):
    """A fixed parameter of the FMU, above its `low`."""

    name: str
    start: float
    unit: str
    description: str
    low: float = 0.0
    high: float | None = None


class Counter(NamedTuple):
    """A count of the solver's work since initialization, a read-only variable of the FMU."""

    name: str
    description: str


@dataclass(frozen=True)
class Solver:
    """A solver: a sentence for the page of an FMU, its settings, and the first ones of `COUNTERS`."""

    sentence: str
    settings: tuple[Setting, ...] = ()
    counters: tuple[Counter, ...] = ()


COUNTERS = (
    Counter("solver.steps", "Steps of the solver since initialization, without rejected ones"),
    Counter("solver.evaluations", "Evaluations of the derivatives by the solver since initialization"),
    Counter("solver.rejected_steps", "Steps that the solver rejected since initialization"),
    Counter("solver.jacobians", "Evaluations of the Jacobian by the solver since initialization"),
    Counter("solver.factorizations", "Matrices factorised by the solver since initialization"),
)
"""All counters, in the order of the counts in `runtime/instance.h`; a solver has all, or the first ones."""


_TOLERANCE = Setting(
    "solver.relative_tolerance",
    1e-8,
    "1",
    "Relative tolerance; the absolute tolerance of a state is this * its nominal value",
)


def _maximum_steps(start: float) -> Setting:
    """Return the setting that ends a communication step which takes too many steps of the solver, and ticks."""
    text = "Most steps, ticks too, in a communication step; beyond them it is discarded with the time reached"
    return Setting("solver.maximum_steps", start, "1", text, 1.0, 1e15)


SOLVERS: Mapping[str, Solver] = {
    "exact": Solver("Co-Simulation uses the exact solution of the linear equations: no step size is unstable."),
    "rosenbrock": Solver(
        "Co-Simulation uses RODAS5P, an error-controlled L-stable method, with the analytic Jacobian.",
        (
            _TOLERANCE,
            Setting("solver.maximum_step", 1.0, "s", "Largest step of the Rosenbrock solver"),
            _maximum_steps(1e5),
        ),
        COUNTERS,
    ),
    "rk4": Solver(
        "Co-Simulation uses the classical Runge-Kutta method with a maximum step.",
        (Setting("solver.maximum_step", 1e-4, "s", "Largest step of the Runge-Kutta solver"), _maximum_steps(1e7)),
        COUNTERS[:2],  # it rejects nothing and has no matrix
    ),
    "cvode": Solver(
        "Co-Simulation uses CVODE of SUNDIALS, restarted in every step, with the analytic Jacobian.",
        (
            _TOLERANCE,
            Setting("solver.maximum_step", 1.0, "s", "Largest step of CVODE"),
            Setting(
                "solver.maximum_order",
                5.0,
                "1",
                "Largest order of CVODE; stable for any oscillation up to 2",
                1.0,
                5.0,
            ),
            _maximum_steps(1e5),
        ),
        COUNTERS,
    ),
}
"""All solvers by name."""
