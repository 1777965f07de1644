"""Parts fused into one FMU: the same signals, without an effect of the communication step between the parts."""

import dataclasses
import tomllib

import h5py
import numpy as np
import pytest

from hfsa.components import rrr_stage
from hfsa.cosim.assembly.build import build, instrument
from hfsa.cosim.assembly.fuse import fused, models_to_export, with_fusion
from hfsa.cosim.assembly.level_rules import check_levels
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.assembly.models import model_of
from hfsa.cosim.fidelity.levels import at_highest
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.results.files import read_run, read_sweep
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.scene_file import read_scene_text, scene_text
from hfsa.cosim.systems.system import Component, Connection, System

DRIVES = "drive[1..3]"
SAMPLE_TIME = 0.25e-3
HEIGHT = "robot.platform.position[3]"


def groups(system: System, *words: str):
    """Return the groups that words mean, in a system alone."""
    scene = Scene(system, [], [f"{system.components[0].name}.any"], step_size=1.0, stop_time=1.0)
    return with_fusion(scene, words).fuse


@pytest.fixture
def heights(opened, library):
    """Run the robot's step response to the end of 20 ms; heights at every tick [m]."""

    def run(step_size: float, *words: str) -> np.ndarray:
        scene = load_scene("sdelta_hfsa")
        system = fused(scene.system, with_fusion(scene, words).fuse if words else ())
        master = make_master(opened(build(system).files), system, "gauss_seidel", step_size, library)
        every = round(SAMPLE_TIME / step_size)
        recording = master.record([HEIGHT], rows=81, every=every)
        master.initialize(starts={"reference.command.position[3]": 10e-6, "robot.damping_ratio": 0.02})
        master.advance(80 * every)
        return recording[HEIGHT].copy()

    return run


def test_a_fused_robot_is_exact_at_every_step(heights):
    """Only sampled torques cross: 1e-9 of the motion, where held forces and tubes are off by a thousand times more."""
    at_ticks = heights(SAMPLE_TIME, f"robot,{DRIVES}")
    size = np.ptp(at_ticks)
    assert size > 5e-7
    assert np.abs(heights(SAMPLE_TIME / 8, f"robot,{DRIVES}") - at_ticks).max() < 1e-9 * size
    errors = [np.abs(heights(SAMPLE_TIME / n) - at_ticks).max() / size for n in (4, 8, 16)]
    assert errors[0] > 1e-3
    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 2, rtol=0.2)


@pytest.mark.slow
def test_a_controller_ticks_in_a_group_as_it_does_alone(heights):
    """Its measured reference is the value at its tick, although the reference has moved when the group steps."""
    apart, together = heights(SAMPLE_TIME, f"robot,{DRIVES}"), heights(SAMPLE_TIME, f"robot,{DRIVES},controller")
    np.testing.assert_allclose(together, apart, rtol=0, atol=1e-9 * np.ptp(apart))


@pytest.mark.slow
def test_parts_that_tick_one_after_the_other_do_so_in_a_group(opened, library):
    """PD whose force a second sampled part converts to a voltage: identical to the last bit, fused or not."""
    scene = load_scene("stage_tracking", {"motion": "three_axis", "law": "pd", "delay": "true"})
    names = [
        "controller.axis[3].command",
        "voltage.axis[3].command",
        "stack[3].stack.voltage",
        "tracking.axis[3].error",
    ]
    courses = []
    for words in ([], ["controller,voltage"], ["controller,voltage,stage,stacks"]):
        system = fused(scene.system, with_fusion(scene, words).fuse if words else ())
        master = make_master(opened(build(system).files), system, "gauss_seidel", scene.step_size, library)
        recording = master.record(names, rows=501)
        master.initialize()
        master.advance(500)
        courses.append(recording.values.copy())
    assert np.abs(courses[0][-1]).min() > 0
    for other in courses[1:]:
        np.testing.assert_array_equal(other, courses[0])


def stiff(damping_time: float) -> System:
    """The stage with static stacks that own their stiffness: k l crosses between FMUs."""
    arguments, start = {"causality": "force"}, {"damping_time": damping_time}
    stacks = [Component(f"stack[{i}]", "pzt_stack", "static", arguments) for i in (1, 2, 3)]
    connections = [
        Connection("stack[1..3].stack.force", "stage.stack[1..3].force"),
        Connection("stage.stack[1..3].elongation", "stack[1..3].stack.elongation"),
    ]
    return System([*stacks, Component("stage", "rrr_stage", None, arguments, start)], connections)


