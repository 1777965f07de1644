"""The error-controlled communication step on a stiff loop, which is unstable with held inputs."""

import numpy as np
import pytest
from algorithm_groups import ERROR_CONTROLLED
from scipy.linalg import expm
from spring_loop import LOOP

from hfsa.components import Model
from hfsa.cosim.assembly.build import build
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.masters.algorithms import ALGORITHMS, open_master
from hfsa.cosim.masters.error_controlled import SCALE, TOLERANCE, ErrorControlled
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, Connection, System

VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
KP, KD, TF = 400.0, 10.0, 5e-3
STEPPED = Component("pd", "x", start={"reference": 1.0, "filtered": 1.0})
"""The filter's state starts at the first error."""


def servo() -> Model:
    """Follows a reference by F = Kp e + Kd de/dt, the derivative filtered with TF."""
    m = Model("Servo", "PD controller of a position")
    r, x = m.input("reference", "m", "What is wanted"), m.input("position", "m", "Measured position")
    w = m.state("filtered", "m", "Filtered error")
    m.der[w] = (r - x - w) / TF
    m.output("force", KP * (r - x) + KD * (r - x - w) / TF, "N", "Force")
    return m


@pytest.fixture(scope="module")
def servos(exported):
    return exported(servo())


def exact(time: np.ndarray) -> np.ndarray:
    """Position from rest at 0 under a reference of 1 m, by the matrix exponential of [x, v, w, 1]."""
    A = np.array(
        [
            [0, 1, 0, 0],
            [-100 - KP - KD / TF, -0.5, -KD / TF, KP + KD / TF],
            [-1 / TF, 0, -1 / TF, 1 / TF],
            [0, 0, 0, 0],
        ]
    )
    return np.array([(expm(A * t) @ [0.0, 0.0, 1.0, 1.0])[0] for t in time])


def run(opened, files, servos, version, tolerance, points=200):
    system = System([Component("plant", "x"), STEPPED], LOOP)
    found = opened({"plant": files["Plant", version], "pd": servos[version]})
    master = ErrorControlled(found, system, ALGORITHMS["error_controlled"], 1.0 / points, tolerance)
    recording = master.record(["plant.position"], rows=points + 1)
    master.initialize()
    master.advance(points)
    error = abs(recording["plant.position"] - exact(recording.time)).max()
    return master, recording["plant.position"][-1], error


@VERSIONS
def test_the_hard_loop(opened, files, servos, version):
    assert exact(np.array([1.0]))[0] == pytest.approx(0.8034755886, abs=1e-10)
    master, end, error = run(opened, files, servos, version, TOLERANCE)
    assert error < 1e-4
    assert abs(end - 0.8034755886) < 1e-4
    assert master.tried < 2000


def test_the_error_follows_the_tolerance(opened, files, servos):
    found = [run(opened, files, servos, 2, tolerance, points=4) for tolerance in (1e-4, 1e-5)]
    errors, steps = [error for *_, error in found], [master.taken for master, *_ in found]
    assert errors[0] / errors[1] == pytest.approx(10, rel=0.3)
    assert steps[1] / steps[0] == pytest.approx(10**0.5, rel=0.2)  # second order


# Ticks ----------------------------------------------------------------------------------------------------------------


def stair() -> Model:
    """Rises by 1 m at each tick."""
    m = Model("Stair", "A stair")
    m.sample_time(0.25)
    height = m.sampled_state("height", "m", "Height")
    m.next[height] = height + 1.0
    m.sampled_output("reference", height + 1.0, "m", "What is wanted")
    return m


def climbed(time: np.ndarray) -> np.ndarray:
    """Position of the mass that follows the stair, the tick at 0 included, at times between 0 and 1 s."""
    A = np.array([[0, 1, 0], [-100 - KP - KD / TF, -0.5, -KD / TF], [-1 / TF, 0, -1 / TF]])
    forced = np.linalg.solve(A, [0.0, KP + KD / TF, 1 / TF])  # rests at -forced under a reference of 1
    ticks = 0.25 * np.arange(4)
    return np.array([sum(((expm(A * (t - tick)) - np.eye(3)) @ forced)[0] for tick in ticks[ticks < t]) for t in time])


def test_jumps_at_ticks(opened, files, servos, exported):
    """Steps are short behind a tick where the inputs jump, and long before the next."""
    connections = [*LOOP, Connection("stair.reference", "pd.reference")]
    instances = opened({"stair": exported(stair())[2], "plant": files["Plant", 2], "pd": servos[2]})
    system = System([Component(name, "x") for name in ("stair", "plant", "pd")], connections)
    master = ErrorControlled(instances, system, ALGORITHMS["error_controlled"], 5e-3, 1e-4)
    recording = master.record(["plant.position"], rows=201)
    taken = []
    master.initialize()
    for _ in range(200):
        master.advance(1)
        taken.append(master.taken)
    position = recording["plant.position"]
    assert np.abs(position - climbed(recording.time)).max() < 1e-3 * position.max()
    steps = np.diff([0, *taken])
    assert np.all(steps[50::50] > 2 * steps[49:-1:50])


def test_a_tick_that_changes_little_shortens_no_step():
    """The stage under its sampled controller: every tick one step is tried whole, and kept as two halves."""
    scene = load_scene("stage_tracking", {"motion": "three_axis"})
    master = open_master(build(scene.system), ERROR_CONTROLLED, scene.step_size, None, scene.tolerance)
    master.initialize()
    master.advance(10)
    before = master.tried
    master.advance(10)
    assert master.tried - before == 3 * 10
    master.close()


# Where it cannot go on ------------------------------------------------------------------------------------------------


def hardening() -> Model:
    """A mass on a spring that gets harder."""
    m = Model("Hardening", "Mass on a hardening spring")
    force = m.input("force", "N", "Force")
    x, v = m.state("x", "m", "Position"), m.state("v", "m/s", "Velocity")
    m.der[x], m.der[v] = v, force - 0.5 * v - 100.0 * x * (1 + x**2)
    m.output("position", x, "m", "Position")
    return m


def test_an_fmu_that_is_solved_coarser_than_the_tolerance(opened, servos, exported):
    tolerance = 1e-8
    instances = opened({"plant": exported(hardening())[3], "pd": servos[3]})
    system = System([Component("plant", "x"), STEPPED], LOOP)
    master = ErrorControlled(instances, system, ALGORITHMS["error_controlled"], 0.01, tolerance)
    with pytest.raises(
        StructureError, match=r"plant \(Hardening\.fmi3\.fmu\) solves its own equations to 1e-08 only; .*"
    ) as caught:
        master.initialize()
    assert "at least 15.5 times as large, or a smaller plant.solver.relative_tolerance" in str(caught.value)
    master.initialize(starts={"plant.solver.relative_tolerance": (SCALE * tolerance) ** 1.5})
    master.tolerance = 15.6 * tolerance
    master.initialize()
