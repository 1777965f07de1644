"""The front: candidates than which no other is both cheaper and more accurate; groups that may be fused."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hfsa.cosim import load_scene
from hfsa.cosim.tradeoff.answer import front
from hfsa.cosim.tradeoff.choices import choices_of
from hfsa.cosim.tradeoff.configuration import Candidate, Composition, Configuration, Counts, Measurement, Prediction

NUMBERS = st.floats(1e-9, 1e3)


def candidate(cost, error, measured=None):
    found = Candidate(Configuration(Composition(), "jacobi", 1e-3), Prediction(error), cost, Counts(1e3, 4e3, 0.0))
    found.measured = measured
    return found


@given(st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=30))
def test_front_dominates_all_and_nothing_on_it_is_dominated(pairs):
    every = [candidate(*pair) for pair in pairs]
    found = front(every)
    assert all(any(f.cost <= c.cost and f.error <= c.error for f in found) for c in every)
    for one in found:
        assert not any(c.cost <= one.cost and c.error < one.error for c in every)
    assert [c.cost for c in found] == sorted(c.cost for c in found)


def test_measured_values_stand_before_predicted_ones():
    slow = candidate(1.0, 1e-6, Measurement(1e-2, cost=5.0))
    quick = candidate(2.0, 1e-3)
    assert front([slow, quick, candidate(0.1, math.nan)]) == [quick]
    assert (slow.error, slow.known_cost) == (1e-2, 5.0)


@pytest.mark.slow
def test_choices_of_a_loop_are_its_parts_and_all_that_is_joined():
    found = choices_of(load_scene("sdelta_hfsa"), None, lambda _: None)
    groups = {composition.fuse for composition in found.compositions}
    drives = "drive[1]", "drive[2]", "drive[3]", "robot"
    assert {(), (drives,), (("reference", "controller", *drives),)} <= groups
    assert found.own == Composition()
    assert found.reference_levels["robot"] == "cartesian"
    assert "sdelta at level rigid" in found.levels["robot"].refusals["rigid"]


def test_levels_are_chosen_below_that_of_the_scene_alone():
    found = choices_of(load_scene("accelerometer_shaker"), None, lambda _: None)
    assert set(found.levels) == {"sensor"}
    errors = found.levels["sensor"].errors
    assert "nonlinear" not in errors
    assert next(reversed(errors)) == "spatial"
