"""The instruments measure what they say: exact derivatives of the source, exact amplitudes from the lock-in."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hfsa.components import Model, ModelError
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.model import Kind
from hfsa.components.lock_in import lock_in
from hfsa.components.multisine_source import multisine_source
from hfsa.components.sampler import sampler
from hfsa.components.sine_source import sine_source


class LockIn:
    """The lock-in of one signal as a Python loop over its tick map."""

    def __init__(self):
        model: Model = lock_in(units=["m"])
        self.tick = functions(model).tick
        self.names = [q.name for q in model.of(Kind.SAMPLED_OUTPUT)]
        self.z = np.zeros(len(model.of(Kind.SAMPLED_STATE)))

    def measure(self, signal, frequency: float, sample_time: float, samples: int, windows: int = 1) -> dict[str, float]:
        for n in range(samples * windows):
            phase = 2 * np.pi * frequency * n * sample_time
            u = [np.sin(phase), np.cos(phase), signal(phase)]
            z, held = self.tick(0, [], self.z, u, [sample_time, samples * sample_time])
            self.z = np.array(z).reshape(-1)
        return dict(zip(self.names, np.array(held).reshape(-1), strict=True))


LOCK_IN = LockIn()


@settings(max_examples=15)
@given(
    a=st.floats(-1, 1),
    b=st.floats(-1, 1),
    second=st.floats(0, 0.5),
    mean=st.floats(-100, 100),
    scale=st.sampled_from([1e-9, 1.0, 1e6]),
    per_period=st.floats(20.3, 90.7),
)
def test_lock_in_recovers_every_component_without_whole_periods(a, b, second, mean, scale, per_period):
    """Any phase, scale and mean, and periods that are no whole number of samples."""

    def signal(phase: float) -> float:
        return scale * (mean + a * np.sin(phase) + b * np.cos(phase) + second * np.sin(2 * phase + 0.4))

    LOCK_IN.z[:] = 0
    r = LOCK_IN.measure(signal, frequency=1.0, sample_time=1 / per_period, samples=int(1.6 * per_period))
    floor = 1e-12 * scale * (1 + abs(mean))
    assert r["windows"] == 1
    assert abs(r["gain[1].real"] - scale * a) <= floor
    assert abs(r["gain[1].imaginary"] - scale * b) <= floor
    of_second = complex(r["harmonic[1].second.real"], r["harmonic[1].second.imaginary"])
    assert abs(of_second - scale * second * np.exp(0.4j)) <= floor
    assert abs(complex(r["harmonic[1].third.real"], r["harmonic[1].third.imaginary"])) <= floor
    assert abs(r["mean[1]"] - scale * mean) <= floor


def test_lock_in_starts_anew_with_each_window():
    LOCK_IN.z[:] = 0
    first = LOCK_IN.measure(lambda p: 5 * np.sin(p), 1.0, 0.01, 150)
    second = LOCK_IN.measure(lambda p: 2 * np.cos(p), 1.0, 0.01, 150)
    assert (first["windows"], second["windows"]) == (1, 2)
    assert first["gain[1].real"] == pytest.approx(5, rel=1e-12)
    assert second["gain[1].real"] == pytest.approx(0, abs=1e-12)
    assert second["gain[1].imaginary"] == pytest.approx(2, rel=1e-12)


def test_lock_in_reports_what_is_not_in_its_basis():
    LOCK_IN.z[:] = 0
    result = LOCK_IN.measure(lambda p: np.sin(p) + 0.1 * np.sin(5 * p), 1.0, 0.001, 1000)
    assert result["residual[1]"] == pytest.approx(0.1 / np.sqrt(2), rel=1e-6)


def test_lock_in_bode_sentence():
    """Zeros of transmission at 0, 2 f and 3 f; the rectangular window's sidelobe elsewhere."""
    for multiple in (0, 2, 3):
        LOCK_IN.z[:] = 0
        r = LOCK_IN.measure(lambda p, k=multiple: np.cos(k * p + 0.3), 1.0, 0.01, 250)
        assert abs(complex(r["gain[1].real"], r["gain[1].imaginary"])) < 1e-12
    LOCK_IN.z[:] = 0
    r = LOCK_IN.measure(lambda p: np.sin(1.15 * p), 1.0, 0.01, 1000)
    assert abs(complex(r["gain[1].real"], r["gain[1].imaginary"])) < 1.5 / (np.pi * 0.15 * 10)


def test_lock_in_needs_a_signal():
    with pytest.raises(ModelError, match="units is empty"):
        lock_in(units=[])


