"""Least squares: covariance, condition of scaled columns, and what equations do not determine."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hfsa.cosim.signals.least_squares import solve

SIZES = st.lists(st.floats(1e-3, 1e3), min_size=4, max_size=4).map(np.array)


@given(st.integers(0, 2**32 - 1), SIZES)
def test_units_of_the_unknowns_change_neither_condition_nor_solution(seed, sizes):
    random = np.random.default_rng(seed)
    A, b = random.normal(size=(30, 4)), random.normal(size=30)
    one, other = solve(A, b), solve(A * sizes, b)
    assert other.condition == pytest.approx(one.condition, rel=1e-9)
    np.testing.assert_allclose(other.values * sizes, one.values, atol=1e-10)
    np.testing.assert_allclose(other.residuals, one.residuals, atol=1e-10)


def test_the_solution_is_that_of_the_normal_equations():
    random = np.random.default_rng(1)
    A, b = random.normal(size=(50, 3)), random.normal(size=50)
    found = solve(A, b)
    np.testing.assert_allclose(found.covariance, np.linalg.inv(A.T @ A), rtol=1e-10)
    np.testing.assert_allclose(found.values, np.linalg.solve(A.T @ A, A.T @ b), rtol=1e-10)
    np.testing.assert_allclose(A.T @ found.residuals, 0, atol=1e-12)
    assert (found.rank, found.unseen) == (3, ())
    orthogonal = np.linalg.qr(A)[0] * [1.0, 1e3, 1e-3]
    assert solve(orthogonal, b).condition == pytest.approx(1.0, abs=1e-12)


def test_what_is_not_determined_is_named_and_the_rest_is_as_if_alone():
    """An unknown in no equation, and two in their sum alone."""
    random = np.random.default_rng(2)
    A = random.normal(size=(40, 5))
    A[:, 1] = 0
    A[:, 4] = 2 * A[:, 2]
    b = random.normal(size=40)
    found = solve(A, b)
    assert found.rank == 3
    assert sorted(found.unseen) == [(1,), (2, 4)]
    assert found.condition == np.inf
    assert np.array_equal(np.isnan(found.values), [False, True, True, False, True])
    alone = solve(A[:, [0, 2, 3]], b)
    np.testing.assert_allclose(found.values[[0, 3]], alone.values[[0, 2]], rtol=1e-10)
    kept = np.ix_([0, 3], [0, 3])
    np.testing.assert_allclose(found.covariance[kept], alone.covariance[np.ix_([0, 2], [0, 2])], rtol=1e-10)
    np.testing.assert_allclose(found.residuals, alone.residuals, atol=1e-10)


def test_a_column_of_rounding_is_no_column():
    A = np.column_stack([np.ones(9), 1e-17 * np.arange(9)])
    assert solve(A, np.ones(9)).unseen == ((1,),)


def test_equations_without_any_motion_determine_nothing():
    found = solve(np.zeros((6, 2)), np.ones(6))
    assert found.rank == 0
    assert sorted(found.unseen) == [(0,), (1,)]
    np.testing.assert_array_equal(found.residuals, np.ones(6))
