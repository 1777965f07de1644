"""A swept response equals the linear one; a failure is a status in the file, and a sweep resumes where it stopped."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hfsa.cosim.assembly import build
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.measurement.sweep import Bench, Settings, linear, plan_sweep, points_of, stepped, system_record
from hfsa.cosim.results.files import Status, SweepFile, read_sweep
from hfsa.cosim.signals.excitation import along_response, logarithmic
from hfsa.cosim.signals.frequency_response import negligible
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, System

SHAKER_INPUTS = [f"reference.command.{kind}[{i}]" for kind in ("rotation", "position") for i in (1, 2, 3)]


class Sweeper:
    """A scene prepared for a sweep, with the values that several tests need."""

    def __init__(self, scene: Scene, inputs, outputs=None):
        self.scene, self.inputs, self.outputs = scene, list(inputs), list(outputs or scene.outputs)
        self.assembly = build.build(scene.system)
        self.settings = Settings(step_size=scene.step_size, algorithm="gauss_seidel")
        self.benches = {}
        for name in self.inputs:
            system = build.instrument(scene, name, self.outputs)
            self.benches[name] = Bench(build.build(system), tuple(self.outputs))

    def plan(self, frequency, **settings):
        chosen = replace(self.settings, **settings)
        return plan_sweep(
            self.assembly, self.inputs, self.outputs, np.asarray(frequency, float), self.scene.amplitude, chosen
        )

    def linear(self, frequency):
        return linear(self.assembly, self.plan(frequency)).response(np.asarray(frequency, float))

    def record(self):
        return system_record("Test", "scene", *(bench.assembly for bench in self.benches.values()))

    def stepped(self, path: Path, frequency, resume=False, jobs=1, executor=None, report=None, **settings):
        chosen = replace(self.settings, **settings)
        opening = SweepFile.resume if resume else SweepFile.create
        plan = self.plan(frequency, **settings)
        with opening(path, plan, self.record()) as file:
            stepped(file, plan, self.benches, chosen, jobs=jobs, executor=executor, report=report)
        return read_sweep(path)


@pytest.fixture(scope="module")
def mass():
    return Sweeper(load_scene("mass_on_spring", {"damping": "5"}), ["mass.base.position"])


def assert_equal_within_a_tenth_of_a_decibel(swept, exact, band):
    """Every entry above -60 dB of its own maximum over the band; those that are zero by symmetry stay zero."""
    units = ["rad"] * 3 + ["m"] * 3
    zero = negligible(band, units, [1e-4] * 3 + [1e-5] * 3 if band.shape[2] == 6 else [1.0])
    largest = np.abs(band).max(axis=0)
    seen = (np.abs(exact) > 1e-3 * largest) & ~zero
    ratio = swept[seen] / exact[seen]
    assert np.abs(20 * np.log10(np.abs(ratio))).max() < 0.1
    assert np.abs(np.degrees(np.angle(ratio))).max() < 1.0
    row = np.broadcast_to(largest.max(axis=1)[:, None], largest.shape)
    moving = zero & (row > 1e-9)
    assert np.all(np.abs(swept)[:, moving] < 1e-6 * row[moving])


def shaker(inputs):
    """Return the swept and the exact response at 8 frequencies, and the exact one over the whole band."""
    sweeper = Sweeper(load_scene("sdelta_shaker"), inputs)
    dense = logarithmic(*sweeper.scene.band, 4000)
    band = sweeper.linear(dense)
    units, amplitude = [s.unit for s in sweeper.plan(dense).outputs], [s.amplitude for s in sweeper.plan(dense).inputs]
    frequency = along_response(dense, band[:, ~negligible(band, units, amplitude)], 8)
    return sweeper, frequency, sweeper.linear(frequency), band


@pytest.mark.slow
def test_the_swept_robot_is_the_linear_robot(tmp_path):
    sweeper, frequency, exact, band = shaker(SHAKER_INPUTS[3:4])
    bode = sweeper.stepped(tmp_path / "sweep.h5", frequency)
    assert np.all(bode.status == Status.DONE)
    assert_equal_within_a_tenth_of_a_decibel(bode.response, exact, band)
    assert np.all(bode.remaining_transient < sweeper.settings.settling_tolerance)


@pytest.mark.slow
def test_the_swept_robot_is_the_linear_robot_at_every_input(tmp_path):
    sweeper, frequency, exact, band = shaker(SHAKER_INPUTS)
    bode = sweeper.stepped(tmp_path / "sweep.h5", frequency, jobs=2)
    assert np.all(bode.status == Status.DONE)
    assert_equal_within_a_tenth_of_a_decibel(bode.response, exact, band)


def test_the_remaining_transient_bounds_the_error(mass, tmp_path):
    frequency = [3.0, 15.2, 15.9155, 17.0, 40.0]
    loose = mass.stepped(tmp_path / "loose.h5", frequency, settling_tolerance=1e-2)
    tight = mass.stepped(tmp_path / "tight.h5", frequency, settling_tolerance=1e-7)
    error = np.abs(loose.response / tight.response - 1)
    assert np.all(error <= loose.remaining_transient + 1e-6)
    assert np.all(loose.remaining_transient <= 1e-2)
    assert np.all(tight.wall_time > 0)


def test_a_linear_part_has_no_distortion(mass, tmp_path):
    bode = mass.stepped(tmp_path / "sweep.h5", [15.9155], settling_tolerance=1e-8)
    assert np.nanmax(bode.harmonic_distortion) < 1e-6


def test_threads_processes_and_this_process_measure_the_same(mass, tmp_path):
    frequency = [10.0, 20.0, 30.0]
    here = mass.stepped(tmp_path / "here.h5", frequency)
    threads = mass.stepped(tmp_path / "threads.h5", frequency, jobs=2)
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as executor:
        processes = mass.stepped(tmp_path / "processes.h5", frequency, executor=executor)
    assert np.array_equal(here.response, threads.response)
    assert np.array_equal(here.response, processes.response)


def test_progress_ends_at_all(mass, tmp_path):
    seen = []
    frequency = [20.0, 1.5, 40.0]
    mass.stepped(tmp_path / "sweep.h5", frequency, report=seen.append)
    assert [p.done for p in seen] == [1, 2, 3]
    assert [p.points for p in seen] == [3, 3, 3]
    assert seen[-1].work == pytest.approx(1)
    assert frequency[seen[0].point.frequency] == 1.5  # the longest first


def test_a_point_that_cannot_settle_says_so(mass, tmp_path):
    bode = mass.stepped(tmp_path / "sweep.h5", [15.9155], settling_time=0.2)
    assert bode.status[0, 0] == Status.NOT_SETTLED
    assert "mass.position has not settled after" in bode.message[0, 0]
    assert "expected 0.001 or less" in bode.message[0, 0]
    assert np.isfinite(bode.response[0, 0, 0])
    assert bode.remaining_transient[0, 0, 0] > 1e-3


def test_an_interrupted_sweep_goes_on_where_it_stopped(mass, tmp_path):
    frequency, path = [10.0, 20.0, 30.0, 40.0], tmp_path / "sweep.h5"
    whole = mass.stepped(tmp_path / "whole.h5", frequency)

    def interrupt(progress):
        if progress.done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mass.stepped(path, frequency, report=interrupt)
    half = read_sweep(path)
    assert half.attributes["status"] == "interrupted"
    assert np.sum(half.status == Status.DONE) == 2
    seen = []
    rest = mass.stepped(path, frequency, resume=True, report=seen.append)
    assert [p.done for p in seen] == [3, 4]
    assert np.array_equal(rest.response, whole.response)
    assert mass.stepped(path, frequency, resume=True).attributes["status"] == "complete"


@pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
def test_a_point_that_fails_is_a_status_and_the_others_go_on(foreign, tmp_path, version):
    # it turns NaN after 1.5 s, which only a low frequency lives to see
    component = Component("box", str(foreign[version]), start={"behaviour": 6, "at": 1.5})
    scene = Scene(
        System([component]), ["box.u"], ["box.y"], band=(1, 50), amplitude={"1": 1.0}, step_size=1e-3, stop_time=1.0
    )
    sweeper = Sweeper(scene, ["box.u"])
    bode = sweeper.stepped(tmp_path / "sweep.h5", [1.0, 20.0, 50.0])
    assert bode.status[:, 0].tolist() == [Status.FAILED, Status.DONE, Status.DONE]
    assert "not finite" in bode.message[0, 0]
    assert "t = 1.5" in bode.message[0, 0]
    assert np.isnan(bode.response[0]).all()
    assert np.abs(bode.response[1:, 0, 0]) == pytest.approx(1 / (2 * np.pi * np.array([20.0, 50.0])), rel=1e-2)
    assert bode.attributes["status"] == "complete"


def test_wrong_wiring_and_wrong_names_are_errors_before_anything_runs(mass, tmp_path):
    with pytest.raises(
        StructureError, match=r"mass \(mass_on_spring\) has no variable 'positon'; did you mean position"
    ):
        plan_sweep(mass.assembly, mass.inputs, ["mass.positon"], np.array([1.0]), {"m": 1}, Settings())
    with pytest.raises(StructureError, match=r"mass.position is an FMU's output, expected an input"):
        plan_sweep(mass.assembly, mass.outputs, mass.outputs, np.array([1.0]), {"m": 1}, Settings())
    bench = mass.benches[mass.inputs[0]]
    files = bench.assembly.files
    wrong = {**files, "source": files["mass"]}
    plan = mass.plan([10.0])
    with SweepFile.create(tmp_path / "sweep.h5", plan, mass.record()) as file:
        with pytest.raises(StructureError, match="source"):
            stepped(
                file,
                plan,
                {mass.inputs[0]: Bench(Assembly.read(bench.assembly.system, wrong), tuple(mass.outputs))},
                mass.settings,
            )
        assert len(file.unfinished()) == 1


def test_a_sweep_knows_what_it_was_made_of(mass, tmp_path):
    plan = replace(mass.plan([1.0, 2.0]), settings={"method": "linear"})
    theory = linear(mass.assembly, plan)
    record = system_record("Mass", "text", mass.assembly, operating_point=theory.operating_point)
    assert record.instances[0].solver == "exact"
    assert record.instances[0].fmi_version == 2
    assert len(record.instances[0].sha256) == 64
    assert dict(record.operating_point) == {"mass.mass.position": 0.0, "mass.mass.velocity": 0.0}
    with SweepFile.create(tmp_path / "linear.h5", plan, record) as file:
        file.write(points_of(theory.response(plan.frequency)))
    assert np.array_equal(read_sweep(tmp_path / "linear.h5").response, theory.response(plan.frequency))


@pytest.mark.parametrize(("bandwidth", "is_stable"), [(175.0, True), (188.0, False)])
def test_an_unstable_loop_is_told_from_a_stable_one(bandwidth, is_stable):
    """Sampled PD at 0.25 ms loses stability at a bandwidth of 181.8 Hz."""
    sweeper = Sweeper(load_scene("sdelta_hfsa", {"bandwidth": bandwidth}), SHAKER_INPUTS[5:])
    theory = linear(sweeper.assembly, sweeper.plan([10.0]))
    assert (theory.growth == 0) is is_stable
    assert np.all(np.isfinite(theory.response(np.array([10.0]))))
