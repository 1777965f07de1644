"""The one-step matrix of an algorithm: its modes and responses equal those of co-simulation."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from algorithm_groups import HELD
from spring_loop import LOOP

from hfsa.components import Model
from hfsa.cosim.analysis.stability import CoupledStep
from hfsa.cosim.assembly import build
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.fmi.co_simulation import open_instances
from hfsa.cosim.linear.linearize import linear_response
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.measurement.rig import Rig, Settings, Task
from hfsa.cosim.measurement.sweep import Bench
from hfsa.cosim.results.records import Status
from hfsa.cosim.signals.frequency_response import negligible
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, System
from hfsa.fmus.export import export

VERTICAL, ACROSS = "reference.command.position[3]", "reference.command.position[1]"
MOVED = {
    VERTICAL: ("robot.platform.position[3]",),
    ACROSS: ("robot.platform.position[1]", "robot.platform.rotation[2]"),
}
SCENES = ("sdelta_hfsa", "sdelta_shaker")
FLEXIBLE_LIMIT = {"jacobi_plain": 62.8e-6, "jacobi": 104.3e-6, "gauss_seidel": 285e-6}
RIGID_GROWTH = {"jacobi_plain": 0.058, "jacobi": 0.0, "gauss_seidel": 0.058}
each_algorithm = pytest.mark.parametrize("algorithm", HELD)


@pytest.fixture(scope="module")
def bench():
    """Return a scene's bench for one input."""
    made: dict[tuple, Bench] = {}

    def make(scene_name: str, excited: str = VERTICAL, outputs: tuple[str, ...] = ()) -> Bench:
        key = scene_name, excited, outputs
        if key not in made:
            scene = load_scene(scene_name)
            system = build.instrument(scene, excited, outputs or None)
            made[key] = Bench(build.build(system), outputs or tuple(scene.outputs))
        return made[key]

    return make


def coupled_step_of(bench: Bench, algorithm: str, opened) -> CoupledStep:
    return CoupledStep(
        bench.assembly.system, opened(bench.assembly.files), algorithm, source="source", lock_in="lock_in"
    )


# What a stepped sweep measures ----------------------------------------------------------------------------------------


def assert_stepped_is_predicted(bench, opened, algorithm, step_size, frequency):
    """Within 0.01 dB and 0.1 degree, for responses that are not zero by symmetry."""
    predicted = coupled_step_of(bench, algorithm, opened).over(step_size).response(frequency)
    settings = Settings(algorithm=algorithm, step_size=step_size, settling_tolerance=1e-4)
    system = bench.assembly.system
    start = {**system["lock_in"].start, "sample_time": step_size}
    components = [replace(c, start=start) if c.name == "lock_in" else c for c in system.components]
    bench = replace(bench, assembly=replace(bench.assembly, system=replace(system, components=components)))
    rig = Rig(bench, settings)
    for k, f in enumerate(frequency):
        point = rig.measure(Task(0, 0, bench, settings, f, 1e-5))
        assert point.status == Status.DONE
        ratio = point.response / predicted[k]
        assert np.abs(20 * np.log10(np.abs(ratio))).max() < 0.01
        assert np.abs(np.degrees(np.angle(ratio))).max() < 0.1
    rig.close()


@each_algorithm
def test_a_stepped_sweep_measures_what_the_one_step_matrix_says(bench, opened, algorithm):
    """At the controller's own sample time, where the errors of algorithms are several degrees."""
    assert_stepped_is_predicted(bench("sdelta_hfsa", VERTICAL, MOVED[VERTICAL]), opened, algorithm, 250e-6, [5.0])


@pytest.mark.parametrize(
    ("algorithm", "scene", "step_size", "frequency"),
    [
        ("quasi_newton", "sdelta_shaker", 2e-3, 24.0),
        ("quasi_newton", "sdelta_hfsa", 1e-3, 5.0),
        ("fixed_point", "sdelta_shaker", 500e-6, 24.0),
    ],
)
def test_a_stepped_sweep_with_iterated_steps_measures_the_same(bench, opened, algorithm, scene, step_size, frequency):
    """Inputs follow lines between points, that of the source as well, whose sine is only known at points then."""
    at = bench(scene, ACROSS, MOVED[ACROSS])
    assert_stepped_is_predicted(at, opened, algorithm, step_size, [frequency])


