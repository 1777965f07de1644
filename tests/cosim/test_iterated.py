"""Iterated coupling: order of convergence, what the one-step matrix says of it, loops that do not converge."""

import numpy as np
import pytest
from spring_loop import closed_loop, loop

from hfsa.cosim.instance import StepError
from hfsa.cosim.master import Master
from hfsa.cosim.stability import Cycle
from hfsa.cosim.system import ITERATED, Component, Connection, StructureError, System

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
        master = Master(opened(found), system, method, 4e-3 / parts)
        errors.append(abs(positions(master, 50 * parts)[-1] - closed_loop(0.2)))
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2, abs=0.1)


@each_method
def test_the_one_step_matrix_says_what_a_step_does(files, opened, method):
    system, found = loop(files)
    step = Cycle(system, opened(found), method).over(5e-3)
    position = positions(Master(opened(found), system, method, 5e-3), 100)
    multipliers = np.linalg.eigvals(step.matrix)
    polynomial = np.real(np.poly(multipliers[abs(multipliers) > 1e-9]))
    left = np.convolve(position, polynomial, "valid")
    assert abs(left).max() < 1e-9 * abs(polynomial).max()


def test_quasi_newton_takes_two_passes_a_step_where_all_is_linear(files, opened):
    system, found = loop(files)
    master = Master(opened(found), system, "quasi_newton", 5e-2)
    position = positions(master, 100)
    assert abs(position[-1]) < 1.0
    assert master._moving.passes <= 200


def test_a_fixed_point_that_does_not_attract_is_told(files, opened):
    """At a step of 0.3 s each pass makes the error larger; Newton's method does not mind."""
    system, found = loop(files)
    with pytest.raises(
        StepError, match=r"fixed_point coupling over .* residual .* after 200 passes .* or quasi_newton"
    ):
        positions(Master(opened(found), system, "fixed_point", 0.3), 10)
    assert np.isfinite(positions(Master(opened(found), system, "quasi_newton", 0.3), 10)).all()


@each_method
def test_sampled_outputs_are_held(files, opened, method):
    system, found = loop(files, controller="SampledPd")
    expected = positions(Master(opened(found), system, "gauss_seidel", 5e-3), 100)
    np.testing.assert_allclose(positions(Master(opened(found), system, method, 5e-3), 100), expected, rtol=1e-11)


def test_an_fmu_without_states_to_go_back_to_is_refused(opened, foreign):
    system = System([Component("a", "x"), Component("b", "x")], [Connection("a.y", "b.u")])
    with pytest.raises(StructureError, match=r"Foreign.*canGetAndSetFMUstate.*gauss_seidel"):
        Master(opened(dict.fromkeys("ab", foreign[2])), system, "quasi_newton", 0.1)
