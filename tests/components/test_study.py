"""Design studies: slopes, maps and optima of a study written here, and those of the accelerometer."""

from types import ModuleType

import casadi as ca
import numpy as np
import pytest

import hfsa.components
from hfsa.components import ModelError
from hfsa.components._mechanics import tba_design as designs
from hfsa.components._modelling.catalogue import find, studied
from hfsa.components._modelling.parts import Part
from hfsa.components._modelling.study import Response, Study, Variable, bounds, optimum, response_map, slopes

PARTS = find([hfsa.components])
PART = PARTS["tba_accelerometer"]
DESIGN = pytest.mark.parametrize("design", designs.DESIGNS)
RULE = pytest.mark.parametrize("rule", ["minus", "plus"])


def cantilever(length: float = 2.0, width: float = 1.0) -> Study:
    """Two dimensions with an optimum that is known: x y - x^2 / 2 within x + y <= 4 is largest at x = 4/3, y = 8/3."""
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    return Study(
        "cantilever",
        {"length": Variable(x, length, "m", "Length"), "width": Variable(y, width, "m", "Width")},
        {"value": Response(x * y - x**2 / 2, "m2", "Value"), "length_squared": Response(x**2, "m2", "Square")},
        {"a length above 0": x, "more width than a third of the length": y - x / 3},
        {"four together": 4 - x - y},
        {},
        (),
    )


# A study written here -------------------------------------------------------------------------------------------------


def test_slopes_are_relative():
    assert slopes(cantilever(), "length_squared") == {"length": 2.0, "width": 0.0}
    found = slopes(cantilever(2.0, 3.0), "value")
    assert found == pytest.approx({"length": (3 - 2) * 2 / 4, "width": 2 * 3 / 4})


def test_a_map_is_blank_where_nothing_can_be_built():
    found = response_map(cantilever(), {"width": (0.0, 2.0), "length": None}, points=11)
    width, length = found.axes.values()
    assert (length[0], length[-1]) == (1.0, 4.0)
    y, x = np.meshgrid(width, length, indexing="ij")
    inside = y - x / 3 > 0
    for name, exact in {"value": x * y - x**2 / 2, "length_squared": x**2}.items():
        np.testing.assert_allclose(found.responses[name][inside], exact[inside], atol=1e-14)
        assert np.all(np.isnan(found.responses[name][~inside]))
    assert 0 < inside.sum() < inside.size


def test_a_map_has_the_present_values_on_its_axes_once():
    axes = response_map(cantilever(), {"length": (1.0, 3.0), "width": (0.95, 3.0)}, points=11).axes
    assert len(axes["length"]) == 11
    assert len(axes["width"]) == 12
    assert 2.0 in axes["length"]
    assert 1.0 in axes["width"]
    assert all(np.all(np.diff(axis) > 0) for axis in axes.values())


def test_an_optimum_keeps_bounds_and_requirements():
    study = cantilever()
    inside = optimum(study, bounds(study, 0.2, {"length": (0.5, 3.5), "width": (0.5, 3.5)}))
    assert inside.values == pytest.approx({"length": 4 / 3, "width": 8 / 3}, rel=1e-6)
    assert (inside.at_bound, inside.active) == ({"length": "", "width": ""}, ["four together"])
    assert inside.is_converged
    held = optimum(study, bounds(study, 0.2, {"length": (0.5, 3.5), "width": (1.0, 1.0)}))
    assert held.values == pytest.approx({"length": 1.0, "width": 1.0}, rel=1e-6)
    assert (held.at_bound, held.active) == ({"length": "", "width": "held"}, [])
    narrow = optimum(study, bounds(study, 0.2))
    assert narrow.values == pytest.approx({"length": 1.6, "width": 1.2}, rel=1e-6)
    assert narrow.at_bound == {"length": "lower", "width": "upper"}
    assert narrow.agreeing == narrow.starts


def test_an_optimum_that_is_none_says_so():
    study = cantilever()
    found = optimum(study, bounds(study, 0.5), iterations=1)
    assert (found.is_converged, found.status) == (False, "Maximum_Iterations_Exceeded")


