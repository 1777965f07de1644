"""The accelerometer on a shaker: formula, linearised and swept response agree."""

import numpy as np
import pytest
from accelerometer_by_hand import NATURAL, PLACE, SENSOR, gain, sensitivity, shaken
from scene_responses import ahead, assert_close, errors, linear, one_step, responses, scene, swept

from hfsa.cosim.cli import main
from hfsa.cosim.figures.bode import bode_figure
from hfsa.cosim.results.files import read_sweep
from hfsa.cosim.results.records import Status

DESIGNS = ("mems", "optimum", "rapid_prototype")
LEVELS = ("planar", "spatial", "nonlinear")
CHEAP = {("mems", "spatial"), ("optimum", "spatial"), ("rapid_prototype", "spatial")}
"""One level of each design."""
EVERY = pytest.mark.parametrize(
    ("design", "level"),
    [
        pytest.param(d, level, marks=() if (d, level) in CHEAP else pytest.mark.slow)
        for d in DESIGNS
        for level in LEVELS
    ],
)


def up_to_twice(design: str) -> np.ndarray:
    """Frequencies up to twice the natural one, close together at it [Hz]."""
    return NATURAL[design] * np.unique([*np.geomspace(0.01, 2, 12), *np.linspace(0.98, 1.02, 5)])


@EVERY
def test_on_the_shaker_linearized_is_the_formula_at_every_level(opened, design, level):
    frequency = up_to_twice(design)
    axes = range(2 if level == "planar" else 3)
    found = linear(
        opened,
        scene("accelerometer_shaker", design=design, sensor=level),
        [shaken(i + 1) for i in axes],
        [PLACE[i] for i in axes],
        frequency,
    )
    expected = sensitivity(design, frequency)
    for i in axes:
        assert_close(found[:, i, i], expected[:, i])
        others = np.delete(found[:, i], i, axis=1)
        assert np.abs(others).max() < 1e-9 * np.abs(expected).max()


@pytest.mark.parametrize(("design", "cost"), [("mems", 0.42), ("optimum", 0.32), ("rapid_prototype", 0.45)])
def test_the_shakers_step_has_the_documented_error(opened, design, cost):
    """180 H f degrees, a lead or a lag; up to twice the natural frequency that is within the limits."""
    at, frequency = scene("accelerometer_shaker", design=design), up_to_twice(design)
    expected = gain(design, frequency)
    for algorithm, sign in (("gauss_seidel", 1), ("jacobi", -1), ("jacobi_plain", -1)):
        found = one_step(opened, at, shaken(1), SENSOR[:1], frequency, algorithm)[:, 0]
        assert_close(found, expected)
        turn = ahead(found, expected)
        np.testing.assert_allclose(turn, sign * 180 * at.step_size * frequency, atol=0.01)
        assert abs(turn[-1]) == pytest.approx(cost, abs=0.01)
        assert errors(found, expected)[0] < 0.01
    assert at.band[1] == pytest.approx(2 * NATURAL[design], rel=0.01)


@pytest.mark.parametrize(
    ("design", "level", "frequency"),
    [
        ("rapid_prototype", "spatial", [10.0, 251.86, 500.0]),
        ("optimum", "spatial", [881.0]),
        ("mems", "spatial", [11.6e3]),
    ],
)
def test_swept_on_the_shaker_is_the_formula(library, design, level, frequency):
    at = scene("accelerometer_shaker", design=design, sensor=level)
    found = responses(swept(library, at, shaken(2), [PLACE[1]], frequency))
    assert_close(found[:, 0], sensitivity(design, frequency)[:, 1])


@pytest.mark.slow
@pytest.mark.parametrize("design", DESIGNS)
@pytest.mark.parametrize("level", LEVELS)
def test_all_swept_on_the_shaker_is_the_formula(library, design, level):
    at, frequency = scene("accelerometer_shaker", design=design, sensor=level), NATURAL[design] * np.array([0.1, 1, 2])
    for axis in (1,) if level == "nonlinear" else (1, 2):  # a minute for a point of the smallest
        found = responses(swept(library, at, shaken(axis), [PLACE[axis - 1]], frequency))
        assert_close(found[:, 0], sensitivity(design, frequency)[:, axis - 1])


