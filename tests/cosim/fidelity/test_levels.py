"""Level auto: the cheapest level within the tolerance, its reference, and impossible choices."""

import json
from dataclasses import replace

import h5py
import numpy as np
import pytest
from conftest import PARTS

from hfsa.components import tba_accelerometer
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.cli import main
from hfsa.cosim.fidelity import levels
from hfsa.cosim.fidelity.level_error import reference_of
from hfsa.cosim.signals.response_scale import fill_valleys
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, Connection, System

ACCELERATION, POSITION = "sensor.base.acceleration[{}]", "sensor.proof_mass.position[{}]"
SENSOR = tba_accelerometer.analyze()
NATURAL, ONE_PERCENT = SENSOR["natural_frequencies_hz"][0], SENSOR["bandwidth_hz"][0]
DAMPING_RATIO = 0.005
PROTOTYPE = Component("sensor", "tba_accelerometer", "auto", {"design": "rapid_prototype"})


def sensor_scene(axes="1", band=(200.0, 500.0), tolerance=0.01, amplitude=1.0, step_size=2e-5) -> Scene:
    """The accelerometer alone, shaken along some axes, displacements along the same axes recorded."""
    return Scene(
        System([Component("sensor", "tba_accelerometer", "auto")]),
        inputs=[ACCELERATION.format(axes)],
        outputs=[POSITION.format(axes)],
        band=band,
        amplitude={"m/s2": amplitude},
        tolerance=tolerance,
        step_size=step_size,
        stop_time=0.05,
    )


def static_error(frequency: float) -> float:
    """Error of a gain in place of a mass on a spring, |1 - (1 - r^2 + 2 i zeta r)|."""
    r = frequency / NATURAL
    return abs(r**2 - 2j * DAMPING_RATIO * r)


# The choice -----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_an_accelerometer_is_a_gain_inside_its_one_percent_band(library):
    assert pytest.approx(579, abs=1) == ONE_PERCENT
    choice = levels.choose(sensor_scene(band=(200.0, 570.0)), library)["sensor"]
    assert choice.level == "static"
    assert choice.error == pytest.approx(static_error(570.0), rel=1e-3)
    assert list(choice.errors) == ["static", "planar", "spatial", "nonlinear"]
    assert choice.errors["planar"] < 1e-6
    assert choice.errors["nonlinear"] == 0
    assert choice.together == choice.error


@pytest.mark.slow
def test_it_has_a_mass_above_that_band(library):
    choice = levels.choose(sensor_scene(band=(200.0, 3000.0)), library)["sensor"]
    assert choice.level == "planar"
    assert choice.errors["static"] == pytest.approx(static_error(3000.0), rel=1e-3)


@pytest.mark.slow
def test_it_moves_out_of_its_plane_where_that_is_recorded(library):
    choice = levels.choose(sensor_scene("1..3"), library)["sensor"]
    assert choice.level == "spatial"
    assert choice.errors["static"] == choice.errors["planar"] == 1  # does not move where the reference does


def test_an_output_that_a_level_does_not_have_counts_although_nothing_moves_it(library):
    """A sensor shaken in its plane stays there; to record motion out of it a scene needs a level with that output."""
    scene = replace(sensor_scene(), outputs=[POSITION.format("1"), POSITION.format("3")])
    choice = levels.choose(scene, library)["sensor"]
    assert choice.level == "spatial"
    assert choice.errors["static"] == choice.errors["planar"] == 1


@pytest.mark.slow
def test_what_the_amplitude_adds_is_part_of_the_error(library):
    scene = replace(sensor_scene(band=(15.0, 20.0), step_size=2e-4), system=System([PROTOTYPE]))
    tiny, small, large = (
        levels.choose(replace(scene, amplitude={"m/s2": amplitude}), library)["sensor"].errors["planar"]
        for amplitude in (0.1, 40.0, 400.0)
    )
    assert tiny < 1e-12  # not worth a co-simulation
    assert 1e-4 < large < 1e-3
    assert large / small == pytest.approx(10, rel=0.02)  # a second harmonic, relative to the first


@pytest.mark.slow
def test_a_rigid_robot_will_do_far_below_its_resonance(library):
    position = {"inputs": ["reference.command.position[3]"], "outputs": ["robot.platform.position[3]"]}
    scene = replace(load_scene("sdelta_shaker", {"robot.level": "auto"}), **position)
    low = levels.choose(replace(scene, band=(0.1, 1.0), tolerance=0.002), library)["robot"]
    assert low.level == "rigid"
    assert low.error == pytest.approx((1.0 / 24.54) ** 2, rel=0.02)
    assert levels.choose(replace(scene, band=(0.1, 2.0), tolerance=0.002), library)["robot"].level == "cartesian"
    assert levels.with_chosen(scene, {"robot": low}).system["robot"].level == "rigid"


