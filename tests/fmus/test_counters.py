"""Counters of the solvers: their numbers against those of the methods, and what resets and keeps them."""

import math
import re

import pytest

from hfsa.components import Model, ModelError
from hfsa.cosim.fmi.description import COUNTERS as NAMES
from hfsa.cosim.fmi.description import describe
from hfsa.fmus._solvers import COUNTERS, SOLVERS
from hfsa.fmus._sundials import sundials
from hfsa.fmus._variables import Role
from hfsa.fmus.c_code import RUNTIME, generate
from hfsa.fmus.errors import ExportError

STAGES = 8
"""Stages of RODAS5P; the first one is the derivative that the Jacobian is computed with."""


def counts(it) -> dict[str, float]:
    """Every counter of an instance by the last part of its name."""
    names = it.names("counter")
    return dict(zip((name.removeprefix("solver.") for name in names), it.get(*names), strict=True))


def solved_by(models, name: str, solver: str) -> Model:
    """A model of conftest.py with a solver; the test is skipped where SUNDIALS is not installed."""
    if solver == "cvode":
        try:
            sundials()
        except ExportError as error:
            pytest.skip(str(error))
    model = models[name]()
    model.solver = solver
    return model


each_solver = pytest.mark.parametrize("solver", ["rk4", "rosenbrock", "cvode"])


# Numbers --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [0.3, 1.0, 2.5, 10.0, 10.0 + 1e-12], ids=lambda r: f"{r:g}")
def test_rk4_takes_as_many_steps_as_its_maximum_step_requires(instance, version, ratio):
    it, longest = instance("van_der_pol", version), 1e-3
    it.set({"solver.maximum_step": longest})
    it.initialize().step(0.0, ratio * longest, 7)
    steps = 7 * math.ceil(ratio * (1 - 1e-9))
    assert counts(it) == {"steps": steps, "evaluations": 4 * steps}


def test_rosenbrock_evaluates_once_for_each_of_its_stages(instance, version):
    """With its tolerance out of the way it rejects nothing, and a maximum step gives the number of steps."""
    it = instance("two_link", version)
    it.set({"solver.relative_tolerance": 1e6, "solver.maximum_step": 1e-2})
    it.initialize().step(0.0, 0.1)
    found = counts(it)
    assert found["steps"] == 10
    assert found == {
        "steps": 10,
        "evaluations": 10 * STAGES,
        "rejected_steps": 0,
        "jacobians": 10,
        "factorizations": 10,
    }


def test_a_step_that_rosenbrock_rejects_costs_all_stages_but_the_first(instance, version):
    """The Jacobian and the first derivative belong to the point, which a shorter step begins at too."""
    it = instance("pendulum", version)
    it.set({"solver.relative_tolerance": 1e-10})
    it.initialize().step(0.0, 1.0)
    found = counts(it)
    steps, rejected = found["steps"], found["rejected_steps"]
    assert rejected > 0
    assert found["jacobians"] == steps
    assert found["factorizations"] == steps + rejected
    assert found["evaluations"] == steps * STAGES + rejected * (STAGES - 1)


def test_a_smaller_tolerance_takes_steps_by_the_order_of_the_method(instance):
    """Order 5: 1e5 times less error takes 10 times as many steps, about; the count shows what accuracy costs."""
    steps = []
    for tolerance in (1e-6, 1e-11):
        it = instance("pendulum")
        it.set({"solver.relative_tolerance": tolerance})
        it.initialize().step(0.0, 10.0)
        steps.append(counts(it)["steps"])
    assert steps[1] / steps[0] == pytest.approx(10.0, rel=0.3)


def test_cvode_counts_what_it_does(instance, models, version):
    """An evaluation or more for each step, a matrix or more for each Jacobian; twice the steps at half the maximum."""
    model = solved_by(models, "two_link", "cvode")
    steps = []
    for longest in (1e-3, 5e-4):
        it = instance(model, version)
        it.set({"solver.maximum_step": longest, "solver.relative_tolerance": 1e-3})
        it.initialize().step(0.0, 1.0)
        found = counts(it)
        steps.append(found["steps"])
        assert found["evaluations"] > found["steps"]
        assert 1 <= found["jacobians"] <= found["factorizations"] < found["steps"]
    assert steps[0] == pytest.approx(1000, rel=0.02)
    assert steps[1] == pytest.approx(2000, rel=0.02)


def test_cvode_rejects_steps_at_a_sudden_change(instance, models, version):
    """A pulse in time, a thousandth of the step wide: the long steps that run into it are rejected."""
    m = Model("Pulse", "Pulse in time")
    x = m.state("x", "1", "State")
    m.der[x] = -x + 1e3 * (1 / (1 + ((m.time - 0.5) / 1e-3) ** 2))
    m.solver = solved_by(models, "pendulum", "cvode").solver
    it = instance(m, version).initialize()
    it.step(0.0, 1.0)
    assert 0 < counts(it)["rejected_steps"] < counts(it)["steps"]


@each_solver
def test_ticks_divide_a_step(instance, models, version, solver):
    """Each part of a communication step between two ticks is solved on its own."""
    it = instance(solved_by(models, "hybrid", solver), version)
    it.set({"solver.maximum_step": 1.0, **({} if solver == "rk4" else {"solver.relative_tolerance": 1.0})})
    it.initialize().step(0.0, 10e-3)  # ticks at 0, 2, 4, 6, 8 ms
    assert counts(it)["steps"] >= 5
    if solver != "cvode":
        assert counts(it)["steps"] == 5


