"""Linearised feedback: of second order, and stable where held inputs diverge within two steps."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from hfsa.components import Model
from hfsa.components._modelling.feedback_ports import with_linear_feedback
from hfsa.cosim.assembly.build import build, instrument, with_ports
from hfsa.cosim.assembly.fuse import fused
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.masters.linearized_feedback import NAME as ALGORITHM
from hfsa.cosim.results.files import read_run
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, Connection, System

AXES, STACKS = "axis[1..3]", "stack[1..3]"
ERROR, ACCELERATION = "tracking.axis[1].error", "reference.stack[1].elongation_acceleration"
FREQUENCY = 77.0
"""Of the first axis [Hz]: it turns at 0.94 m/s2."""


def stage(kp: float, kv: float, **start: float) -> System:
    """The undamped stage under continuous computed torque, on a motion of all axes."""
    gains = {f"{AXES}.proportional_gain": kp, f"{AXES}.derivative_gain": kv, f"{AXES}.limit": 1e15}
    components = [
        Component("reference", "stage_reference", None, {"motion": "three_axis"}, {"frequency": FREQUENCY}),
        Component("tracking", "tracking_error", None, {"axes": 3, "unit": "m"}),
        Component(
            "controller",
            "stage_computed_torque",
            "continuous",
            {"model": "constant_jacobian"},
            {**gains, "damping_time": 0.0},
        ),
        Component("stage", "rrr_stage", None, {"causality": "force"}, {"damping_time": 0.0, **start}),
    ]
    orders = ("", "_rate", "_acceleration")
    connections = [
        *(Connection(f"reference.{STACKS}.elongation{o}", f"controller.{AXES}.reference{o}") for o in orders),
        *(Connection(f"stage.{STACKS}.elongation{o}", f"controller.{AXES}.measured{o}") for o in orders[:2]),
        Connection(f"controller.{AXES}.command", f"stage.{STACKS}.force"),
        Connection(f"reference.{STACKS}.elongation", f"tracking.{AXES}.reference"),
        Connection(f"stage.{STACKS}.elongation", f"tracking.{AXES}.measured"),
    ]
    return System(components, connections)


def robot(**arguments: str) -> System:
    """The robot under continuous control, PD by default."""
    return load_scene("sdelta_hfsa", {"execution": "continuous", **arguments}).system


@pytest.fixture
def run(opened, library):
    """Run a system by the loop in C; the recording of `names`."""

    def recorded(system: System, step_size: float, until: float, names: list[str], **starts: float):
        files = with_ports(build(system), ALGORITHM).files
        master = make_master(opened(files), system, ALGORITHM, step_size, library)
        steps = round(until / step_size)
        recording = master.record(names, rows=steps + 1)
        master.initialize(starts=starts)
        master.advance(steps)
        return recording

    return recorded


# The stage at the source's gains --------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(("step_size", "expected"), [(1e-6, 4.6e-13), (1e-5, 4.7e-11), (1e-4, 4.7e-9)])
def test_the_stage_tracks_at_the_sources_gains_at_every_step(run, step_size, expected):
    """Kp = 5e16, Kv = 6e8: the remaining error is the curvature of the reference within a step, r'' H^2 / 2."""
    found = run(stage(5e16, 6e8), step_size, 100 * step_size, [ERROR, ACCELERATION])
    error, bend = np.abs(found[ERROR][20:]), np.abs(found[ACCELERATION][19:-1]) * step_size**2 / 2
    assert error.max() == pytest.approx(expected, rel=0.03)
    np.testing.assert_allclose(error, bend, atol=0.05 * bend.max())


@pytest.mark.parametrize("step_size", [1e-6, 1e-5, 1e-4])
@pytest.mark.parametrize(("law", "bias"), [("ctc", 0.0), ("pd", 29.1175e6 * 3e-6 / 1e17)])
def test_the_ramp_is_followed_from_the_second_step_on(run, law, bias, step_size):
    """At full speed from rest: behind the impact computed torque leaves nothing, PD the hinges' force over Kp."""
    scene = load_scene("stage_extremes", {"law": law, "execution": "continuous"})
    assert (scene.step_size, scene.algorithm) == (1e-6, "linearized_feedback")
    found = run(scene.system, step_size, 10 * step_size, [ERROR, "controller.axis[1].command"])
    assert found["controller.axis[1].command"][0] == pytest.approx({"ctc": 745, "pd": 30}[law], rel=1e-3)
    np.testing.assert_allclose(found[ERROR][4:], bias * found.time[4:], rtol=1e-3, atol=1e-22)


