"""Controllers of the 3-RRR stage: what they cancel, hold, convert and clip, and their Bode sentences."""

from functools import cache

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hfsa.components import Model, ModelError, rrr_stage
from hfsa.components._mechanics.rrr_design import Design
from hfsa.components._mechanics.rrr_kinematics import NOMINAL, forward
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.linearize import linearize
from hfsa.components._modelling.model import Kind
from hfsa.components.pzt_stack import pzt_stack
from hfsa.controllers.force_to_voltage import force_to_voltage
from hfsa.controllers.stage_computed_torque import stage_computed_torque
from hfsa.controllers.stage_feed_forward import stage_feed_forward
from hfsa.controllers.stage_integral import stage_integral

MODELS = ("exact", "constant_jacobian")
CTC = {model: stage_computed_torque(model=model) for model in MODELS}
TICK = {model: functions(controller).tick for model, controller in CTC.items()}
CONVERSION, INTEGRAL = force_to_voltage(axes=1), stage_integral()
PLANT = {level: rrr_stage.rrr_stage(level=level, causality="force") for level in MODELS}
FUNCTIONS = {level: functions(plant) for level, plant in PLANT.items()}
FEED_FORWARD = {model: functions(stage_feed_forward(model=model)) for model in MODELS}

micrometres = st.tuples(*[st.floats(-12e-6, 12e-6)] * 3)
speeds = st.tuples(*[st.floats(-1e-2, 1e-2)] * 3)
accelerations = st.tuples(*[st.floats(-10.0, 10.0)] * 3)


def column(model: Model, kind: Kind, values: dict[str, float]) -> list[float]:
    return [values.get(q.name, q.start) for q in model.of(kind)]


def axes(**triples) -> dict[str, float]:
    return {f"axis[{i}].{name}": triple[i - 1] for name, triple in triples.items() for i in (1, 2, 3)}


def tick(model: Model, sampled: list[float], inputs: dict[str, float]) -> tuple[list[float], dict[str, float]]:
    """Next sampled states, and sampled outputs by name."""
    columns = column(model, Kind.INPUT, inputs), column(model, Kind.PARAMETER, {})
    following, held = tick_of(model)(0.0, [], sampled, *columns)
    outputs = [q.name for q in model.of(Kind.SAMPLED_OUTPUT)]
    return list(np.array(following).ravel()), dict(zip(outputs, np.array(held).ravel(), strict=True))


@cache
def tick_of(model: Model) -> ca.Function:
    return functions(model).tick


@pytest.mark.parametrize("level", MODELS)
@settings(max_examples=25)
@given(micrometres, speeds, micrometres, speeds, accelerations)
def test_computed_torque_leaves_a_linear_error(level, elongation, rate, r, r_rate, r_acceleration):
    """On a stage that is its model the elongations accelerate as demanded, whatever the state, but for the hold."""
    given_values = axes(
        reference=r,
        reference_rate=r_rate,
        reference_acceleration=r_acceleration,
        measured=elongation,
        measured_rate=rate,
    )
    _, held = TICK[level](
        0.0,
        [],
        [],
        column(CTC[level], Kind.INPUT, given_values),
        column(CTC[level], Kind.PARAMETER, {"sample_time": 1e-12}),
    )
    force = np.array(held).ravel()[:3]
    kp, kv = (2 * np.pi * 300) ** 2, 2 * 2 * np.pi * 300
    demanded = np.array(r_acceleration) + kv * (np.array(r_rate) - rate) + kp * (np.array(r) - elongation)
    assert acceleration(level, elongation, rate, force) == pytest.approx(demanded, rel=1e-9, abs=1e-6)


def acceleration(level, elongation, rate, force) -> np.ndarray:
    """Second derivatives of the elongations: those of the output `elongation_rate` along the motion."""
    plant, kinds = PLANT[level], (Kind.INPUT, Kind.PARAMETER)
    u, p = (column(plant, kind, {f"stack[{i + 1}].force": force[i] for i in range(3)}) for kind in kinds)
    J = rrr_stage.analyze(level=level, elongation=tuple(elongation))["jacobian"]
    state = [*elongation, *rate] if level == "constant_jacobian" else [*forward(NOMINAL, elongation), *(J @ rate)]
    made = FUNCTIONS[level]
    moving = made.rhs(0.0, state, [], u, p)
    slopes = made.fwd(0.0, state, [], u, p, 1.0, moving, [], np.zeros(len(u)), np.zeros(len(p)))[1]
    names = [q.name for q in plant.of(Kind.OUTPUT)]
    return np.array([float(slopes[names.index(f"stack[{i}].elongation_rate")]) for i in (1, 2, 3)])


