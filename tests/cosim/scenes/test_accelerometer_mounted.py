"""The accelerometer on the robot and on the stage: its estimates, and refused mountings."""

import re

import numpy as np
import pytest
from accelerometer_by_hand import IDEAL, PLACE, SENSOR, VOLTS, X, gain, shaken
from scene_responses import assert_close, linear, responses, scene, swept

from hfsa.components import rrr_stage
from hfsa.cosim.assembly import build
from hfsa.cosim.cli import main
from hfsa.cosim.systems.check import check

# The robot ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["sdelta_accelerometer", "stage_accelerometer"])
def test_a_chain_has_no_algebraic_loop(opened, name):
    at = scene(name)
    check(at.system, {key: i.fmu.variables for key, i in opened(build.build(at.system).files).items()})
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


def test_the_bode_plot_of_the_sensor_on_the_robot_is_as_documented(opened):
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


# The stage ------------------------------------------------------------------------------------------------------------


def test_the_bode_plot_of_the_sensor_on_the_stage_is_as_documented(opened):
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


# Bad input ------------------------------------------------------------------------------------------------------------

ROTATION = "mounting.rotation=1,0,0,0,0.9,0,0,0,1"


@pytest.mark.parametrize(
    ("words", "message"),
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
def test_bad_input_is_wrong_usage_with_a_message(words, message, capsys):
    assert main(["sweep", *words, "--method", "linear", "-o", "unused.h5"]) == 2
    assert re.search(message, capsys.readouterr().err)
