"""A design study: how responses follow from dimensions; their slopes, maps over two of them, and the best of them.

    study = parts["tba_accelerometer"].design_study(design="mems")
    slopes(study, "frequency_ratio")                        # d ln r / d ln p, by exact derivatives
    response_map(study, {"tm": None, "l": (1e-4, 3e-4)})    # over two dimensions, of which one has the usual range
    optimum(study, bounds(study, 0.2))                      # maximises the first response, with IPOPT

A part offers one by a function `study` beside `analyze`, which takes structural arguments of its own and returns a
`Study`: CasADi symbols with their present values, and what follows from them as expressions.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from hfsa.components._modelling.model import ModelError, nearest

Range = tuple[float, float]
"""Lowest and highest value, in the variable's unit."""

_USUAL = (0.5, 2.0)
_MARGIN = 1e-3
"""At which an optimum keeps conditions, since at 0 nothing can be built."""
_AT_BOUND = 1e-6
_STARTS = 16
_SAME = 1e-6


class Variable(NamedTuple):
    """A dimension that is free: its symbol, present value, unit and description."""

    symbol: ca.SX
    value: float
    unit: str
    description: str


class Response(NamedTuple):
    """What follows from the dimensions: an expression of their symbols, its unit and description."""

    expression: ca.SX
    unit: str
    description: str


