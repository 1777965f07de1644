"""Longest stable sample time of a sampled system, against its difference equation and against co-simulation."""

import math

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize

from hfsa.cosim.analysis.sampling import ACCURACY, SamplingLimit, sampling_limit
from hfsa.cosim.assembly import build
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.systems.system import Component, Connection, System

OUTPUTS = ["plant.position"]


def sampled_loop(sample_time: float) -> System:
    """The mass on a spring under the sampled controller of `conftest`."""
    return System(
        [Component("plant", "Plant"), Component("pd", "SampledPd", start={"sample_time": sample_time})],
        [Connection("plant.position", "pd.position"), Connection("pd.force", "plant.force")],
    )


def radius(sample_time: float) -> float:
    """Spectral radius of [x, v, last sample] from tick to tick: 1 kg, 0.5 N.s/m, 100 N/m; gains 40 N/m, 2 N.s/m."""
    free = np.array([[0.0, 1.0, 0.0], [-100.0, -0.5, 1.0], [0.0, 0.0, 0.0]])
    between = scipy.linalg.expm(free * sample_time)
    force = np.array([-40.0 - 2.0 / sample_time, 0.0, 2.0 / sample_time])
    matrix = np.vstack([np.column_stack([between[:2, :2], [0, 0]]) + np.outer(between[:2, 2], force), [1, 0, 0]])
    return float(np.abs(np.linalg.eigvals(matrix)).max())


@pytest.mark.parametrize("sample_time", [0.01, 1.0], ids=["stable as it is", "unstable as it is"])
def test_the_limit_is_that_of_the_difference_equation(files, opened, sample_time):
    instances = opened({"plant": files["Plant", 2], "pd": files["SampledPd", 2]})
    found = sampling_limit(sampled_loop(sample_time), instances, OUTPUTS)
    assert found is not None
    assert (found.sample_time, found.is_stable) == (sample_time, sample_time == 0.01)
    assert radius(found.longest * (1 - 3 * ACCURACY)) < 1 < radius(found.longest * (1 + 3 * ACCURACY))


def test_what_has_no_limit(files, opened):
    loop = sampled_loop(0.01)
    instances = opened({"plant": files["Plant", 2], "pd": files["SampledPd", 2]})
    open_loop = System(loop.components, loop.connections[:1])
    assert sampling_limit(open_loop, instances, OUTPUTS) is None  # the controller does not reach the plant
    assert sampling_limit(open_loop, instances, [*OUTPUTS, "pd.force"]) == SamplingLimit(0.01, math.inf)


def test_the_robot_settles_on_one_side_of_its_limit_and_not_on_the_other(opened, library):
    """A jump of the command by 10 um, co-simulated at 16 steps in a sample time: the last jerk beside the first."""
    scene = load_scene("sdelta_hfsa")
    instances = opened(build.build(scene.system).files)
    found = sampling_limit(scene.system, instances, scene.outputs)
    assert found is not None
    assert found.is_stable
    assert found.longest == pytest.approx(3.366e-3, rel=1e-3)
    remains = {}
    for side in (0.97, 1.03):
        tick = side * found.longest
        master = make_master(instances, scene.system, "gauss_seidel", tick / 16, library)
        recording = master.record(scene.outputs, rows=16 * 400 + 1)
        master.initialize(starts={"controller.sample_time": tick, "reference.command.position[3]": 10e-6})
        master.advance(16 * 400)
        first, last = np.ptp(recording.values[:800], axis=0), np.ptp(recording.values[-800:], axis=0)
        remains[side] = last.max() / first.max()
    assert remains[0.97] < 1e-3
    assert remains[1.03] > 10


YAW, SHIFT = (0.414010, 29.1175e6), (2.446981, 27.0388e6)
"""Mass [kg] and stiffness [N/m] of the stage's modes of free stacks: equal elongations, and those that add up to 0."""


def mode_limit(mass: float, stiffness: float, gain: float, rate_gain: float, ahead: float = 0.0) -> float:
    """Sample time [s] above which a held force -gain x - rate_gain v + ahead T v makes a mode of the stage grow."""

    def grows(sample_time: float) -> bool:
        free = np.array([[0, 1, 0], [-stiffness / mass, -6.02e-6 * stiffness / mass, 1 / mass], [0, 0, 0]])
        between = scipy.linalg.expm(free * sample_time)[:2]
        force = np.array([[-gain, -rate_gain + ahead * sample_time]])
        return np.abs(np.linalg.eigvals(between[:, :2] + between[:, 2:] @ force)).max() > 1

    times = np.geomspace(1e-8, 1e-2, 2000)
    low = times[np.argmax([grows(t) for t in times]) - 1]
    return float(scipy.optimize.brentq(lambda t: grows(t) - 0.5, low, 1.01 * low))


CONSTANT = {"actuator": "force", "stage": "constant_jacobian", "model": "constant_jacobian"}


def stage_limit(opened, arguments: dict[str, object]) -> SamplingLimit:
    scene = load_scene("stage_tracking", arguments)
    found = sampling_limit(scene.system, opened(build.build(scene.system).files), scene.outputs)
    assert found is not None
    return found


@pytest.mark.parametrize(("gain", "rate_gain"), [(1e9, 5e4), (1e12, 2e6)])
def test_the_stage_under_pd_is_limited_by_its_yaw(opened, gain, rate_gain):
    arguments = {"law": "pd", "proportional_gain": gain, "derivative_gain": rate_gain, **CONSTANT}
    found = stage_limit(opened, arguments)
    expected = min(mode_limit(*mode, gain, rate_gain) for mode in (YAW, SHIFT))
    assert found.longest == pytest.approx(expected, rel=1e-3)
    assert found.longest == pytest.approx(min(2 * rate_gain / gain, 2 * YAW[0] / rate_gain), rel=3e-3)
    assert found.is_stable == (gain == 1e9)


def test_the_stage_under_computed_torque_is_limited_by_its_yaw(opened):
    """The held force cancels the hinges at the ticks only, half a sample ahead: below the 0.53 ms of a free mass."""
    omega = 2 * math.pi * 300
    expected = min(
        mode_limit(m, k, m * omega**2 - k, 2 * m * omega - 6.02e-6 * k, ahead=k / 2) for m, k in (YAW, SHIFT)
    )
    found = stage_limit(opened, {"law": "ctc", **CONSTANT})
    assert found.longest == pytest.approx(expected, rel=1e-3)
    assert found.longest == pytest.approx(0.383e-3, rel=1e-3)
