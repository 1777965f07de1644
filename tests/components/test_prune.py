"""Pruning of a model: what is kept, and that it moves as in the whole model."""

import casadi as ca
import numpy as np
import pytest

from hfsa.components import Model, sdelta
from hfsa.components._mechanics.sdelta_geometry import Posture
from hfsa.components._modelling.functions import functions
from hfsa.components._modelling.model import Kind
from hfsa.components._modelling.prune import OUTPUTS, STATES, dependencies, pruned

KINDS = (Kind.STATE, Kind.SAMPLED_STATE, Kind.INPUT, Kind.PARAMETER)
RESULTS = (Kind.STATE, Kind.OUTPUT, Kind.SAMPLED_STATE, Kind.SAMPLED_OUTPUT)
HEIGHT = "platform.position[3]"


def states(model: Model, *outputs: str) -> set[str]:
    """The states that outputs need."""
    return {name for name in dependencies(model).reached(outputs) if model[name].kind in STATES}


def evaluated(model: Model, values: dict[str, float]) -> dict[str, float]:
    """Derivatives, outputs and next values by name, from the functions of the exporter."""
    found = functions(model)
    point = [0.1, *(np.array([values[q.name] for q in model.of(kind)]) for kind in KINDS)]
    results = [found.rhs(*point), found.out(*point), *found.tick(*point)]
    return {
        q.name: value
        for kind, column in zip(RESULTS, results, strict=True)
        for q, value in zip(model.of(kind), np.array(column, dtype=float).ravel(), strict=True)
    }


def near_rest(model: Model) -> dict[str, float]:
    """Values about the start by a few nominal values, within the bounds."""
    random = np.random.default_rng(5)
    values = {}
    for q in model.of(*KINDS):
        moves = 0.0 if q.kind is Kind.PARAMETER else q.nominal * random.uniform(0.1, 1.0)
        low, high = -np.inf if q.min is None else q.min, np.inf if q.max is None else q.max
        values[q.name] = float(np.clip(q.start + moves, low, high))
    return values


