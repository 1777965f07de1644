"""The scale of a response: its valleys are filled as a morphological closing fills them."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import grey_closing

from hfsa.cosim.signals.response_scale import fill_valleys


@given(st.integers(2, 300), st.floats(0.05, 12), st.integers(0, 2**32 - 1))
def test_valleys_are_filled_by_a_closing_of_an_octave(points, octaves, seed):
    frequency = np.geomspace(1.0, 2.0**octaves, points)
    size = np.random.default_rng(seed).lognormal(0, 3, (points, 2, 3))
    width = min(max(round((points - 1) / octaves), 1), 2 * points)
    beyond = np.pad(size, [(width, width), (0, 0), (0, 0)])
    expected = grey_closing(beyond, (width, 1, 1), mode="constant")[width:-width]
    np.testing.assert_array_equal(fill_valleys(size, frequency), expected)
