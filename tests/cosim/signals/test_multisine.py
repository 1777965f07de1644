"""Lines, phases, spectrum and distortion of a multisine as numbers."""

import contextlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hfsa.cosim.signals.excitation import FEWEST_SAMPLES, logarithmic
from hfsa.cosim.signals.frequency_response import FEWEST_WINDOWS
from hfsa.cosim.signals.multisine import (
    PHASES,
    Grid,
    LineSettling,
    Spectrum,
    choose_lines,
    collapsed,
    design_grid,
    detection_lines,
    distortion,
    excitation,
    schroeder,
)

ASKED = logarithmic(1.0, 50.0, 40)


def wave(grid: Grid, one, samples) -> np.ndarray:
    """Values of an excitation at samples, in whole numbers of turns."""
    turns = (np.outer(samples, one.lines) % grid.points) / grid.points
    return np.sin(2 * np.pi * turns + one.phase) @ one.amplitude


@given(
    st.floats(0.01, 1e4),
    st.floats(1.5, 300),
    st.integers(2, 60),
    st.integers(1, 7),
    st.integers(1, 4),
    st.integers(0, 5),
)
@settings(max_examples=60)
def test_lines_are_whole_periods_of_a_window_of_whole_steps(low, ratio, points, ticks, inputs, seed):
    frequency = logarithmic(low, low * ratio, points)
    step_size = 1 / (FEWEST_SAMPLES * 1.7 * frequency[-1])
    with contextlib.suppress(ValueError):  # no room for lines
        grid = design_grid(frequency, step_size, inputs=inputs, ticks=ticks, seed=seed)
        check_lines(grid, choose_lines(grid, frequency, inputs), frequency, step_size, ticks)


def check_lines(grid, lines, frequency, step_size, ticks):
    assert grid.points % ticks == 0
    every = np.concatenate(lines)
    assert len(np.unique(every)) == len(every)  # no line belongs to two inputs
    assert np.all(every % 2 == 1)
    assert np.all(grid.frequency(every) <= 1 / (FEWEST_SAMPLES * step_size))
    assert np.all(grid.frequency(every) >= frequency[0] - 0.51 * grid.spacing)
    assert np.all(grid.frequency(every) <= frequency[-1] + 0.51 * grid.spacing)
    for own in lines:
        assert np.all(np.diff(own) > 0)


def test_the_window_is_no_longer_than_one_period_of_each_frequency():
    grid = design_grid(ASKED, 50e-6)
    assert grid.window <= np.sum(1 / ASKED)
    assert grid.periods % 2 == 1
    assert choose_lines(grid, ASKED)[0][0] == grid.periods  # 1 Hz is a line


