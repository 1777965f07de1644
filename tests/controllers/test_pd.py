"""PD control: its law, its limit, its delay, its Bode sentence; and the tuning of the SDelta's motors."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hfsa.components import ModelError
from hfsa.components._mechanics.sdelta_geometry import Posture
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.linearize import linearize
from hfsa.components._modelling.model import Kind
from hfsa.components.sdelta import sdelta
from hfsa.controllers.pd import pd
from hfsa.controllers.sdelta_tuning import analyze

MODEL = pd(axes=2)
TICK = functions(MODEL).tick


def command(inputs: dict[str, float], parameters: dict[str, float]) -> dict[str, float]:
    columns = [
        [values.get(q.name, q.start) for q in MODEL.of(kind)]
        for kind, values in ((Kind.INPUT, inputs), (Kind.PARAMETER, parameters))
    ]
    _, held = TICK(0.0, [], [], *columns)
    return dict(zip([q.name for q in MODEL.of(Kind.SAMPLED_OUTPUT)], np.array(held).ravel(), strict=True))


@given(*[st.floats(-10, 10) for _ in range(5)], st.floats(0, 100), st.floats(0, 100), st.floats(0.1, 50))
def test_the_law_and_its_limit(reference, measured, rate, measured_rate, feed_forward, kp, kd, limit):
    axis = "axis[2]."
    out = command(
        {
            axis + "reference": reference,
            axis + "measured": measured,
            axis + "reference_rate": rate,
            axis + "measured_rate": measured_rate,
            axis + "feed_forward": feed_forward,
        },
        {axis + "proportional_gain": kp, axis + "derivative_gain": kd, axis + "limit": limit},
    )
    wanted = feed_forward + kp * (reference - measured) + kd * (rate - measured_rate)
    assert out[axis + "command"] == pytest.approx(np.clip(wanted, -limit, limit), abs=1e-9)
    assert out[axis + "saturation"] == (abs(wanted) > limit)
    assert out["axis[1].command"] == 0


@pytest.mark.parametrize("delay", [False, True])
def test_bode_sentence(delay):
    """Flat at -Kp from measured, at -Kd from its rate; `delay` turns by frequency times sample time."""
    gains = {"axis[1].proportional_gain": 3.0, "axis[1].derivative_gain": 0.5, "sample_time": 1e-3}
    system = linearize(pd(delay=delay), gains)
    row = system.output_labels.index("axis[1]/command")
    for frequency in (1.0, 40.0, 400.0):
        z = np.exp(2j * np.pi * frequency * 1e-3)
        H = np.atleast_2d(system(z))[row]
        turn = 1 / z if delay else 1
        assert H[system.input_labels.index("axis[1]/measured")] == pytest.approx(-3.0 * turn, rel=1e-12)
        assert H[system.input_labels.index("axis[1]/measured_rate")] == pytest.approx(-0.5 * turn, rel=1e-12)


def test_bode_sentence_without_sampling():
    """The same at every instant, with no state that could remember."""
    gains = {"axis[1].proportional_gain": 3.0, "axis[1].derivative_gain": 0.5}
    system = linearize(pd(level="continuous"), gains)
    row = system.output_labels.index("axis[1]/command")
    assert system.nstates == 0
    for signal, gain in (("measured", -3.0), ("measured_rate", -0.5), ("reference", 3.0), ("feed_forward", 1.0)):
        assert np.asarray(system.D)[row, system.input_labels.index(f"axis[1]/{signal}")] == gain


def test_the_law_is_the_same_at_both_levels():
    continuous = pd(level="continuous", axes=2)
    inputs = np.random.default_rng(0).standard_normal(10)
    parameters = [0.7, 1.1, 0.2, 0.4, 0.5, 0.6]
    _, held = TICK(0.0, [], [], inputs, [1.0, *parameters])
    out = functions(continuous).out(0.0, [], [], inputs, parameters)
    np.testing.assert_array_equal(np.array(out), np.array(held))
    assert np.array(out)[2:].any()  # the limit acts


def test_units_follow_the_arguments():
    model = pd(unit="m", effort="N")
    assert model["axis[1].proportional_gain"].unit == "N/m"
    assert model["axis[1].derivative_gain"].unit == "N.s/m"


def test_refusals():
    with pytest.raises(ModelError, match="axes is 0, expected 1 or more"):
        pd(axes=0)
    with pytest.raises(ModelError, match=r"proportional_gain is -1 N\.m/rad, expected 0 to inf"):
        pd().set_start("axis[1].proportional_gain", -1.0)
    with pytest.raises(
        ModelError, match="pd: delay is one sample time, and level continuous has none; take level samp"
    ):
        pd(level="continuous", delay=True)
    with pytest.raises(ModelError, match="pd: level is 'sample'; did you mean sampled"):
        pd(level="sample")  # type: ignore[arg-type]


def test_tuning_follows_its_law():
    """Every motor has the same inertia at the symmetric posture, where all angles are zero."""
    result, w_c = analyze(bandwidth=6.0, damping=0.7), 2 * np.pi * 6
    inertia = np.diag(result["motor_inertia"])
    assert inertia == pytest.approx(inertia[0], rel=1e-12)
    assert result["proportional_gain"] == pytest.approx(inertia * w_c**2, rel=1e-12)
    assert result["derivative_gain"] == pytest.approx(2 * 0.7 * w_c * inertia, rel=1e-12)
    assert result["motor_angles"] == pytest.approx([0.0] * 6, abs=1e-12)


def test_the_holding_torque_balances_the_robots_reaction():
    """J_C^T of the weight's reaction on the tubes plus the motors' torque is nothing, also away from symmetry."""
    from hfsa.components._mechanics.sdelta_kinematics import THESIS

    posture = Posture((10.0, 5.0, 8.0), (0.005, 0.003, 0.155))
    model = sdelta(posture=posture, level="rigid")
    model.set_start("gravity", 9.81)
    inputs, parameters = ([q.start for q in model.of(kind)] for kind in (Kind.INPUT, Kind.PARAMETER))
    out = functions(model).out(0.0, [], [], inputs, parameters)
    reaction = dict(zip([q.name for q in model.of(Kind.OUTPUT)], np.array(out).ravel(), strict=True))
    tubes = np.array([[reaction[f"drive[{j}].force"], reaction[f"drive[{j}].torque"]] for j in (1, 2, 3)]).ravel()
    torque = analyze(posture=posture)["holding_torque"]
    assert THESIS.drives_matrix.T @ tubes + torque == pytest.approx([0.0] * 6, abs=1e-12)


def test_tuning_refuses_a_negative_bandwidth():
    with pytest.raises(ModelError, match="bandwidth is -6, expected 0 or more"):
        analyze(bandwidth=-6.0)
