"""Settling: the remaining transient of a settled gain is within the tolerance."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import cont2discrete, lfilter, ss2tf

from hfsa.cosim.signals.excitation import ramp_time
from hfsa.cosim.signals.frequency_response import (
    FEWEST_WINDOWS,
    Settling,
    harmonic_distortion,
    negligible,
    noise_floor,
    phase,
    remaining_transient,
    resonances,
)

TOLERANCE = 1e-3


def measured(frequency, modes, weights, *, samples=100.3, noise=0.0, seed=0):
    """Return gains of every window after the ramp, shape (windows, outputs), and the settled gains, shape (outputs,).

    Outputs are sums of modes (natural frequency [Hz], damping ratio) by `weights`, shape (outputs, modes), driven by a
    ramped sine from rest until the slowest mode has lost six decades; `samples` in a period, not a whole number.
    """
    weights = np.atleast_2d(weights)
    step = 1 / frequency / samples
    window = round(samples)
    decay = min(2 * np.pi * f0 * zeta for f0, zeta in modes)
    ramp = int(np.ceil(ramp_time(frequency) / (window * step)))
    windows = ramp + int(14 / decay / (window * step)) + 2 * FEWEST_WINDOWS
    time = np.arange(windows * window) * step
    omega = 2 * np.pi * frequency
    rising = time < ramp_time(frequency)
    drive = np.where(rising, (1 - np.cos(np.pi * time / ramp_time(frequency))) / 2, 1) * np.sin(omega * time)
    signals, settled = np.zeros((len(weights), len(time))), np.zeros(len(weights), complex)
    for (f0, zeta), weight in zip(modes, weights.T, strict=True):
        w0 = 2 * np.pi * f0
        matrices = [[0, 1], [-(w0**2), -2 * zeta * w0]], [[0], [w0**2]], [[1, 0]], [[0]]
        plant = cont2discrete([np.array(matrix) for matrix in matrices], step, "foh")
        numerator, denominator = ss2tf(*plant[:4])
        signals += np.outer(weight, lfilter(numerator[0], denominator, drive))
        z = np.exp(1j * omega * step)
        settled += weight * np.polyval(numerator[0], z) / np.polyval(denominator, z)
    signals += noise * np.abs(settled).max() * np.random.default_rng(seed).standard_normal(signals.shape)
    gains = []
    for k in range(ramp, windows):
        part = slice(k * window, (k + 1) * window)
        harmonics = [wave(m * omega * time[part]) for m in (1, 2, 3) for wave in (np.sin, np.cos)]
        fit = np.linalg.lstsq(np.column_stack([np.ones(window), *harmonics]), signals[:, part].T)[0]
        gains.append(fit[1] + 1j * fit[2])
    return np.array(gains), settled


def windows_until_settled(gains, settling):
    for k, gain in enumerate(gains):
        settling.add(gain)
        if settling.settled:
            return k + 1
    pytest.fail("never settled")


def assert_honest(gains, settled, slack=1.0):
    """The settled gain is within tolerance, and settling ends soon after the last gain that is not."""
    settling = Settling(TOLERANCE)
    count = windows_until_settled(gains, settling)
    error = np.abs(gains - settled) / np.abs(settled)
    assert np.all(error[count - 1] <= slack * TOLERANCE)
    needed = np.flatnonzero(np.any(error > TOLERANCE, axis=1))
    needed = needed[-1] + 2 if len(needed) else 1
    assert count <= 1.5 * max(needed, 2 * FEWEST_WINDOWS)


@pytest.mark.parametrize("zeta", [1e-3, 3e-3, 1e-2, 3e-2, 1e-1])
@pytest.mark.parametrize("ratio", [0.05, 0.5, 0.97, 1.0, 1.004, 1.5, 2.0])
def test_one_mode_settles_within_tolerance(zeta, ratio):
    gains, settled = measured(ratio * 20.0, [(20.0, zeta)], [1.0])
    assert_honest(gains, settled)


@pytest.mark.parametrize("spacing", [1.001, 1.01, 1.04])
@pytest.mark.parametrize("zeta", [(1e-3, 1e-3), (1e-2, 1e-2), (2e-3, 5e-2)])
@pytest.mark.parametrize("weight", [(1.0, 1.0), (1.0, -0.9), (0.02, 1.0)])
def test_two_close_modes_that_beat_settle_within_tolerance(spacing, zeta, weight):
    gains, settled = measured(20.0, list(zip((20.0, 20.0 * spacing), zeta, strict=True)), [weight])
    assert_honest(gains, settled)


def test_a_weak_slow_mode_below_a_strong_fast_one_is_seen():
    modes, weight = [(20.0, 0.002), (20.0, 0.1)], (4e-4, 1.0)
    gains, settled = measured(20.0, modes, [weight])
    change = np.abs(np.diff(gains[:, 0])) / np.abs(settled)
    early = np.flatnonzero(change < TOLERANCE)[0] + 1
    assert np.abs(gains[early] - settled) / np.abs(settled) > 5 * TOLERANCE  # a small change is not enough
    assert_honest(gains, settled)


@pytest.mark.parametrize("seed", range(12))
def test_several_modes_and_outputs_settle_within_tolerance(seed):
    rng = np.random.default_rng(seed)
    modes = [(f0, zeta) for f0, zeta in zip(10 ** rng.uniform(1, 1.7, 4), 10 ** rng.uniform(-2.5, -1, 4), strict=True)]
    weights = rng.standard_normal((3, 4)) * 10 ** rng.uniform(-2, 0, (3, 4))
    frequency = modes[0][0] * rng.choice([0.3, 0.99, 1.0, 1.05])
    gains, settled = measured(frequency, modes, weights, noise=10 ** rng.uniform(-10, -6), seed=seed)
    assert_honest(gains, settled, slack=1.2)


def test_an_entry_of_rounding_noise_is_judged_by_the_floor():
    gains, _ = measured(20.0, [(24.5, 0.01)], [1.0])
    noise = np.random.default_rng(1).standard_normal((len(gains), 2)) @ [1, 1j] * 1e-16
    both = np.column_stack([gains[:, 0], noise])
    alone = windows_until_settled(gains, Settling(TOLERANCE))
    assert windows_until_settled(both, Settling(TOLERANCE, floor=[0.0, 1e-9])) == alone
    with pytest.raises(pytest.fail.Exception, match="never settled"):
        windows_until_settled(both, Settling(TOLERANCE))


def test_noise_that_never_decays_settles_when_it_is_below_the_tolerance():
    rng = np.random.default_rng(2)
    gains = 1 + 1e-5 * rng.standard_normal((60, 1)) + 1e-5j * rng.standard_normal((60, 1))
    assert windows_until_settled(gains, Settling(TOLERANCE)) < 10
    with pytest.raises(pytest.fail.Exception, match="never settled"):
        windows_until_settled(gains, Settling(1e-6))


def test_a_growing_or_lasting_oscillation_never_settles():
    k = np.arange(200)[:, None]
    for growth in (1.0, 1.003, 1.1):
        with pytest.raises(pytest.fail.Exception, match="never settled"):
            windows_until_settled(1 + 0.01 * (growth * np.exp(0.3j)) ** k, Settling(TOLERANCE))
    with pytest.raises(pytest.fail.Exception, match="never settled"):
        windows_until_settled(1 + 0.01 * k, Settling(TOLERANCE))


def test_a_gain_that_is_not_finite_never_settles():
    settling = Settling(TOLERANCE)
    for gain in [1.0] * 10 + [np.nan]:
        settling.add([gain])
    assert not settling.settled


@given(st.floats(0.05, 0.995), st.floats(-3, 3), st.integers(FEWEST_WINDOWS, 30))
def test_one_decay_is_summed_exactly(rho, angle, windows):
    decay = rho * np.exp(1j * angle)
    gains = 3 - 2j + (0.7 + 0.1j) * decay ** np.arange(windows)
    largest = 0.71 * rho ** (windows - 1) / rho**2  # of the last three windows
    remaining = remaining_transient(gains[:, None])
    assert remaining[0] >= np.abs(gains[-1] - 3 + 2j) * (1 - 1e-4) - 1e-12
    assert remaining[0] <= largest * (1 + 1e-4) + 1e-9


def test_too_few_windows_say_nothing():
    assert np.isinf(remaining_transient(np.ones((FEWEST_WINDOWS - 1, 2)))).all()
    assert np.array_equal(remaining_transient(np.ones((FEWEST_WINDOWS, 2))), [0, 0])


def test_a_resonance_stands_above_its_surroundings():
    assert resonances([0, 5, 1, 2, 1, 9, 8, 8.5, 0]).tolist() == [1, 5]
    assert resonances([0, 5, 1, 2, 1, 9, 8, 8.5, 0], height=0.4).tolist() == [1, 3, 5, 7]
    assert resonances([0, 1, 2, 9]).size == 0  # an end is no maximum


def test_phase_lies_above_minus_pi():
    response = [-1 + 0j, complex(-1, -0.0), 1j, -1j, complex(np.nan, 0)]
    assert np.array_equal(phase(response), [np.pi, np.pi, np.pi / 2, -np.pi / 2, np.nan], equal_nan=True)


def test_harmonic_distortion_is_relative_to_the_fundamental():
    assert np.array_equal(harmonic_distortion([2j, 0], [0.3, 1], [0.4, 1]), [0.25, np.nan], equal_nan=True)


def test_numbers_without_a_unit_are_not_compared():
    """A strain of 1e-6 beside a pressure of 1e6 is no noise, a displacement of 1e-9 m beside one of 1 m is."""
    gain = [1e6, 1e-6]
    assert noise_floor(gain, ["", ""], [0.0, 0.0]).tolist() == [0.0, 0.0]
    assert noise_floor([1.0, 1e-9], ["m", "m"], [1.0, 1.0])[1] == pytest.approx(1e-6)
    response = np.array(gain)[None, :, None]
    assert not negligible(response, ["1", "1"], [1.0]).any()
    assert negligible(response, ["m", "m"], [1.0])[:, 0].tolist() == [False, True]
    assert negligible(np.array([1.0, 0.0])[None, :, None], ["1", "1"], [1.0])[:, 0].tolist() == [False, True]
