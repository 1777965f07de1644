"""Inputs extrapolated within a Co-Simulation step: accuracy, and the time at which they act."""

import math

import numpy as np
import pytest

from hfsa.components import Model

# Accuracy -------------------------------------------------------------------------------------------------------------


def driven() -> Model:
    """An oscillator x'' = u - x, from rest."""
    m = Model("Driven", "Driven oscillator")
    u = m.input("u", "m/s2", "Drive")
    x = m.state("x", "m", "Displacement")
    v = m.state("v", "m/s", "Velocity")
    m.der[x] = v
    m.der[v] = u - x
    m.output("y", x, "m", "Displacement")
    return m


def test_exact_is_exact_for_a_quadratic_input(instance, version):
    """With u = t^2, whose response from rest is t^2 - 2 (1 - cos t)."""
    it, h = instance(driven(), version).initialize(), 0.4
    for k in range(25):
        it.set({"u": (k * h) ** 2})
        it.move({"u": (2 * k * h, 2.0)})
        it.step(k * h, h)
        t = (k + 1) * h
        expected = [t**2, t**2 - 2 * (1 - math.cos(t)), 2 * t - 2 * math.sin(t)]
        np.testing.assert_allclose(it.get("u", "x", "v"), expected, rtol=0, atol=1e-12 * t**2)


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize("solver", ["exact", "rosenbrock", "rk4"])
def test_an_input_of_degree_k_has_order_k_plus_1(instance, version, solver, degree):
    """With u = cos(2 t), held or with its derivatives at each communication point; x = (cos t - cos 2 t) / 3."""
    model, errors = driven(), []
    model.solver = solver
    finest = {"exact": {}, "rosenbrock": {"solver.relative_tolerance": 1e-12}, "rk4": {"solver.maximum_step": 1e-3}}
    for h in (0.05, 0.025):
        it = instance(model, version)
        it.set(finest[solver])
        it.initialize()
        for k in range(round(2.0 / h)):
            phase = 2 * k * h
            it.set({"u": math.cos(phase)})
            if degree:
                it.move({"u": (-2 * math.sin(phase), -4 * math.cos(phase))[:degree]})
            it.step(k * h, h)
        expected = (math.cos(2.0) - math.cos(4.0)) / 3, (2 * math.sin(4.0) - math.sin(2.0)) / 3
        errors.append(math.dist(it.get("x", "v"), expected))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(degree + 1, abs=0.1)


# What sees them -------------------------------------------------------------------------------------------------------


def test_ticks_inside_a_step_see_the_moving_input(instance, version):
    it = instance("controller", version).initialize()
    it.set({"error": 2.0})
    it.move({"error": (100.0, 1e5)})
    it.step(0.0, 4e-3)
    t = np.arange(4) * 1e-3
    sampled = 2.0 + 100.0 * t + 5e4 * t**2
    z = 0.25 + np.cumsum(np.concatenate([[0.0], sampled * 1e-3]))
    assert it.get("integral", "command") == pytest.approx([z[4], 20 * z[3] + sampled[3] * math.cos(3e-3)], rel=1e-13)
    assert it.get("error") == pytest.approx([3.2])


def test_output_derivatives_contain_those_of_inputs(instance, version):
    """At a communication point, of the motion that begins there: a second derivative does not act yet."""
    it = instance("gain", version).initialize()
    it.set({"u": 1.0})
    it.move({"u": (3.0, 50.0)})
    assert it.output_derivatives("y") == [6.0]


# When they act --------------------------------------------------------------------------------------------------------


def test_derivatives_of_inputs_act_for_one_step_in_fmi_2(instance):
    """Then the inputs stay where they were brought; derivatives may come one by one, in any order."""
    it = instance("gain", 2).initialize()
    it.set({"u": 1.0})
    it.move({"u": (-8.0,)})
    it.fmu.setRealInputDerivatives(it.references("u", "u"), [2, 1], [16.0, 3.0])
    it.step(0.0, 0.5)
    assert it.get("u", "y") == [4.5, 9.0]
    assert it.output_derivatives("y") == [0.0]
    it.step(0.5, 0.5)
    assert it.get("u", "y") == [4.5, 9.0]


def test_derivatives_of_inputs_act_until_changed_in_fmi_3(instance):
    """Parameters that keep their values, set in step mode; each step starts from where the last one has brought u."""
    it = instance("gain", 3)
    assert it.get("input_derivative[1].u", "input_derivative[2].u") == [0.0, 0.0]
    it.set({"u": 1.0, "input_derivative[1].u": 3.0})
    it.initialize()
    it.set({"input_derivative[2].u": 16.0})
    for k, expected in enumerate([4.5, 8.0]):
        it.step(0.5 * k, 0.5)
        assert it.get("u", "y", "input_derivative[1].u", "input_derivative[2].u") == [expected, 2 * expected, 3.0, 16.0]
    it.set({"input_derivative[1].u": 0.0, "input_derivative[2].u": 0.0})
    it.step(1.0, 0.5)
    assert it.get("u") == [8.0]


def test_derivatives_of_inputs_that_cannot_be(instance, version):
    it = instance("gain", version).initialize()
    with it.refused("u", "nan"):
        it.move({"u": (0.0, math.nan)})
    if version == 3:
        return
    for reference, order, word in (
        (it.references("y"), 1, "y is not an input"),
        (it.references("u"), 3, "order 3 of u is not known; the highest is 2"),
        (it.references("u"), 0, "order 0 of u"),
    ):
        with it.refused(word):
            it.fmu.setRealInputDerivatives(reference, [order], [1.0])


def test_a_failed_step_keeps_the_derivatives_of_inputs(instance, version):
    """The step may be tried again, with the same bits as if it had not failed."""
    ends = []
    for fails in (True, False):
        it = instance("van_der_pol", version).initialize()
        it.set({"u": 0.5})
        it.move({"u": (2.0, -30.0)})
        if fails:
            it.set({"mu": 1e9})
            with it.refused("state x is"):
                it.step(0.0, 0.1)
            it.set({"mu": 1.0})
        it.step(0.0, 0.1)
        ends.append(it.get("x", "v", "u"))
    assert ends[0] == ends[1]
    assert ends[0][2] == pytest.approx(0.55, rel=1e-14)


def test_model_exchange_knows_no_derivatives_of_inputs(instance):
    """The parameters may be set there too, and change nothing."""
    it = instance("pendulum", 3, "me").initialize()
    it.update()
    it.set({"torque": 2.0})
    before = it.get("der(rate)", "energy", "feed", "torque")
    it.move({"torque": (5.0, 7.0)})
    it.fmu.enterContinuousTimeMode()
    assert it.get("der(rate)", "energy", "feed", "torque") == before