def test_of_four_odd_lines_one_is_left_out():
    grid = Grid(20_000, 50e-6, 1, 1.0, 81.0)
    odd = set(range(1, 82, 2))
    left_out = sorted(odd - set(grid.excitable.tolist()))
    assert len(left_out) == 10
    assert [line // 8 for line in left_out] == list(range(10))
    assert 1 in grid.excitable
    assert grid.excitable.tolist() != Grid(20_000, 50e-6, 1, 1.0, 81.0, seed=1).excitable.tolist()


def test_collapsed_frequencies_are_named_with_a_remedy_that_helps():
    grid = design_grid(ASKED, 50e-6, periods=1)
    (lines,) = choose_lines(grid, ASKED)
    sentence = collapsed(ASKED, lines, grid)
    assert sentence.startswith(f"40 frequencies lie on {len(lines)} lines")
    finer = design_grid(ASKED, 50e-6, periods=int(sentence.split("--measurement-periods ")[1].split()[0]))
    (separate,) = choose_lines(finer, ASKED)
    assert len(separate) == 40
    assert collapsed(ASKED, separate, finer) == ""


@pytest.mark.parametrize(
    ("frequency", "step_size", "more", "words"),
    [
        ([10.0], 1e-4, {}, "one frequency, 10 Hz"),
        ([10.0, 10.2, 10.3], 1e-4, {"periods": 1}, "no room for two lines from 10 to 10.3 Hz"),
        ([1.0, 2000.0], 1e-4, {}, "2000 Hz has 5 steps"),
    ],
    ids=["one point", "narrow band", "beyond the step"],
)
def test_what_has_no_lines_is_refused(frequency, step_size, more, words):
    with pytest.raises(ValueError, match=words):
        design_grid(np.array(frequency), step_size, **more)


def test_more_inputs_than_lines_are_refused():
    grid = Grid(1000, 1e-3, 1, 1.0, 5.0)
    with pytest.raises(ValueError, match="no room for 6 inputs together: 3 lines"):
        choose_lines(grid, np.array([1.0, 5.0]), 6)


@pytest.mark.parametrize("n", [10, 29, 40, 120])
def test_schroeders_phases_have_a_low_crest_factor_for_a_flat_spectrum(n):
    """Of neighbouring lines; that of equal phases is sqrt(2 n)."""
    lines = np.arange(1, n + 1)
    assert excitation(lines, 1.0).crest_factor < 2
    assert np.all((schroeder(n) >= 0) & (schroeder(n) < 2 * np.pi))


@pytest.mark.parametrize("phases", PHASES)
def test_the_peak_of_the_sum_is_the_amplitude(phases):
    grid = design_grid(ASKED, 500e-6, periods=5)
    (lines,) = choose_lines(grid, ASKED)
    one = excitation(lines, 3e-6, phases, seed=4)
    values = wave(grid, one, np.arange(grid.points))
    assert np.abs(values).max() == pytest.approx(3e-6, rel=0.01)
    assert one.crest_factor == pytest.approx(3e-6 / np.sqrt(np.mean(values**2)), rel=0.01)
    again = excitation(lines, 3e-6, phases, seed=4)
    assert np.array_equal(again.phase, one.phase)


@given(st.integers(0, 1000), st.integers(1, 9000))
@settings(max_examples=15)
def test_a_spectrum_has_no_leakage_however_its_samples_arrive(seed, block):
    grid = Grid(10_007, 1e-4, 1, 1.0, 1000.0)
    rng = np.random.default_rng(seed)
    lines = rng.choice(np.arange(1, 1001), 20, replace=False)
    gains = rng.normal(size=(20, 2)) + 1j * rng.normal(size=(20, 2))
    turns = (np.outer(np.arange(grid.points), lines) % grid.points) / grid.points
    values = np.imag(np.exp(2j * np.pi * turns) @ gains) + np.array([1e3, -5.0])
    silent = np.setdiff1d(np.arange(1, 1001), lines)[:30]
    spectrum = Spectrum(grid, np.concatenate([lines, silent]), 2)
    for first in range(0, grid.points, block):
        spectrum.add(values[first : first + block])
    np.testing.assert_allclose(spectrum.gain[:20], gains, atol=1e-10)
    assert np.abs(spectrum.gain[20:]).max() < 1e-10


def test_detection_lines_are_the_nearest_that_are_not_excited():
    odd, even = detection_lines(np.array([1, 5, 7, 13]))
    assert odd.tolist() == [3, 9, 11, 15]
    assert even.tolist() == [2, 4, 6, 8, 12, 14]


@pytest.mark.parametrize(
    ("shape", "odd_alone"),
    [(lambda u: u + 0.05 * u**3, True), (lambda u: u + 0.05 * u**2, False)],
    ids=["cubic", "square"],
)
def test_distortion_is_that_of_the_spectrum_of_a_known_nonlinearity(shape, odd_alone):
    """An odd nonlinearity leaves even lines silent, an even one the odd lines."""
    grid = design_grid(logarithmic(1.0, 40.0, 12), 1e-3, periods=3)
    (lines,) = choose_lines(grid, logarithmic(1.0, 40.0, 12))
    one = excitation(lines, 1.0)
    values = shape(wave(grid, one, np.arange(grid.points)))
    odd, even = detection_lines(lines)
    wanted = np.concatenate([lines, odd, even])
    spectrum = Spectrum(grid, wanted, 1)
    spectrum.add(values[:, None])
    gains = dict(zip(wanted.tolist(), spectrum.gain, strict=True))
    full = 2 / grid.points * np.abs(np.fft.rfft(values))
    silent, loud = (even, odd) if odd_alone else (odd, even)
    assert full[silent].max() < 1e-14
    expected = np.sqrt(np.interp(lines, loud, full[loud] ** 2))
    np.testing.assert_allclose(distortion(lines, gains)[:, 0], expected, rtol=1e-9, atol=1e-15)
    assert expected.max() > 1e-4


def test_two_windows_that_agree_are_enough_where_the_decay_is_known():
    known = LineSettling(1e-3, keeps=0.5)
    known.add([1.0])
    assert not known.settled
    known.add([1.0 + 1e-4])
    assert known.settled
    assert known.remaining[0] == pytest.approx(4e-4)
    unknown = LineSettling(1e-3)
    for gain in (1.0, 1.0 + 1e-4):
        unknown.add([gain])
        assert not unknown.settled
    unknown.add([1.0 + 1.01e-4])
    assert unknown.settled


@given(st.floats(0.0, 0.999), st.floats(1e-6, 1.0), st.floats(0, 6.28))
def test_what_remains_is_not_underestimated_before_five_windows(keeps, departure, angle):
    settling = LineSettling(1e-3)
    for window in range(FEWEST_WINDOWS - 1):
        settling.add([1 + departure * np.exp(1j * angle) * keeps**window])
        if settling.settled:
            assert np.abs(1 - settling.gain[0]) <= 1.01 * settling.remaining[0] + 1e-14
            break
