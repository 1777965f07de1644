"""Flags of branches: where two sweeps differ, and which one jumps."""

import numpy as np

from hfsa.cosim.signals.branches import DIFFERENT, JUMP_DOWN, JUMP_UP, branch_flags

UP = np.array([[1.0], [1.5], [2.0], [2.5], [0.4], [0.3]], complex)
DOWN = np.array([[1.0], [1.5], [0.6], [0.5], [0.4], [0.3]], complex)


def test_jumps_are_at_the_ends_of_the_range_with_two_branches():
    flags = branch_flags(UP, DOWN, ["m"], 1e-3)
    assert flags.tolist() == [0, JUMP_DOWN, DIFFERENT, DIFFERENT, JUMP_UP, 0]


def test_equal_within_the_tolerance_and_missing_points_have_no_flags():
    assert not branch_flags(UP, UP * (1 + 5e-3), ["m"], 1e-3).any()
    missing = DOWN.copy()
    missing[2:4] = np.nan
    assert not branch_flags(UP, missing, ["m"], 1e-3).any()


def test_noise_of_outputs_that_are_zero_by_symmetry_is_no_branch():
    """Another output of the same unit, or all outputs of another unit."""
    noise = 1e-12 * np.arange(6)[:, None]
    for units in (["m", "m"], ["m", "rad"]):
        assert not branch_flags(np.hstack([UP, noise]), np.hstack([UP, -noise]), units, 1e-3).any()
    real = branch_flags(np.hstack([UP, UP * 1e-6]), np.hstack([UP, DOWN * 1e-6]), ["m", "rad"], 1e-3)
    assert np.count_nonzero(real & DIFFERENT) == 2
