"""The accelerometer on a shaker, on the robot and on the stage: formula, linearised and swept response are one."""

import re
from functools import cache

import numpy as np
import pytest

from hfsa.components import rrr_stage, tba_accelerometer
from hfsa.cosim import build
from hfsa.cosim._rig import Rig, Settings, Task
from hfsa.cosim._storage.records import Status
from hfsa.cosim.cli import main
from hfsa.cosim.linearize import linear_response
from hfsa.cosim.plots import bode_figure
from hfsa.cosim.results import read
from hfsa.cosim.stability import Cycle
from hfsa.cosim.sweep import Bench
from hfsa.cosim.system import Scene, check

DESIGNS = ("mems", "optimum", "rapid_prototype")
LEVELS = ("planar", "spatial", "nonlinear")
NATURAL = {"mems": 5818.9, "optimum": 881.0, "rapid_prototype": 251.86}
DAMPING = {"mems": 0.005, "optimum": 0.005, "rapid_prototype": 0.03}
DECIBELS, DEGREES = 0.05, 0.5
SENSOR = [f"sensor.acceleration_estimate[{i}]" for i in (1, 2)]
IDEAL = [f"ideal.acceleration_estimate[{i}]" for i in (1, 2)]
PLACE = [f"sensor.proof_mass.position[{i}]" for i in (1, 2, 3)]
X, Z = "reference.command.position[1]", "reference.command.position[3]"
VOLTS = "stack[1].command.voltage"


@cache
def scene(name: str, **arguments) -> Scene:
    return build.load_scene(name, arguments)


def linear(opened, at: Scene, inputs, outputs, frequency) -> np.ndarray:
    """Return (frequencies, outputs, inputs)."""
    return linear_response(at.system, opened(build.build(at.system)), inputs, outputs, np.atleast_1d(frequency))


def one_step(opened, at: Scene, excited: str, outputs, frequency, algorithm="gauss_seidel", step_size=None):
    """Return what a stepped sweep measures in the end, (frequencies, outputs)."""
    system = build.instrument(at, excited, outputs)
    cycle = Cycle(system, opened(build.build(system)), algorithm, source="source", lock_in="lock_in")
    return cycle.over(step_size or at.step_size).response(np.atleast_1d(frequency))


def swept(library, at: Scene, excited: str, outputs, frequency, step_size=None, amplitude=1.0):
    """Return the points of a stepped sweep."""
    system = build.instrument(at, excited, outputs)
    bench = Bench(system, build.build(system), tuple(outputs), library=library)
    settings = Settings(step_size=step_size or at.step_size, settling_tolerance=1e-4)
    rig = Rig(bench, settings)
    points = [rig.measure(Task(0, 0, bench, settings, float(f), amplitude)) for f in np.atleast_1d(frequency)]
    rig.close()
    return points


def responses(points) -> np.ndarray:
    assert {(point.status, point.message) for point in points} == {(Status.DONE, "")}
    return np.array([point.response for point in points])


def sensitivity(design: str, frequency) -> np.ndarray:
    """Return -Gamma / (M s^2 + D s + K) along x, y, z by the part's numbers, (frequencies, 3) [s2]."""
    found = tba_accelerometer.analyze(design=design)
    M, K = found["mass"], found["stiffness"]
    zeta = np.array([DAMPING[design]] * 2 + [0.03 if design == "rapid_prototype" else 0.02])
    s = 2j * np.pi * np.atleast_1d(frequency)[:, None]
    return -found["driven_mass"] / (M * s**2 + 2 * zeta * np.sqrt(K * M) * s + K)


def gain(design: str, frequency) -> np.ndarray:
    """Return the estimate by the true acceleration along x, (frequencies,)."""
    at = sensitivity(design, frequency)[:, 0]
    return at / sensitivity(design, 0.0)[0, 0]