def test_a_continuous_controller_has_no_sample_time():
    with pytest.raises(StructureError, match="a continuous controller has no sample_time"):
        load_scene("stage_extremes", {"execution": "continuous", "sample_time": 1e-9})


@pytest.mark.slow
def test_held_forces_explode_in_two_steps(opened):
    """The same scene at 1 us: each step multiplies the error by more than Kv H = 600."""
    system = stage(5e16, 6e8)
    master = make_master(opened(build(system).files), system, "gauss_seidel", 1e-6)
    recording = master.record([ERROR], rows=10)
    master.initialize()
    with pytest.raises(StepError):
        master.advance(9)
    error = np.abs(recording[ERROR])
    assert error[2] > 600 * error[1] > 0
    assert error[3] > 600 * error[2]


# Order ----------------------------------------------------------------------------------------------------------------


def orders(ends: list[np.ndarray]) -> np.ndarray:
    """Observed orders from results at steps that are halved."""
    changes = [np.abs(a - b).max() for a, b in itertools.pairwise(ends)]
    return np.log2(np.divide(changes[:-1], changes[1:]))


@pytest.mark.slow
def test_it_is_of_second_order_on_the_stage(run):
    """Computed torque of 300 Hz over a period of its fastest axis."""
    omega, names = 2 * np.pi * 300, [f"stage.stack[{i}].elongation" for i in (1, 2, 3)]
    system = stage(omega**2, 2 * omega, **{"solver.relative_tolerance": 1e-11})
    ends = [run(system, 1e-4 / n, 4e-3, names).values[-1] for n in (1, 2, 4, 8)]
    np.testing.assert_allclose(orders(ends), 2, atol=0.05)


def test_it_is_of_second_order_on_the_robot(run):
    """Motors, controller and robot as separate FMUs: limb forces and torques both feed back to the drives."""
    names = ["robot.platform.position[1]", "robot.platform.position[3]", "drive[1].motor[1].angle"]
    start = {"reference.command.position[3]": 10e-6, "reference.command.position[1]": 5e-6}
    ends = [run(robot(), 1e-3 / n, 20e-3, names, **start).values[-1] for n in (1, 2, 4, 8)]
    np.testing.assert_allclose(orders(ends), 2, atol=0.05)


def test_with_a_fused_robot_a_linear_controller_is_exact(run):
    """All measurements of PD are states of one FMU, so the linear loop is integrated exactly."""
    names = ["robot.platform.position[1]", "robot.platform.position[3]"]
    system = fused(robot(), [["robot", "drive[1]", "drive[2]", "drive[3]"]])
    start = {"reference.command.position[3]": 10e-6}
    coarse, fine = (run(system, h, 20e-3, names, **start).values[-1] for h in (1e-3, 1e-4))
    np.testing.assert_allclose(coarse, fine, rtol=0, atol=1e-10 * np.abs(fine).max())


@pytest.fixture(scope="module", params=[2, 3], ids=["fmi2", "fmi3"])
def filtered_loop(request, exported) -> tuple[dict[str, Path], System]:
    """A mass of 1 kg on a spring, F = 400 e + 10 e' with e' filtered over 5 ms: FMUs of one version, and system."""
    mass = Model("Mass", "Mass on a spring")
    force = mass.input("force", "N", "Force")
    x, v = mass.state("x", "m", "Position"), mass.state("v", "m/s", "Velocity")
    mass.der[x], mass.der[v] = v, force - 0.5 * v - 100 * x
    mass.output("position", x, "m", "Position")
    mass.output("acceleration", force - 0.5 * v - 100 * x, "m/s2", "Acceleration")
    law = Model("Law", "PD with a filtered derivative")
    error = law.parameter("reference", 1.0, "m", "Reference") - law.input("position", "m", "Position")
    filtered = law.state("filtered", "m", "Filtered error", start=1.0)
    law.der[filtered] = (error - filtered) / 5e-3
    law.output("force", 400 * error + 10 * (error - filtered) / 5e-3, "N", "Force")
    ported = with_linear_feedback(mass, [("force", "position")])
    files = {name: exported(model)[request.param] for name, model in (("mass", ported), ("law", law))}
    components = [Component("mass", "mass"), Component("law", "law")]
    return files, System(
        components, [Connection("mass.position", "law.position"), Connection("law.force", "mass.force")]
    )


