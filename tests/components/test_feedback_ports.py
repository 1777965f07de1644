"""Ports for linearised feedback: what they add to a model, and what they leave as it is."""

import casadi as ca
import numpy as np
import pytest

from hfsa.components import Model, ModelError
from hfsa.components._modelling.feedback_ports import with_linear_feedback
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.model import Kind
from hfsa.components._modelling.units import quotient_unit, unit
from hfsa.components.rrr_stage import rrr_stage
from hfsa.components.sdelta import sdelta


def mass(explicit: bool = True) -> Model:
    """A mass under force + pull, with position and acceleration to see, and an input that moves nothing."""
    m = Model("Mass", "A mass")
    force, pull = m.input("force", "N", "Force"), m.input("pull", "N", "Another force")
    shown = m.input("shown", "m", "Only shown")
    x, v = m.state("x", "m", "Position", nominal=1e-6), m.state("v", "m/s", "Speed")
    m.der[x] = v
    a = (force + pull) / 2 if explicit else m.motion(v, mass=ca.SX(2), force=force + pull)
    if explicit:
        m.der[v] = a
    m.output("position", x, "m", "Position", nominal=1e-6)
    m.output("acceleration", a, "m/s2", "Acceleration")
    m.output("sum", x + shown, "m", "Position and more")
    return m


PAIRS = [("force", "position"), ("pull", "position"), ("shown", "position")]


def values(model: Model, **given: float) -> list:
    point = {q.name: given.get(q.name.replace(".", "_"), 0.0) for q in model}
    kinds = (Kind.STATE, Kind.SAMPLED_STATE, Kind.INPUT, Kind.PARAMETER)
    return [0.0, *[[point[q.name] for q in model.of(kind)] for kind in kinds]]


@pytest.mark.parametrize("explicit", [True, False])
def test_an_input_follows_the_output_it_is_paired_with(explicit):
    model = with_linear_feedback(mass(explicit), PAIRS)
    made = functions(model)
    point = {"x": 3.0, "force": 1.0, "feedback_at_position": 2.5}
    gained = {"feedback_gain_force_position": -8.0, "feedback_gain_pull_position": 2.0}
    np.testing.assert_allclose(made.rhs(*values(model, **point, **gained)), [[0], [(1 - 8 * 0.5 + 2 * 0.5) / 2]])
    np.testing.assert_allclose(made.rhs(*values(model, **point)), [[0], [0.5]])
    at_point = {**point, "feedback_at_position": 3.0}
    np.testing.assert_allclose(made.out(*values(model, **at_point, **gained)), [[3.0], [0.5], [3.0]])


def test_ports_are_named_and_measured_by_what_they_join():
    model = with_linear_feedback(mass(), PAIRS)
    gain, at = model["feedback.gain.force.position"], model["feedback.at.position"]
    assert (gain.kind, gain.unit, gain.start) == (Kind.PARAMETER, "N/m", 0.0)
    assert (at.kind, at.unit, at.nominal) == (Kind.INPUT, "m", 1e-6)
    assert [q.name for q in model if q.name.startswith("feedback")] == [
        "feedback.at.position",
        "feedback.gain.force.position",
        "feedback.gain.pull.position",
    ]  # nothing moves with `shown`


def test_a_linear_model_stays_linear_and_its_matrix_has_the_feedback():
    model = with_linear_feedback(mass(), [("force", "position")])
    made = functions(model)
    assert made.is_linear
    jacobian = made.jacobian(*values(model, feedback_gain_force_position=-8.0))
    np.testing.assert_allclose(np.array(jacobian), [[0, 1], [-4, 0]])


def test_parts_take_ports():
    """A robot's accelerations of its tubes move nothing at this level; a stage's forces do."""
    robot = sdelta()
    assert with_linear_feedback(robot, [("drive[1].slide_acceleration", "platform.position[3]")]) is robot
    assert not any(q.name.startswith("feedback") for q in robot)
    pairs = [(f"stack[{i}].force", f"stack[{j}].{y}") for i in (1, 2, 3) for j in (1, 2, 3) for y in ("elongation",)]
    stage = with_linear_feedback(rrr_stage(causality="force"), pairs)
    assert len([q for q in stage.of(Kind.PARAMETER) if q.name.startswith("feedback")]) == 9
    functions(stage)


@pytest.mark.parametrize(
    ("pair", "message"),
    [
        (("force", "acceleration"), "acceleration has direct feedthrough from an input of its feedback"),
        (("force", "x"), "x is a state, expected an output to feed back"),
        (("position", "position"), "position is a output, expected an input"),
        (("forces", "position"), "has no quantity 'forces'; did you mean force"),
    ],
)
@pytest.mark.parametrize("explicit", [True, False])
def test_misuse_names_the_quantity(explicit, pair, message):
    with pytest.raises(ModelError, match=message):
        with_linear_feedback(mass(explicit), [pair])


@pytest.mark.parametrize(
    ("above", "below", "expected"),
    [
        ("N", "m", "N/m"), ("N", "m/s", "N.s/m"), ("m", "m", "1"), ("1", "m", "1/m"), ("N", "1", "N"),
        ("N.m", "rad/s", "N.m.s/rad"), ("m/s2", "m", "m/(s2.m)"), ("N", "N.m/rad", "N.rad/(N.m)"),
    ],
)  # fmt: skip
def test_units_of_quotients(above, below, expected):
    assert quotient_unit(above, below) == expected
    difference = np.subtract(unit(above).exponents, unit(below).exponents)
    np.testing.assert_array_equal(unit(expected).exponents, difference)
