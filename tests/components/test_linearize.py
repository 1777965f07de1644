"""Linearisation keeps names and units of time, takes operating points, and knows the tick map of a sampled model."""

import casadi as ca
import numpy as np
import pytest

from hfsa.components import Model, ModelError
from hfsa.components._modelling.linearize import linearize
from hfsa.components.mass_on_spring import mass_on_spring


def integrator() -> Model:
    """Held y = z + k u; z+ = z + Ts u."""
    m = Model("Integrator", "Sampled integrator with feedthrough")
    sample_time = m.sample_time(0.01)
    u = m.input("u", "m", "Input")
    k = m.parameter("k", 3.0, "1", "Feedthrough")
    z = m.sampled_state("z", "m.s", "Integral")
    m.next[z] = z + sample_time * u
    m.sampled_output("y", z + k * u, "m.s", "Output")
    return m


def test_names_and_matrices_of_a_continuous_model():
    system = linearize(mass_on_spring(), {"stiffness": 4.0})
    assert (system.input_labels, system.output_labels) == (["base/position"], ["position"])
    assert system.state_labels == ["mass/position", "mass/velocity"]
    np.testing.assert_array_equal(system.A, [[0, 1], [-4, -0.5]])
    np.testing.assert_array_equal(system.B, [[0], [4]])


def test_the_operating_point_enters():
    m = Model("Pendulum", "Gravity pendulum")
    angle, rate = m.state("angle", "rad", "Angle"), m.state("rate", "rad/s", "Rate")
    m.der[angle] = rate
    m.der[rate] = -9.81 * ca.sin(angle)
    np.testing.assert_allclose(linearize(m, {"angle": 1.0}).A, [[0, 1], [-9.81 * np.cos(1.0), 0]], rtol=1e-15)


def test_a_sampled_model_gives_its_tick_map():
    system = linearize(integrator(), {"sample_time": 0.5})
    assert system.dt == 0.5
    np.testing.assert_array_equal(np.hstack([system.A, system.B, system.C, system.D]), [[1, 0.5, 1, 3]])


def test_refusals():
    with pytest.raises(ModelError, match="no quantity 'stifness'"):
        linearize(mass_on_spring(), {"stifness": 1.0})
    m = integrator()
    m.der[m.state("x", "m", "Continuous")] = m["u"].expression
    with pytest.raises(ModelError, match="continuous and sampled"):
        linearize(m)