@pytest.mark.slow
def test_a_level_that_does_not_fit_its_neighbours_takes_no_part(library):
    choice = levels.choose(load_scene("sdelta_hfsa", {"robot.level": "auto"}), library)["robot"]
    assert choice.level == "cartesian"
    assert "held inertial reaction diverges" in choice.refusals["rigid"]
    assert np.isnan(choice.errors["rigid"])


@pytest.mark.slow
def test_start_values_that_a_level_leaves_out_and_outputs_that_it_lacks(library):
    off = {"hysteresis.amplitude": "0", "creep[1..2].gain": "0"}
    arguments = {"stack[1].level": "auto"} | {f"stack[1].{name}": value for name, value in off.items()}
    scene = replace(load_scene("stage_bode", arguments), inputs=["stack[1].command.voltage"], tolerance=0.02)
    choice = levels.choose(replace(scene, band=(100.0, 1000.0), step_size=2e-5), library)["stack[1]"]
    assert choice.level == "linear"  # which `hysteretic` without hysteresis is
    assert choice.error < 1e-9
    assert choice.errors["static"] > 0.1
    assert "amplifier.resistance" in levels.with_chosen(scene, {"stack[1]": choice}).system["stack[1]"].start
    recorded = replace(scene, band=(1.0, 20.0), outputs=["stage.stack[1].force"], tolerance=0.02)
    stage = replace(recorded.system["stage"], level="auto")
    system = System([stage, *recorded.system.components[1:]], recorded.system.connections)
    named = levels.with_chosen(replace(recorded, system=system), {"stack[1]": choice})
    found = levels.choose(named, library)["stage"]
    assert found.level == PARTS["rrr_stage"].ladder[-1]  # bodies give as well as necks
    assert found.errors["flexible_hinges"] < found.errors["constant_jacobian"]
    assert found.errors["constant_jacobian"] > 0.02
    assert found.errors["jacobian"] == 1
    assert found.refusals["jacobian"] == "it has no stack[1].force"


def test_two_choices_that_are_too_much_together(library):
    chain = System(
        [Component("first", "tba_accelerometer", "auto"), Component("second", "tba_accelerometer", "auto")],
        [Connection("first.acceleration_estimate[1]", "second.base.acceleration[1]")],
    )
    ends = {"inputs": ["first.base.acceleration[1]"], "outputs": ["second.proof_mass.position[1]"]}
    scene = replace(sensor_scene(band=(400.0, 500.0)), system=chain, **ends)
    error = static_error(500.0)
    both = levels.choose(replace(scene, tolerance=2.2 * error), library)
    assert [choice.level for choice in both.values()] == ["static", "static"]
    assert both["first"].together == pytest.approx(2 * error, rel=0.01)
    assert both["first"].error == pytest.approx(error, rel=0.01)
    one = levels.choose(replace(scene, tolerance=1.8 * error), library)
    assert sorted(choice.level for choice in one.values()) == ["planar", "static"]
    assert one["first"].together == pytest.approx(error, rel=0.01)


@pytest.mark.slow
def test_a_motion_of_its_own(library):
    source = Component("shaker", "sine_source", None, {"unit": "m/s2"}, {"frequency": 10.0, "amplitude": 1.0})
    system = System([source, PROTOTYPE], [Connection("shaker.value", ACCELERATION.format(1))])
    outputs = [POSITION.format(axis) for axis in (1, 3)]  # the third does not move
    moving = replace(sensor_scene(step_size=1e-4), system=system, inputs=[], outputs=outputs, stop_time=0.7)
    choice = levels.choose(moving, library)["sensor"]
    assert choice.level == "static"
    # a mass on a spring with its damping; `auto` lets the input move over a step, so that it is not ahead
    late = 2 * np.pi * 10 * 2 * 0.0316 / (2 * np.pi * 251.9)
    assert choice.error == pytest.approx(abs((10 / 251.9) ** 2 - 1j * late), rel=0.1)
    assert levels.choose(replace(moving, tolerance=1e-3), library)["sensor"].level == "planar"


def test_what_was_measured_is_not_measured_again(library, monkeypatch):
    scene = sensor_scene(band=(200.0, 570.0))
    before = levels.choose(scene, library)
    monkeypatch.delattr(levels, "_LevelChoices")
    assert levels.choose(scene, library) == before
    with pytest.raises(NameError):
        levels.choose(replace(scene, tolerance=0.011), library)
    assert levels.choose(levels.with_chosen(scene, before), library) == {}


# What an error is relative to -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("points", [60, 61, 400])
def test_slopes_and_resonances_stay_and_notches_are_filled(points):
    f = np.geomspace(1.0, 1000.0, points)
    curves = {
        "slope": f**-2.0,
        "rise": f**3,
        "resonance": np.abs(1 / (1 - (f / 100) ** 2 + 0.02j * f / 100)),
    }
    for size in curves.values():
        np.testing.assert_allclose(fill_valleys(size[:, None], f)[:, 0], size, rtol=1e-12)
    notch = np.abs(1 - (f / 100) ** 2 + 0.001j)
    full = fill_valleys(notch[:, None], f)[:, 0]
    assert full[np.abs(f - 100).argmin()] == pytest.approx(0.59, abs=0.1)  # where an octave about it begins and ends
    np.testing.assert_allclose(full[(f < 60) | (f > 160)], notch[(f < 60) | (f > 160)])


