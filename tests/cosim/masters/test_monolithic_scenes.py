"""Monolithic integration of scenes: the limit of co-simulation, as exact as its tolerance, and as fast."""

import numpy as np
import pytest
from algorithm_groups import MONOLITHIC, MONOLITHIC_DAE

from hfsa.cosim.assembly.build import build
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.masters.algorithms import open_master
from hfsa.cosim.masters.monolithic import integrator
from hfsa.cosim.masters.monolithic.cvode import Cvode


def simulated(name, arguments, algorithm, step, stop, names, starts=None, library=None) -> np.ndarray:
    """Values of a scene's run at twenty points, (21, names)."""
    scene = load_scene(name, arguments)
    one = open_master(build(scene.system), algorithm, step, library)
    try:
        recording = one.record(names, rows=21, every=round(stop / step / 20))
        one.initialize(starts=starts)
        one.advance(round(stop / step))
        return np.array([recording[name] for name in names]).T
    finally:
        one.close()


ROBOT = ("sdelta_hfsa", {}), ["robot.platform.position[3]", "controller.axis[1].command"]
STAGE = ("stage_tracking", {"motion": "three_axis"}), ["stage.stack[1].elongation", "controller.axis[1].command"]


def errors(found: list[np.ndarray], exact: np.ndarray) -> np.ndarray:
    """Largest error of each run, relative to the largest value of its column."""
    return np.array([(np.abs(one - exact).max(axis=0) / np.abs(exact).max(axis=0)).max() for one in found])


def test_the_robots_co_simulation_tends_to_it(library):
    """Gauss-Seidel with held inputs: of the first order in the step."""
    scene, names = ROBOT
    starts = {"reference.command.position[3]": 1e-5}
    exact = simulated(*scene, "monolithic", 0.25e-3, 0.02, names, starts)
    steps = [0.25e-3 / n for n in (10, 20, 40)]
    found = [simulated(*scene, "gauss_seidel", step, 0.02, names, starts, library) for step in steps]
    error = errors(found, exact)
    assert error[0] < 0.05
    np.testing.assert_allclose(error[:-1] / error[1:], 2.0, rtol=0.05)


def test_the_stages_co_simulation_is_it(library):
    """No value that could be late is exchanged between the stage's ticks."""
    scene, names = STAGE
    exact = simulated(*scene, "monolithic", 1e-5, 1e-3, names)
    assert errors([simulated(*scene, "gauss_seidel", 1e-5, 1e-3, names, None, library)], exact)[0] < 1e-9


@pytest.mark.parametrize("algorithm", [MONOLITHIC, MONOLITHIC_DAE])
@pytest.mark.parametrize("frequency", [1, 20])
def test_rounding_is_not_resolved(monkeypatch, hfsa, algorithm, frequency):
    """A sine sets in from rest, picometres beside a tube's angle of 1 rad: tens of steps a tick, at 1 Hz up to 200."""
    steps, step = [], integrator.Integrator._step

    def counted(self, to, stop):
        steps.append(to)
        step(self, to, stop)

    monkeypatch.setattr(integrator.Integrator, "_step", counted)
    monkeypatch.setattr(integrator, "MOST_STEPS", 10_000)
    command = f"run sdelta_hfsa --algorithm {algorithm} --frequency {frequency} --step 0.25e-3 --stop 5e-3 -o run.h5"
    assert hfsa(*command.split())[0] == 0
    assert 20 * 10 < len(steps) < 20 * 300


@pytest.mark.parametrize(
    ("part", "step", "stop"), [(ROBOT, 0.25e-3, 5e-3), (STAGE, 1e-5, 4e-4)], ids=["robot", "stage"]
)
def test_the_error_follows_the_tolerance(monkeypatch, part, step, stop):
    scene, names = part
    starts = {"reference.command.position[3]": 1e-5} if part is ROBOT else None
    found = {}
    for tolerance in (3e-14, 1e-11, 1e-8, 1e-5):
        monkeypatch.setattr(Cvode, "tolerance", tolerance)
        found[tolerance] = simulated(*scene, "monolithic", step, stop, names, starts)
    exact = found.pop(3e-14)
    error = errors(list(found.values()), exact)
    assert np.all(np.diff(error) > 0)
    assert np.all(error < [1e-9, 1e-6, 1e-2])
