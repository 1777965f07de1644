"""Driving signals: exact derivatives, two limits at a jump, spectra, tables, refusals."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hfsa.cosim.signals.drive import Function
from hfsa.cosim.signals.shapes import Chirp, Ramp, Sine, Step
from hfsa.cosim.signals.sums import Multisine, Noise
from hfsa.cosim.signals.table import Table, table

SMOOTH = {
    "ramp": Ramp(2.0, 0.5, -1.0, duration=9.0),
    "sine": Sine(2.0, 0.5, -1.0, frequency=3.0, phase=0.4),
    "chirp": Chirp(2.0, 0.5, -1.0, from_=1.0, to=9.0, duration=4.0),
    "falling": Chirp(2.0, 0.5, -1.0, from_=9.0, to=1.0, duration=4.0),
    "logarithmic": Chirp(2.0, 0.5, -1.0, from_=1.0, to=9.0, duration=4.0, sweep="logarithmic"),
    "multisine": Multisine(0.3, 0.1, 1.0, 9.0, 7, seed=3),
    "noise": Noise(0.5, 0.1, bandwidth=9.0, period=3.0),
    "table": table([[0, 1.0], [0.7, 2.0], [1.1, -1.0], [2.0, 0.0]], "smooth"),
}
TIMES = np.array([0.05, 0.311, 0.6, 0.95, 1.4, 1.9])


@pytest.mark.parametrize("name", SMOOTH)
@pytest.mark.parametrize("order", [1, 2, 3])
def test_derivatives_are_those_of_the_value(name, order):
    """By differences of the derivative before."""
    h, signal = 1e-6, SMOOTH[name]
    ahead, behind = (signal.derivatives(TIMES + side * h)[order - 1] for side in (1, -1))
    found = signal.derivatives(TIMES)[order]
    assert np.allclose(found, (ahead - behind) / (2 * h), rtol=1e-6, atol=1e-6 * max(1.0, np.abs(found).max()))


@pytest.mark.parametrize("sweep", ["linear", "logarithmic"])
def test_a_chirp_ends_at_its_last_frequency(sweep):
    """The rate at the zeros of the sine is the amplitude times the angular frequency."""
    chirp = Chirp(1.0, from_=2.0, to=50.0, duration=3.0, sweep=sweep)
    for time, frequency in ((0.0, 2.0), (3.0, 50.0)):
        value, rate, *_ = chirp.derivatives(np.array([time]), -1e-9 * time)[:, 0]
        assert np.hypot(value, rate / (2 * np.pi * frequency)) == pytest.approx(1.0, rel=1e-6)
    assert np.array_equal(chirp.derivatives(np.array([4.0]))[1:], np.zeros((3, 1)))


def test_a_step_has_two_limits_at_its_jump():
    """Also where the time is rounded."""
    step, at = Step(2.0, 1.0, start=0.3), np.array([3 * 0.1])
    assert step.derivatives(at, 1e-9)[0] == 3.0
    assert step.derivatives(at, -1e-9)[0] == 1.0
    assert np.array_equal(step.breaks(0, 1), [0.3])
    assert not len(step.breaks(0.3, 1))


def test_noise_has_its_rms_and_nothing_beyond_its_bandwidth():
    """By the spectrum of one period; the same seed gives the same noise."""
    noise = Noise(rms=0.2, bandwidth=40.0, period=5.0, seed=7)
    values = noise.derivatives(np.arange(5000) / 1000)[0]
    assert np.sqrt(np.mean(values**2)) == pytest.approx(0.2, rel=1e-5)
    lines = np.abs(np.fft.rfft(values)) / 5000
    assert lines[201:].max() < 1e-5 * lines[1:201].max()
    assert np.allclose(lines[1:201], lines[1], rtol=1e-4)
    assert np.array_equal(
        values, Noise(rms=0.2, bandwidth=40.0, period=5.0, seed=7).derivatives(np.arange(5000) / 1000)[0]
    )
    assert noise.remarks(0, 5) == []
    assert "repeats after 5 s" in noise.remarks(0, 6)[0]


def test_a_multisine_has_its_lines_alone():
    """Each of the amplitude."""
    found = Multisine(0.3, 0.0, 2.0, 8.0, 3).derivatives(np.arange(2000) / 1000)[0]
    lines = 2 * np.abs(np.fft.rfft(found)) / 2000
    assert np.allclose(lines[[4, 8, 16]], 0.3)
    assert np.delete(lines, [4, 8, 16]).max() < 1e-12


rows = st.lists(st.tuples(st.floats(1e-3, 1), st.floats(-10, 10)), min_size=2, max_size=12)


@given(rows, st.lists(st.floats(-1, 12), min_size=1, max_size=20))
def test_tables_pass_through_their_rows(given_rows, others):
    """Held and linear as numpy has them; smooth through every row, at rest at both ends; constant outside."""
    time, values = np.cumsum([gap for gap, _ in given_rows]), np.array([value for _, value in given_rows])
    at = np.array(others)
    linear, held, smooth = (Table(time, values, way) for way in ("linear", "held", "smooth"))
    assert np.allclose(linear.derivatives(at)[0], np.interp(at, time, values), atol=1e-9)
    before = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 1)
    assert np.array_equal(held.derivatives(at)[0], values[before])
    for signal in (linear, held, smooth):
        assert np.allclose(signal.derivatives(time)[0], values, atol=1e-9)
        assert np.array_equal(signal.derivatives(time[[0, -1]] + [-1, 1])[:, :], [values[[0, -1]], *np.zeros((3, 2))])
    assert np.allclose(smooth.derivatives(time[[0, -1]], np.array([1e-12, -1e-12]))[1], 0, atol=1e-5)


@pytest.mark.parametrize(
    ("time", "values", "words"),
    [
        ([0, 1, 1], [1, 2, 3], "row 3: time is 1 s after 1 s"),
        ([0, 1, 0.5], [1, 2, 3], "row 3: time is 0.5 s after 1 s"),
        ([0, 1], [1, np.nan], "row 2: value is nan"),
        ([0, np.inf], [1, 2], "row 2: time is inf"),
        ([0], [1], "has 1 rows, expected 2 or more"),
        ([0, 1], [1, 2, 3], "one value for each time"),
    ],
    ids=["equal", "falling", "nan", "infinite", "one-row", "lengths"],
)
def test_bad_tables_are_refused(time, values, words):
    """With the row."""
    with pytest.raises(ValueError, match=words):
        Table(np.array(time, float), np.array(values, float))


def test_a_table_says_where_it_is_held():
    """Before its first row, and after its last one."""
    found = table([[1, 5.0], [2, 7.0]])
    assert found.remarks(0, 3) == ["a table is held at its ends: 5 before 1 s and 7 after 2 s"]
    assert found.remarks(1, 2) == []


@pytest.mark.parametrize(
    "make",
    [
        lambda: Sine(frequency=0.0),
        lambda: Sine(amplitude=np.nan),
        lambda: Ramp(duration=-1.0),
        lambda: Chirp(from_=0.0),
        lambda: Multisine(from_=5.0, to=5.0),
        lambda: Multisine(lines=1),
        lambda: Noise(bandwidth=0.01, period=1.0),
        lambda: Noise(bandwidth=1e9, period=1e3),
        lambda: Function(lambda t: "x"),
        lambda: Function(lambda t: [1.0] * 5),
        lambda: Function(lambda t: 1 / 0),
    ],
    ids=["frequency", "nan", "duration", "from", "band", "lines", "no-line", "many-lines", "text", "five", "raises"],
)
def test_impossible_signals_are_refused(make):
    """With the number."""
    with pytest.raises(ValueError, match=r"expected|no line|ZeroDivisionError"):
        make()


def test_a_function_may_return_derivatives():
    """As many as it knows."""
    found = Function(lambda t: (t**2, 2 * t))
    assert found.known == 1
    assert np.array_equal(found.derivatives(np.array([3.0]))[:2, 0], [9.0, 6.0])
    assert Function(lambda t: t).known == 0