@pytest.mark.slow
def test_a_fused_robot_bears_any_bandwidth(run):
    """Computed torque of 5 kHz, 200 times the first mode, in steps of 1 ms: the motors are there after two."""
    system = fused(
        robot(law="ctc", bandwidth="5000", torque_limit="1e9"), [["robot", "drive[1]", "drive[2]", "drive[3]"]]
    )
    names = ["drive[1].motor[1].angle", "reference.motor[1].angle"]
    found = run(system, 1e-3, 50e-3, names, **{"reference.command.position[3]": 10e-6}).values
    assert found[0, 0] == 0
    np.testing.assert_allclose(found[2:, 0], found[2:, 1], rtol=1e-4)


def test_a_controller_with_states_is_of_second_order(opened, filtered_loop):
    """Against the matrix exponential; values read at each point belong to that point."""
    files, system = filtered_loop
    A = np.array([[0, 1, 0], [-2500, -0.5, -2000], [-200, 0, -200]])
    rest = np.linalg.solve(A, [0, -2400, -200])
    exact = rest + expm(A) @ ([0, 0, 1] - rest)
    assert exact[0] == pytest.approx(0.8034755886, abs=1e-10)
    errors = []
    for step_size in (2e-3, 1e-3, 0.5e-3):
        master = make_master(opened(files), system, "linearized_feedback", step_size)
        recording = master.record(["mass.x", "mass.v", "law.filtered", "mass.acceleration"], rows=2001)
        master.initialize()
        master.advance(round(1 / step_size))
        x, v, w, a = recording.values.T
        errors.append(abs(x[-1] - exact[0]))
        np.testing.assert_allclose(a, 400 * (1 - x) + 2000 * (1 - x - w) - 0.5 * v - 100 * x, atol=1e-9)
    assert errors[-1] < 1e-4
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2, atol=0.2)


# In C -----------------------------------------------------------------------------------------------------------------


def recorded(names: list[str], steps: int):
    """Return a function that runs and records a master for a number of steps."""

    def run(master):
        recording = master.record(names, rows=steps + 1)
        master.initialize()
        master.advance(1)
        master.advance(steps - 1)
        return recording

    return run


@pytest.mark.parametrize("version", [2, pytest.param(3, marks=pytest.mark.slow)], ids=["fmi2", "fmi3"])
@pytest.mark.parametrize("name", ["sdelta_hfsa", "stage_extremes"])
def test_scenes_have_the_same_bits(both, name, version):
    """On the robot one controller follows the motors of three drives, and a source moves."""
    scene = load_scene(name, {"execution": "continuous"})
    names, system = list(scene.outputs), scene.system
    if scene.inputs:
        system = instrument(scene, scene.inputs[-1], fmi=version)
        names += ["source.value"]
    files = with_ports(build(system, version), ALGORITHM, version).files
    python, c = both(system, files, recorded(names, 200), ALGORITHM, scene.step_size)
    assert python == c
    assert python[:2] == (None, 201)


def test_a_controller_with_states_has_the_same_bits(both, filtered_loop):
    files, system = filtered_loop
    python, c = both(system, files, recorded(["mass.x", "law.filtered", "mass.acceleration"], 500), ALGORITHM, 1e-3)
    assert python == c
    assert python[:2] == (None, 501)


@pytest.mark.parametrize("behaviour", [1.0, 2.0, 3.0, 6.0], ids=["warning", "discard", "error", "not a number"])
def test_what_another_fmu_does_is_told_alike(both, filtered_loop, foreign, behaviour):
    files, system = filtered_loop
    version = 3 if files["mass"].name.endswith("fmi3.fmu") else 2
    components = [*system.components, Component("gauge", "x", start={"behaviour": behaviour, "at": 0.05})]
    watched = System(components, [*system.connections, Connection("mass.position", "gauge.u")])
    run = recorded(["mass.x", "gauge.y"], 100)
    python, c = both(watched, {**files, "gauge": foreign[version]}, run, ALGORITHM, 1e-3)
    assert python == c
    failure, _, time, warnings, _ = python
    if behaviour == 1.0:
        assert failure is None
        assert warnings["gauge"].startswith(f"gauge: fmi{version}DoStep: warning at t = 0.05 s")
    else:
        assert time == pytest.approx(0.05, abs=1.1e-3)


