"""A composed model is its parts: the same derivatives, outputs, ticks and linearisation as theirs, joined by hand."""

from functools import cache

import casadi as ca
import numpy as np
import pytest

from hfsa.components import Model, ModelError
from hfsa.components._modelling.compose import compose
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.linearize import linearize
from hfsa.components._modelling.model import Kind
from hfsa.components.c_drive import c_drive
from hfsa.components.pzt_stack import pzt_stack
from hfsa.components.rrr_stage import rrr_stage
from hfsa.components.sdelta import sdelta
from hfsa.controllers.pd import pd

MOTIONS = ("slide", "angle", "slide_rate", "angle_rate")
STAGE = {
    "stage": rrr_stage(causality="force"),
    **{f"stack[{i}]": pzt_stack(level="hysteretic", causality="force") for i in (1, 2, 3)},
}
STACKED = [
    *((f"stack[{i}].stack.force", f"stage.stack[{i}].force") for i in (1, 2, 3)),
    *(
        (f"stage.stack[{i}].{name}", f"stack[{i}].stack.{name}")
        for i in (1, 2, 3)
        for name in ("elongation", "elongation_rate")
    ),
]
ROBOT = {"robot": sdelta(), **{f"drive[{j}]": c_drive() for j in (1, 2, 3)}}
DRIVEN = [
    *((f"drive[{j}].tube.{name}", f"robot.drive[{j}].{name}") for j in (1, 2, 3) for name in MOTIONS),
    *((f"robot.drive[{j}].{load}", f"drive[{j}].tube.{load}") for j in (1, 2, 3) for load in ("force", "torque")),
]

Point = dict[str, float]
compiled = cache(functions)


def near_start(model: Model, seed: int) -> Point:
    """Values by name: time, states, sampled states, inputs and parameters, each near its start."""
    rng, values = np.random.default_rng(seed), {"time": 0.3}
    for q in model.of(Kind.STATE, Kind.SAMPLED_STATE, Kind.INPUT, Kind.PARAMETER):
        moved = q.start * (1 + 0.1 * rng.random()) + (0 if q.kind is Kind.PARAMETER else q.nominal * rng.normal())
        values[q.name] = q.start if q.name == "sample_time" else moved
    return values


def evaluate(model: Model, values: Point) -> dict[str, float]:
    """Everything that follows from values: `der(x)`, outputs, `next(z)` and sampled outputs as of a tick."""
    made = compiled(model)
    kinds = (Kind.STATE, Kind.SAMPLED_STATE, Kind.INPUT, Kind.PARAMETER)
    point = [values["time"], *[[values[q.name] for q in model.of(kind)] for kind in kinds]]
    names = [
        *[f"der({q.name})" for q in model.of(Kind.STATE)],
        *[q.name for q in model.of(Kind.OUTPUT)],
        *[f"next({q.name})" for q in model.of(Kind.SAMPLED_STATE)],
        *[q.name for q in model.of(Kind.SAMPLED_OUTPUT)],
    ]
    found = [made.rhs(*point), made.out(*point), *made.tick(*point)]
    return dict(zip(names, np.concatenate([np.array(f, float).ravel() for f in found]), strict=True))


def by_hand(parts: dict[str, Model], connections, values: Point) -> dict[str, float]:
    """Evaluate the parts, each with the inputs that the others' outputs give it, until nothing changes."""
    fed = {end: 0.0 for _, end in connections}
    while True:
        found = {}
        for member, part in parts.items():
            own = {n.removeprefix(f"{member}."): v for n, v in {**values, **fed}.items() if n.startswith(f"{member}.")}
            for name, value in evaluate(part, {"time": values["time"], **own}).items():
                word, bracket, inner = name.partition("(")
                full = f"{word}({member}.{inner}" if bracket else f"{member}.{name}"
                found[full] = value
        new = {end: found[start] for start, end in connections}
        if new == fed:
            return found
        fed = new


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("parts", "connections"), [(STAGE, STACKED), (ROBOT, DRIVEN)], ids=["stage", "robot"])
def test_a_composed_model_is_its_parts(parts, connections, seed):
    whole = compose("Whole", parts, connections)
    values = near_start(whole, seed)
    expected, found = by_hand(parts, connections, values), evaluate(whole, values)
    assert set(found) == set(expected)
    for name in expected:
        assert found[name] == pytest.approx(expected[name], rel=1e-9, abs=1e-12), name