@pytest.mark.parametrize(
    ("ranges", "message"),
    [
        ({"length": None}, "a map has two dimensions, not 1: length"),
        ({"length": None, "widht": None}, "cantilever has no dimension 'widht'.*width"),
        ({"length": None, "zzz": None}, "cantilever has no dimension 'zzz'; there are length, width"),
        (
            {"length": (3.0, 1.0), "width": None},
            "range of length is 3 to 1, .*; the present value is 2",
        ),
        ({"length": (1.0, 1.0), "width": None}, "range of length is 1 to 1"),
        ({"length": (1.0, np.inf), "width": None}, "range of length is 1 to inf"),
        ({"length": (-3.0, -1.0), "width": None}, "length from -3 to -1 .*: never a length above 0; .* has length = 2"),
        ({"length": (6.0, 9.0), "width": (0.1, 1.0)}, "never more width than a third of the length"),
    ],
)
def test_maps_that_cannot_be_made(ranges, message):
    with pytest.raises(ModelError, match=message):
        response_map(cantilever(), ranges)


@pytest.mark.parametrize(
    ("share", "given", "message"),
    [
        (0.0, {}, "bounds are 0 % to either side, expected between 0 and 100 %"),
        (1.5, {}, "bounds are 150 %"),
        (0.2, {"lenght": (1.0, 2.0)}, "no dimension 'lenght'.*length"),
        (0.2, {"length": (2.0, 1.0)}, "bounds of length are 2 to 1, expected the lower one first"),
        (0.2, {"length": (np.nan, 1.0)}, "bounds of length are nan to 1"),
        (0.2, {"length": (2.0, 2.0), "width": (1.0, 1.0)}, "leave no dimension free"),
        (0.2, {"length": (-2.0, -1.0)}, "no feasible design was found within the bounds; it needs a length"),
    ],
)
def test_bounds_that_cannot_be_kept(share, given, message):
    with pytest.raises(ModelError, match=message):
        optimum(cantilever(), bounds(cantilever(), share, given))


def test_a_part_without_a_study_names_those_with_one():
    with pytest.raises(ModelError, match=r"mass_on_spring offers no design study; these do: .*tba_accelerometer"):
        studied("mass_on_spring", PARTS)
    assert studied("tba_accelerometer", PARTS) is PART
    own = Part("cantilever", ModuleType("cantilever"), None, None, cantilever)
    with pytest.raises(ModelError, match="cantilever: a design study has no argument 'hieght'"):
        own.design_study(hieght="2")


# The accelerometer's --------------------------------------------------------------------------------------------------


@DESIGN
@RULE
def test_slopes_are_those_of_finite_differences(design, rule):
    """Of all responses; a frequency falls as all lengths grow together, a ratio of two does not."""
    study, step = PART.design_study(design=design, k_out_rule=rule), 1e-5
    scaled = study.values[:, None] * (1 + step * np.eye(len(study.values)))
    ends = [study.at(scaled), study.at(study.values[:, None] ** 2 / scaled)]
    for name in study.responses:
        exact = np.array(list(slopes(study, name).values()))
        np.testing.assert_allclose(exact, np.log(ends[0][name] / ends[1][name]) / (2 * np.log1p(step)), atol=1e-8)
        assert exact.sum() == pytest.approx(0 if name == "frequency_ratio" else -1, abs=1e-12)


@DESIGN
def test_the_map_at_the_design_is_what_analyze_says(design):
    study, numbers = PART.design_study(design=design), PART.analysis(design=design)
    shape = designs.DESIGNS[design].shape
    found = response_map(study, {"tm": None, "l": None}, points=6)
    where = tuple(int(np.flatnonzero(found.axes[name] == getattr(shape, name))[0]) for name in ("tm", "l"))
    at = {name: values[where] for name, values in found.responses.items()}
    assert at["frequency_ratio"] == pytest.approx(numbers["formula_frequency_ratio"], rel=1e-12)
    by_formulas = np.sqrt(numbers["formula_stiffness"] / numbers["mass"]) / (2 * np.pi)
    assert [at["f_in"], at["f_out"]] == pytest.approx([by_formulas[0], by_formulas[2]], rel=1e-12)