def test_a_zero_that_moves_a_little_is_a_little_wrong(library):
    """The robot's antiresonance at 31.8 Hz, with another damping: at the zero itself, |H| is almost all damping."""
    horizontal = {"inputs": ["reference.command.position[1]"], "outputs": ["robot.platform.position[1]"]}
    scene = replace(load_scene("sdelta_shaker"), band=(30.0, 34.0), **horizontal)
    reference = reference_of(scene, library)
    robot = replace(scene.system["robot"], start={"damping_ratio": 0.011})
    other = System([scene.system["reference"], robot], scene.system.connections)
    assert reference.error(scene.system) == 0
    assert 1e-3 < reference.error(other) < 0.05


# What cannot be chosen ------------------------------------------------------------------------------------------------


def test_parts_without_levels(foreign, library):
    scene = load_scene("mass_on_spring", {"mass.level": "auto"})
    with pytest.raises(StructureError, match="mass: mass_on_spring has no levels to choose from"):
        levels.choose(scene, library)
    strange = replace(sensor_scene(), system=System([Component("sensor", str(foreign[2]), "auto")]))
    with pytest.raises(StructureError, match=r"Foreign\.fmu has no levels"):
        levels.at_highest(strange)


def test_scenes_without_an_answer_to_compare_with(foreign, library):
    scene = sensor_scene()
    components = [*scene.system.components, Component("other", str(foreign[2]))]
    silent = replace(scene, system=System(components), outputs=["other.y"])
    with pytest.raises(StructureError, match=r"no response: other: .*derivatives.*; name the levels \(sensor: static"):
        levels.choose(silent, library)
    with pytest.raises(StructureError, match="no output of the scene moves"):
        levels.choose(replace(scene, outputs=[POSITION.format(2)]), library)


# On the command line --------------------------------------------------------------------------------------------------


LINEAR = ["-p", "reference.level=linear"]
"""Tubes that follow a linear reference, at which the robot's level `nonlinear` is no candidate."""
CHOICE = ["-p", "robot.level=auto", *LINEAR, "--input", "command.position[3]", "--tolerance", "0.01"]


def test_a_sweep_reports_and_stores_its_choice(tmp_path, capsys):
    path = tmp_path / "sweep.h5"
    words = [*CHOICE, "--signal", "platform.position[3]", "--to", "2", "--from", "0.5", "--method", "linear"]
    assert main(["sweep", "sdelta_shaker", *words, "--points", "5", "-o", str(path), "--json"]) == 0
    answer = capsys.readouterr()
    assert "robot: level rigid (error 0.664 %; tolerance 1 %); cartesian: the reference" in answer.err
    found = json.loads(answer.out)["levels"]["robot"]
    assert found["level"] == "rigid"
    assert found["errors"] == {"rigid": found["error"], "cartesian": 0.0}
    with h5py.File(path) as file:
        robot = file["system/robot"]
        assert robot.attrs["level"] == "rigid"
        assert robot.attrs["level_error"] == found["error"]
        assert robot.attrs["level_tolerance"] == 0.01
        assert robot["levels/error"][:].tolist() == [found["error"], 0.0]
        assert "level_error" not in file["system/reference"].attrs
        assert 'level = "rigid"' in file["system"].attrs["scene"]
    assert main(["sweep", "sdelta_shaker", *words, "--points", "5", "-o", str(path), "--resume"]) == 0


def test_a_run_reports_and_stores_its_choice(tmp_path, capsys):
    path = tmp_path / "run.h5"
    assert main(["run", "sdelta_shaker", *CHOICE, "--stop", "0.01", "-o", str(path), "--json"]) == 0
    answer = capsys.readouterr()
    assert "robot: level cartesian (the reference; tolerance 1 %); rigid: 415 %" in answer.err
    assert json.loads(answer.out)["levels"]["robot"]["level"] == "cartesian"


def test_a_comparison_beside_a_named_level(tmp_path, capsys):
    words = [
        *LINEAR,
        "--over",
        "robot.level=auto,cartesian",
        "--stop",
        "0.01",
        "-o",
        str(tmp_path / "c.png"),
        "-j",
        "1",
    ]
    assert main(["compare", "sdelta_shaker", *words]) == 0
    assert "robot.level=auto: robot: level cartesian (the reference" in capsys.readouterr().err


def test_a_part_alone_has_nothing_to_choose_by(capsys):
    assert main(["export", "sdelta", "--level", "auto"]) == 2
    assert "sdelta: level auto is for an instance in a scene" in capsys.readouterr().err
    assert main(["sweep", "stage_bode", "-p", "stage=auto", "--tolerance", "0"]) == 2
