"""A linear transformation is its two numbers at every frequency, whatever the units are called."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hfsa.components import ModelError
from hfsa.components._modelling.functions import functions
from hfsa.components.linear_transformation import linear_transformation


@given(st.lists(st.tuples(*[st.floats(-1e6, 1e6)] * 3), min_size=1, max_size=4))
def test_each_value_is_its_own_factor_and_offset(numbers):
    n = len(numbers)
    model = linear_transformation(units=["mm"] * n, results=["m"] * n)
    factor, offset, signal = np.array(numbers).T
    found = functions(model).out(0, [], [], signal, np.column_stack([factor, offset]).ravel())
    np.testing.assert_array_equal(np.array(found).ravel(), factor * signal + offset)


@pytest.mark.parametrize(
    ("units", "factor"), [(("m", "N"), "N/m"), (("V", "V"), "1"), (("degC", "V"), "(V)/(degC)")], ids=str
)
def test_the_factor_has_the_unit_of_the_quotient(units, factor):
    model = linear_transformation(units=[units[0]], results=[units[1]])
    assert model["factor[1]"].unit == factor


@pytest.mark.parametrize("lists", [([], []), (["m"], []), (["m"], ["m", "m"])], ids=["none", "fewer", "more"])
def test_as_many_results_as_units(lists):
    with pytest.raises(ModelError, match=f"{len(lists[0])} units and {len(lists[1])} results"):
        linear_transformation(units=lists[0], results=lists[1])
