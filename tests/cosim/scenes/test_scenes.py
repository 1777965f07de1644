"""Every scene can be built and run; the numbers in each docstring are correct."""

import numpy as np
import pytest
from algorithm_groups import HELD

from hfsa.components import sdelta
from hfsa.components._mechanics.sdelta_geometry import Posture
from hfsa.cosim.assembly.build import build, instrument
from hfsa.cosim.assembly.load_scene import available_scenes, load_scene
from hfsa.cosim.linear.linearize import linear_response
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.masters.master import Master
from hfsa.cosim.systems.check import check
from hfsa.cosim.systems.connectors import connector
from hfsa.cosim.systems.scene_file import read_scene_text, scene_text

SCENES = pytest.mark.parametrize("name", list(available_scenes()))


@SCENES
def test_a_scene_fits_its_fmus(name, opened):
    scene = load_scene(name)
    variables = {name: i.fmu.variables for name, i in opened(build(scene.system).files).items()}
    check(scene.system, variables)
    for full in scene.inputs:
        found = connector(scene.system, variables, full)
        assert found.causality == "input"
        assert found.unit in scene.amplitude
        assert full not in {connection.end for connection in scene.system.connections}
    for full in scene.outputs:
        assert connector(scene.system, variables, full).causality == "output"
    assert read_scene_text(scene_text(scene)) == scene
    assert (available_scenes()[name].doc or "").endswith(".")


@SCENES
@pytest.mark.parametrize("algorithm", HELD)
def test_a_scene_runs_with_its_instruments_or_its_own_motion(name, opened, algorithm):
    scene = load_scene(name)
    system, starts = scene.system, {}
    if scene.inputs:
        system = instrument(scene, scene.inputs[-1])
        starts = {"source.frequency": scene.band[1], "lock_in.window": 100 * scene.step_size}
    master = make_master(opened(build(system).files), system, algorithm, scene.step_size)
    master.initialize(starts=starts)
    before = master.read(list(scene.outputs))
    master.advance(301)
    assert not scene.inputs or master.read(["lock_in.windows"])[0] == 3
    assert np.any(master.read(list(scene.outputs)) != before)
    assert not master.warnings


def peak(f: np.ndarray, response: np.ndarray) -> tuple[float, float]:
    """Frequency and decibels of the largest magnitude."""
    k = int(np.argmax(np.abs(response)))
    return f[k], 20 * np.log10(np.abs(response[k]))


def test_the_response_of_mass_on_spring(opened):
    scene = load_scene("mass_on_spring")
    f = np.linspace(*scene.band, 20_001)
    response = linear_response(scene.system, opened(build(scene.system).files), scene.inputs, scene.outputs, f)[:, 0, 0]
    frequency, decibels = peak(f, response)
    assert (round(frequency, 1), round(decibels)) == (15.9, 46)
    decade = np.abs(response[-1] / response[np.searchsorted(f, 50.0)])
    assert decade == pytest.approx(0.25, rel=0.1)  # -40 dB per decade: a quarter at twice the frequency


def test_the_response_of_sdelta_shaker(opened):
    scene = load_scene("sdelta_shaker")
    f = np.linspace(*scene.band, 4901)
    response = linear_response(scene.system, opened(build(scene.system).files), scene.inputs, scene.outputs, f)
    ratios = np.abs(np.einsum("fii->fi", response))
    np.testing.assert_allclose(ratios[0], 1.0, atol=2e-3)
    frequency, decibels = peak(f, response[:, 5, 5])
    assert (round(frequency, 1), round(decibels)) == (24.5, 34)
    frequency, _ = peak(f, response[:, 3, 3])
    assert round(frequency, 1) == 23.6
    above = f > 25.0
    assert round(f[above][np.argmin(ratios[above, 3])], 1) == 31.8
    assert np.abs(response[:, 1, 3]).max() > 100  # rad/m: it turns as well


def test_the_rate_and_acceleration_reach_the_reference():
    system = instrument(load_scene("sdelta_shaker"), "reference.command.position[3]")
    ends = [str(c) for c in system.connections if c.start.startswith("source.")]
    assert ends == [
        "source.value -> reference.command.position[3]",
        "source.rate -> reference.command.position_rate[3]",
        "source.acceleration -> reference.command.position_acceleration[3]",
        "source.sine -> lock_in.sine",
        "source.cosine -> lock_in.cosine",
    ]
    assert system["lock_in"].arguments["units"] == ("rad", "rad", "rad", "m", "m", "m")


def settled(opened, arguments: dict[str, object], name: str = "sdelta_hfsa", seconds: float = 3.0) -> Master:
    """The scene at rest under control, with the controller's own step."""
    scene = load_scene(name, arguments)
    master = make_master(opened(build(scene.system).files), scene.system, "gauss_seidel", 0.25e-3)
    master.initialize()
    master.advance(round(seconds / 0.25e-3))
    return master


def test_control_carries_the_weight_by_feed_forward(opened):
    """The springs alone sag by 0.412 mm; without the holding torque the motors give way as well, by 19 mm."""
    held = settled(opened, {"gravity": 9.81})
    assert held.read(["robot.platform.position[3]"])[0] == pytest.approx(-0.412e-3, abs=1e-6)
    torque = held.read([f"controller.axis[{i}].command" for i in range(1, 7)])
    assert torque == pytest.approx([0.458382] * 6, abs=1e-4)
    falling = settled(opened, {"gravity": 9.81, "controller.axis[1..6].feed_forward": 0})
    assert falling.read(["robot.platform.position[3]"])[0] == pytest.approx(-19.7e-3, abs=0.1e-3)


def test_control_begins_at_rest_in_any_posture(opened):
    """Motors count from the posture, so that nothing moves, not by a last digit, until something is commanded."""
    master = settled(opened, {"posture.rotation": "10,5,8", "posture.position": "0.005,0.003,0.155"}, seconds=0.1)
    angles = [f"drive[{j}].motor[{i}].angle" for j in (1, 2, 3) for i in (1, 2)]
    assert not np.any(master.read([*angles, *load_scene("sdelta_hfsa").outputs]))


def test_the_encoders_steps_are_those_of_the_absolute_angle(opened):
    """What is shown at a posture, and the angle there, make whole steps."""
    posture = {"posture.rotation": "10,5,8", "posture.position": "0.005,0.003,0.155"}
    master = settled(opened, {**posture, "encoder_resolution": 1e-3, "gravity": 9.81}, seconds=0.1)
    numbers = sdelta.analyze(posture=Posture((10, 5, 8), (0.005, 0.003, 0.155)))
    shown = master.read([f"drive[{j}].motor[{i}].angle" for j in (1, 2, 3) for i in (1, 2)])
    steps = (shown + numbers["motor_angles"]) / 1e-3
    assert steps == pytest.approx(np.round(steps), abs=1e-9)
    assert np.abs(shown / 1e-3 - np.round(shown / 1e-3)).max() > 0.1


def test_the_encoders_noise_is_heard_and_their_resolution_seen(opened):
    quiet = settled(opened, {"encoder_resolution": 1e-3, "gravity": 9.81}, seconds=0.1)
    steps = quiet.read(["drive[1].motor[1].angle"]) / 1e-3
    assert steps == pytest.approx(np.round(steps), abs=1e-9)
    noisy = settled(opened, {"encoder_noise": 1e-5}, seconds=0.1)
    assert 0 < np.abs(noisy.read(["robot.platform.position[3]"])[0]) < 1e-6