def test_a_stepped_sweep_with_linearised_feedback_measures_the_same(opened):
    """Continuous control, which the drives take into account within a step, and a source on lines at its own rate."""
    scene = load_scene("sdelta_hfsa", {"execution": "continuous"})
    system = build.instrument(scene, VERTICAL, MOVED[VERTICAL])
    at = Bench(build.with_ports(build.build(system), "linearized_feedback"), MOVED[VERTICAL])
    assert_stepped_is_predicted(at, opened, "linearized_feedback", 1e-3, [10.0])


@pytest.mark.slow
@each_algorithm
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("excited", MOVED)
def test_stepped_sweeps_measure_what_the_one_step_matrix_says(bench, opened, algorithm, scene, excited):
    assert_stepped_is_predicted(
        bench(scene, excited, MOVED[excited]), opened, algorithm, 50e-6, [2.0, 10.0, 22.0, 40.0]
    )


@pytest.mark.slow
@each_algorithm
def test_a_stepped_shaker_with_longer_steps(bench, opened, algorithm):
    assert_stepped_is_predicted(bench("sdelta_shaker", ACROSS, MOVED[ACROSS]), opened, algorithm, 500e-6, [5.0, 24.0])


@each_algorithm
@pytest.mark.parametrize("scene_name", SCENES)
def test_extrapolated_to_step_zero_it_is_the_linear_response(bench, opened, algorithm, scene_name):
    """2 G(H/2) - G(H) at 50 us: within 0.1 dB and 1 degree, every entry above -60 dB of its maximum over the band."""
    scene = load_scene(scene_name)
    frequency = np.concatenate([np.geomspace(*scene.band, 12), [23.59, 24.55]])
    for excited in (VERTICAL, ACROSS, "reference.command.rotation[2]"):
        at = bench(scene_name, excited)
        coupled = coupled_step_of(at, algorithm, opened)
        found = 2 * coupled.over(25e-6).response(frequency) - coupled.over(50e-6).response(frequency)
        instances = opened(build.build(scene.system).files)
        exact = linear_response(scene.system, instances, [excited], scene.outputs, frequency)
        zero = negligible(exact, ["rad"] * 3 + ["m"] * 3, [1.0])[:, 0]
        exact = exact[:, :, 0]
        seen = (np.abs(exact) > 1e-3 * np.abs(exact).max(axis=0)) & ~zero
        ratio = found[seen] / exact[seen]
        assert np.abs(20 * np.log10(np.abs(ratio))).max() < 0.1
        assert np.abs(np.degrees(np.angle(ratio))).max() < 1.0


# Stability ------------------------------------------------------------------------------------------------------------


@each_algorithm
@pytest.mark.parametrize("delay", [False, True])
def test_under_control_every_step_that_fits_the_sample_time_is_stable(opened, algorithm, delay):
    scene = load_scene("sdelta_hfsa", {"delay": str(delay)})
    coupled = CoupledStep(scene.system, opened(build.build(scene.system).files), algorithm)
    for n in (1, 2, 3, 4, 5, 10, 25, 100):
        step = coupled.over(0.25e-3 / n)
        assert step.steps == n
        assert step.spectral_radius < 1
        assert step.growth() < -5
    with pytest.raises(StructureError, match="one must be a multiple of the other"):
        coupled.over(0.1e-3)


def free_drives() -> System:
    """Return robot and drives without a controller."""
    system = load_scene("sdelta_hfsa").system
    gone = ("controller", "reference")
    inner = [c for c in system.connections if not {system.split(c.start)[0], system.split(c.end)[0]} & {*gone}]
    return System([c for c in system.components if c.name not in gone], inner)


