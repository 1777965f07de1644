"""Iterative coupling: order of convergence, its one-step matrix, loops that do not converge."""

import numpy as np
import pytest
from algorithm_groups import ITERATED
from spring_loop import closed_loop, loop

from hfsa.components import Model
from hfsa.cosim.analysis.stability import CoupledStep
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, Connection, System

each_method = pytest.mark.parametrize("method", ITERATED)
VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])


def positions(master, steps: int) -> np.ndarray:
    recording = master.record(["plant.position"], rows=steps + 1)
    master.initialize()
    master.advance(steps)
    return recording["plant.position"]


@VERSIONS
@each_method
def test_second_order(files, opened, version, method):
    system, found = loop(files, version)
    errors = []
    for parts in (1, 2, 4):
        master = make_master(opened(found), system, method, 4e-3 / parts)
        errors.append(abs(positions(master, 50 * parts)[-1] - closed_loop(0.2)))
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2, abs=0.1)


@each_method
def test_the_one_step_matrix_agrees_with_a_step(files, opened, method):
    system, found = loop(files)
    step = CoupledStep(system, opened(found), method).over(5e-3)
    position = positions(make_master(opened(found), system, method, 5e-3), 100)
    multipliers = np.linalg.eigvals(step.matrix)
    polynomial = np.real(np.poly(multipliers[abs(multipliers) > 1e-9]))
    left = np.convolve(position, polynomial, "valid")
    assert abs(left).max() < 1e-9 * abs(polynomial).max()


def test_quasi_newton_takes_two_passes_a_step_where_all_is_linear(files, opened):
    system, found = loop(files)
    master = make_master(opened(found), system, "quasi_newton", 5e-2)
    position = positions(master, 100)
    assert abs(position[-1]) < 1.0
    assert master.statistics["passes"] <= 200


def test_a_fixed_point_that_does_not_attract_is_an_error(files, opened):
    """At a step of 0.3 s each pass of the fixed point increases the error; Newton's method converges."""
    system, found = loop(files)
    with pytest.raises(
        StepError, match=r"fixed_point coupling over .* residual .* after 200 passes .* or quasi_newton"
    ):
        positions(make_master(opened(found), system, "fixed_point", 0.3), 10)
    assert np.isfinite(positions(make_master(opened(found), system, "quasi_newton", 0.3), 10)).all()


def growing() -> Model:
    """State x' = 2 u: on a straight line from x to w, x + 2 (x + w) / 2 after a second."""
    m = Model("Growing", "Integrator")
    u, x = m.input("u", "1", "Rate"), m.state("x", "1", "State", start=1.0)
    m.der[x] = 2 * u
    m.output("y", x, "1", "State")
    return m


def test_a_step_without_a_solution_is_an_error(exported, opened):
    system = System([Component("it", "x")], [Connection("it.y", "it.u")])
    instances = opened({"it": exported(growing())[2]})
    with pytest.raises(StepError, match=r"quasi_newton coupling over it.y -> it.u has loop gain 1 over a step of 1 s"):
        run(instances, system, 1.0)
    assert run(instances, system, 0.5)[-1] == pytest.approx(3.0**4, rel=1e-9)  # each step (1 + H) / (1 - H)


def run(instances, system, step_size: float) -> np.ndarray:
    """Values of `it.y` over two seconds of quasi_newton."""
    master = make_master(instances, system, "quasi_newton", step_size)
    recording = master.record(["it.y"], rows=5)
    master.initialize()
    master.advance(round(2 / step_size))
    return recording["it.y"]


@each_method
def test_sampled_outputs_are_held(files, opened, method):
    system, found = loop(files, controller="SampledPd")
    expected = positions(make_master(opened(found), system, "gauss_seidel", 5e-3), 100)
    np.testing.assert_allclose(positions(make_master(opened(found), system, method, 5e-3), 100), expected, rtol=1e-11)


def test_an_fmu_without_states_to_go_back_to_is_refused(opened, foreign):
    system = System([Component("a", "x"), Component("b", "x")], [Connection("a.y", "b.u")])
    with pytest.raises(StructureError, match=r"Foreign.*canGetAndSetFMUstate.*gauss_seidel"):
        make_master(opened(dict.fromkeys("ab", foreign[2])), system, "quasi_newton", 0.1)