@pytest.mark.parametrize("model", MODELS)
@settings(max_examples=20)
@given(micrometres)
def test_feed_forward_holds_the_stage(model, r):
    out = np.array(FEED_FORWARD[model].out(0.0, [], [], r, [52.0625e6, 833 / 150])).ravel()
    holding = rrr_stage.analyze(level=model, elongation=r)
    assert out[:3] == pytest.approx(holding["force"], rel=1e-9, abs=1e-9)
    assert out[3:] == pytest.approx(holding["voltage"], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("model", MODELS)
def test_feed_forward_holds_the_stage_with_the_calibrated_links(model):
    """316.2 N hold 12 um on all stacks, in place of 348.9 N."""
    made = functions(stage_feed_forward(model=model, design=Design("calibrated")))
    for r in ([12e-6] * 3, [0.0, 12e-6, 3e-6]):
        out = np.array(made.out(0.0, [], [], r, [52.0625e6, 833 / 150])).ravel()
        holding = rrr_stage.analyze(level=model, design=Design("calibrated"), elongation=tuple(r))
        assert out[:3] == pytest.approx(holding["force"], rel=1e-9, abs=1e-9)
        assert out[3:] == pytest.approx(holding["voltage"], rel=1e-9, abs=1e-9)
    out = np.array(made.out(0.0, [], [], [12e-6] * 3, [52.0625e6, 833 / 150])).ravel()
    assert out[:3] == pytest.approx([316.2] * 3, abs=0.05)


def test_forces_at_12_um_are_the_sources():
    for model, force in (("constant_jacobian", 348.9), ("exact", 350.1)):
        out = np.array(FEED_FORWARD[model].out(0.0, [], [], [12e-6] * 3, [52.0625e6, 833 / 150])).ravel()
        assert out[:3] == pytest.approx([force] * 3, abs=0.05)
        assert out[3:] == pytest.approx([175.4] * 3, abs=0.16)


@given(st.floats(-500, 900), st.floats(0, 16e-6))
def test_a_stack_pushes_with_the_force_that_was_converted(force, elongation):
    _, held = tick(CONVERSION, [], {"axis[1].force": force, "axis[1].elongation": elongation})
    voltage = held["axis[1].command"]
    assert 0 <= voltage <= 150
    stack = pzt_stack(level="static", causality="force")
    given_values = {"command.voltage": voltage, "stack.elongation": elongation}
    out = functions(stack).out(0.0, [], [], column(stack, Kind.INPUT, given_values), column(stack, Kind.PARAMETER, {}))
    pushed = float(out[[q.name for q in stack.of(Kind.OUTPUT)].index("stack.force")])
    reachable = np.clip(force, -52.0625e6 * elongation, 833 - 52.0625e6 * elongation)
    assert pushed == pytest.approx(reachable, abs=1e-9)
    if not 1e-9 < abs(reachable - force) < 1e-6:  # rounding about a bound is no saturation
        assert held["axis[1].saturation"] == (abs(reachable - force) >= 1e-6)


def test_the_integral_goes_on_from_a_limit():
    """After a long time at the limit the voltage follows the error at once: it has not wound up."""
    controller, state = stage_integral(), [0.0] * 3
    for _ in range(2000):
        state, held = tick(controller, state, axes(reference=(12e-6, 12e-6, -1e-6)))
    assert [held[f"axis[{i}].command"] for i in (1, 2, 3)] == [150, 150, 0]
    assert [held[f"axis[{i}].saturation"] for i in (1, 2, 3)] == [1, 1, 1]
    state, held = tick(controller, state, axes(reference=(-1e-6, 0, 1e-6)))
    step = 4.3e8 * 50e-6 * 1e-6
    assert [held[f"axis[{i}].command"] for i in (1, 2, 3)] == pytest.approx([150 - step, 150, step], rel=1e-9)
    assert [held[f"axis[{i}].saturation"] for i in (1, 2, 3)] == [0, 0, 0]


@given(st.floats(0, 150), st.floats(-150, 150))
def test_the_integral_keeps_to_the_feed_forward(feed_forward, integral):
    _, held = tick(INTEGRAL, [integral] * 3, axes(feed_forward=(feed_forward,) * 3))
    assert held["axis[2].command"] == pytest.approx(np.clip(feed_forward + integral, 0, 150), abs=1e-12)


def entry(controller: Model, output: str, source: str, z: complex) -> complex:
    """One entry of a controller's transfer function, about rest, from tick to tick."""
    system = linearize(controller, {})
    labels = system.output_labels, system.input_labels
    return np.atleast_2d(system(z))[
        labels[0].index(output.replace(".", "/")), labels[1].index(source.replace(".", "/"))
    ]


@pytest.mark.parametrize("kinematics", ["nominal", "calibrated"])
@pytest.mark.parametrize("delay", [False, True])
def test_bode_sentence_of_computed_torque(delay, kinematics):
    rest = rrr_stage.analyze(level="constant_jacobian", design=Design(kinematics))
    kp, kv, z = (2 * np.pi * 300) ** 2, 2 * 2 * np.pi * 300, np.exp(2j * np.pi * 200 * 50e-6)
    controller = stage_computed_torque(model="constant_jacobian", design=Design(kinematics), delay=delay)
    turn = 1 / z if delay else 1
    ahead = 75e-6 if delay else 25e-6
    for i, j in ((1, 1), (1, 2), (3, 2)):
        K, M = rest["stiffness"][i - 1, j - 1], rest["inertia"][i - 1, j - 1]
        by_place = entry(controller, f"axis[{i}].command", f"axis[{j}].measured", z)
        by_rate = entry(controller, f"axis[{i}].command", f"axis[{j}].measured_rate", z)
        assert by_place == pytest.approx((K - kp * M) * turn, rel=1e-9)
        assert by_rate == pytest.approx(((6.02e-6 + ahead) * K - kv * M) * turn, rel=1e-9)


def test_bode_sentence_of_computed_torque_without_sampling():
    """The same, taken where the stage is."""
    rest = rrr_stage.analyze(level="constant_jacobian")
    kp, kv = (2 * np.pi * 300) ** 2, 2 * 2 * np.pi * 300
    controller = stage_computed_torque(level="continuous", model="constant_jacobian")
    for i, j in ((1, 1), (1, 2), (3, 2)):
        K, M = rest["stiffness"][i - 1, j - 1], rest["inertia"][i - 1, j - 1]
        by_place = entry(controller, f"axis[{i}].command", f"axis[{j}].measured", 1j)
        by_rate = entry(controller, f"axis[{i}].command", f"axis[{j}].measured_rate", 1j)
        assert by_place == pytest.approx(K - kp * M, rel=1e-9)
        assert by_rate == pytest.approx(6.02e-6 * K - kv * M, rel=1e-9)


def test_bode_sentences_of_the_others():
    z = np.exp(2j * np.pi * 3 * 50e-6)
    assert entry(force_to_voltage(), "axis[2].command", "axis[2].force", z) == pytest.approx(150 / 833)
    assert entry(force_to_voltage(), "axis[2].command", "axis[2].elongation", z) == pytest.approx(52.0625e6 * 150 / 833)
    rate = entry(force_to_voltage(), "axis[2].command", "axis[2].elongation_rate", z)
    assert rate == pytest.approx(52.0625e6 * 150 / 833 * 25e-6)
    measured = entry(stage_integral(), "axis[1].command", "axis[1].measured", z)
    assert measured == pytest.approx(-4.3e8 * 50e-6 / (1 - 1 / z), rel=1e-9)
    assert np.angle(measured, deg=True) == pytest.approx(90, abs=0.1)
    stiffness = rrr_stage.analyze()["stiffness"]
    held = entry(stage_feed_forward(model="constant_jacobian"), "axis[1].force", "axis[2].reference", z)
    assert held == pytest.approx(stiffness[0, 1], rel=1e-9)


def test_mistakes_are_named():
    with pytest.raises(ModelError, match="model of the stage is 'exakt'; did you mean exact"):
        stage_computed_torque(model="exakt")  # type: ignore[arg-type]
    with pytest.raises(ModelError, match="stage_computed_torque: delay is one sample time, and level continuous has"):
        stage_computed_torque(level="continuous", delay=True)
    with pytest.raises(ModelError, match="axes is 0, expected 1 or more"):
        force_to_voltage(axes=0)
    with pytest.raises(ModelError, match=r"axis\[1\].proportional_gain is -1 1/s2, expected 0 to inf"):
        CTC["exact"].set_start("axis[1].proportional_gain", -1)
