"""Calibration: dimensions of a part from measured responses, with what the measurement does not see.

    task = parts["rrr_stage"].calibration(turn=53.961)
    found = fit(task, measured, ["links.radius", "links.psi1"])          # columns by name, (rows,) each, in SI units
    found.values, found.deviations                                       # infinite for what is not determined

The responses f of a `Study` are functions of its dimensions. A column of the table is a response, y_i, or a dimension
that is known in every row, such as an elongation. The free dimensions p minimise

    least_squares   sum of r_ij^2          r_ij = (f_j(p; row i) - y_ij) / size_j
    largest         max over i of sum over j of r_ij^2

within bounds. The singular values of dr/dp, with every p in units of its present value, tell the directions that the
rows determine. Dimensions with a share of any other direction are not determined: their values are one choice of many.
Standard deviations are those of the residuals, s^2 = sum of r^2 / (equations - determined directions), so they
hold for errors that are independent and of equal size in units of size_j.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from hfsa.components._modelling.calibration import Calibration, Fit, Objective, Table
from hfsa.components._modelling.model import ModelError, nearest
from hfsa.components._modelling.study import Range

_RANK = 1e-7
"""Smallest singular value of a determined direction, relative to the largest."""
_SHARE = 1e-6
"""Largest share of a direction that is not determined in a dimension that is."""
_MISSED = 1e6
"""Residual of a point at which the part cannot be built, in units of those at the start."""
_STRANGE = 300.0
"""Ratio of measured to computed magnitudes from which a column is in another unit."""
_AT_BOUND = 1e-9
_EXACT = 1e-18
"""Largest weighted square of a row that is rounding, by that at the start."""


def fit(
    task: Calibration,
    table: Table,
    free: Sequence[str] = (),
    bounds: Mapping[str, Range] | None = None,
    sizes: Mapping[str, float] | None = None,
    objective: Objective = "least_squares",
) -> Fit:
    """Return the dimensions that fit a table best.

    Args:
        task: what the part offers.
        table: columns by name in SI units, all of one length; responses, and dimensions that are known in every row.
        free: names of the dimensions to fit, by default those of the task.
        bounds: bounds by dimension, in place of those of the task.
        sizes: errors that weigh alike, by response, in place of those of the task.
        objective: what is minimised.

    Raises:
        ModelError: unknown names; a dimension that is free and known; no response; fewer numbers than free dimensions;
            a column in another unit; bounds without the present value; a present design that cannot be built.
    """
    chosen = tuple(free or task.free)
    _check_names(task, table, chosen, {**(bounds or {})}, {**(sizes or {})})
    equations = _Equations(task, table, chosen, sizes or {})
    problem = _Problem(equations, {**task.bounds, **(bounds or {})})
    return problem.least_squares() if objective == "least_squares" else problem.largest()


class _Equations:
    """Residuals and their derivatives, over the free dimensions in units of their present values."""

    def __init__(self, task: Calibration, table: Table, free: Sequence[str], sizes: Mapping[str, float]):
        study = task.study
        self.task, self.free = task, free
        self.measured = tuple(name for name in study.responses if name in table)
        self.rows = len(next(iter(table.values())))
        if self.rows * len(self.measured) < len(free):
            raise ModelError(
                f"{study.title}: {self.rows} row{'s' * (self.rows > 1)} of {', '.join(self.measured)} are "
                f"{self.rows * len(self.measured)} numbers for {len(free)} free dimensions; measure more, or fit fewer "
                "(--free)"
            )
        present = study.values
        self.start = np.array([study.variables[name].value for name in free])
        self.scale = np.where(self.start == 0, 1.0, np.abs(self.start))
        self._places = [list(study.variables).index(name) for name in free]
        self._points = np.tile(present[:, None], self.rows)
        for name, values in table.items():
            if name in study.variables:
                self._points[list(study.variables).index(name)] = values
        self._wanted = np.array([table[name] for name in self.measured])
        expressions = ca.vertcat(*[study.responses[name].expression for name in self.measured])
        p = study.symbols
        self._function = ca.Function("responses", [p], [expressions, ca.jacobian(expressions, p)])
        self._others = [name for name in study.responses if name not in table]
        others = (
            ca.vertcat(*[study.responses[name].expression for name in self._others]) if self._others else ca.SX(0, 1)
        )
        self._unmeasured = ca.Function("others", [p], [others, ca.jacobian(others, p)])
        computed = self._computed(self.start)
        if not np.all(np.isfinite(computed)):
            raise ModelError(f"{study.title}: the present design has no {', '.join(self.measured)} in some rows")
        self._check_units(computed)
        rms = np.sqrt((self._wanted**2).mean(axis=1))
        usual = dict(zip(self.measured, np.where(rms > 0, rms, 1.0).tolist(), strict=True))
        self.sizes = {name: sizes.get(name, task.sizes.get(name, usual[name])) for name in self.measured}
        self._weights = 1 / np.array([self.sizes[name] for name in self.measured])[:, None]

    def errors(self, values: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return the errors by response, (rows,) each."""
        return dict(zip(self.measured, self._computed(values) - self._wanted, strict=True))

    def residuals(self, scaled: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return r, rows after rows, shape (equations,); large where the part cannot be built."""
        r = (self._weights * (self._computed(scaled * self.scale) - self._wanted)).T.ravel()
        return np.where(np.isfinite(r), r, _MISSED)

    def slopes(self, scaled: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return dr/dp in units of the present values, shape (equations, free)."""
        found = []
        for point in self._moved(scaled * self.scale).T:
            found.append(self._weights * self._function(point)[1].full()[:, self._places])
        J = np.concatenate(found) * self.scale
        return np.where(np.isfinite(J), J, 0.0)

    def others(self, values: NDArray[np.float64]) -> tuple[dict[str, float], NDArray[np.float64]]:
        """Return the responses that are not measured, without the known dimensions, and their slopes."""
        point = self.task.study.values.copy()
        point[self._places] = values
        found, J = self._unmeasured(point)
        return dict(zip(self._others, found.full().ravel().tolist(), strict=True)), J.full()[
            :, self._places
        ] * self.scale

    def _moved(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return all rows with values of the free dimensions, shape (variables, rows)."""
        points = self._points.copy()
        points[self._places] = values[:, None]
        return points

    def _computed(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the measured responses as computed, shape (responses, rows); NaN where the part cannot be built."""
        points = self._moved(values)
        impossible = np.any(~(self.task.study.margins(points) > 0), axis=0)
        found = np.array([self._function(point)[0].full().ravel() for point in points.T]).T
        return np.where(impossible, np.nan, found)

    def _check_units(self, computed: NDArray[np.float64]) -> None:
        """Raise `ModelError` for a column whose magnitude is that of another unit."""
        for name, found, wanted in zip(self.measured, computed, self._wanted, strict=True):
            one, other = (float(np.sqrt((values**2).mean())) for values in (found, wanted))
            if one > 0 and other > 0 and not 1 / _STRANGE < other / one < _STRANGE:
                unit = self.task.units[name]
                raise ModelError(
                    f"{name} is of the order of {other:.3g} in the table, of {one:.3g} {unit} in the part; expected "
                    f"{unit}, and what it depends on in the units of the part"
                )


class _Problem:
    """The minimisation of residuals within bounds."""

    def __init__(self, equations: _Equations, bounds: Mapping[str, Range]):
        self._equations = equations
        limits = np.array([bounds.get(name, (-np.inf, np.inf)) for name in equations.free])
        self._low, self._high = (limits / equations.scale[:, None]).T
        self._start = equations.start / equations.scale
        for name, value, (low, high) in zip(equations.free, equations.start, limits, strict=True):
            if not low < high:
                raise ModelError(f"bounds of {name} are {low:g} to {high:g}, expected the lower one first")
            if not low <= value <= high:
                raise ModelError(
                    f"{name} is {value:g} at the start, its bounds are {low:g} to {high:g}; expected a range that "
                    "contains it"
                )

    def least_squares(self) -> Fit:
        """Return the least squares."""
        from scipy import optimize  # imported here, as it takes as long as a small sweep

        e = self._equations
        jac: Any = e.slopes  # a function, which the stubs of scipy do not know
        solved = optimize.least_squares(
            e.residuals,
            self._start,
            jac,
            (self._low, self._high),
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
            max_nfev=500,
        )
        return self._fit(solved.x, "least_squares", str(solved.message), solved.status > 0)

    def largest(self) -> Fit:
        """Return the least of the largest row, from the least squares."""
        from scipy import optimize  # imported here, as it takes as long as a small sweep

        e, shape = self._equations, (self._equations.rows, len(self._equations.measured))
        begun = self.least_squares()
        if not begun.weighted(begun.after).max() > _EXACT * max(begun.weighted(begun.before).max(), _EXACT):
            return begun._replace(objective="largest")  # no row has an error beyond rounding
        x0 = np.array([begun.values[name] for name in e.free]) / e.scale
        size = float(begun.weighted(begun.after).max()) or 1.0

        def sums(z: NDArray[np.float64]) -> NDArray[np.float64]:
            """Return the margins of the rows to the largest one, in units of that of the least squares."""
            return z[-1] - (e.residuals(z[:-1]).reshape(shape) ** 2).sum(axis=1) / size

        def slopes(z: NDArray[np.float64]) -> NDArray[np.float64]:
            """Return the derivatives of `sums`."""
            r, J = e.residuals(z[:-1]).reshape(shape), e.slopes(z[:-1]).reshape(*shape, -1)
            return np.column_stack([-2 * np.einsum("ij,ijk->ik", r, J) / size, np.ones(len(r))])

        along = np.append(np.zeros(len(x0)), 1.0)
        solved = optimize.minimize(
            lambda z: z[-1],
            np.append(x0, 1.0),
            jac=lambda _: along,
            bounds=[*zip(self._low, self._high, strict=True), (0.0, np.inf)],
            constraints={"type": "ineq", "fun": sums, "jac": slopes},
            method="SLSQP",
            options={"maxiter": 500, "ftol": 1e-12},
        )
        return self._fit(np.clip(solved.x[:-1], self._low, self._high), "largest", str(solved.message), solved.success)

    def _fit(self, scaled: NDArray[np.float64], objective: Objective, message: str, is_converged: bool) -> Fit:
        """Return the result at values of the free dimensions."""
        e = self._equations
        J = e.slopes(scaled)
        _, singular, directions = np.linalg.svd(J, full_matrices=True)
        singular = np.append(singular, np.zeros(len(e.free) - len(singular)))
        is_seen = singular > _RANK * singular[0]
        unseen = directions[~is_seen]
        values = scaled * e.scale
        redundant = e.rows * len(e.measured) - int(is_seen.sum())
        r = e.residuals(scaled)
        s = np.sqrt(r @ r / redundant) if redundant and objective == "least_squares" else np.nan
        spread = directions[is_seen] / np.where(is_seen, singular, 1.0)[is_seen, None]

        def deviation(slope: NDArray[np.float64]) -> float:
            """Return the standard deviation of what has a slope over the scaled dimensions."""
            if np.linalg.norm(unseen @ slope) > _SHARE * np.linalg.norm(slope):
                return np.inf
            return float(s * np.linalg.norm(spread @ slope))

        others, slopes = e.others(values)
        unit = np.diag(e.scale)
        return Fit(
            e.task,
            e.free,
            e.measured,
            e.rows,
            dict(zip(e.free, values.tolist(), strict=True)),
            {name: deviation(row) for name, row in zip(e.free, unit, strict=True)},
            {name: self._bound(i, scaled[i]) for i, name in enumerate(e.free)},
            singular,
            [_named(direction, e.free) for direction in unseen],
            {name: (value, deviation(row)) for (name, value), row in zip(others.items(), slopes, strict=True)},
            e.errors(e.start),
            e.errors(values),
            e.sizes,
            objective,
            message,
            is_converged,
        )

    def _bound(self, place: int, scaled: float) -> str:
        """Return which bound a value is at, or nothing."""
        if scaled - self._low[place] < _AT_BOUND:
            return "lower"
        return "upper" if self._high[place] - scaled < _AT_BOUND else ""


def _named(direction: NDArray[np.float64], names: Sequence[str]) -> dict[str, float]:
    """Return the shares of a direction by name, the largest positive, without those that are rounding."""
    largest = direction[np.argmax(np.abs(direction))]
    return {name: float(v / largest) for name, v in zip(names, direction, strict=True) if abs(v / largest) > _SHARE}


def _check_names(
    task: Calibration, table: Table, free: Sequence[str], bounds: Mapping[str, Range], sizes: Mapping[str, float]
) -> None:
    """Raise `ModelError` for names that are none of the part's, or are taken twice."""
    study = task.study
    if not free:
        raise ModelError(
            f"{study.title}: no dimension to fit is named; --free takes some of {', '.join(study.variables)}"
        )
    study.check([*free, *bounds])
    for name in table:
        if name not in task.units:
            raise ModelError(f"{study.title} has no {name!r}{nearest(name, task.units)}")
        if name in free:
            raise ModelError(f"{name} is a column of the table, and free; it is either known or fitted")
    if not set(table) & set(study.responses):
        raise ModelError(f"the table has no response of {study.title}; expected some of {', '.join(study.responses)}")
    for name, size in sizes.items():
        if name not in table or name not in study.responses:
            raise ModelError(f"{name!r} is given a size, but is no measured response{nearest(name, table)}")
        if not (np.isfinite(size) and size > 0):
            raise ModelError(f"the size of {name} is {size:g}, expected a finite number above 0")