@dataclass(frozen=True)
class Study:
    """Dimensions and what follows from them.

    Attributes:
        title: what is studied.
        variables: free dimensions by name.
        responses: by name; the first is the one that an optimum has at its largest.
        conditions: expressions that are above 0, where 1 is large, for dimensions that can be built, by what they say.
        requirements: expressions that an optimum keeps at 0 or above, by what they say.
        references: responses of other designs by what they are, to judge an optimum by.
        remarks: what a reader of an optimum must know.
    """

    title: str
    variables: Mapping[str, Variable]
    responses: Mapping[str, Response]
    conditions: Mapping[str, ca.SX]
    requirements: Mapping[str, ca.SX]
    references: Mapping[str, Mapping[str, float]]
    remarks: Sequence[str]

    @property
    def symbols(self) -> ca.SX:
        """Symbols of all variables, shape (variables, 1)."""
        return ca.vertcat(*[variable.symbol for variable in self.variables.values()])

    @property
    def values(self) -> NDArray[np.float64]:
        """Present values of all variables, shape (variables,)."""
        return np.array([variable.value for variable in self.variables.values()])

    @property
    def objective(self) -> str:
        """Name of the response that an optimum has at its largest."""
        return next(iter(self.responses))

    def check(self, names: Sequence[str]) -> None:
        """Check that variables exist; `ModelError` with the nearest names for one that does not."""
        for name in names:
            if name not in self.variables:
                raise ModelError(f"{self.title} has no dimension {name!r}{nearest(name, self.variables)}")

    def at(self, points: ArrayLike) -> dict[str, NDArray[np.float64]]:
        """Return the responses, each of shape (points,), NaN where a condition is not met.

        Args:
            points: values of all variables, shape (variables, points).
        """
        impossible = np.any(~(self.margins(points) > 0), axis=0)
        found = _evaluated(self.symbols, [response.expression for response in self.responses.values()], points)
        return {name: np.where(impossible, np.nan, row) for name, row in zip(self.responses, found, strict=True)}

    def margins(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the expressions of the conditions, shape (conditions, points)."""
        return _evaluated(self.symbols, list(self.conditions.values()), points)


class ResponseMap(NamedTuple):
    """Responses over two variables.

    Attributes:
        study: whose responses.
        axes: values of the two variables by name, ascending, the present one among them where it is in the range.
        responses: by name, shape (values of the first, of the second); NaN where nothing can be built.
    """

    study: Study
    axes: Mapping[str, NDArray[np.float64]]
    responses: Mapping[str, NDArray[np.float64]]


class Optimum(NamedTuple):
    """The best that IPOPT ended with.

    Attributes:
        study: whose first response is maximised.
        bounds: of every variable.
        values: of every variable; responses: at these.
        at_bound: `lower`, `upper`, `held` (both) or nothing, for every variable.
        active: requirements, and conditions, that are only just met.
        status: IPOPT's word; `is_converged` whether it is a maximum.
        starts: places IPOPT began at; `agreeing`: from how many it came to this response.
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
    """Return d ln(response) / d ln(p) for every variable p, by exact derivatives, at a point or the present values."""
    expression, x = study.responses[response].expression, study.symbols
    relative = ca.gradient(expression, x) * x / expression
    (found,) = _evaluated(x, [relative], study.values if point is None else point)[None]
    return {name: float(value) for name, value in zip(study.variables, found.ravel(), strict=True)}


def response_map(study: Study, ranges: Mapping[str, Range | None], points: int = 101) -> ResponseMap:
    """Return the responses over two variables, the others as they are.

    Args:
        study: whose responses.
        ranges: of the two variables by name; none for half to twice the present value.
        points: values of each variable, evenly spaced; the present one is added.

    Raises:
        ModelError: not two variables, an unknown one, an empty range, or one where nothing can be built.
    """
    if len(ranges) != 2:
        raise ModelError(f"a map has two dimensions, not {len(ranges)}: {', '.join(ranges) or 'none'}")
    study.check(list(ranges))
    axes = {name: _axis(name, study.variables[name].value, given, points) for name, given in ranges.items()}
    grid = np.meshgrid(*axes.values(), indexing="ij")
    places = np.tile(study.values[:, None], grid[0].size)
    for name, values in zip(axes, grid, strict=True):
        places[list(study.variables).index(name)] = values.ravel()
    found = study.at(places)
    if all(np.all(np.isnan(values)) for values in found.values()):
        never = np.all(study.margins(places) <= 0, axis=1)
        texts = [text for text, is_never in zip(study.conditions, never, strict=True) if is_never]
        spans = " and ".join(f"{name} from {axis[0]:g} to {axis[-1]:g}" for name, axis in axes.items())
        reason = f"never {' nor '.join(texts)}" if texts else f"never all of: {'; '.join(study.conditions)}"
        present = ", ".join(f"{name} = {study.variables[name].value:g}" for name in axes)
        raise ModelError(f"{study.title}: nothing with {spans} can be built: {reason}; the design has {present}")
    return ResponseMap(study, axes, {name: values.reshape(grid[0].shape) for name, values in found.items()})


def bounds(study: Study, share: float, given: Mapping[str, Range] | None = None) -> dict[str, Range]:
    """Return bounds of all variables: those given, and for the others the present value by `share` to either side.

    Raises:
        ModelError: a share that is not between 0 and 1, an unknown variable, a lower bound above the upper one.
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
    """Return where the first response is largest, the best of IPOPT's maxima from the present values and others.

    Args:
        study: whose response.
        limits: bounds of all variables, as `bounds` returns them.
        seed: of the other places to begin at, evenly distributed within the bounds.
        iterations: after which IPOPT gives up.

    Raises:
        ModelError: bounds that leave nothing free, or within which nothing can be built.
    """
    low, high = np.array([limits[name] for name in study.variables]).T
    if not np.any(low < high):
        raise ModelError(f"{study.title}: the bounds leave no dimension free")
    random = np.random.default_rng(seed).uniform(size=(_STARTS, len(low)))
    starts = np.vstack([np.clip(study.values, low, high), low + random * (high - low)])
    begun = study.at(starts.T)[study.objective]
    starts, begun = starts[~np.isnan(begun)], begun[~np.isnan(begun)]
    if not len(starts):
        texts = "; ".join(study.conditions)
        raise ModelError(f"{study.title}: nothing that can be built was found within the bounds; it needs {texts}")
    size = float(np.max(np.abs(begun))) or 1.0
    solve = _solver(study, low, high, size, iterations)
    ends = [solve(start) for start in starts]
    # one that did not converge stands only where none did
    ends = [end for end in ends if end.is_converged] or ends[:1]
    reached = [study.at(end.values)[study.objective][0] for end in ends]
    best = int(np.nanargmax(reached)) if np.any(np.isfinite(reached)) else 0
    agreeing = int(np.sum(np.abs(np.array(reached) - reached[best]) <= _SAME * size))
    return _optimum(study, limits, ends[best], len(starts), agreeing)


class _End(NamedTuple):
    values: NDArray[np.float64]
    status: str
    is_converged: bool


def _solver(
    study: Study, low: NDArray[np.float64], high: NDArray[np.float64], size: float, iterations: int
) -> Callable[[NDArray[np.float64]], _End]:
    """Return IPOPT for the largest first response, which is of that size, a function of the values to begin with."""
    middle, half = (low + high) / 2, (high - low) / 2
    free = np.where(half > 0, 1.0, 0.0)
    # from -1 to 1 within the bounds, 0 for what is held
    u = ca.SX.sym("u", len(middle))
    response = study.responses[study.objective].expression
    program = ca.Function("program", [study.symbols], [response, ca.vertcat(*_kept(study).values())])
    found, kept = program(ca.DM(middle) + ca.DM(half) * u)
    options = {
        "print_time": False,
        "show_eval_warnings": False,
        "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-10, "bound_relax_factor": 0.0, "max_iter": iterations},
    }
    solver = ca.nlpsol("optimum", "ipopt", {"x": u, "f": -found / size, "g": kept}, options)

    def solve(start: NDArray[np.float64]) -> _End:
        """Search from one start."""
        x0 = np.divide(start - middle, half, out=np.zeros_like(half), where=half > 0)
        solved = solver(x0=x0, lbx=-free, ubx=free, lbg=0, ubg=np.inf)
        stats = solver.stats()
        values = np.clip(middle + half * solved["x"].full().ravel(), low, high)
        return _End(values, str(stats["return_status"]), bool(stats["success"]))

    return solve


def _kept(study: Study) -> dict[str, ca.SX]:
    """Return what an optimum keeps at 0 or above, by what it says."""
    return {text: condition - _MARGIN for text, condition in study.conditions.items()} | dict(study.requirements)


def _optimum(study: Study, limits: Mapping[str, Range], end: _End, starts: int, agreeing: int) -> Optimum:
    """Return where a search ended, with what it says about the bounds and requirements there."""
    kept = _kept(study)
    margins = _evaluated(study.symbols, list(kept.values()), end.values).ravel()
    values = dict(zip(study.variables, end.values.tolist(), strict=True))
    return Optimum(
        study,
        limits,
        values,
        {name: float(value[0]) for name, value in study.at(end.values).items()},
        {name: _place(value, *limits[name]) for name, value in values.items()},
        [text for text, margin in zip(kept, margins, strict=True) if margin < _AT_BOUND],
        end.status,
        end.is_converged,
        starts,
        agreeing,
    )


def _place(value: float, low: float, high: float) -> str:
    """Return at which of its bounds a value is: `lower`, `upper`, `held` (both), or none."""
    near = _AT_BOUND * (high - low)
    return "held" if low == high else "lower" if value - low <= near else "upper" if high - value <= near else ""


def _axis(name: str, value: float, given: Range | None, points: int) -> NDArray[np.float64]:
    """Return evenly spaced values with the present one among them, if it is between the ends."""
    low, high = given or sorted(factor * value for factor in _USUAL)
    if not (np.isfinite([low, high]).all() and low < high):
        raise ModelError(
            f"the range of {name} is {low:g} to {high:g}, expected the lower end first; it is {value:g} now"
        )
    values = np.linspace(low, high, points)
    if low < value < high:
        values[np.abs(values - value) < 1e-9 * (high - low)] = value
        values = np.union1d(values, [value])
    return values


def _evaluated(symbols: ca.SX, expressions: Sequence[ca.SX], points: ArrayLike) -> NDArray[np.float64]:
    """Return expressions at points of shape (variables, points) or (variables,), shape (rows, points)."""
    points = np.asarray(points, dtype=float).reshape(symbols.numel(), -1)
    return ca.Function("evaluated", [symbols], [ca.vertcat(*expressions)])(points).full()
