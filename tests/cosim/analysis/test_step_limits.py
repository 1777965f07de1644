"""Step limits computed before a run, and the advice for a step beyond them."""

import json

import numpy as np
import pytest
from algorithm_groups import HELD
from spring_loop import loop

from hfsa.cosim.analysis.stability import CoupledStep
from hfsa.cosim.analysis.step_limits import LIMITED, advice, fitting, step_limits
from hfsa.cosim.assembly.build import build
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.experiments.stability_map import Axis, stability_map
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.masters.master import Master
from hfsa.cosim.systems.system import System


def free_drives(arguments: dict[str, str]) -> System:
    """The robot and its drives without a controller."""
    system = load_scene("sdelta_hfsa", arguments).system
    names = [c.name for c in system.components if c.name == "robot" or c.name.startswith("drive")]
    inner = [c for c in system.connections if {system.split(end)[0] for end in (c.start, c.end)} <= set(names)]
    return System([system[name] for name in names], inner)


def growth(master: Master, steps: int = 3000) -> float:
    """How many times as large the position is in the last sixth of a run as after a third of it."""
    recording = master.record(["plant.position"], rows=steps + 1)
    master.initialize()
    master.advance(steps)
    found, sixth = np.abs(recording["plant.position"]), steps // 6
    return found[-sixth:].max() / found[2 * sixth : 3 * sixth].max()


@pytest.mark.parametrize("algorithm", ["gauss_seidel", "jacobi", "jacobi_plain", "gauss_seidel_linear", "quasi_newton"])
def test_a_loop_decays_below_its_limit_and_grows_above(files, opened, algorithm):
    system, found = loop(files)
    (limit,) = step_limits(system, opened(found), 1e-3, [algorithm])
    assert limit.is_stable
    assert limit.longest > 1e-3
    if np.isfinite(limit.longest):
        assert growth(make_master(opened(found), system, algorithm, 0.98 * limit.longest)) < 1
        assert growth(make_master(opened(found), system, algorithm, 1.02 * limit.longest)) > 1


@pytest.mark.parametrize(("algorithm", "ratio"), [("gauss_seidel", 2), ("jacobi", 2), ("jacobi_plain", 1)])
def test_steps_of_a_sampled_loop_fit_its_ticks(files, opened, algorithm, ratio):
    """The limit is a multiple of the sample time; the next one grows in simulation."""
    system, found = loop(files, controller="SampledPd")
    (limit,) = step_limits(system, opened(found), 0.01, [algorithm])
    assert limit.longest == pytest.approx(ratio * 0.01)
    assert growth(make_master(opened(found), system, algorithm, ratio * 0.01)) < 1
    assert growth(make_master(opened(found), system, algorithm, (ratio + 1) * 0.01), steps=150) > 1


@pytest.mark.parametrize(
    ("name", "arguments", "limits"),
    [
        (
            "sdelta_hfsa",
            {},
            {
                "gauss_seidel": (1.5e-3, 1.75e-3),
                "jacobi": (0.5e-3, 0.75e-3),
                "jacobi_plain": (0.25e-3, 0.5e-3),
                "linearized_feedback": (2.5e-3, 2.75e-3),
            },
        ),
        (
            "stage_tracking",
            {"actuator": "force"},
            {"gauss_seidel": (0.32e-3, 0.33e-3), "jacobi": (0.32e-3, 0.33e-3), "jacobi_plain": (0.15e-3, 0.16e-3)},
        ),
    ],
)
def test_limits_of_the_robot_and_the_stage(opened, name, arguments, limits):
    """Each is the last step that fits, and simulations on it and on the next one decay and grow.

    On the stage 0.33 ms is the only one below 0.45 ms that grows.
    """
    scene = load_scene(name, arguments)
    found = step_limits(scene.system, opened(build(scene.system).files), scene.step_size, limits)
    assert {limit.algorithm: limit.longest for limit in found} == pytest.approx({k: v[0] for k, v in limits.items()})
    for algorithm, steps in limits.items():
        sides = stability_map(name, arguments, [Axis("step_size", np.array(steps))], algorithm=algorithm)
        assert sides.stable.tolist() == [True, False]
        assert sides.verified.tolist() == [1, 1]


def test_free_rigid_motion_does_not_count(opened):
    """The drives of `sdelta_hfsa` without a controller: an algorithm makes their drift grow, the modes have a limit."""
    system = free_drives({})
    limits = {f.algorithm: f.longest for f in step_limits(system, opened(build(system).files), 50e-6, HELD)}
    expected = {"jacobi_plain": 62.8e-6, "jacobi": 104.3e-6, "gauss_seidel": 285e-6}
    assert limits == pytest.approx(expected, rel=2e-3)