def test_each_output_of_every_part_moves_as_in_the_whole_part(part_model):
    """For every part at every level: one output at a time, against the whole model's functions at one point."""
    values, known = near_rest(part_model), dependencies(part_model)
    whole = evaluated(part_model, values)
    outputs = [q for q in part_model.of(*OUTPUTS) if np.isfinite(whole[q.name])]
    for q in outputs[:: max(len(outputs) // 6, 1)]:
        kept = known.reached([q.name])
        small = pruned(part_model, kept)
        assert {p.name for p in small.of(Kind.PARAMETER)} == {p.name for p in part_model.of(Kind.PARAMETER)}
        for name, value in evaluated(small, values).items():
            same_unit = [abs(whole[o.name]) for o in part_model if o.name in whole and o.unit == part_model[name].unit]
            assert value == pytest.approx(whole[name], rel=1e-9, abs=1e-11 * max(same_unit)), (q.name, name)


# Robot ----------------------------------------------------------------------------------------------------------------


def test_a_symmetric_robot_moves_up_and_down_by_two_states():
    """Vertical motion is uncoupled at the symmetric posture, but for rounding; beside it all six are coupled."""
    assert states(sdelta.sdelta(), HEIGHT) == {"center.position[3]", "center.velocity[3]"}
    posture = Posture(rotation=(10.0, 5.0, 8.0), position=(0.005, 0.003, 0.155))
    assert len(states(sdelta.sdelta(posture=posture), HEIGHT)) == 12
    kept = dependencies(sdelta.sdelta()).reached([HEIGHT])
    assert "wrench.force[3]" in kept
    assert "wrench.torque[1]" not in kept


# Laws -----------------------------------------------------------------------------------------------------------------


def pair(coupling: float = 0.0, unit: float = 1.0) -> Model:
    """Two first-order lags; `coupling` starts the parameter that lets the second act on the first."""
    m = Model("Pair", "Two lags")
    c = m.parameter("coupling", coupling, "1", "Effect of the second on the first")
    u = m.input("u", "1", "Input")
    x, y = m.state("x", "1", "First"), m.state("y", "1", "Second", nominal=unit)
    m.der[x], m.der[y] = c * y - x, u - y
    m.output("first", x, "1", "First")
    m.output("second", y, "1", "Second")
    return m


def test_a_coupling_by_a_parameter_stays_although_it_is_zero_at_the_start():
    assert states(pair(), "first") == {"x", "y"}
    assert states(pair(), "second") == {"y"}


@pytest.mark.parametrize(
    ("share", "unit", "is_kept"),
    [
        pytest.param(1e-9, 1.0, True, id="small"),
        pytest.param(1e-17, 1.0, False, id="rounding"),
        pytest.param(1e-17, 1e9, True, id="large-state"),
        pytest.param(1e-9, 1e-9, True, id="small-state"),
    ],
)
def test_a_constant_coupling_counts_from_1e_12_on_in_both_units(share, unit, is_kept):
    m = pair(unit=unit)
    m.der.update({"x": share * m["y"].expression - m["x"].expression})
    assert states(m, "first") == ({"x", "y"} if is_kept else {"x"})


def test_the_only_effect_of_an_input_stays_however_stiff_its_row_is():
    """K / m = 1e14 1/s2 in units of metres: the force is 1e-14 of its row, and all that moves the mass."""
    m = Model("Stiff", "Stiff oscillator")
    force = m.input("force", "N", "Force")
    x, v = m.state("x", "m", "Position"), m.state("v", "m/s", "Velocity")
    m.der[x], m.der[v] = v, force - 1e14 * x
    m.output("position", x, "m", "Position")
    assert dependencies(m).reached(["position"]) == ["force", "x", "v", "position"]


def test_jumps_and_kinks_count_although_their_slope_is_zero():
    m = pair()
    m.output("sign", ca.sign(m["y"].expression) + m["x"].expression, "1", "A jump")
    m.output("limit", m["y"].expression > 5, "1", "A flag")
    assert "y" in states(m, "limit")
    m = pair()
    m.der.update({"x": -m["x"].expression + 1e-17 * ca.fmax(m["y"].expression, 0)})
    assert states(m, "first") == {"x", "y"}


def masses(joint: float) -> Model:
    """Two bodies with a mass matrix of off-diagonal `joint`, each on a spring of its own."""
    m = Model("Bodies", "Two bodies")
    force = m.input("force", "N", "Force on the second")
    q, v = m.state("q[1..2]", "m", "Positions"), m.state("v[1..2]", "m/s", "Velocities")
    m.der[q] = v
    sides = ca.vertcat(-q[0], force - 4 * q[1])
    a = m.motion(v, mass=ca.DM([[1.0, joint], [joint, 2.0]]), force=sides)
    m.output("acceleration[1..2]", a, "m/s2", "Accelerations")
    return m


@pytest.mark.parametrize(("joint", "count"), [(0.0, 2), (1e-17, 2), (1e-3, 4)], ids=["split", "rounding", "joined"])
def test_a_mass_matrix_falls_apart_into_its_blocks(joint, count):
    """Each block as a matrix of its own: the acceleration is that of the whole."""
    m = masses(joint)
    assert len(states(m, "acceleration[1]")) == count
    small = pruned(m, dependencies(m).reached(["acceleration[1]"]))
    values = {"q[1]": 1.0, "q[2]": -2.0, "v[1]": 0.5, "v[2]": 0.1, "force": 3.0}
    assert evaluated(small, values)["acceleration[1]"] == pytest.approx(
        evaluated(m, values)["acceleration[1]"], rel=1e-14
    )


def test_a_model_with_ticks_and_motion_steps_with_the_others_as_before():
    """An FMU of sampled outputs alone steps first: a continuous output stays, and with it the place in the order."""
    m = pair()
    m.sample_time(0.1)
    z = m.sampled_state("z", "1", "Count")
    m.next[z] = z + 1
    m.sampled_output("count", z, "1", "Count")
    small = pruned(m, dependencies(m).reached(["count"]))
    assert small.is_sampled
    assert small.of(Kind.OUTPUT)


def test_the_solver_is_that_of_the_whole_model():
    """A linear rest of a nonlinear model keeps the tolerance that the model has."""
    m = pair()
    m.der.update({"y": m["u"].expression - m["y"].expression ** 3, "x": -m["x"].expression})
    assert pruned(m, ["x", "first"]).solver == "rosenbrock"
    assert pruned(pair(), ["y", "u", "second"]).solver is None