@pytest.mark.parametrize("step_size", [1e-5, 1e-4, 1e-3])
def test_a_stiff_connection_within_an_fmu_limits_no_step(opened, library, step_size):
    """Force causality diverges above 2 c / k = 2.7 us; fused, half the voltage settles where statics says."""
    system = stiff(6.02e-6)
    names = [f"stage.stack[{i}].elongation" for i in (1, 2, 3)]
    whole = fused(system, [[c.name for c in system.components]])
    (component,) = whole.components
    master = make_master(opened(build(whole).files), whole, "gauss_seidel", step_size, library)
    assert (component.name, whole.connections) == ("fused", ())
    master.initialize(starts={f"stack[{i}].command.voltage": 75.0 for i in (1, 2, 3)})
    master.advance(round(0.2 / step_size))
    expected = rrr_stage.analyze(voltage=(75.0,) * 3)["elongation_at_voltage"]
    np.testing.assert_allclose(master.read(names), expected, rtol=1e-6)


# Names ----------------------------------------------------------------------------------------------------------------


ERRORS = ("rotation_error", "position_error")
"""Components of `sdelta_hfsa` that its runs record."""


def test_signals_keep_their_names():
    system = load_scene("sdelta_hfsa").system
    whole = fused(system, groups(system, "robot,drives"))
    assert [c.name for c in whole.components] == ["reference", "controller", "fused", *ERRORS]
    assert whole.split(HEIGHT) == ("fused", HEIGHT)
    assert whole.own_name(f"fused.{HEIGHT}") == HEIGHT
    assert whole["fused"].start["robot.damping_ratio"] == 0.01
    assert Connection("controller.axis[1].command", "fused.drive[1].motor[1].torque") in whole.connections
    inside = {c.start.partition(".")[0] for c in whole["fused"].connections}
    assert inside == {"robot", "drive[1]", "drive[2]", "drive[3]"}


def test_the_clock_and_the_solver_are_common():
    scene = load_scene("stage_tracking", {"sample_time": 20e-6})
    setting = {"solver.relative_tolerance": 1e-10}
    members = [
        dataclasses.replace(c, start={**c.start, **setting}) if c.name == "stage" else c
        for c in scene.system.components
    ]
    system = System(members, scene.system.connections)
    whole = fused(system, groups(system, "controller,voltage,stage,stacks"))
    assert whole.components[0].name == "fused"  # a group that ticks steps first
    start = whole["fused"].start
    assert (start["sample_time"], start["solver.relative_tolerance"]) == (20e-6, 1e-10)
    assert whole.split("voltage.sample_time") == ("fused", "sample_time")


def test_a_scene_keeps_its_groups_as_text():
    scene = with_fusion(load_scene("sdelta_hfsa"), ["drive[1..2],robot"])
    assert tomllib.loads(scene_text(scene))["fuse"] == [["drive[1]", "drive[2]", "robot"]]
    assert read_scene_text(scene_text(scene)).fuse == scene.fuse
    with pytest.raises(StructureError, match="fuse is 'robot', expected a list of lists"):
        read_scene_text('fuse = "robot"\n' + scene_text(load_scene("sdelta_hfsa")))


def test_a_run_of_fused_parts_records_the_scenes_signals(hfsa):
    options = ["--stop", "1e-3", "-p", "robot.damping_ratio=0.03", "--frequency", "10"]
    assert hfsa("run", "sdelta_hfsa", *options, "--fuse", "robot,drives", "-o", "fused.h5")[0] == 0
    assert hfsa("run", "sdelta_hfsa", *options, "-o", "apart.h5")[0] == 0
    (found, units), (other, _) = read_run("fused.h5"), read_run("apart.h5")
    assert list(found) == list(other)
    assert units[HEIGHT] == "m"
    with h5py.File("fused.h5") as file:
        assert file["system/fused"].attrs["name"] == "CDriveSDelta"
        start = file["system/fused/start"]
        assert dict(zip(start["variable"].asstr(), start["value"], strict=True))["robot.damping_ratio"] == 0.03


def test_a_sweep_of_fused_parts_is_that_of_the_scene(hfsa):
    options = ["--input", "reference.command.position[3]", "--signal", HEIGHT, "--from", "5", "--to", "40"]
    assert hfsa("sweep", "sdelta_hfsa", *options, "--method", "linear", "--points", 20, "-o", "apart.h5")[0] == 0
    options += ["--fuse", "robot,drives"]
    assert hfsa("sweep", "sdelta_hfsa", *options, "--method", "linear", "--points", 20, "-o", "fused.h5")[0] == 0
    apart, together = read_sweep("apart.h5"), read_sweep("fused.h5")
    assert [s.name for s in together.outputs] == [HEIGHT]
    np.testing.assert_allclose(together.response, apart.response, rtol=1e-9)
    with h5py.File("fused.h5") as file:
        assert "robot.center.position[3]" in file["system/operating_point/variable"].asstr()[:]