def test_what_is_said_of_a_step_beyond_the_limit(files, opened):
    system, found = loop(files)
    instances = opened(found)
    (limit,) = step_limits(system, instances, 1e-3, ["gauss_seidel"])
    coupled = CoupledStep(system, instances)
    assert advice(coupled, "gauss_seidel", 1e-3, []) is None
    sentence = advice(coupled, "gauss_seidel", 1.1 * limit.longest, [])
    assert sentence is not None
    assert "a mode grows by" in sentence
    assert f"{limit.longest:.3g}"[:4] in sentence
    assert "the algorithm " in sentence


@pytest.mark.slow
def test_linearised_feedback_is_advised_where_nothing_else_goes_as_far(opened):
    """The stage at its extreme gains, continuously: with plants that close their loops any step will do."""
    scene = load_scene("stage_extremes", {"execution": "continuous"})
    coupled = CoupledStep(scene.system, opened(build(scene.system).files))
    assert advice(coupled, "linearized_feedback", 1e-6, []) is None
    sentence = advice(coupled, "quasi_newton", 1e-6, [])
    assert sentence is not None
    assert "a step of 1.549e-08 s or less" in sentence
    assert "the algorithm linearized_feedback, stable at every step that was evaluated" in sentence


@pytest.mark.parametrize(
    ("step", "times", "fits"),
    [
        (1.7e-3, [], 1.7e-3),
        (1.7e-3, [1e-3], 1e-3),
        (2.1e-3, [1e-3], 2e-3),
        (0.7e-3, [1e-3], 0.5e-3),
        (0.5e-3, [1e-3], 0.5e-3),
        (5e-3, [1e-3, 2e-3], 4e-3),
    ],
)
def test_the_longest_step_that_fits(step, times, fits):
    assert fitting(step, times) == pytest.approx(fits, rel=1e-12)


@pytest.mark.slow
def test_the_verb(hfsa):
    code, out, _ = hfsa("stability", "sdelta_hfsa", "-p", "delay=true", "--json")
    assert code == 0
    data = json.loads(out)
    assert {entry["algorithm"] for entry in data["algorithms"]} >= set(LIMITED)
    assert data["sample_time"]["longest"] > data["sample_time"]["own"] == 0.25e-3


@pytest.mark.parametrize(
    ("damping", "oscillatory", "aperiodic"),
    [(20.0, -10.0, None), (250.0, None, -50.0)],
    ids=["it oscillates at 15.8 Hz", "it creeps back, beyond critical damping"],
)
def test_modes_are_called_by_what_they_do(hfsa, damping, oscillatory, aperiodic):
    """Of 1 kg on 1e4 N/m: -c/2 where it turns; the roots -50 and -200 1/s where it does not: no free motion."""
    words = ("stability", "mass_on_spring", "-p", f"damping={damping}", "--algorithm", "gauss_seidel")
    code, out, _ = hfsa(*words, "--json")
    (entry,) = json.loads(out)["algorithms"]
    assert (code, json.loads(out)["oscillatory_from"]) == (0, 1.0)
    for found, expected in ((entry["oscillatory_growth"], oscillatory), (entry["aperiodic_growth"], aperiodic)):
        assert found == (None if expected is None else pytest.approx(expected, rel=1e-4))
    _, out, _ = hfsa(*words)
    assert "oscillatory modes" in out
    assert "aperiodic modes" in out
    assert "oscillatory from 1 Hz on" in out
    assert "rigid" not in out


@pytest.mark.slow
def test_the_verb_of_one_algorithm(hfsa):
    code, out, _ = hfsa("stability", "sdelta_hfsa", "--algorithm", "linearized_feedback", "--json")
    assert code == 0
    (entry,) = json.loads(out)["algorithms"]
    assert (entry["algorithm"], entry["is_stable"]) == ("linearized_feedback", True)
    assert entry["longest_step"] == pytest.approx(2.5e-3)
    code, out, _ = hfsa("stability", "stage_tracking", "--algorithm", "linearized_feedback")
    assert code == 0
    assert "not offered" in out
    assert "there is nothing to feed back" in out
    code, out, _ = hfsa("stability", "stage_tracking", "--algorithm", "monolithic")
    assert "chooses its steps" in out


def test_a_file_is_made_of_a_map_only(hfsa):
    code, _, err = hfsa("stability", "sdelta_hfsa", "-o", "limits.h5")
    assert code == 2
    assert "-o limits.h5: limits are printed" in err
    assert "--vary NAME=FROM:TO:N" in err


def test_a_run_warns_of_its_step(hfsa, tmp_path):
    code, _, err = hfsa(
        "run", "sdelta_hfsa", "--step", "0.00125", "--algorithm", "jacobi", "--stop", "0.005", "-o", tmp_path / "x.h5"
    )
    assert code == 0
    assert "with jacobi at a step of 0.00125 s a mode grows" in err
