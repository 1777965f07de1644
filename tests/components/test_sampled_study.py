"""Studies of functions of numbers: slopes, maps and optima against those of the same function as an expression."""

import casadi as ca
import numpy as np
import pytest

from hfsa.components import ModelError
from hfsa.components._modelling.sampled_study import Dimension, sampled_study
from hfsa.components._modelling.study import Response, Study, Variable, bounds, optimum, response_map, slopes

DIMENSIONS = {"length": Dimension(2.0, 1.0, "m", "Length"), "width": Dimension(1.5, 1.0, "m", "Width")}


def sampled() -> Study:
    def evaluate(values):
        x, y = values
        return np.array([x * y - x**2 / 2]), np.array([x, y - x / 3, 4 - x - y]), np.empty(0)

    conditions = ["a length above 0", "more width than a third of the length", "at most four together"]
    return sampled_study("cantilever", DIMENSIONS, {"value": ("m2", "Value")}, conditions, evaluate)


def symbolic() -> Study:
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    variables = {n: Variable(s, d.value, d.unit, d.description) for s, (n, d) in zip((x, y), DIMENSIONS.items())}  # noqa: B905
    conditions = {"a length above 0": x, "more width than a third of the length": y - x / 3}
    conditions["at most four together"] = 4 - x - y
    return Study("cantilever", variables, {"value": Response(x * y - x**2 / 2, "m2", "Value")}, conditions, {}, {}, ())


def test_slopes_are_those_of_the_expression():
    assert slopes(sampled(), "value") == pytest.approx(slopes(symbolic(), "value"), rel=1e-8)


def test_a_map_is_that_of_the_expression():
    ranges = {"length": (0.5, 3.5), "width": (0.0, 2.0)}
    one, other = (response_map(study, ranges, points=9) for study in (sampled(), symbolic()))
    np.testing.assert_array_equal(one.responses["value"], other.responses["value"])
    assert one.failing == other.failing
    assert set(one.failing) == {"more width than a third of the length", "at most four together"}


def test_an_optimum_is_that_of_the_expression():
    limits = {"length": (0.5, 3.5), "width": (0.5, 3.5)}
    one, other = (optimum(study, bounds(study, 0.2, limits)) for study in (sampled(), symbolic()))
    assert one.is_converged
    assert one.values == pytest.approx(other.values, rel=1e-4)
    assert one.active == other.active == ["at most four together"]


def test_the_least_of_crossing_responses_is_maximised_at_their_crossing():
    """min(x, 2 - x) has a kink at x = 1, where no derivative of the least one is 0."""

    def evaluate(values):
        both = np.array([values[0], 2 - values[0]])
        return np.array([both.min()]), np.array([1.0]), both

    study = sampled_study(
        "kink", {"x": Dimension(0.3, 1.0, "1", "X")}, {"least": ("1", "Least")}, ["a condition"], evaluate, together=2
    )
    found = optimum(study, {"x": (0.0, 2.0)})
    assert found.is_converged
    assert found.values["x"] == pytest.approx(1.0, abs=1e-6)
    assert found.agreeing == found.starts


def test_a_dimension_of_0_needs_a_range():
    study = sampled_study(
        "place", {n: Dimension(0.0, 1.0, "m", n) for n in "xy"}, {"r": ("m", "R")}, ["any"],
        lambda v: (np.array([np.hypot(*v)]), np.array([1.0]), np.empty(0)),
    )  # fmt: skip
    with pytest.raises(ModelError, match=r"x is 0, of which half to twice is no range; give one: x=LOW:HIGH"):
        response_map(study, {"x": None, "y": (0.0, 1.0)})
    found = response_map(study, {"x": (-1.0, 1.0), "y": (0.0, 1.0)}, points=3)
    np.testing.assert_allclose(found.responses["r"][:, 0], [1, 0, 1])
