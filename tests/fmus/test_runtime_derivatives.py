"""Directional, adjoint and output derivatives of an instance, against the functions of its model."""

import math

import numpy as np
import pytest

from hfsa.components._modelling.functions import functions

KNOWNS = ("time", "state", "sampled_state", "input", "parameter")
UNKNOWNS = ("derivative", "output", "next", "sampled_output")


def jacobian(it) -> tuple[np.ndarray, list[str], list[str]]:
    """Column by column; unknowns and knowns by role, as the model's functions have them."""
    unknowns, knowns = ([name for role in roles for name in it.names(role)] for roles in (UNKNOWNS, KNOWNS))
    columns = [it.forward(unknowns, [known], [1.0]) for known in knowns]
    return np.array(columns).T, unknowns, knowns


def test_forward_derivatives_equal_finite_differences(instance, version, interface, model_name, models, start_values):
    """At time 0.7, with every known and every unknown: the tick map too."""
    made, at = functions(models[model_name]()), start_values
    it = instance(model_name, version, interface)
    at["u"] = np.linspace(0.6, 1.1, len(at["u"]))
    it.set(dict(zip(it.names("input"), at["u"], strict=True)))
    it.initialize(time=0.7)
    found, _, _ = jacobian(it)
    point = np.concatenate([[0.7], at["x"], at["z"], at["u"], at["p"]])
    cuts = np.cumsum([1, len(at["x"]), len(at["z"]), len(at["u"])])

    def values(vector):
        arguments = np.split(vector, cuts)
        results = [made.rhs(*arguments), made.out(*arguments), *made.tick(*arguments)]
        return np.concatenate([np.array(r).ravel() for r in results])

    for j, value in enumerate(point):
        h = 1e-5 * max(1.0, abs(value))
        ahead, behind = point.copy(), point.copy()
        ahead[j] += h
        behind[j] -= h
        expected = (values(ahead) - values(behind)) / (2 * h)
        np.testing.assert_allclose(found[:, j], expected, rtol=2e-6, atol=2e-8)


def test_adjoint_derivatives_are_the_transpose(instance, interface, model_name):
    it = instance(model_name, 3, interface)
    it.set(dict.fromkeys(it.names("input"), 0.8))
    it.initialize(time=0.7)
    forward, unknowns, knowns = jacobian(it)
    rows = [it.adjoint([unknown], knowns, [1.0]) for unknown in unknowns]
    np.testing.assert_allclose(rows, forward, rtol=1e-12, atol=1e-12)
    weights = np.arange(1.0, len(unknowns) + 1)
    np.testing.assert_allclose(it.adjoint(unknowns, knowns, weights), weights @ forward, rtol=1e-11, atol=1e-11)


def test_derivatives_follow_time_and_inputs(instance, version):
    """The pendulum has d feed / d torque = sin(t), wherever time stands."""
    it = instance("pendulum", version, "me").initialize()
    it.update()
    it.fmu.enterContinuousTimeMode()
    for t in (0.0, 0.5, 2.0):
        it.fmu.setTime(t)
        assert it.forward(["feed"], ["torque"], [1.0]) == pytest.approx([math.sin(t)])
        assert it.get("feed") == pytest.approx([0.5 / 1.16])
        it.set({"torque": 2.0})
        assert it.forward(["feed", "der(rate)"], ["time"], [1.0]) == pytest.approx(
            [2 * math.cos(t), -6 * math.sin(3 * t)]
        )
        it.set({"torque": 0.0})


def test_what_is_no_known_or_unknown_is_named(instance, version):
    it = instance("hybrid", version).initialize()
    for unknown, known, word in (
        ("position", "target", "position"),
        ("power", "der(position)", "der(position)"),
        ("target", "target", "target"),
    ):
        with it.refused(word, "derivative"):
            it.forward([unknown], [known], [1.0])


def test_output_derivatives_follow_the_motion(instance, version):
    """dy/dt from the FMU equals the difference quotient across a short step, held outputs rest."""
    it = instance("pendulum", version).initialize()
    it.set({"torque": 1.5})
    it.step(0.0, 0.3)
    found = it.output_derivatives("energy", "feed")
    before = np.array(it.get("energy", "feed"))
    it.step(0.3, 1e-6)
    np.testing.assert_allclose(found, (np.array(it.get("energy", "feed")) - before) / 1e-6, rtol=1e-4)
    with it.refused("order 2", "energy"):
        it.output_derivatives("energy", order=2)
    with it.refused("angle", "output"):
        it.output_derivatives("angle")
    other = instance("hybrid", version).initialize()
    other.step(0.0, 1e-3)
    assert other.output_derivatives("seen") == [0.0]