def test_linearisation_is_that_of_the_connected_parts():
    """The connections u = L y + e with y = C x + D u closes the parts' own matrices."""
    whole = compose("Whole", ROBOT, DRIVEN)
    parts = {name: linearize(part) for name, part in ROBOT.items()}
    A, B, C, D = (ca.diagcat(*[ca.DM(getattr(s, key)) for s in parts.values()]).full() for key in "ABCD")

    def labels(key: str) -> list[str]:
        return [f"{name}.{label.replace('/', '.')}" for name, s in parts.items() for label in getattr(s, key)]

    inputs, outputs = labels("input_labels"), labels("output_labels")
    L, E = np.zeros((len(inputs), len(outputs))), np.eye(len(inputs))
    for start, end in DRIVEN:
        L[inputs.index(end), outputs.index(start)] = 1.0
        E[inputs.index(end)] = 0.0
    through = np.linalg.inv(np.eye(len(inputs)) - L @ D)
    found = linearize(whole)
    assert labels("state_labels") == [label.replace("/", ".") for label in found.state_labels]
    np.testing.assert_allclose(found.A, A + B @ through @ L @ C, rtol=1e-10, atol=1e-9)
    free = [i for i in range(len(inputs)) if E[i, i]]
    np.testing.assert_allclose(found.B, (B @ through @ E)[:, free], rtol=1e-10, atol=1e-9)
    np.testing.assert_allclose(found.C, C + D @ through @ L @ C, rtol=1e-10, atol=1e-9)


def test_masses_stay_and_linear_models_stay_linear():
    assert functions(compose("Robot", ROBOT, DRIVEN)).is_linear
    stage = compose("Stage", STAGE, STACKED)
    assert not functions(stage).is_linear
    assert [motion.rates for motion in stage.motions] == [tuple(f"stage.leg[{i}].elongation_rate" for i in (1, 2, 3))]


def test_names_units_bounds_and_arguments_are_those_of_the_members():
    whole = compose("Robot", ROBOT, DRIVEN)
    ratio = whole["robot.damping_ratio"]
    assert (ratio.kind, ratio.unit, ratio.start, ratio.min) == (Kind.PARAMETER, "1", 0.01, 0)
    assert "robot.drive[1].slide" not in whole
    assert [q.name for q in whole.of(Kind.INPUT) if q.name.startswith("drive[2]")][:2] == [
        "drive[2].motor[1].torque",
        "drive[2].motor[2].torque",
    ]
    part = c_drive()
    part.information = {"level": "rigid_shaft"}
    assert compose("One", {"drive[1]": part}, []).information == {"drive[1].level": "rigid_shaft"}


# Accelerations between members ----------------------------------------------------------------------------------------


def cart(name: str = "Cart") -> Model:
    """A mass that is pushed: m a = f - m b, b the acceleration of what it stands on."""
    m = Model(name, "Mass on a base")
    f = m.input("force", "N", "Force")
    b = m.input("base", "m/s2", "Acceleration of the base")
    v = m.state("speed", "m/s", "Speed on the base")
    mass = m.parameter("mass", 2.0, "kg", "Mass")
    a = m.motion(v, mass=ca.SX(mass), force=f - mass * b)
    m.output("acceleration", a + b, "m/s2", "Acceleration")
    return m


def test_an_acceleration_may_push_another_member():
    whole = compose("Stack", {"upper": cart(), "lower": cart()}, [("lower.acceleration", "upper.base")])
    values = {q.name: q.start for q in whole.of(Kind.STATE, Kind.INPUT, Kind.PARAMETER)}
    found = evaluate(whole, {"time": 0.0, **values, "lower.force": 6.0, "upper.force": 1.0})
    assert (found["der(lower.speed)"], found["der(upper.speed)"]) == (3.0, -2.5)
    assert found["upper.acceleration"] == 0.5


def test_a_loop_through_accelerations_is_spelt_out():
    loop = [("lower.acceleration", "upper.base"), ("upper.acceleration", "lower.base")]
    with pytest.raises(ModelError, match=r"loop: .*lower\.acceleration -> upper\.base -> upper\.acceleration"):
        compose("Stack", {"upper": cart(), "lower": cart()}, loop)


# Ticks ----------------------------------------------------------------------------------------------------------------


def counter(sample_time: float = 0.01) -> Model:
    """Held y = z + u, then z = y."""
    m = Model("Counter", "Sums what it sees")
    m.sample_time(sample_time)
    u = m.input("u", "1", "Input")
    z = m.sampled_state("z", "1", "Sum")
    m.next[z] = z + u
    m.sampled_output("y", z + u, "1", "Sum with the newest", start=5.0)
    return m


