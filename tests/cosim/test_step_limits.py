"""Limits of communication steps before anything runs, and what is said of a step beyond them."""

import json

import numpy as np
import pytest
from spring_loop import loop

from hfsa.cosim.build import build, load_scene
from hfsa.cosim.master import Master
from hfsa.cosim.step_limits import LIMITED, step_limits, unstable_step
from hfsa.cosim.system import HELD, System


def growth(master: Master) -> float:
    """How many times as large the position is at the end as after a third of 3000 steps."""
    recording = master.record(["plant.position"], rows=3001)
    master.initialize()
    master.advance(3000)
    found = np.abs(recording["plant.position"])
    return found[-500:].max() / found[1000:1500].max()


@pytest.mark.parametrize("algorithm", ["gauss_seidel", "jacobi", "jacobi_plain", "gauss_seidel_linear", "quasi_newton"])
def test_a_loop_decays_below_its_limit_and_grows_above(files, opened, algorithm):
    system, found = loop(files)
    (limit,) = step_limits(system, opened(found), 1e-3, [algorithm])
    assert limit.is_stable
    assert limit.longest > 1e-3
    if np.isfinite(limit.longest):
        assert growth(Master(opened(found), system, algorithm, 0.98 * limit.longest)) < 1
        assert growth(Master(opened(found), system, algorithm, 1.02 * limit.longest)) > 1


def test_steps_of_a_sampled_loop_fit_its_ticks(files, opened):
    system, found = loop(files, controller="SampledPd")
    limits = list(step_limits(system, opened(found), 0.01, HELD, {"pd.sample_time": 0.01}))
    for limit in limits:
        ratio = limit.longest / 0.01 if limit.longest > 0.01 else 0.01 / limit.longest
        assert ratio == pytest.approx(round(ratio))


def test_free_rigid_motion_does_not_count(opened):
    """The drives of `sdelta_hfsa` without a controller: an algorithm makes their drift grow, the modes have a limit."""
    scene = load_scene("sdelta_hfsa")
    names = [c.name for c in scene.system.components if c.name == "robot" or c.name.startswith("drive")]
    components = [scene.system[name] for name in names]
    inner = [c for c in scene.system.connections if {scene.system.split(e)[0] for e in (c.start, c.end)} <= set(names)]
    system = System(components, inner)
    limits = {f.algorithm: f.longest for f in step_limits(system, opened(build(system)), 50e-6, HELD)}
    expected = {"jacobi_plain": 62.8e-6, "jacobi": 104.3e-6, "gauss_seidel": 285e-6}
    assert limits == pytest.approx(expected, rel=2e-3)


def test_what_is_said_of_a_step_beyond_the_limit(files, opened):
    system, found = loop(files)
    instances = opened(found)
    (limit,) = step_limits(system, instances, 1e-3, ["gauss_seidel"])
    assert unstable_step(system, instances, "gauss_seidel", 1e-3) is None
    sentence = unstable_step(system, instances, "gauss_seidel", 1.1 * limit.longest)
    assert sentence is not None
    assert "a mode grows by" in sentence
    assert f"{limit.longest:.3g}"[:4] in sentence
    assert "the algorithm " in sentence


def test_the_verb(hfsa):
    code, out, _ = hfsa("stability", "sdelta_hfsa", "-p", "delay=true", "--json")
    assert code == 0
    data = json.loads(out)
    assert {entry["algorithm"] for entry in data["algorithms"]} >= set(LIMITED)
    assert data["sample_time"]["longest"] > data["sample_time"]["own"] == 0.25e-3


def test_a_run_warns_of_its_step(hfsa, tmp_path):
    code, _, err = hfsa(
        "run", "sdelta_hfsa", "--step", "0.00125", "--algorithm", "jacobi", "--stop", "0.005", "-o", tmp_path / "x.h5"
    )
    assert code == 0
    assert "with jacobi at a step of 0.00125 s a mode grows" in err
