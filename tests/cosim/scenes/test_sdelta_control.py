"""The SDelta under its control laws, from linearised FMUs: tracking, damping, and limits of the bandwidth."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from hfsa.cosim.analysis.stability import CoupledStep
from hfsa.cosim.assembly.build import build, instrument
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.fmi.co_simulation import open_instances
from hfsa.cosim.linear.linearize import linear_response, linearize
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene

Z = 5
"""Vertical position among the scene's inputs and outputs; horizontal along x is 3."""


class Robot:
    """The scene with some arguments, built and opened once; gains and damping are start values."""

    def __init__(self, arguments: dict[str, str]):
        self.scene: Scene = load_scene("sdelta_hfsa", arguments)
        self.instances = open_instances(build(self.scene.system).files)
        tuned = self.scene.system["controller"].start
        self._gains = {n: float(v) for n, v in tuned.items() if n.endswith("gain")}

    def starts(
        self, bandwidth: float, control_damping: float, damping: float, sample_time: float | None
    ) -> dict[str, float]:
        """Start values for a design of 6 Hz and 0.7 scaled to another one."""
        scales = {"proportional_gain": (bandwidth / 6) ** 2, "derivative_gain": bandwidth / 6 * control_damping / 0.7}
        values = {f"controller.{n}": gain * scales[n.rpartition(".")[2]] for n, gain in self._gains.items()}
        ticking = {} if sample_time is None else {"controller.sample_time": sample_time}
        return {**values, **ticking, "robot.damping_ratio": damping}

    def response(self, frequency: list[float], starts: dict[str, float] | None = None) -> np.ndarray:
        """Pose commands to poses, (frequencies, 6, 6)."""
        scene = self.scene
        return linear_response(scene.system, self.instances, scene.inputs, scene.outputs, np.array(frequency), starts)

    def poles(
        self,
        bandwidth: float,
        control_damping: float = 0.7,
        damping: float = 0.01,
        sample_time: float | None = None,
    ) -> NDArray[np.complex128]:
        """Poles of the closed loop [1/s]."""
        starts = self.starts(bandwidth, control_damping, damping, sample_time)
        return linearize(self.scene.system, self.instances, [], self.scene.outputs, starts).poles

    def is_stable(self, *design: float) -> bool:
        """Whether no pole of a design is on the right."""
        return bool(np.all(self.poles(*design).real < 0))


@pytest.fixture(scope="module")
def robot():
    """Scenes by their arguments, opened once."""
    made: list[Robot] = []

    @cache
    def opened(**arguments: str) -> Robot:
        made.append(Robot(arguments))
        return made[-1]

    yield opened
    for one in made:
        one.instances.close()


# Tracking -------------------------------------------------------------------------------------------------------------


def test_printed_tracking_of_computed_torque(robot):
    """Command to pose at 5, 10 and 20 Hz: amplitude and error."""
    found = robot(law="ctc", execution="continuous").response([5.0, 10.0, 20.0])
    np.testing.assert_allclose(np.abs(found[:, 3, 3]), [1.02535, 1.07219, 1.25041], atol=1e-5)
    np.testing.assert_allclose(np.abs(found[:, 3, 3] - 1), [0.0261, 0.0823, 0.2853], atol=1e-4)
    np.testing.assert_allclose(np.abs(found[:, Z, Z]), [1.04911, 1.07378, 1.06545], atol=1e-5)
    np.testing.assert_allclose(np.abs(found[:, Z, Z] - 1), [0.0544, 0.1502, 0.2969], atol=1e-4)


def test_printed_tracking_of_pd(robot):
    found = robot(law="pd", execution="continuous").response([2.0, 5.0, 10.0])[:, Z, Z]
    np.testing.assert_allclose(np.abs(found), [1.36814, 0.97084, 0.33123], atol=1e-5)
    assert np.degrees(np.angle(found[1])) == pytest.approx(-85.6, abs=0.05)