def test_groups_are_exported_with_the_scenes_start_values(hfsa, tmp_path):
    code, answer, _ = hfsa("export", "sdelta_hfsa", "--fuse", "drive[1],drive[2]", "--fmi", 2, "-o", tmp_path)
    assert code == 0
    (file,) = tmp_path.iterdir()
    assert answer.strip() == str(file)
    assert file.name.startswith("CDrive_")
    from hfsa.cosim.fmi.description import describe

    found = describe(file).variables
    assert (
        found["drive[2].encoder.offset[1]"].start
        == load_scene("sdelta_hfsa").system["drive[2]"].start["encoder.offset[1]"]
    )


# What cannot be fused -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["robot,drive[1..4]"], r"no component is called 'drive\[4\]'; did you mean drive\[3\]"),
        (["robot,drivers"], "no component is called 'drivers'; did you mean"),
        (["robot"], "a group to fuse has two components or more; found robot"),
        (["robot,drives", "drive[2],controller"], r"drive\[2\] cannot be fused into two groups"),
    ],
)
def test_a_group_that_cannot_be_is_named(words, message):
    with pytest.raises(StructureError, match=message):
        with_fusion(load_scene("sdelta_hfsa"), words)


def test_a_finished_fmu_is_not_fused(foreign):
    system = System([Component("box", str(foreign[2])), Component("robot", "sdelta")])
    with pytest.raises(StructureError, match=r"box is the finished FMU .* cannot be fused: only parts have equations"):
        groups(system, "box,robot")


def test_a_member_that_would_tick_out_of_order_is_named():
    scene = load_scene("stage_tracking")
    with pytest.raises(
        StructureError, match=r"controller and voltage tick one after the other, .* fuse voltage as well"
    ):
        fused(scene.system, with_fusion(scene, ["controller,stage"]).fuse)


def test_different_sample_times_are_refused(hfsa):
    options = ["--fuse", "controller,voltage,stage,stacks", "-p", "controller.sample_time=20e-6"]
    code, _, error = hfsa("run", "stage_tracking", *options)
    assert code == 2
    assert "one model has one sample time; found controller 2e-05 s, voltage 1e-05 s" in error


def test_levels_that_do_not_fit_are_refused_within_an_fmu_too():
    scene = load_scene("sdelta_hfsa", {"robot.level": "rigid"})
    whole = dataclasses.replace(scene.system["robot"], name="fused", members=scene.system.components[2:])
    whole = dataclasses.replace(whole, connections=[c for c in scene.system.connections if c.end.startswith("robot")])
    with pytest.raises(StructureError, match="robot is sdelta at level rigid, which may be joined to"):
        check_levels(System([whole]))


@pytest.mark.slow
def test_a_level_to_be_chosen_has_no_fused_fmu():
    scene = load_scene("sdelta_hfsa", {"robot.level": "auto"})
    with pytest.raises(StructureError, match="robot: level auto is a scene's question"):
        fused(scene.system, with_fusion(scene, ["robot,drives"]).fuse)
    highest = fused(at_highest(scene).system, with_fusion(scene, ["robot,drives"]).fuse)
    assert model_of(highest["fused"]).name == "CDriveSDelta"


def test_what_an_exported_group_cannot_hold_is_refused(tmp_path):
    with pytest.raises(StructureError, match=r"a group has no level 'rigid'; name that of each component"):
        models_to_export("sdelta_hfsa", "rigid", {}, ["robot,drives"])
    scene = load_scene("stage_tracking")
    setting = {"solver.relative_tolerance": 1e-10}
    members = [dataclasses.replace(c, start=setting) if c.name == "stage" else c for c in scene.system.components]
    file = tmp_path / "scene.toml"
    changed = dataclasses.replace(scene, system=System(members, scene.system.connections))
    file.write_text(scene_text(changed), encoding="utf-8")
    with pytest.raises(StructureError, match=r"solver.relative_tolerance = 1e-10 is set in the FMU when it is run"):
        models_to_export(str(file), None, {}, ["stage,stacks"])


def test_instruments_stay_outside():
    scene = with_fusion(load_scene("sdelta_hfsa"), ["robot,drives"])
    system = fused(instrument(scene, scene.inputs[0]), scene.fuse)
    assert [c.name for c in system.components] == ["source", "reference", "controller", "fused", *ERRORS, "lock_in"]
