"""Engineering numbers as text: rounding noise is 0 in any units, units are shown, digits are significant."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hfsa.cosim.commands._numbers import NOISE, numbers_text, without_noise

SIZES = st.floats(0.1, 10)
SIGNED = st.builds(lambda size, sign: size * sign, SIZES, st.sampled_from([-1, 1]))
POWERS = st.integers(-4, 4)


@given(arrays(float, (4, 3), elements=SIGNED), arrays(bool, (4, 3)), st.lists(POWERS, min_size=7, max_size=7))
def test_noise_is_noise_in_any_units(values, noisy, powers):
    """Units of rows and columns may differ by decades: only entries far below their neighbours are 0."""
    noisy[0], noisy[:, 0] = False, False
    matrix = np.where(noisy, 1e-22 * values, values)
    matrix = matrix * 10.0 ** np.array(powers[:4])[:, None] * 10.0 ** np.array(powers[4:])
    np.testing.assert_array_equal(without_noise(matrix), np.where(noisy, 0.0, matrix))


@given(arrays(float, 5, elements=SIGNED), st.floats(-30, 30))
def test_of_a_vector_what_is_less_than_the_bound_is_zero(values, power):
    vector = 10.0**power * values * [1, 1e-13, 1e-11, 1e-19, 1.0]
    expected = np.where(np.abs(vector) < NOISE * np.abs(vector).max(), 0.0, vector)
    np.testing.assert_array_equal(without_noise(vector), expected)
    np.testing.assert_array_equal(without_noise(1j * vector), 1j * expected)


def test_what_is_not_finite_stays():
    found = without_noise(np.array([[np.inf, 1.0, 1.0], [np.nan, 1e-14, 1.0]]))
    np.testing.assert_array_equal(found, [[np.inf, 1.0, 1.0], [np.nan, 0.0, 1.0]])
    assert without_noise(np.zeros((0, 3))).shape == (0, 3)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (25304.09483871957, "N", "x = 25304.09 N"),
        (-0.0, "m", "x = 0 m"),
        (1.4e-6, "F", "x = 1.4e-06 F"),
        (3, "1", "x = 3"),
        ("no clear separation", "1", "x = no clear separation"),
        (np.float64(np.inf), "s", "x = inf s"),
        (np.array([-0.0, 2.0]), "rad", "x [rad] =\n  0  2"),
        (np.array([[1e3, 5e-13], [-1e-14, -2.5]]), "N, m; m, kg", "x [N, m; m, kg] =\n  1000     0\n     0  -2.5"),
        (np.array([-1 - 2j, -3 + 1e-15j]), "1/s", "x [1/s] =\n  -1 - 2j  -3"),
        ({"in_plane": 1.5, "out": 2e-9}, "m", "x [m] =\n  in_plane    1.5\n  out       2e-09"),
        ([{"type": "T", "pitch": None, "direction": [0.0, 1.0]}], "1", "x =\n  type T, pitch none, direction 0 1"),
        ([], "1", "x ="),
    ],
)
def test_a_quantity_is_told_with_its_unit(value, unit, text):
    assert numbers_text({"x": value}, {"x": unit}) == text


def test_a_long_vector_goes_on_in_the_next_line():
    lines = numbers_text({"x": np.arange(60) + 0.12345}, {}).splitlines()[1:]
    assert len(lines) > 3
    assert max(map(len, lines)) <= 125
    assert [float(word) for line in lines for word in line.split()] == pytest.approx(np.arange(60) + 0.12345)