@pytest.fixture(scope="module")
def free():
    """Return a system with free drives and its instances."""
    system = free_drives()
    with open_instances(build.build(system).files) as instances:
        yield system, instances


@each_algorithm
def test_free_drives(free, algorithm):
    """Flexible modes leave the unit circle at one step; rigid motion is neutral or grows as the step, from 0 on."""
    coupled = CoupledStep(free[0], free[1], algorithm)
    (limit,) = coupled.stability_limits(20e-6, 600e-6, kind="oscillatory", points=40)
    assert limit == pytest.approx(FLEXIBLE_LIMIT[algorithm], rel=1e-3)
    for step_size in (5e-6, 20e-6, 50e-6):
        growth = coupled.over(step_size).growth("aperiodic") / (step_size * 1e6)
        assert growth == pytest.approx(RIGID_GROWTH[algorithm], abs=5e-4)
    assert coupled.over(50e-6).is_stable("aperiodic") == (algorithm == "jacobi")
    oscillatory = coupled.over(1e-6).of("oscillatory")
    expected = [47.70929, 47.70929, 95.00686, 129.88789, 129.88789, 164.05113]
    assert sorted(mode.frequency for mode in oscillatory) == pytest.approx(expected, rel=1e-3)


@each_algorithm
@pytest.mark.parametrize("factor", [0.98, 1.02])
def test_free_drives_in_simulation(free, algorithm, factor):
    """A robot that starts in its critical mode grows or decays at the rate of the matrix.

    Seen in the springs' forces at the mode's frequency, through a Hann window early and one late.
    """
    system, instances = free
    step_size = factor * FLEXIBLE_LIMIT[algorithm]
    mode = CoupledStep(system, instances, algorithm).over(step_size).of("oscillatory")[0]
    assert (mode.rate > 0) == (factor > 1)
    forces = [f"robot.drive[{j}].{kind}" for j in (1, 2, 3) for kind in ("force", "torque")]
    master = make_master(instances, system, algorithm, step_size)
    window, apart = round(0.25 / step_size), round(0.7 / step_size)
    recording = master.record(forces, window + apart + 1)
    size = max(abs(value) for name, value in mode.shape.items() if "center.position" in name)
    rest = {name: system[name.partition(".")[0]].start.get(name.partition(".")[2], 0.0) for name in mode.shape}
    master.initialize(starts={name: rest[name] + 1e-6 * value.real / size for name, value in mode.shape.items()})
    master.advance(window + apart)
    turned = np.hanning(window) * np.exp(-2j * np.pi * mode.frequency * step_size * np.arange(window))
    early, late = (
        np.linalg.norm([turned @ recording[name][first : first + window] for name in forces]) for first in (0, apart)
    )
    measured = np.log(late / early) / (apart * step_size)
    assert (measured > 0) == (factor > 1)
    assert measured == pytest.approx(mode.rate, abs=0.02)


@each_algorithm
def test_free_drives_with_gains_of_zero(opened, algorithm):
    """The same with the controller in place, at steps on either side of the limit that fit its sample time."""
    scene = load_scene("sdelta_hfsa")
    zero = {f"controller.axis[{i}].{name}_gain": 0.0 for i in range(1, 7) for name in ("proportional", "derivative")}
    limit = FLEXIBLE_LIMIT[algorithm]
    coupled = CoupledStep(scene.system, opened(build.build(scene.system).files), algorithm, starts={**zero})
    fitting = [0.25e-3 / n for n in range(1, 10)]
    assert [coupled.over(h).is_stable("oscillatory") for h in fitting] == [h < limit for h in fitting]


def test_modes_of_one_fmu_are_its_poles_whatever_the_step(opened):
    """With its base at rest, a mass on a spring is integrated exactly."""
    scene = load_scene("mass_on_spring")
    instances = opened(build.build(scene.system).files)
    exact = np.roots([1, 0.5, 1e4])[0]
    for algorithm in HELD:
        (mode,) = CoupledStep(scene.system, instances, algorithm).over(3e-3).modes
        assert mode.rate == pytest.approx(exact.real, rel=1e-9)
        assert 2 * np.pi * mode.frequency == pytest.approx(abs(exact.imag), rel=1e-9)