def rooted() -> Model:
    """The root of its input, whose derivative is infinite at 0."""
    m = Model("Root", "Root")
    m.output("root", -(m.input("square", "m", "Square") ** 0.5), "N", "Root")
    return m


@pytest.mark.parametrize("is_controller", [True, False], ids=["gains", "rates"])
def test_a_derivative_that_is_refused_is_told_alike(both, filtered_loop, exported, foreign, is_controller):
    """The gain is infinite where the root closes the loop, the rate where it only measures; the mass starts at 0."""
    files, system = filtered_loop
    version = 3 if files["mass"].name.endswith("fmi3.fmu") else 2
    files = {**files, "root": exported(rooted())[version], "listener": foreign[version]}
    command = "root.root" if is_controller else "law.force"
    connections = [
        Connection("mass.position", "law.position"),
        Connection("mass.position", "root.square"),
        Connection(command, "mass.force"),
        Connection("law.force" if is_controller else "root.root", "listener.u"),
    ]
    components = [*system.components, Component("root", "root"), Component("listener", "x")]
    run = recorded(["mass.x"], 100)
    python, c = both(System(components, connections), files, run, ALGORITHM, 1e-3)
    assert python == c
    words, status, time = python[0]
    assert words.startswith(f"root: fmi{version}GetDirectionalDerivative: discard at t = 0 s: the derivative for root")
    assert (status, time) == ("discard", 0.0)


# What cannot be fed back ----------------------------------------------------------------------------------------------


def test_a_scene_without_such_a_loop_is_refused(opened):
    system = load_scene("stage_tracking", {"actuator": "force"}).system
    with pytest.raises(StructureError, match="no output of a component returns to it by direct feedthrough"):
        make_master(opened(with_ports(build(system), "linearized_feedback").files), system, "linearized_feedback", 1e-5)


def test_a_finished_fmu_has_no_ports(opened, files):
    system = System(
        [Component("plant", str(files["Plant", 2])), Component("law", str(files["Pd", 2]))],
        [Connection("plant.position", "law.position"), Connection("law.force", "plant.force")],
    )
    with pytest.raises(
        StructureError, match=r"plant: Plant.fmi2.fmu has no feedback port feedback.gain.force.position; only parts"
    ):
        make_master(opened(with_ports(build(system), "linearized_feedback").files), system, "linearized_feedback", 1e-3)


def test_a_finished_fmu_beside_a_part_is_told_of(opened, files, filtered_loop):
    """Its loop is closed by lines, which is enough at this step; the loop of the part is closed as before."""
    own, system = filtered_loop
    finished = [Component("box", str(files["Plant", 2])), Component("box_law", str(files["Pd", 2]))]
    loop = [Connection("box.position", "box_law.position"), Connection("box_law.force", "box.force")]
    both = System([*finished, *system.components], [*loop, *system.connections])
    paths = {"box": files["Plant", 2], "box_law": files["Pd", 2], **own}
    master = make_master(opened(paths), both, "linearized_feedback", 1e-3)
    assert master.warnings["box"].endswith("only parts are exported with it; force moves on a line instead")
    assert "mass" not in master.warnings
    master.initialize(starts={"box.x": 0.1})
    master.advance(1000)
    position, height = master.read(["box.x", "mass.x"])
    assert height == pytest.approx(0.8034755886, abs=1e-3)
    assert 0 < abs(position) < 0.1


def test_it_is_an_algorithm_of_the_command_line(hfsa):
    """The limbs' forces are fed back to the drives: at 0.25 ms a fiftieth of the error of held forces."""
    options = ["sdelta_hfsa", "--stop", "20e-3", "--frequency", "30", "--input", "command.position[3]"]
    height, found = "robot.platform.position[3]", {}
    for name, algorithm, more in (
        ("fed_back", "linearized_feedback", ["--step", "0.25e-3"]),
        ("held", "gauss_seidel", ["--step", "0.25e-3"]),
        ("exact", "gauss_seidel", ["--step", "0.25e-3", "--fuse", "robot,drives"]),
    ):
        assert hfsa("run", *options, *more, "--algorithm", algorithm, "-o", f"{name}.h5")[0] == 0
        found[name] = read_run(f"{name}.h5")[0][height]
    fed_back, held = (np.abs(found[name] - found["exact"]).max() for name in ("fed_back", "held"))
    assert fed_back < held / 50
