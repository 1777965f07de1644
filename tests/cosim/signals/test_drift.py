"""A drift along a parabola is removed exactly, a periodic signal stays as it is, and a steeper drift is doubted."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hfsa.cosim.signals.drift import of_lines, of_sine
from hfsa.cosim.signals.frequency_response import Settling


def fitted(signal, samples, turn, windows):
    """Return means and complex amplitudes of the first three harmonics, each window fitted by least squares."""
    n = np.arange(samples * windows)
    angle = turn * n[:, None] * [1, 2, 3]
    basis = np.concatenate([np.ones((len(n), 1)), np.sin(angle), np.cos(angle)], axis=1)
    values = signal(n)
    fits = [
        np.linalg.lstsq(basis[k : k + samples], values[k : k + samples], rcond=None)[0]
        for k in range(0, len(n), samples)
    ]
    found = np.array(fits)
    return found[:, :1], (found[:, 1:4] + 1j * found[:, 4:])[:, :, None]


coefficients = st.lists(st.floats(-50, 50), min_size=3, max_size=3)


@settings(max_examples=30)
@given(coefficients, st.floats(30.0, 90.0), st.integers(1, 3), st.integers(3, 9))
def test_a_parabola_is_removed_from_gain_and_harmonics(powers, per_period, periods, windows):
    """Also where windows are no whole periods; with three windows a line is, which two differences determine."""
    samples, turn = round(periods * per_period), 2 * np.pi / per_period
    if windows == 3:
        powers = [*powers[:2], 0.0]
    own = np.array([1 + 2j, 0.1j, -0.2])

    def signal(n):
        time = n / samples
        drift = sum(a * time**q for q, a in enumerate(powers))
        return drift + sum(np.imag(a * np.exp(1j * m * turn * n)) for m, a in enumerate(own, 1))

    found, doubt = of_sine(samples, turn).removed(*fitted(signal, samples, turn, windows))
    assert found[-1, :, 0] == pytest.approx(own, abs=1e-10 * (1 + windows**2 * np.abs(powers).sum()))
    assert np.all(doubt < 1e-10 * (1 + windows**2 * np.abs(powers).sum()))


def test_a_periodic_signal_keeps_its_amplitudes_whatever_its_harmonics():
    """A square wave: a straight line in the basis of the fit would take its fifth harmonic for a slope."""
    samples = 100
    means, amplitudes = fitted(
        lambda n: np.where(n % samples < samples / 2, 1.0, -1.0), samples, 2 * np.pi / samples, 6
    )
    found, doubt = of_sine(samples, 2 * np.pi / samples).removed(means, amplitudes)
    assert np.abs(found - amplitudes).max() < 1e-13
    assert doubt.max() < 1e-13


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_a_parabola_settles_and_a_steeper_drift_does_not(degree):
    samples = 80
    means, amplitudes = fitted(
        lambda n: np.sin(2 * np.pi * n / samples) + 0.5 * (n / samples) ** degree, samples, 2 * np.pi / samples, 30
    )
    drift, settling = of_sine(samples, 2 * np.pi / samples), Settling(1e-3)
    for k in range(1, 31):
        found, doubt = drift.removed(means[:k], amplitudes[:k])
        settling.judge(found[:, 0], doubt[0])
    assert settling.settled == (degree <= 2)
    if degree <= 2:
        assert settling.gain[0] == pytest.approx(1.0, abs=1e-10)


def test_windows_are_numbered_from_the_first_that_is_kept():
    """The phase of a window that is no whole period depends on its number."""
    samples, turn = 77, 2 * np.pi / 70.3
    means, amplitudes = fitted(lambda n: 3 * np.sin(turn * n) + 0.01 * n, samples, turn, 9)
    drift = of_sine(samples, turn)
    whole, _ = drift.removed(means, amplitudes)
    late, _ = drift.removed(means[4:], amplitudes[4:], first=4)
    assert late[-1] == pytest.approx(whole[-1], abs=1e-12)
    assert whole[-1, 0, 0] == pytest.approx(3.0, abs=1e-11)


def test_lines_of_a_spectrum_lose_the_drift_too():
    points, lines = 600, np.array([3, 7, 20])
    n = np.arange(5 * points)
    values = 4 + 0.02 * n + 1e-5 * n**2 + np.cos(2 * np.pi * 7 * n / points)
    windows = values.reshape(5, points)
    spectra = 2j / points * np.fft.rfft(windows, axis=1)[:, lines]
    found, doubt = of_lines(points, lines).removed(windows.mean(axis=1)[:, None], spectra[:, :, None])
    assert found[-1, :, 0] == pytest.approx([0, 1j, 0], abs=1e-11)
    assert doubt.max() < 1e-10


def test_silence_and_numbers_that_are_none_never_settle():
    settling = Settling(1e-3)
    settling.silent = np.array([True])
    for _ in range(8):
        settling.add([0.0])
    assert not settling.settled
    settling.silent = np.array([False])
    assert settling.settled
    settling.judge([*np.ones((7, 1)), [1.0]], doubt=[np.nan])
    assert not settling.settled