def test_with_any_step_swept_is_the_exact_one_step_response(library, opened):
    """Ten steps in a period, far beyond what is accurate: what is measured is still what the algorithm makes of it."""
    at, frequency, step = scene("accelerometer_shaker", design="rapid_prototype"), [100.0, 250.0, 1000.0], 1e-4
    found = responses(swept(library, at, shaken(1), SENSOR[:1], frequency, step))
    expected = one_step(opened, at, shaken(1), SENSOR[:1], frequency, step_size=step)
    np.testing.assert_allclose(found, expected, rtol=2e-4)
    assert errors(found[:, 0], gain("rapid_prototype", frequency))[1] > 15


def test_the_bode_plot_of_the_shaker_is_as_documented(opened):
    for design, peak, height in (("mems", 5818.9, 40), ("optimum", 881.0, 40), ("rapid_prototype", 251.6, 24)):
        f = np.linspace(0.9, 1.1, 8001) * NATURAL[design]
        found = linear(opened, scene("accelerometer_shaker", design=design), [shaken(1)], SENSOR[:1], [1.0, *f])[
            :, 0, 0
        ]
        assert abs(found[0]) == pytest.approx(1, abs=1e-4)
        curve = np.abs(found[1:])
        assert f[curve.argmax()] == pytest.approx(peak, abs=0.1 if peak < 1000 else 1)
        assert 20 * np.log10(curve.max()) == pytest.approx(height, abs=0.5)
        quarter = np.interp(np.pi / 2, -np.unwrap(np.angle(found[1:])), f)
        assert quarter == pytest.approx(NATURAL[design], rel=1e-4)
    z = np.linspace(12e3, 14e3, 4001)
    found = np.abs(linear(opened, scene("accelerometer_shaker"), [shaken(3)], PLACE[2:], [1.0, *z])[:, 0, 0])
    assert z[found[1:].argmax()] == pytest.approx(13063.9, rel=1e-3)
    assert 20 * np.log10(found.max() / found[0]) == pytest.approx(28, abs=0.5)


def test_a_turned_sensor_shows_the_two_orientations_on_its_axes(opened):
    f = np.array([10.0, 251.86])
    found = linear(
        opened, scene("accelerometer_shaker", design="rapid_prototype", angle=30.0), [shaken(1), shaken(2)], SENSOR, f
    )
    c, s = np.cos(np.pi / 6), 0.5
    expected = gain("rapid_prototype", f)[:, None, None] * [[c, s], [-s, c]]
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_the_published_vibration_test_on_the_command_line(tmp_path, capsys):
    path = tmp_path / "test.h5"
    words = ["-p", "design=rapid_prototype", "--from", "10", "--to", "300", "--points", "4", "-j", "1", "-o", str(path)]
    assert main(["sweep", "accelerometer_shaker", *words]) == 0
    assert main(["bode", str(path)]) == 0
    left_out = "sensor: 2 of 6 states and 5 outputs reach nothing observed and are left out; --keep all keeps them"
    assert capsys.readouterr().err == f"hfsa: {left_out}\n"
    bode = read_sweep(path)
    assert [signal.name for signal in bode.inputs] == [shaken(1), shaken(2)]
    assert sorted(bode.marks.values()) == [250.34, 251.86, 255.0]
    figure = bode_figure([bode])
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels[-2:] == ["published: finite elements, 250.34 Hz", "published: vibration test, 255 Hz"]
    for k, output in enumerate(SENSOR):
        entry = bode.entry(output, shaken(k + 1))
        assert_close(entry, gain("rapid_prototype", bode.frequency))
        assert 251 < bode.frequency[np.abs(entry).argmax()] < 252.5


def test_a_displacement_beyond_the_travel_is_reported(library, tmp_path, capsys):
    """At the resonance 5 um are reached at 65 m/s2: 100 times 7.66e-10 m per m/s2."""
    at = scene("accelerometer_shaker")
    points = [swept(library, at, shaken(1), SENSOR[:1], 5818.9, 2e-6, amplitude)[0] for amplitude in (60.0, 70.0)]
    assert [point.status for point in points] == [Status.DONE, Status.LIMITED]
    assert "sensor: saturated" in points[1].message
    words = ["--frequency", "5818.9", "--amplitude", "70", "--step", "2e-6", "--stop", "0.6"]
    assert main(["run", "accelerometer_shaker", *words, "-o", str(tmp_path / "run.h5")]) == 0
    captured = capsys.readouterr()
    assert "sensor: saturated: saturated" in captured.err
    assert "sensor.saturated: saturated" in captured.out
