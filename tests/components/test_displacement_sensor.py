"""Displacement sensors: steps, noise of a known spread, seeds, and a derivative that does not open the loop."""

import casadi as ca
import numpy as np
import pytest

from hfsa.components import ModelError
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.model import Kind
from hfsa.components.displacement_sensor import displacement_sensor

T = 1e-5
"""Interval of the noise [s]."""


def readings(value, times, axes: int = 2, **parameters) -> np.ndarray:
    """Readings of all axes of one value, (times, axes)."""
    model = displacement_sensor(axes=axes)
    start = {"interval": T, **parameters}
    p = [start.get(q.name, q.start) for q in model.of(Kind.PARAMETER)]
    out = functions(model).out
    empty = ca.DM(0, 1)
    return np.array([np.array(out(t, empty, empty, [v] * axes, p)).ravel()
                     for t, v in np.broadcast(times, value)])  # fmt: skip


def test_readings_are_the_nearest_steps():
    values = np.linspace(-2e-8, 2e-8, 401)
    found = readings(values, 5.5 * T, resolution=5e-9)[:, 0]
    assert found / 5e-9 == pytest.approx(np.round(found / 5e-9), abs=1e-9)
    assert np.abs(found - values).max() == pytest.approx(2.5e-9, rel=1e-6)
    assert len(set(np.round(found / 5e-9))) == 9
    assert np.array_equal(readings(values, 5.5 * T)[:, 0], values)


def test_noise_has_the_spread_that_is_asked_for_in_each_axis():
    """10^4 intervals: the mean of squares is within 5 of its standard deviations, and the axes do not correlate."""
    times = (np.arange(1, 10_001) + 0.5) * T
    found = readings(1e-6, times, noise=4.2e-9) - 1e-6
    assert found.std(axis=0) == pytest.approx(4.2e-9, rel=5 / np.sqrt(2e4))
    assert abs(np.corrcoef(found.T)[0, 1]) < 5 / 100
    assert abs(np.corrcoef(found[1:, 0], found[:-1, 0])[0, 1]) < 5 / 100


def test_noise_depends_on_interval_axis_and_seed_alone():
    times = np.arange(1, 200) * T
    one, later, other = (
        readings(0.0, t, noise=1e-9, seed=s) for t, s in ((times, 3), (times + 0.9 * T, 3), (times, 4))
    )
    assert np.array_equal(one, later)
    assert not np.any(one == other)
    assert not np.any(one[:, 0] == one[:, 1])


def test_the_first_interval_is_that_of_an_ideal_sensor():
    values = np.linspace(0, 3e-9, 7)
    assert np.array_equal(readings(values, 0.9 * T, resolution=5e-9, noise=1e-9)[:, 0], values)


@pytest.mark.parametrize("resolution", [0.0, 5e-9])
@pytest.mark.parametrize("time", [0.0, 7.3 * T])
def test_the_derivatives_are_the_mean_slope(resolution, time):
    """Forward and reverse, as an FMU offers them."""
    model = displacement_sensor(axes=2)
    found = functions(model)
    p = [{"resolution": resolution}.get(q.name, q.start) for q in model.of(Kind.PARAMETER)]
    n, empty = len(p), ca.DM(0, 1)
    at = (time, empty, empty, [1.23e-8, 1e-9], p)
    _, forward, _, _ = found.fwd(*at, 0, empty, empty, [1.0, 2.0], [0.0] * n)
    assert np.array(forward).ravel().tolist() == [1.0, 2.0]
    gradient = found.adj(*at, empty, [3.0, 4.0], empty, empty)[3]
    assert np.array(gradient).ravel().tolist() == [3.0, 4.0]


def test_no_axes_are_refused():
    with pytest.raises(ModelError, match="axes is 0, expected 1 or more"):
        displacement_sensor(axes=0)