# Reset, restored, repeated --------------------------------------------------------------------------------------------


def run(it, count: int) -> dict[str, float]:
    it.initialize().step(0.0, 0.05, count)
    return counts(it)


@each_solver
def test_counts_repeat_exactly_after_a_reset(instance, models, version, solver):
    it = instance(solved_by(models, "two_link", solver), version)
    first = run(it, 5)
    assert first["steps"] > 0
    it.fmu.reset()
    assert set(counts(it).values()) == {0.0}
    assert run(it, 5) == first


@each_solver
def test_two_instances_count_each_for_itself(instance, models, version, solver):
    model = solved_by(models, "two_link", solver)
    one, other = instance(model, version), instance(model, version)
    other.initialize()
    few = run(one, 2)
    assert set(counts(other).values()) == {0.0}
    other.step(0.0, 0.05, 6)
    assert counts(one) == few
    assert counts(other)["steps"] > few["steps"]


@each_solver
def test_a_restored_state_does_not_undo_the_work(instance, models, version, solver):
    """The repeated step counts again, and the same number; the state has the same bytes as without counts."""
    it = instance(solved_by(models, "two_link", solver), version).initialize()
    it.step(0.0, 0.05)
    before, state = counts(it), it.state()
    content = it.serialize(state)
    it.step(0.05, 0.05)
    once = counts(it)
    it.restore(state)
    assert counts(it) == once
    again = it.state()
    assert it.serialize(again) == content
    it.step(0.05, 0.05)
    assert counts(it) == {name: 2 * once[name] - before[name] for name in once}
    for kept in (state, again):
        it.free_state(kept)


def test_an_initialization_begins_at_zero_from_a_restored_state_too(instance, version):
    it = instance("two_link", version)
    state = it.state()
    first = run(it, 3)
    it.restore(state)
    assert run(it, 3) == first
    it.free_state(state)


def test_a_failed_step_counts(instance, version):
    """The instance stays as it was, but the work was done."""
    it = instance("van_der_pol", version)
    it.set({"mu": 1e9, "solver.maximum_step": 1e-3})
    it.initialize()
    with it.refused("state x is"):
        it.step(0.0, 0.1)
    assert counts(it) == {"steps": 100, "evaluations": 400}


@each_solver
def test_reading_counts_nothing(instance, models, version, solver):
    """Outputs, derivatives and linearisation are evaluated for the importer, and are the importer's cost."""
    it = instance(solved_by(models, "two_link", solver), version)
    before = run(it, 2)
    it.set({"torque[1]": 3.0})
    it.get("energy", "der(v[1])")
    it.forward(["energy"], ["v[1]"], [1.0])
    assert counts(it) == before


# Variables ------------------------------------------------------------------------------------------------------------


def test_counters_cannot_be_set(instance, version):
    it = instance("two_link", version)
    with it.refused("solver.steps is calculated"):
        it.set({"solver.steps": 3.0})
    it.initialize()
    with it.refused("solver.steps is calculated"):
        it.set({"solver.steps": 3.0})


def test_they_stay_zero_in_model_exchange(instance, version):
    it = instance("two_link", version, "me").initialize()
    it.get("der(v[1])", "energy")
    assert set(counts(it).values()) == {0.0}


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("van_der_pol", ["solver.steps", "solver.evaluations"]),
        ("pendulum", [counter.name for counter in COUNTERS]),
        ("mass_on_spring", []),
        ("controller", []),
        ("gain", []),
    ],
    ids=["rk4", "rosenbrock", "exact", "sampled", "stateless"],
)
def test_which_models_have_them(models, name, expected):
    variables = generate(models[name]()).variables
    assert [v.name for v in variables if v.role is Role.COUNTER] == expected


def test_they_are_nothing_but_variables(models, exported, version):
    """Discrete locals that no unknown is, that nothing depends on, and that are no sign of undeclared dynamics."""
    found = describe(exported(models["pendulum"]())[version])
    assert found.counters == NAMES
    for name in NAMES:
        v = found.variables[name]
        assert (v.causality, v.variability, v.unit, v.start) == ("local", "discrete", "1", None)
    assert found.undeclared(["energy", "feed"]) == ""
    assert not found.sampled_states
    other = describe(exported(models["pendulum"]())[version], "model_exchange")
    assert other.counters == ()
    assert other.undeclared(["energy", "feed"]) == ""


def test_the_three_lists_of_counters_are_one():
    """That of the left wing, that of the C code, and that of the right wing, which knows FMUs alone."""
    (listed,) = re.findall(r"enum \{ (ACCEPTED_STEPS, .*), COUNTERS \};", (RUNTIME / "instance.h").read_text())
    in_c = [word.strip().lower().removeprefix("accepted_") for word in listed.split(",")]
    assert [f"solver.{word}" for word in in_c] == [counter.name for counter in COUNTERS] == list(NAMES)
    for solver in SOLVERS.values():
        assert solver.counters == COUNTERS[: len(solver.counters)]


def test_a_model_cannot_take_their_names():
    m = Model("Own", "Own counter")
    with pytest.raises(ModelError, match=r"Own: solver\.steps begins as the names of the solver do"):
        m.parameter("solver.steps", 1.0, "1", "Steps")
    m.parameter("solver_steps", 1.0, "1", "Steps")