@pytest.mark.parametrize("frequency", [0.3, 1.0, 40.0])
def test_sine_source_rates_are_its_derivatives_also_in_the_ramp(frequency):
    out = functions(sine_source(unit="m")).out
    ramp = max(2 / frequency, 0.5)

    def at(t: float) -> np.ndarray:
        return np.array(out(t, [], [], [], [2e-3, frequency, 0.0, 1.0])).reshape(-1)

    for t in np.array([0.1, 0.37, 0.83, 1.9]) * ramp:
        h = 1e-4 / frequency
        omega = 2 * np.pi * frequency
        slope = (at(t - 2 * h) - 8 * at(t - h) + 8 * at(t + h) - at(t + 2 * h)) / (12 * h)
        assert at(t)[1] == pytest.approx(slope[0], abs=1e-9 * 2e-3 * omega)
        assert at(t)[2] == pytest.approx(slope[1], abs=1e-9 * 2e-3 * omega**2)
        assert at(t)[3] == pytest.approx(slope[2], abs=1e-9 * 2e-3 * omega**3)
    assert at(0.0)[:2] == pytest.approx([0, 0])
    assert at(1.5 * ramp)[0] == pytest.approx(2e-3 * np.sin(2 * np.pi * frequency * 1.5 * ramp))


def test_sine_source_may_have_its_amplitude_from_the_start():
    """Without the ramp it is the plain sine with its derivatives."""
    out = functions(sine_source(unit="m")).out
    for t in (0.0, 0.01, 0.3, 7.0):
        w, phase = 2 * np.pi * 3.0, 2 * np.pi * 3.0 * t
        sine, cosine = np.sin(phase), np.cos(phase)
        expected = 2e-3 * np.array([sine, w * cosine, -(w**2) * sine, -(w**3) * cosine])
        scale = 2e-3 * w ** np.arange(4)
        found = np.array(out(t, [], [], [], [2e-3, 3.0, 0.0, 0.0])).ravel()[:4]
        np.testing.assert_allclose(found / scale, expected / scale, atol=1e-13)


def test_sine_source_swings_about_its_offset():
    """The offset moves the value and nothing else, ramp or not."""
    out = functions(sine_source(unit="V")).out
    for t in (0.0, 0.2, 3.3):
        about, plain = (np.array(out(t, [], [], [], [0.5, 1.0, offset, 1.0])).ravel() for offset in (75.0, 0.0))
        assert about[0] == pytest.approx(75.0 + plain[0], rel=1e-15)
        assert about[1:].tolist() == plain[1:].tolist()


def multisine(orders, amplitudes, phases, step=50e-6, points=20_000, offset=0.0, ramp=0.0):
    """Outputs of a multisine at a time."""
    out = functions(multisine_source(lines=len(orders), unit="m")).out
    values = [*amplitudes, *orders, *phases, step, points, offset, ramp]
    return lambda t: np.array(out(t, [], [], [], values)).ravel()


@pytest.mark.parametrize("late", [0, 1_000_000, 999_999_937])
def test_a_multisine_loses_no_digits_however_late(late):
    """At multiples of the step: phases by whole numbers, in 1e-13 of the amplitude."""
    orders, amplitudes, phases = np.array([1, 37, 1999]), np.array([1.0, 0.5, 0.25]), np.array([0.3, -1.0, 2.0])
    step, points = 50e-6, 20_000
    at = multisine(orders, amplitudes, phases, step, points)
    for n in late + np.array([0, 1, 777, 12_345]):
        turns = np.array([int(k) * int(n) % points for k in orders]) / points
        angle, omega = 2 * np.pi * turns + phases, 2 * np.pi * orders / (points * step)
        exact = [np.sum(amplitudes * np.imag((1j * omega) ** d * np.exp(1j * angle))) for d in range(4)]
        scale = [np.sum(amplitudes * omega**d) for d in range(4)]
        assert np.max(np.abs(at(n * step) - exact) / scale) < 1e-13
        assert np.array_equal(at(n * step), at((n + points) * step))


@pytest.mark.parametrize("ramp", [0.0, 1.5])
def test_rates_of_a_multisine_are_its_derivatives_also_in_the_ramp(ramp):
    at = multisine([3, 7, 20], [1e-3, 2e-3, 5e-4], [0.1, 2.0, -1.0], 1e-3, 1000, 0.25, ramp)
    omega, size = 2 * np.pi * 20, 3.5e-3
    for t in (0.2, 0.777123, 1.3, 9.1234567):
        h = 2e-4
        slope = (at(t - 2 * h) - 8 * at(t - h) + 8 * at(t + h) - at(t + 2 * h)) / (12 * h)
        for d in range(3):
            assert at(t)[d + 1] == pytest.approx(slope[d], abs=1e-6 * size * omega ** (d + 1))
    if ramp:
        assert at(0.0)[:2] == pytest.approx([0.25, 0], abs=1e-15)


def test_a_multisine_and_a_sampler_need_a_line_and_a_signal():
    with pytest.raises(ModelError, match="lines is 0"):
        multisine_source(lines=0)
    with pytest.raises(ModelError, match="units is empty"):
        sampler(units=[])


def test_a_sampler_holds_the_signals_of_its_tick():
    tick = functions(sampler(units=["m", "rad"])).tick
    _, held = tick(0, [], [], [0.25, -3.0], [1e-3])
    assert np.array(held).ravel().tolist() == [0.25, -3.0]