def test_motors_and_their_pose_are_one_law(robot):
    """The linear model is one map from motors to pose, so that errors of either are the same."""
    frequency = [1.0, 5.0, 23.0, 47.7]
    motor, pose = (robot(law=law, execution="continuous") for law in ("ctc", "ctc_cartesian"))
    np.testing.assert_allclose(motor.response(frequency), pose.response(frequency), atol=1e-9)


def test_sampled_computed_torque_tends_to_the_continuous_one_at_order_one(robot):
    frequency = [2.0, 10.0]
    exact, it = robot(law="ctc", execution="continuous").response(frequency), robot(law="ctc")
    error = []
    for sample_time in 0.25e-3 / 2 ** np.arange(3):
        starts = {"controller.sample_time": sample_time}
        error.append(np.abs(it.response(frequency, starts) - exact).max())
    np.testing.assert_allclose(np.log2(np.divide(error[:-1], error[1:])), 1, atol=0.03)


@pytest.mark.slow
def test_the_exact_model_is_the_linear_one_about_the_posture(robot):
    """In an FMU, tilted, direct kinematics and all."""
    chosen = {"law": "ctc_cartesian", "execution": "continuous"}
    tilted = {"posture.rotation": "10,5,8", "posture.position": "0.005,0.003,0.155"}
    linear, exact = (robot(**chosen, **tilted, **{"controller.model": model}) for model in ("linear", "exact"))
    np.testing.assert_allclose(exact.response([1.0, 10.0, 40.0]), linear.response([1.0, 10.0, 40.0]), atol=1e-8)


@pytest.mark.parametrize("law", ["pd", "ctc", "ctc_cartesian"])
def test_elastic_feed_forward_leaves_no_error(robot, law):
    """The platform follows the command to 1e-9, in its own motion and in all others, whatever corrects it."""
    found = robot(law=law, execution="continuous", feed_forward="elastic").response([1.0, 10.0, 23.59, 24.55, 50.0])
    np.testing.assert_allclose(found, np.broadcast_to(np.eye(6), found.shape), atol=1e-9)


def test_elastic_feed_forward_for_a_measured_pose(robot):
    chosen = {"law": "ctc_cartesian", "feedback": "pose", "execution": "continuous", "feed_forward": "elastic"}
    found = robot(**chosen).response([1.0, 20.0])
    np.testing.assert_allclose(found, np.broadcast_to(np.eye(6), found.shape), atol=1e-9)


def test_rigid_feed_forward_is_what_computed_torque_contains(robot):
    own, fed = (robot(law="ctc", execution="continuous", feed_forward=word) for word in ("none", "rigid"))
    np.testing.assert_allclose(fed.response([2.0, 20.0]), own.response([2.0, 20.0]), atol=1e-9)


def test_elastic_feed_forward_bears_the_steps_of_a_co_simulation(opened):
    """At the scene's own step, with inputs held, 20 Hz: no more than what sampling leaves, 1.6 %."""
    vertical, position = "reference.command.position[3]", "robot.platform.position[3]"
    scene = load_scene("sdelta_hfsa", {"law": "ctc", "feed_forward": "elastic"})
    system = instrument(scene, vertical, [position])
    coupled = CoupledStep(system, opened(build(system).files), "gauss_seidel", source="source", lock_in="lock_in")
    found = coupled.over(scene.step_size).response([20.0])[0, 0]
    assert abs(found - 1) < 0.02


@pytest.mark.parametrize("law", ["pd", "ctc"])
def test_the_weight_is_held(robot, law):
    """The motors stay and the springs sag by 0.412 mm; the elastic feed-forward lifts the platform by as much."""
    held = {"law": law, "execution": "continuous", "gravity": "9.81"}
    for feed_forward, sag in (("none", -0.412e-3), ("elastic", 0.0)):
        it = robot(**held, feed_forward=feed_forward)
        point = linearize(it.scene.system, it.instances, [], it.scene.outputs).operating_point
        assert point["robot.center.position[3]"] == pytest.approx(sag, abs=1e-6)