def errors(found: np.ndarray, expected: np.ndarray) -> tuple[float, float]:
    """Return the largest difference in dB and in degrees."""
    ratio = found / expected
    return np.abs(20 * np.log10(np.abs(ratio))).max(), np.abs(np.degrees(np.angle(ratio))).max()


def assert_close(found, expected) -> None:
    decibels, degrees = errors(found, expected)
    assert decibels < DECIBELS
    assert degrees < DEGREES


def up_to_twice(design: str) -> np.ndarray:
    """Frequencies up to twice the natural one, close together at it [Hz]."""
    return NATURAL[design] * np.unique([*np.geomspace(0.01, 2, 12), *np.linspace(0.98, 1.02, 5)])


def shaken(axis: int) -> str:
    return f"sensor.base.acceleration[{axis}]"


def ahead(found: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Return by what phase a response leads the expected one [deg]."""
    return np.degrees(np.angle(found / expected))


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


# The shaker -----------------------------------------------------------------------------------------------------------


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
def test_the_shakers_step_costs_what_is_said(opened, design, cost):
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


def test_the_bode_plot_of_the_shaker_is_as_its_docstring_says(opened):
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
    assert capsys.readouterr().err == ""
    bode = read(path)
    assert [signal.name for signal in bode.inputs] == [shaken(1), shaken(2)]
    assert sorted(bode.marks.values()) == [250.34, 251.86, 255.0]
    figure = bode_figure([bode])
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels[-2:] == ["published: finite elements, 250.34 Hz", "published: vibration test, 255 Hz"]
    for k, output in enumerate(SENSOR):
        entry = bode.entry(output, shaken(k + 1))
        assert_close(entry, gain("rapid_prototype", bode.frequency))
        assert 251 < bode.frequency[np.abs(entry).argmax()] < 252.5


def test_a_displacement_beyond_the_travel_is_told(library, tmp_path, capsys):
    """At the resonance 5 um are reached at 65 m/s2: 100 times 7.66e-10 m per m/s2."""
    at = scene("accelerometer_shaker")
    points = [swept(library, at, shaken(1), SENSOR[:1], 5818.9, 2e-6, amplitude)[0] for amplitude in (60.0, 70.0)]
    assert [point.status for point in points] == [Status.DONE, Status.LIMITED]
    assert "sensor: saturated" in points[1].message
    words = ["--frequency", "5818.9", "--amplitude", "70", "--step", "2e-6", "--stop", "0.6"]
    assert main(["run", "accelerometer_shaker", *words, "-o", str(tmp_path / "run.h5")]) == 0
    told = capsys.readouterr()
    assert "sensor: saturated: saturated" in told.err
    assert "sensor.saturated: saturated" in told.out


# The robot ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["sdelta_accelerometer", "stage_accelerometer"])
def test_a_chain_has_no_algebraic_loop(opened, name):
    at = scene(name)
    check(at.system, {key: i.fmu.variables for key, i in opened(build.build(at.system)).items()})
    fed = {connection.start.partition(".")[0] for connection in at.system.connections}
    assert not fed & {"sensor", "ideal"}


def test_the_sensor_on_the_robot_shows_the_true_acceleration_as_on_the_shaker(opened):
    frequency = np.array([5.0, 20.0, 50.0, 250.0, 500.0])
    for design in ("mems", "rapid_prototype"):
        at = scene("sdelta_accelerometer", design=design)
        found = linear(opened, at, [X], [SENSOR[0], IDEAL[0]], frequency)[:, :, 0]
        assert_close(found[:, 0] / found[:, 1], gain(design, frequency))


def test_mounting_anywhere_is_rigid_body_kinematics(opened):
    """Q^T (a + w' x r) of the platform, for a rotation about a slanted axis and a lever in space."""
    turn = np.array([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3
    lever = np.array([0.02, -0.03, 0.04])
    words = {"mounting.rotation": ",".join(map(repr, turn.ravel().tolist())), "mounting.lever": "0.02,-0.03,0.04"}
    at = scene("sdelta_accelerometer", **words, **{"posture.position": "0.02,0,0.15"})
    moves = [f"robot.platform.{name}[{i}]" for name in ("acceleration", "angular_acceleration") for i in (1, 2, 3)]
    found = linear(opened, at, at.inputs, [*IDEAL, *moves], [5.0, 20.0, 45.0])
    acceleration, turning = found[:, 2:5], found[:, 5:]
    felt = acceleration + np.cross(turning, lever, axisa=1, axisc=1)
    expected = np.einsum("ji,fjk->fik", turn, felt)[:, :2]
    np.testing.assert_allclose(found[:, :2], expected, atol=1e-9 * np.abs(expected).max())


def test_the_bode_plot_of_the_sensor_on_the_robot_is_as_its_docstring_says(opened):
    at, f = scene("sdelta_accelerometer"), np.linspace(5, 50, 4501)
    assert at.band == (f[0], f[-1])
    names = [*SENSOR, "robot.platform.position[1]"]
    found = linear(opened, at, [X, at.inputs[2]], names, f)
    along, across, place = np.abs(found[:, :, 0]).T
    assert (f[along.argmax()], 1e-5 * along.max()) == pytest.approx((23.6, 5.2), rel=0.01)
    assert f[f > 25][along[f > 25].argmin()] == pytest.approx(31.8, abs=0.05)
    assert across.max() < 1e-9 * along.max()
    np.testing.assert_allclose(along, (2 * np.pi * f) ** 2 * place, rtol=1e-3)
    assert np.abs(found[:, 1, 1]).min() > 0  # the rotation about the vertical, through the lever arm
    off = scene("sdelta_accelerometer", **{"posture.position": "0.02,0,0.15"})
    along, across = np.abs(linear(opened, off, [X], SENSOR, [10.0, 20.0])[:, :, 0]).T
    assert 20 * np.log10(along / across) == pytest.approx([43, 5], abs=0.5)


def test_a_micrometre_at_50_hz_moves_the_mems_sensors_mass_by_75_picometres(opened, library):
    """0.098696 m/s2, whatever brings it about."""
    found = responses(swept(library, scene("accelerometer_shaker"), shaken(1), PLACE[:1], 50.0, 5e-6, 0.098696))
    assert abs(found[0, 0]) * 0.098696 == pytest.approx(7.5597e-11, rel=1e-4)
    for name, arguments, excited, moved in (
        ("sdelta_accelerometer", {}, X, "robot.platform.position[1]"),
        ("stage_accelerometer", {"stage": "jacobian"}, "stage.stack[1].elongation", "stage.platform.position[1]"),
    ):
        place, position = linear(opened, scene(name, **arguments), [excited], [PLACE[0], moved], 50.0)[0, :, 0]
        assert abs(place / position) * 1e-6 == pytest.approx(7.5597e-11, rel=1e-4)


# What a step costs in a chain -----------------------------------------------------------------------------------------


def test_a_step_costs_on_the_robot_what_is_said(opened):
    at, names = scene("sdelta_accelerometer"), [SENSOR[0], IDEAL[0], SENSOR[1]]
    frequency, turning = np.array([5.0, 10.0, 20.0, 30.0, 31.8, 50.0]), at.inputs[2]
    expected = linear(opened, at, [X, turning], names, frequency)
    first, second = (
        one_step(opened, at, X, names[:2], frequency, algorithm) for algorithm in ("gauss_seidel", "jacobi")
    )
    assert ahead(first[:, 0], expected[:, 0, 0]) == pytest.approx([0.9, 0.4, 0.1, -0.75, 0.57, 0.16], abs=0.03)
    lag = 180 * at.step_size * frequency
    quotients = (first[:, 0] / first[:, 1], expected[:, 0, 0] / expected[:, 1, 0])
    np.testing.assert_allclose(ahead(*quotients), -lag, atol=1e-3)
    decibels, degrees = errors((first + second)[:, 0] / 2, expected[:, 0, 0])
    assert decibels < 0.002
    assert degrees < 0.05
    turned = ahead(one_step(opened, at, turning, names[2:], frequency)[:, 0], expected[:, 2, 1])
    fast, omega = 2 * np.pi * 161.1, 2 * np.pi * frequency
    half = at.step_size * fast**2 / (2 * omega)
    assert turned[0] == pytest.approx(4.7, abs=0.05)
    np.testing.assert_allclose(turned, np.degrees(np.arctan(half)) - lag, atol=0.02)


@pytest.mark.parametrize(
    ("name", "excited", "frequency"),
    [("sdelta_accelerometer", X, [5.0, 20.0, 50.0]), ("stage_accelerometer", VOLTS, [100.0, 919.0, 3000.0])],
)
def test_algorithms_and_steps_agree_in_the_limit(opened, name, excited, frequency):
    """The error of each halves with the step; twice the half step's less the whole step's has none."""
    at = scene(name)
    expected = linear(opened, at, [excited], SENSOR[:1], frequency)[:, :, 0]
    for algorithm in ("gauss_seidel", "jacobi", "jacobi_plain"):
        whole, half = (
            one_step(opened, at, excited, SENSOR[:1], frequency, algorithm, at.step_size / n) for n in (1, 2)
        )
        ratio = (whole - expected) / (half - expected)
        np.testing.assert_allclose(ratio, 2, atol=0.15)
        assert max(errors(2 * half - whole, expected)) < 0.01


def test_with_robot_rigid_only_the_sensors_hold_remains(opened):
    at, frequency = scene("sdelta_accelerometer", robot="rigid"), np.array([5.0, 20.0, 50.0])
    names = [SENSOR[0], "robot.platform.position[1]"]
    expected = linear(opened, at, [X], names, frequency)[:, :, 0]
    np.testing.assert_allclose(expected[:, 0], -((2 * np.pi * frequency) ** 2) * gain("mems", frequency), rtol=1e-6)
    found = one_step(opened, at, X, names[:1], frequency)[:, 0]
    np.testing.assert_allclose(ahead(found, expected[:, 0]), -180 * at.step_size * frequency, atol=1e-3)


@pytest.mark.parametrize(
    ("name", "excited", "frequency", "step", "amplitude"),
    [
        ("sdelta_accelerometer", X, [20.0, 50.0], 1e-4, 1e-5),
        ("stage_accelerometer", VOLTS, [200.0, 919.0], 5e-6, 0.5),
    ],
)
def test_swept_in_a_chain_is_the_exact_one_step_response(library, opened, name, excited, frequency, step, amplitude):
    at = scene(name)
    found = responses(swept(library, at, excited, [SENSOR[0], IDEAL[0]], frequency, step, amplitude))
    expected = one_step(opened, at, excited, [SENSOR[0], IDEAL[0]], frequency, step_size=step)
    np.testing.assert_allclose(found, expected, rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "excited", "frequency"),
    [("sdelta_accelerometer", X, [5.0, 20.0, 23.59, 50.0]), ("stage_accelerometer", VOLTS, [200.0, 919.0, 3000.0])],
)
def test_swept_in_a_chain_with_the_scenes_step(library, opened, name, excited, frequency):
    at = scene(name)
    found = responses(
        swept(library, at, excited, SENSOR[:1], frequency, amplitude=at.amplitude["m" if excited == X else "V"])
    )
    expected = one_step(opened, at, excited, SENSOR[:1], frequency)
    np.testing.assert_allclose(found, expected, rtol=1e-3)
    assert errors(found, linear(opened, at, [excited], SENSOR[:1], frequency)[:, :, 0])[1] < 1.0


# The stage ------------------------------------------------------------------------------------------------------------


def test_the_bode_plot_of_the_sensor_on_the_stage_is_as_its_docstring_says(opened):
    at, f = scene("stage_accelerometer"), np.arange(100.0, 3000.5, 0.5)
    found = np.abs(linear(opened, at, [VOLTS], SENSOR, f))[:, :, 0]
    assert found[0] == pytest.approx([0.053, 0.073], rel=0.02)
    assert f[found.argmax(axis=0)] == pytest.approx([919, 919], abs=1)
    assert found.max(axis=0) == pytest.approx([37, 51], rel=0.01)
    for frequency in (2000, 2500, 3000):
        assert found[f == frequency][0] == pytest.approx([5.3, 7.3], rel=0.1)
    decade = linear(opened, at, [VOLTS], SENSOR[:1], [10.0, 100.0])[:, 0, 0]
    assert 20 * np.log10(abs(decade[1] / decade[0])) == pytest.approx(40, abs=0.2)
    beside = scene("stage_accelerometer", **{"mounting.lever": "0.02,0,0"})
    found = np.abs(linear(opened, beside, [VOLTS], SENSOR[1:], f))[:, 0, 0]
    assert (f[found.argmax()], found.max()) == pytest.approx((2384, 77), rel=0.01)


def test_by_elongation_the_stage_is_its_jacobian(opened):
    at, frequency = scene("stage_accelerometer", stage="jacobian"), np.array([100.0, 1000.0, 3000.0])
    found = linear(opened, at, at.inputs, SENSOR, frequency)
    J = rrr_stage.analyze()["jacobian"]
    expected = -((2 * np.pi * frequency[:, None, None]) ** 2) * J[:2]
    np.testing.assert_allclose(found, expected * gain("mems", frequency)[:, None, None], rtol=1e-6)


def test_a_step_costs_on_the_stage_what_is_said(opened):
    at, frequency = scene("stage_accelerometer"), np.array([100.0, 200.0, 500.0, 919.0, 2000.0, 3000.0])
    names = [SENSOR[0], IDEAL[0]]
    expected = linear(opened, at, [VOLTS], names, frequency)[:, :, 0]
    found = one_step(opened, at, VOLTS, names, frequency)
    behind = -ahead(found[:, 0], expected[:, 0])
    assert behind[:3] == pytest.approx([1.5, 0.7, 0.3], abs=0.05)
    assert np.abs(behind[2:]).max() < 0.3
    lead = ahead(found[:, 0] / found[:, 1], expected[:, 0] / expected[:, 1])
    np.testing.assert_allclose(lead, -180 * at.step_size * frequency, atol=2e-3)


# Bad input ------------------------------------------------------------------------------------------------------------

ROTATION = "mounting.rotation=1,0,0,0,0.9,0,0,0,1"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["accelerometer_shaker", "-p", "design=mens"], "mems"),
        (["accelerometer_shaker", "-p", "sensor=spatal"], "spatial"),
        (["accelerometer_shaker", "-p", "angle=nan"], "angle is nan deg, expected a number"),
        (["accelerometer_shaker", "-p", "sensor.dimensions.s=1e-3"], "the frame must be larger than the proof mass"),
        (
            ["accelerometer_shaker", "-p", "sensor.dimensions.tm=-1e-6"],
            "expected a number above 0; the design has 2e-05",
        ),
        (["sdelta_accelerometer", "-p", ROTATION], "no rotation.*the nearest is 1,0,0,0,1,0,0,0,1"),
        (["stage_accelerometer", "-p", "mounting.rotation=1,0,0,0,1,0,0,0,-1"], "is a reflection"),
        (["stage_accelerometer", "-p", "bias=200"], "stage_accelerometer: bias is 200 V, expected 0 to 150 V"),
    ],
)
def test_bad_input_is_wrong_usage_and_told(words, told, capsys):
    assert main(["sweep", *words, "--method", "linear", "-o", "unused.h5"]) == 2
    assert re.search(told, capsys.readouterr().err)
