"""Design studies: responses as functions of dimensions, with sensitivities, maps over two dimensions, and optimisation.

    study = parts["tba_accelerometer"].design_study(design="mems")
    slopes(study, "frequency_ratio")                        # d ln r / d ln p, by exact derivatives
    response_map(study, {"tm": None, "l": (1e-4, 3e-4)})    # over two dimensions, the first over its default range
    optimum(study, bounds(study, 0.2))                      # maximises the first response, with IPOPT

A part offers a design study by a function `study` beside `analyze`. It takes structural arguments of its own and
returns a `Study`: dimensions as CasADi symbols with their present values, and responses as expressions of them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from hfsa.components._modelling.model import ModelError, nearest

Expression = Any
"""A CasADi expression: `SX`, or `MX` with calls of functions that are not made of expressions (`sampled_study`)."""
Range = tuple[float, float]
"""Lowest and highest value, in the variable's unit."""

_DEFAULT_RANGE = (0.5, 2.0)
"""Default range of a map, relative to the present value."""
_MARGIN = 1e-3
"""Lower limit of the conditions in an optimisation; a design with a condition at 0 is infeasible."""
_AT_BOUND = 1e-6
"""Distance below which a value is at its bound, relative to the range, and a constraint is active."""
_AGREEMENT = 1e-6
"""Relative difference of two objective values that count as equal."""


class Variable(NamedTuple):
    """A free dimension: symbol, present value, unit and description."""

    symbol: Expression
    value: float
    unit: str
    description: str


class Response(NamedTuple):
    """A function of the dimensions: expression of their symbols, unit and description.

    `minimum_of` is a column of expressions of which it is the least: an optimisation maximises all of them together,
    because the least one has a kink where two of them cross.
    """

    expression: Expression
    unit: str
    description: str
    minimum_of: Expression | None = None