def test_the_map_elsewhere_is_what_analyze_says_there():
    found = response_map(PART.design_study(k_out_rule="plus"), {"c": (1e-4, 3e-4), "w": (2e-4, 5e-4)}, points=3)
    there = {"dimensions.c": found.axes["c"][0], "dimensions.w": found.axes["w"][-1], "k_out_rule": "plus"}
    assert found.responses["frequency_ratio"][0, -1] == pytest.approx(PART.analysis(**there)["frequency_ratio"])


def test_the_map_is_blank_where_analyze_refuses():
    """Feet stiffer than their legs, with the rule `minus`."""
    found = response_map(PART.design_study(), {"tm": (2e-5, 3e-4), "l": None}, points=9)
    ratio = found.responses["frequency_ratio"]
    assert np.isfinite(ratio[0]).all()
    assert np.isnan(ratio[-1]).all()
    with pytest.raises(ModelError, match="twist more easily"):
        PART.analysis(**{"dimensions.tm": found.axes["tm"][-1]})


@DESIGN
@RULE
def test_no_step_within_the_bounds_improves_an_optimum(design, rule):
    """Nor do other places to begin at; all requirements are met."""
    study = PART.design_study(design=design, k_out_rule=rule)
    limits = bounds(study, 0.2)
    found = optimum(study, limits)
    assert found.is_converged
    best = found.responses["frequency_ratio"]
    assert best > study.at(study.values)["frequency_ratio"][0]
    assert optimum(study, limits, seed=1).responses["frequency_ratio"] == pytest.approx(best, rel=1e-6)
    low, high = np.array(list(limits.values())).T
    values, random = np.array(list(found.values.values())), np.random.default_rng(2)
    kept = ca.Function("kept", [study.symbols], [ca.vertcat(*study.requirements.values())])
    assert np.all(kept(values).full() > -1e-6)
    for size in (1e-3, 1e-1, 1.0):
        steps = size * (high - low)[:, None] * random.uniform(-1, 1, (len(low), 2000))
        near = np.clip(values[:, None] + steps, low[:, None], high[:, None])
        near = near[:, np.all(kept(near).full() >= 0, axis=0)]
        assert near.shape[1] > 50
        assert np.all(study.at(near)["frequency_ratio"] <= best * (1 + 1e-7))
    if not found.active:
        pushes = {"lower": -1, "upper": 1}
        rising = slopes(study, "frequency_ratio", values)
        assert all(rising[name] * pushes[place] > 0 for name, place in found.at_bound.items())


def test_the_printed_optimum_does_not_follow_from_the_formulas():
    """1.506 by them, 2.884 by the stiffness of finite elements, which other feet would give them; and it is no best."""
    study = PART.design_study(design="optimum")
    printed, by_elements, other_feet = (found["frequency_ratio"] for found in study.references.values())
    assert printed == pytest.approx(1.506, abs=5e-4)
    assert printed == study.at(study.values)["frequency_ratio"][0]
    assert by_elements == pytest.approx(2.884, abs=5e-4)
    assert by_elements == pytest.approx(PART.analysis(design="optimum")["frequency_ratio"], rel=1e-12)
    assert other_feet == pytest.approx(by_elements, rel=5e-3)
    assert optimum(study, bounds(study, 0.2)).responses["frequency_ratio"] == pytest.approx(2.851, abs=5e-4)


def test_with_springs_subtracted_there_is_no_largest_ratio():
    """Towards the pole of k_out the ratio grows without bound; an optimum stays away from it."""
    study = PART.design_study(design="rapid_prototype")
    (requirement,) = [text for text in study.requirements if "k_xlt" in text]
    assert requirement in optimum(study, bounds(study, 0.2)).active
    shape, ratios = designs.DESIGNS["rapid_prototype"].shape, []
    for share in (0.5, 0.9, 0.99, 0.9999):
        foot, leg = designs.torsional_stiffnesses(shape)
        # a leg's twist as the inverse of its length
        thin = shape._replace(e=shape.e * share * 2 * leg / foot)
        ratios.append(study.at(np.array(thin[:9]))["frequency_ratio"][0])
    assert np.all(np.diff(ratios) > 0)
    assert ratios[-1] > 50
