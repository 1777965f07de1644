"""Portions of frequencies: all of them once and in order, and never more than memory holds."""

import pytest

from hfsa.cosim.linear.portions import portions


@pytest.mark.parametrize("count", [0, 1, 256, 2437], ids=str)
@pytest.mark.parametrize("unknowns", [0, 12, 600, 5000], ids=str)
def test_each_frequency_is_in_one_portion(count, unknowns):
    found = list(portions(count, unknowns))
    assert [place for some in found for place in range(count)[some]] == list(range(count))
    assert all(len(range(count)[some]) * unknowns**2 <= 2**22 or len(range(count)[some]) == 1 for some in found)