@dataclass(frozen=True)
class Study:
    """Dimensions, responses and constraints of a design.

    Attributes:
        title: name of the design in messages and figures.
        variables: free dimensions by name.
        responses: functions of the dimensions by name; the first is the objective to maximise.
        conditions: expressions by description, above 0 for feasible dimensions, scaled to the order of 1.
        requirements: expressions by description, constrained to 0 or above in an optimisation.
        references: responses of other designs by description, for comparison with an optimum.
        remarks: notes for the reader of an optimum.
        points: usual number of values of a dimension in a map.
        starts: number of random initial guesses of an optimisation.
        slope_remarks: notes for the reader of sensitivities.
    """

    title: str
    variables: Mapping[str, Variable]
    responses: Mapping[str, Response]
    conditions: Mapping[str, Expression]
    requirements: Mapping[str, Expression]
    references: Mapping[str, Mapping[str, float]]
    remarks: Sequence[str]
    points: int = 101
    starts: int = 16
    slope_remarks: Sequence[str] = ()

    @property
    def symbols(self) -> Expression:
        """The symbols of all variables, shape (variables, 1)."""
        column = ca.vertcat(*[variable.symbol for variable in self.variables.values()])
        # elements of one symbol are expressions of it, not symbols themselves
        return column if isinstance(column, ca.SX) else ca.symvar(column)[0]

    @property
    def values(self) -> NDArray[np.float64]:
        """The present values of all variables, shape (variables,)."""
        return np.array([variable.value for variable in self.variables.values()])

    @property
    def objective(self) -> str:
        """The name of the response to maximise."""
        return next(iter(self.responses))

    def check(self, names: Sequence[str]) -> None:
        """Raise `ModelError` with the nearest names if there is no variable with one of `names`."""
        for name in names:
            if name not in self.variables:
                raise ModelError(f"{self.title} has no dimension {name!r}{nearest(name, self.variables)}")

    def at(self, points: ArrayLike) -> dict[str, NDArray[np.float64]]:
        """Return the responses at points by name, each of shape (points,); NaN at infeasible points.

        Args:
            points: values of all variables, shape (variables, points).
        """
        impossible = np.any(~(self.margins(points) > 0), axis=0)
        found = _evaluated(self.symbols, [response.expression for response in self.responses.values()], points)
        return {name: np.where(impossible, np.nan, row) for name, row in zip(self.responses, found, strict=True)}

    def margins(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the values of the conditions at points, shape (conditions, points)."""
        return _evaluated(self.symbols, list(self.conditions.values()), points)


class ResponseMap(NamedTuple):
    """Responses over a grid of two variables.

    Attributes:
        study: study of the responses.
        axes: ascending values of the two variables by name, with the present value if it is within the range.
        responses: responses by name, shape (values of the first, values of the second); NaN at infeasible points.
        failing: number of points at which a condition does not hold, by description, without those that always do.
    """

    study: Study
    axes: Mapping[str, NDArray[np.float64]]
    responses: Mapping[str, NDArray[np.float64]]
    failing: Mapping[str, int]


class Optimum(NamedTuple):
    """The best solution that IPOPT found from several initial guesses.

    Attributes:
        study: study whose objective is maximised.
        bounds: bounds of every variable.
        values: value of every variable.
        responses: responses at these values.
        at_bound: `lower`, `upper`, `held` (both) or empty, for every variable.
        active: descriptions of the active requirements and conditions.
        status: return status of IPOPT.
        is_converged: whether IPOPT converged to a maximum.
        starts: number of initial guesses.
        agreeing: number of initial guesses that led to the same objective.
    """

    study: Study
    bounds: Mapping[str, Range]
    values: Mapping[str, float]
    responses: Mapping[str, float]
    at_bound: Mapping[str, str]
    active: Sequence[str]
    status: str
    is_converged: bool
    starts: int
    agreeing: int


def slopes(study: Study, response: str, point: ArrayLike | None = None) -> dict[str, float]:
    """Return d ln(response) / d ln(p) for every variable p by exact derivatives, by default at the present values."""
    expression, x = study.responses[response].expression, study.symbols
    relative = ca.gradient(expression, x) * x / expression
    (found,) = _evaluated(x, [relative], study.values if point is None else point)[None]
    return {name: float(value) for name, value in zip(study.variables, found.ravel(), strict=True)}


def response_map(study: Study, ranges: Mapping[str, Range | None], points: int | None = None) -> ResponseMap:
    """Return the responses over two variables, all others at their present values.

    Args:
        study: study of the responses.
        ranges: ranges of the two variables by name; `None` for half to twice the present value.
        points: number of evenly spaced values per variable, by default the usual one; the present value is added.

    Raises:
        ModelError: not two variables; an unknown variable; an empty range; ranges without a feasible point.
    """
    if len(ranges) != 2:
        raise ModelError(f"a map has two dimensions, not {len(ranges)}: {', '.join(ranges) or 'none'}")
    study.check(list(ranges))
    axes = {
        name: _axis(name, study.variables[name].value, given, points or study.points) for name, given in ranges.items()
    }
    grid = np.meshgrid(*axes.values(), indexing="ij")
    places = np.tile(study.values[:, None], grid[0].size)
    for name, values in zip(axes, grid, strict=True):
        places[list(study.variables).index(name)] = values.ravel()
    found = study.at(places)
    fails = ~(study.margins(places) > 0)
    if all(np.all(np.isnan(values)) for values in found.values()):
        never = np.all(fails, axis=1)
        texts = [text for text, is_never in zip(study.conditions, never, strict=True) if is_never]
        spans = " and ".join(f"{name} from {axis[0]:g} to {axis[-1]:g}" for name, axis in axes.items())
        reason = f"never {' nor '.join(texts)}" if texts else f"never all of: {'; '.join(study.conditions)}"
        present = ", ".join(f"{name} = {study.variables[name].value:g}" for name in axes)
        raise ModelError(f"{study.title}: no feasible design with {spans}: {reason}; the design has {present}")
    failing = {text: int(np.sum(row)) for text, row in zip(study.conditions, fails, strict=True) if np.any(row)}
    return ResponseMap(study, axes, {name: values.reshape(grid[0].shape) for name, values in found.items()}, failing)


def bounds(study: Study, share: float, given: Mapping[str, Range] | None = None) -> dict[str, Range]:
    """Return bounds of all variables: those given, and by default the present value minus and plus the `share` of it.

    Raises:
        ModelError: a share that is not between 0 and 1; an unknown variable; a lower bound above the upper one.
    """
    if not 0 < share < 1:
        raise ModelError(f"bounds are {100 * share:g} % to either side, expected between 0 and 100 %")
    given = given or {}
    study.check(list(given))
    for name, (low, high) in given.items():
        if not (np.isfinite([low, high]).all() and low <= high):
            raise ModelError(f"bounds of {name} are {low:g} to {high:g}, expected the lower one first, both finite")
    usual = {
        name: (v.value - share * abs(v.value), v.value + share * abs(v.value)) for name, v in study.variables.items()
    }
    return usual | dict(given)


def optimum(study: Study, limits: Mapping[str, Range], seed: int = 0, iterations: int = 500) -> Optimum:
    """Return the dimensions that maximise the first response, by IPOPT from several initial guesses.

    The initial guesses are the present values and random points, uniformly distributed within the bounds.

    Args:
        study: study whose objective is maximised.
        limits: bounds of all variables, as `bounds` returns them.
        seed: seed of the random points.
        iterations: maximum number of iterations of IPOPT.

    Raises:
        ModelError: bounds that fix every dimension; bounds without a feasible initial guess.
    """
    low, high = np.array([limits[name] for name in study.variables]).T
    if not np.any(low < high):
        raise ModelError(f"{study.title}: the bounds leave no dimension free")
    random = np.random.default_rng(seed).uniform(size=(study.starts, len(low)))
    starts = np.vstack([np.clip(study.values, low, high), low + random * (high - low)])
    initial = study.at(starts.T)[study.objective]
    starts, initial = starts[~np.isnan(initial)], initial[~np.isnan(initial)]
    if not len(starts):
        texts = "; ".join(study.conditions)
        raise ModelError(f"{study.title}: no feasible design was found within the bounds; it needs {texts}")
    size = float(np.max(np.abs(initial))) or 1.0
    solve = _solver(study, low, high, size, iterations)
    solutions = [solve(start) for start in starts]
    # a solution that has not converged counts only if none has
    solutions = [solution for solution in solutions if solution.is_converged] or solutions[:1]
    objectives = [study.at(solution.values)[study.objective][0] for solution in solutions]
    best = int(np.nanargmax(objectives)) if np.any(np.isfinite(objectives)) else 0
    agreeing = int(np.sum(np.abs(np.array(objectives) - objectives[best]) <= _AGREEMENT * size))
    return _optimum(study, limits, solutions[best], len(starts), agreeing)


class _Solution(NamedTuple):
    """The result of one call of IPOPT."""

    values: NDArray[np.float64]
    status: str
    is_converged: bool


def _solver(
    study: Study, low: NDArray[np.float64], high: NDArray[np.float64], size: float, iterations: int
) -> Callable[[NDArray[np.float64]], _Solution]:
    """Return a function that maximises the objective, of magnitude `size`, with IPOPT from an initial guess."""
    middle, half = (low + high) / 2, (high - low) / 2
    free = np.where(half > 0, 1.0, 0.0)
    # normalised variables: -1 to 1 within the bounds, 0 if both bounds are equal; then the least of the responses
    is_symbolic, n = isinstance(study.symbols, ca.SX), len(middle)
    u: Expression = (ca.SX if is_symbolic else ca.MX).sym("u", n + 1)
    response = study.responses[study.objective]
    together = (response.expression if response.minimum_of is None else response.minimum_of) / size
    program = ca.Function("program", [study.symbols], [together, ca.vertcat(*_constraints(study).values())])
    objectives, constraints = program(ca.DM(middle) + ca.DM(half) * u[:n])
    options = {
        "print_time": False,
        "show_eval_warnings": False,
        "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-10, "bound_relax_factor": 0.0, "max_iter": iterations},
    }
    if not is_symbolic:
        options["ipopt"] |= {"hessian_approximation": "limited-memory", "tol": 1e-7}
    equations = {"x": u, "f": -u[n], "g": ca.vertcat(objectives - u[n], constraints)}
    solver = ca.nlpsol("optimum", "ipopt", equations, options)
    ends = np.append(free, np.inf)

    def solve(start: NDArray[np.float64]) -> _Solution:
        """Return the solution from one initial guess."""
        x0 = np.divide(start - middle, half, out=np.zeros_like(half), where=half > 0)
        least = float(ca.mmin(program(start)[0]))
        solved = solver(x0=np.append(x0, least), lbx=-ends, ubx=ends, lbg=0, ubg=np.inf)
        stats = solver.stats()
        values = np.clip(middle + half * solved["x"].full().ravel()[:n], low, high)
        return _Solution(values, str(stats["return_status"]), bool(stats["success"]))

    return solve


def _constraints(study: Study) -> dict[str, Expression]:
    """Return the expressions constrained to 0 or above in an optimisation, by description."""
    return {text: condition - _MARGIN for text, condition in study.conditions.items()} | dict(study.requirements)


def _optimum(study: Study, limits: Mapping[str, Range], solution: _Solution, starts: int, agreeing: int) -> Optimum:
    """Return a solution as an `Optimum`, with its active bounds and constraints."""
    constraints = _constraints(study)
    margins = _evaluated(study.symbols, list(constraints.values()), solution.values).ravel()
    values = dict(zip(study.variables, solution.values.tolist(), strict=True))
    return Optimum(
        study,
        limits,
        values,
        {name: float(value[0]) for name, value in study.at(solution.values).items()},
        {name: _active_bound(value, *limits[name]) for name, value in values.items()},
        [text for text, margin in zip(constraints, margins, strict=True) if margin < _AT_BOUND],
        solution.status,
        solution.is_converged,
        starts,
        agreeing,
    )


def _active_bound(value: float, low: float, high: float) -> str:
    """Return the bound that a value is at: `lower`, `upper`, `held` (both) or an empty string."""
    near = _AT_BOUND * (high - low)
    return "held" if low == high else "lower" if value - low <= near else "upper" if high - value <= near else ""


def _axis(name: str, value: float, given: Range | None, points: int) -> NDArray[np.float64]:
    """Return evenly spaced values, with the present value added if it is between the ends."""
    if given is None and value == 0:
        raise ModelError(f"{name} is 0, of which half to twice is no range; give one: {name}=LOW:HIGH")
    low, high = given or sorted(factor * value for factor in _DEFAULT_RANGE)
    if not (np.isfinite([low, high]).all() and low < high):
        raise ModelError(
            f"the range of {name} is {low:g} to {high:g}, expected the lower end first; the present value is {value:g}"
        )
    values = np.linspace(low, high, points)
    if low < value < high:
        values[np.abs(values - value) < 1e-9 * (high - low)] = value
        values = np.union1d(values, [value])
    return values


def _evaluated(symbols: Expression, expressions: Sequence[Expression], points: ArrayLike) -> NDArray[np.float64]:
    """Return values of expressions, shape (rows, points), at points of shape (variables, points) or (variables,)."""
    points = np.asarray(points, dtype=float).reshape(symbols.numel(), -1)
    return ca.Function("evaluated", [symbols], [ca.vertcat(*expressions)])(points).full()
