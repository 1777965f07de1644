"""Controllers at level `continuous`: the limit of the sampled ones for a sample time of zero."""

import numpy as np
import pytest

from hfsa.cosim.assembly.build import build
from hfsa.cosim.linear.linearize import linear_response, linearize
from hfsa.cosim.systems.system import Component, Connection, System

AXES = "axis[1..3]"
PD = {f"{AXES}.proportional_gain": 1e9, f"{AXES}.derivative_gain": 5e4}
# apart, so that each pole moves in proportion to the sample time
CTC = {f"{AXES}.proportional_gain": 3e6, f"{AXES}.derivative_gain": 5e3}
LAWS = {
    "pd": ({"axes": 3, "unit": "m", "effort": "N"}, PD),
    "stage_computed_torque": ({"model": "constant_jacobian"}, CTC),
}
SAMPLE_TIMES = 0.5e-6 / 2 ** np.arange(4)
FREQUENCIES = np.array([50.0, 300.0, 900.0])


def loop(law: str, level: str, sample_time: float | None = None) -> System:
    """The stage with ideal force actuators under a law at a level."""
    arguments, start = LAWS[law]
    ticking = {} if sample_time is None else {"sample_time": sample_time}
    return System(
        [
            Component("controller", law, level, arguments, {**start, **ticking}),
            Component("stage", "rrr_stage", "constant_jacobian", {"causality": "force"}),
        ],
        [
            Connection("stage.stack[1..3].elongation", f"controller.{AXES}.measured"),
            Connection("stage.stack[1..3].elongation_rate", f"controller.{AXES}.measured_rate"),
            Connection(f"controller.{AXES}.command", "stage.stack[1..3].force"),
        ],
    )


@pytest.mark.parametrize("law", LAWS)
def test_sampled_control_tends_to_continuous_control_at_order_one(opened, law):
    """The response to a reference with its rate, and the poles."""
    entering, outputs = ["controller.axis[1].reference"], ["stage.platform.position[1]", "stage.platform.rotation"]
    instances = {level: opened(build(loop(law, level)).files) for level in ("continuous", "sampled")}

    def found(level: str, sample_time: float | None = None) -> tuple[np.ndarray, np.ndarray]:
        system = loop(law, level, sample_time)
        response = linear_response(system, instances[level], entering, outputs, FREQUENCIES)[:, :, 0]
        return response, linearize(system, instances[level], [], outputs).poles

    exact, poles = found("continuous")
    sampled = [found("sampled", T) for T in SAMPLE_TIMES]
    of_response = [np.abs(response - exact).max() for response, _ in sampled]
    of_poles = [np.abs(poles[:, None] - near).min(axis=1).max() for _, near in sampled]
    for error in (of_response, of_poles):
        np.testing.assert_allclose(np.log2(np.divide(error[:-1], error[1:])), 1, atol=0.03)


@pytest.mark.parametrize("law", LAWS)
def test_a_continuous_controller_has_no_memory(opened, law):
    """The linearised loop has the states of the stage alone."""
    system = loop(law, "continuous")
    linear = linearize(system, opened(build(system).files), [], ["stage.platform.rotation"])
    assert not linear.is_sampled
    assert len(linear.states) == 6
    assert np.all(linear.poles.real < 0)