# Continuous loops -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("law", "printed"),
    [
        (
            "pd",
            {
                6: (0.0145, -8.57),
                23.6: (0.0204, -20.87),
                50: (0.0184, -6.80),
                100: (0.0142, -2.34),
                200: (0.0108, -1.59),
            },
        ),
        (
            "ctc",
            {
                6: (0.0111, -11.48),
                23.6: (0.0139, -14.36),
                50: (0.0181, -6.38),
                100: (0.0156, -2.27),
                200: (0.0107, -1.58),
            },
        ),
    ],
)
def test_collocated_continuous_control_is_stable_at_every_bandwidth(robot, law, printed):
    """Beyond the first natural frequency it locks the motors: what is left is the robot's own 1 %."""
    it = robot(law=law, execution="continuous")
    for bandwidth, (ratio, abscissa) in printed.items():
        poles = it.poles(bandwidth)
        assert (-poles.real / np.abs(poles)).min() == pytest.approx(ratio, abs=0.5e-4)
        assert poles.real.max() == pytest.approx(abscissa, abs=0.5e-2)
    assert all(it.is_stable(bandwidth) for bandwidth in (0.01, 1.0, 1e3, 1e4))


@pytest.mark.parametrize(
    ("law", "control_damping", "damping", "critical"),
    [
        ("ctc", 0.7, 0.01, 1.3367),
        ("ctc", 1.0, 0.01, 0.9364),
        ("ctc", 0.7, 0.005, 0.668),
        ("ctc", 0.7, 0.02, 2.673),
        ("ctc", 0.7, 0.05, 6.680),
        ("ctc_cartesian", 0.7, 0.01, 1.3367),
        ("ctc_cartesian", 1.0, 0.01, 0.9364),
        ("pd", 0.7, 0.01, 0.5054),
        ("pd", 1.0, 0.01, 0.3538),
    ],
)
def test_the_bandwidth_at_which_a_measured_pose_turns_unstable(robot, law, control_damping, damping, critical):
    """Far below the first natural frequency, and in proportion to the damping; to the printed digits."""
    it, digit = robot(law=law, feedback="pose", execution="continuous"), 1e-3 if damping != 0.01 else 1e-4
    assert it.is_stable(critical - digit, control_damping, damping)
    assert not it.is_stable(critical + digit, control_damping, damping)


# Sampled loops --------------------------------------------------------------------------------------------------------

SAMPLED = {
    ("pd", False): {0.25e-3: 181.8, 1e-3: 44.2, 2e-3: 19.8},
    ("pd", True): {0.25e-3: 84.6, 1e-3: 13.3, 2e-3: 1.58},
    ("ctc", False): {0.25e-3: 60.6, 1e-3: 14.75, 2e-3: 6.72},
    ("ctc", True): {0.25e-3: 29.5, 1e-3: 5.60, 2e-3: 0.975},
}


@pytest.mark.parametrize(("law", "delay"), SAMPLED)
def test_the_bandwidth_at_which_sampled_control_turns_unstable(robot, law, delay):
    """Computed torque is the more fragile: at high frequency it commands up to 15 times what the motors see."""
    it = robot(law=law, delay=str(delay))
    for sample_time, critical in SAMPLED[law, delay].items():
        assert it.is_stable(0.99 * critical, 0.7, 0.01, sample_time)
        assert not it.is_stable(1.01 * critical, 0.7, 0.01, sample_time)


# Mistakes -------------------------------------------------------------------------------------------------------------


def test_an_elastic_feed_forward_against_a_measured_pose_is_refused():
    with pytest.raises(StructureError, match="but elastic feed-forward makes them differ; take law ctc_cartesian"):
        load_scene("sdelta_hfsa", {"law": "ctc", "feedback": "pose", "feed_forward": "elastic"})


def test_auto_takes_continuous_control_where_sampling_is_of_no_consequence(library):
    """At 1 us it makes 0.015 % of the response; at 0.25 ms several percent."""
    from hfsa.cosim.fidelity.levels import choose

    for sample_time, level in (("1e-6", "continuous"), ("0.25e-3", "sampled")):
        scene = load_scene("sdelta_hfsa", {"controller.level": "auto", "sample_time": sample_time})
        assert choose(scene, library)["controller"].level == level