def gain(k: float = 2.0) -> Model:
    m = Model("Gain", "y = k u")
    m.output("y", k * m.input("u", "1", "Input"), "1", "Output")
    return m


def test_members_tick_one_after_the_other():
    """At a tick, b sees what a has just put out; a sees what b put out at the last tick."""
    parts = {"a": counter(), "double": gain(), "b": counter()}
    whole = compose("Ring", parts, [("a.y", "double.u"), ("double.y", "b.u"), ("b.y", "a.u")])
    assert [(q.name, q.start) for q in whole.of(Kind.SAMPLED_STATE)] == [
        ("a.z", 0.0), ("b.z", 0.0), ("held.a.y", 5.0), ("held.b.y", 5.0)
    ]  # fmt: skip
    values = {"time": 0.0, "sample_time": 0.01, "a.z": 0.0, "b.z": 0.0, "held.a.y": 5.0, "held.b.y": 5.0}
    assert evaluate(whole, values)["double.y"] == 10.0
    for a, b in ((5.0, 10.0), (15.0, 40.0)):
        found = evaluate(whole, values)
        assert (found["a.y"], found["b.y"]) == (a, b)
        values |= {name: found[f"next({name})"] for name in ("a.z", "b.z", "held.a.y", "held.b.y")}


def test_a_sampled_controller_holds_its_command_inside():
    """Between ticks the mass feels the held force, at a tick the controller sees the mass as it is."""
    mass = Model("Mass", "m a = f")
    f = mass.input("force", "N", "Force")
    x, v = mass.state("x", "m", "Position"), mass.state("v", "m/s", "Speed")
    mass.der[x], mass.der[v] = v, f
    mass.output("position", x, "m", "Position")
    law = pd(unit="m", effort="N")
    connections = [("mass.position", "law.axis[1].measured"), ("law.axis[1].command", "mass.force")]
    whole = compose("Loop", {"mass": mass, "law": law}, connections)
    values = near_start(whole, 0) | {"mass.x": 0.5, "law.axis[1].reference": 2.0, "held.law.axis[1].command": 7.0}
    values |= {f"law.axis[1].{name}": 0.0 for name in ("feed_forward", "reference_rate", "measured_rate")}
    found = evaluate(whole, values | {"law.axis[1].proportional_gain": 4.0, "law.axis[1].limit": 100.0})
    assert found["der(mass.v)"] == 7.0
    assert found["law.axis[1].command"] == found["next(held.law.axis[1].command)"] == 6.0
    assert whole["law.axis[1].command"].kind is Kind.SAMPLED_OUTPUT


# Misuse ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("connections", "message"),
    [
        ([("a.y", "c.u")], "c.u: there is no member 'c'"),
        ([("a.y", "b.w")], "has no quantity 'w'"),
        ([("a.u", "b.u")], "joins input and input, expected output and input"),
        ([("a.y", "b.u"), ("b.y", "b.u")], "b.u is fed twice: by a.y and by b.y"),
        ([("a.y[1..2]", "b.u")], "joins 2 output"),
        ([("a.y", "b.u"), ("b.y", "a.u")], "algebraic loop: .*a.y -> b.u"),
        ([("a.y", "robot.drive[1].slide")], "a.y is in 1, but robot.drive\\[1\\].slide in m"),
    ],
)
def test_misuse_names_the_connection(connections, message):
    with pytest.raises(ModelError, match=message):
        compose("Whole", {"a": gain(), "b": gain(), "robot": ROBOT["robot"]}, connections)


def test_the_whole_has_the_solver_of_its_members():
    asking, exact = gain(), gain()
    asking.solver, exact.solver = "rk4", "exact"
    parts = {"a": asking, "b": gain(), "c": exact}
    assert compose("Whole", parts, []).solver == "rk4"
    assert compose("Whole", {"b": gain(), "c": exact}, []).solver is None
    parts["b"].solver = "rosenbrock"
    with pytest.raises(ModelError, match="one model has one solver; found a rk4, b rosenbrock"):
        compose("Whole", parts, [])


def test_two_sample_times_are_refused():
    with pytest.raises(ModelError, match=r"one model has one sample time; found a 0.01 s, b 0.02 s"):
        compose("Whole", {"a": counter(), "b": counter(0.02)}, [])
