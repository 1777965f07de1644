"""Balancing: the units are those of LAPACK, and they are powers of two."""

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hfsa.cosim.linear.balance import balance

ENTRIES = st.floats(-1, 1).map(lambda x: np.sign(x) * 10 ** (24 * abs(x) - 12) if abs(x) > 0.1 else 0.0)


@given(st.integers(1, 8).flatmap(lambda n: arrays(float, (n, n), elements=ENTRIES)))
def test_the_scale_is_that_of_lapack(matrix):
    _, (expected, _) = scipy.linalg.matrix_balance(matrix, permute=False, separate=True)
    np.testing.assert_array_equal(balance(matrix), expected)


def test_units_disappear():
    """A matrix in micrometres and kilonewtons gets the scale of the one in SI, up to these units."""
    units = 2.0 ** np.array([-20, 10, 0, 3, -7])
    even = np.array([[abs(i - j) + 1.0 for j in range(5)] for i in range(5)])
    scale = balance(even * units[:, None] / units)
    np.testing.assert_array_equal(scale / scale[2], units / balance(even) * balance(even)[2])


@pytest.mark.parametrize("wrong", [np.nan, np.inf], ids=["nan", "infinity"])
def test_what_is_not_finite_is_refused(wrong):
    with pytest.raises(ValueError, match="infs or NaNs"):
        balance(np.array([[1.0, wrong], [0.0, 1.0]]))
