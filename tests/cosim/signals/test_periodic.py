"""Trigonometric interpolation at phase 0."""

import numpy as np
import pytest

from hfsa.cosim.signals.periodic import closing_weights


@pytest.mark.parametrize("spacing", [2 * np.pi / 500, 0.3, 0.83], ids=["close", "wide", "all round"])
@pytest.mark.parametrize("first", [-2.7, -0.4, 0.3], ids=["before", "near", "after"])
def test_it_is_exact_for_as_many_harmonics_as_the_samples_determine(spacing, first):
    phase = spacing * (first + np.arange(7))
    motion = sum(np.cos(m * phase + m) * 2.0**-m for m in range(4))
    weights = closing_weights(phase)
    assert weights @ motion == pytest.approx(sum(np.cos(m) * 2.0**-m for m in range(4)), abs=1e-11)


def test_whole_turns_apart_tell_nothing():
    assert not np.all(np.abs(closing_weights(0.1 + np.pi * np.arange(7))) < 1e6)


def test_an_even_number_is_refused():
    with pytest.raises(ValueError, match="6 samples, expected an odd number"):
        closing_weights(np.arange(6))
