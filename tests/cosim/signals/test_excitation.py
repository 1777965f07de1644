"""Excitation: frequencies at resonances, amplitudes by unit, samples in a window."""

import numpy as np
import pytest

from hfsa.cosim.signals.excitation import along_response, amplitude_of, linear, logarithmic, ramp_time, window_steps


def resonance(f, f0, zeta):
    return 1 / (1 - (f / f0) ** 2 + 2j * zeta * f / f0)


def test_logarithmic_grid_keeps_its_ends():
    grid = logarithmic(1.0, 50.0, 30)
    assert (grid[0], grid[-1], len(grid)) == (1.0, 50.0, 30)
    assert np.allclose(grid[1:] / grid[:-1], grid[1] / grid[0])


def test_linear_grid_is_even_in_hertz_and_keeps_its_ends():
    assert np.allclose(linear(10.0, 300.0, 30), 10.0 * np.arange(1, 31), rtol=1e-15)
    assert linear(0.3, 0.7, 7)[[0, -1]].tolist() == [0.3, 0.7]


@pytest.mark.parametrize("grid", [logarithmic, linear])
@pytest.mark.parametrize(("low", "high", "points"), [(0, 1, 3), (2, 1, 3), (1, np.inf, 3), (0, 0, 1), (1, 2, 0)])
def test_a_grid_that_cannot_be_is_refused(grid, low, high, points):
    with pytest.raises(ValueError, match="expected"):
        grid(low, high, points)


def test_one_point_is_the_lowest_frequency():
    assert linear(3.0, 50.0, 1).tolist() == logarithmic(3.0, 50.0, 1).tolist() == [3.0]
    assert logarithmic(7.3, 7.3, 40).tolist() == [7.3]
    f = np.geomspace(3, 50, 400)
    assert along_response(f, 1 / (1 - (f / 20) ** 2 + 0.02j * f / 20), 1).tolist() == [3.0]
    assert along_response([7.3], [[1 + 2j]], 40).tolist() == [7.3]


@pytest.mark.parametrize("points", [12, 30])
def test_grid_along_a_response_hits_every_resonance(points):
    f = np.geomspace(1, 100, 20001)
    response = np.column_stack([resonance(f, 24.5, 0.01), resonance(f, 61.0, 0.003), np.zeros_like(f)])
    grid = along_response(f, response, points)
    assert len(grid) == points
    assert (grid[0], grid[-1]) == (1, 100)
    for f0 in (24.5, 61.0):
        assert np.abs(grid / f0 - 1).min() < 2e-4
    near = np.sum(np.abs(grid / 24.5 - 1) < 0.05)
    assert near >= points // 6  # close together where the curve turns


def test_grid_along_nothing_is_logarithmic():
    f = np.geomspace(1, 10, 100)
    assert np.allclose(along_response(f, np.zeros(100), 5), logarithmic(1, 10, 5))


def test_amplitude_goes_by_unit():
    assert amplitude_of("command.position[3]", "m", {"m": 1e-5, "rad": 1e-4}) == 1e-5
    with pytest.raises(ValueError, match=r"input torque is in N.m.*there is 1e-05 m, 0.0001 rad"):
        amplitude_of("torque", "N.m", {"m": 1e-5, "rad": 1e-4})


def test_ramp_is_two_periods_or_half_a_second():
    assert (ramp_time(1.0), ramp_time(50.0)) == (2.0, 0.5)


def test_window_is_the_nearest_number_of_steps():
    assert window_steps(24.5, 50e-6) == 816
    assert window_steps(24.5, 50e-6, 3) == 2449
    with pytest.raises(ValueError, match=r"4000 Hz has 5 steps.*a step of 2.5e-05 s or less"):
        window_steps(4000, 50e-6)
