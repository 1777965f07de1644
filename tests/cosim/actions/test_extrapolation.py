"""Input extrapolation: orders of convergence, linear maps, ticks, FMUs without input derivatives."""

import numpy as np
import pytest
from algorithm_groups import ALGORITHMS
from spring_loop import closed_loop, loop

from hfsa.cosim.analysis.stability import CoupledStep
from hfsa.cosim.masters.algorithms import make_master
from hfsa.cosim.systems.system import Component, Connection, System

ORDERS = {"gauss_seidel_linear": 2, "gauss_seidel_quadratic": 3, "jacobi_linear": 2, "jacobi_quadratic": 3}
VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
WAYS = pytest.mark.parametrize("way", ["python", "c"])


def end(master, steps: int) -> float:
    recording = master.record(["plant.position"], rows=steps + 1)
    master.initialize()
    master.advance(steps)
    return recording["plant.position"][-1]


@VERSIONS
@WAYS
@pytest.mark.parametrize(("algorithm", "order"), ORDERS.items())
def test_order_of_convergence(files, opened, library, version, way, algorithm, order):
    system, found = loop(files, version)
    errors = []
    for parts in (1, 2, 4):
        master = make_master(opened(found), system, algorithm, 2e-3 / parts, library if way == "c" else None)
        errors.append(abs(end(master, 100 * parts) - closed_loop(0.2)))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert rates[-1] == pytest.approx(order, abs=0.25), (errors, rates)


@VERSIONS
@pytest.mark.parametrize("algorithm", ORDERS)
def test_the_one_step_matrix_agrees_with_a_step(files, opened, version, algorithm):
    """After the start, positions follow the recurrence of the matrix's characteristic polynomial."""
    system, found = loop(files, version)
    step = CoupledStep(system, opened(found), algorithm).over(5e-3)
    master = make_master(opened(found), system, algorithm, 5e-3)
    recording = master.record(["plant.position"], rows=101)
    master.initialize()
    master.advance(100)
    multipliers = np.linalg.eigvals(step.matrix)
    multipliers = multipliers[abs(multipliers) > 1e-9]
    polynomial = np.real(np.poly(multipliers))
    position = recording["plant.position"][5:]
    left = np.convolve(position, polynomial, "valid")
    assert abs(left).max() < 1e-10 * abs(position).max() * abs(polynomial).max()


@WAYS
def test_sampled_outputs_are_held(files, opened, library, way):
    """The input of the plant has a step at each tick, as without extrapolation: both are exact."""
    results = []
    for algorithm in ("gauss_seidel", "gauss_seidel_quadratic"):
        system, found = loop(files, controller="SampledPd")
        master = make_master(opened(found), system, algorithm, 5e-3, library if way == "c" else None)
        results.append(end(master, 100))
    assert results[0] == pytest.approx(results[1], rel=1e-12)


def test_inputs_of_an_fmu_without_input_derivatives_are_held_with_a_warning(opened, foreign):
    system = System([Component("a", "x"), Component("b", "x")], [Connection("a.y", "b.u")])
    found = dict.fromkeys("ab", foreign[3])
    masters = [
        make_master(opened(found), system, algorithm, 0.01) for algorithm in ("gauss_seidel", "gauss_seidel_linear")
    ]
    values = []
    for master in masters:
        master.initialize()
        master.advance(10)
        values.append(master.read(["b.y"])[0])
    assert values[0] == values[1]
    assert "takes no derivatives of its inputs" in masters[1].warnings["b"]


def test_all_algorithms_with_moving_inputs_are_tested():
    assert {name for name in ALGORITHMS if name.endswith(("_linear", "_quadratic"))} == set(ORDERS)