@pytest.mark.parametrize("steps", [1, 4])
@pytest.mark.parametrize("algorithm", ["gauss_seidel", "jacobi"])
def test_a_sampled_loop_at_a_step_of_its_sample_time_is_the_linear_one(files, opened, algorithm, steps):
    """Values change only at the tick: these algorithms are exact at that step, and at its whole fractions."""
    system = System(
        [Component("plant", "x"), Component("pd", "x")],
        LOOP,
    )
    instances = opened({"plant": files["Plant", 2], "pd": files["SampledPd", 2]})
    step = CoupledStep(system, instances, algorithm).over(0.01 / steps)
    P = step_matrix_by_hand()
    found = np.sort_complex(np.array([m.multiplier for m in step.modes]))
    expected = np.linalg.eigvals(P)
    expected = np.sort_complex(expected[expected.imag >= 0])
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def step_matrix_by_hand() -> np.ndarray:
    """Return [x; v; last] of `spring_loop`'s plant and sampled controller over 10 ms."""
    moved = scipy.linalg.expm(0.01 * np.array([[0, 1, 0], [-100, -0.5, 1], [0, 0, 0]]))
    law = np.array([-40 - 2 / 0.01, 0, 2 / 0.01])
    return np.vstack([moved[:2, :2] @ np.eye(2, 3) + np.outer(moved[:2, 2], law), [1, 0, 0]])


# Identity of ticks ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("algorithm", ["gauss_seidel", "jacobi"])
def test_whole_parts_of_the_sample_time_give_the_same_sampled_sequence(files, opened, algorithm):
    """A closed loop with an exactly solved plant: the controller measures the same values at every tick."""
    instances = opened({"plant": files["Plant", 2], "pd": files["SampledPd", 2]})
    system = System([Component("plant", "x"), Component("pd", "x")], LOOP)
    sequences = []
    for parts in (1, 2, 5, 8):
        master = make_master(instances, system, algorithm, 0.01 / parts)
        # a sampled output changes within the step that begins at its tick
        recording = master.record(["pd.force"], 50 * parts + 1)
        master.initialize(starts={"plant.x": 1.0})
        master.advance(50 * parts)
        sequences.append(recording["pd.force"][1::parts])
    assert np.ptp(sequences[0]) > 10
    for sequence in sequences[1:]:
        np.testing.assert_allclose(sequence, sequences[0], rtol=1e-10, atol=1e-10)


@each_algorithm
def test_multiples_of_the_sample_time_give_the_same_sampled_sequence(opened, tmp_path, algorithm):
    """A sampled oscillator under a constant input: bit for bit, be the ticks at communication points or between."""
    m = Model("Oscillator", "Sampled oscillator")
    m.sample_time(0.01)
    u = m.input("u", "1", "Input", start=0.3)
    a, b = m.sampled_state("a", "1", "One", start=1.0), m.sampled_state("b", "1", "Other")
    m.next[a] = 0.99 * a - 0.1 * b + u
    m.next[b] = 0.1 * a + 0.99 * b
    m.sampled_output("y", a + b, "1", "Output")
    instances = opened({"it": export(m, tmp_path, (2,))[0]})
    sequences = []
    for ratio in (0.1, 0.5, 1, 2, 5, 10):
        master = make_master(instances, System([Component("it", "x")]), algorithm, 0.01 * ratio)
        recording = master.record(["it.y"], 31, every=round(10 / ratio))
        master.initialize()
        master.advance(round(300 / ratio))
        sequences.append(recording["it.y"].copy())
    assert np.ptp(sequences[0]) > 1
    for sequence in sequences[1:]:
        np.testing.assert_array_equal(sequence, sequences[0])
