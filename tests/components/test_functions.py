"""Derivatives of every kind agree with finite differences and with each other, in explicit and mass-matrix form."""

import casadi as ca
import numpy as np
import pytest

from hfsa.components import Model
from hfsa.components._modelling.functions import functions


def double_pendulum(explicit: bool) -> Model:
    """Two links under gravity and damping, torque and time dependent stiffness; once with the mass matrix inverted."""
    m = Model("DoublePendulum", "Two links")
    q = m.state("q[1..2]", "rad", "Angles")
    v = m.state("v[1..2]", "rad/s", "Rates")
    tau = m.input("tau[1..2]", "N.m", "Torques")
    k = m.parameter("k", 2.0, "N.m/rad", "Stiffness")
    c = ca.cos(q[1])
    M = ca.blockcat([[3 + 2 * c, 1 + c], [1 + c, 1]])
    h = tau - k * ca.sin(q) * (1 + m.time**2) - 0.1 * v
    m.der[q] = v
    if explicit:
        a = ca.inv(M) @ h
        m.der[v] = a
    else:
        a = m.motion(v, mass=M, force=h)
    m.output("acceleration[1..2]", a, "rad/s2", "Accelerations")
    m.output("energy", v.T @ M @ v / 2 + k * m.time, "J", "Kinetic energy and a drift")
    return m


ROWS = {"t": 1, "x": 4, "z": 0, "u": 2, "p": 1}


@pytest.fixture
def point() -> list[np.ndarray]:
    rng = np.random.default_rng(1)
    return [rng.normal(size=n) for n in ROWS.values()]


@pytest.fixture
def direction() -> list[np.ndarray]:
    rng = np.random.default_rng(2)
    return [rng.normal(size=n) for n in ROWS.values()]


def column(dm) -> np.ndarray:
    return np.array(dm, dtype=float).reshape(-1)


def test_the_mass_matrix_form_is_the_explicit_one(point, direction):
    implicit, explicit = functions(double_pendulum(False)), functions(double_pendulum(True))
    for name in ("rhs", "out", "jacobian"):
        a, b = getattr(implicit, name)(*point), getattr(explicit, name)(*point)
        np.testing.assert_allclose(np.array(a), np.array(b), rtol=1e-12, atol=1e-12)
    for a, b in zip(implicit.fwd(*point, *direction), explicit.fwd(*point, *direction), strict=True):
        np.testing.assert_allclose(column(a), column(b), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("explicit", [False, True])
def test_forward_derivatives_are_finite_differences_also_along_time(explicit, point, direction):
    f, step = functions(double_pendulum(explicit)), 1e-6
    ahead = [p + step * d for p, d in zip(point, direction, strict=True)]
    behind = [p - step * d for p, d in zip(point, direction, strict=True)]
    forward = f.fwd(*point, *direction)
    for function, derivative in ((f.rhs, forward[0]), (f.out, forward[1])):
        difference = (column(function(*ahead)) - column(function(*behind))) / (2 * step)
        np.testing.assert_allclose(column(derivative), difference, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("explicit", [False, True])
def test_adjoint_is_the_transpose_of_forward(explicit, point, direction):
    f = functions(double_pendulum(explicit))
    weights = [np.random.default_rng(3).normal(size=n) for n in (4, 3, 0, 0)]
    forward = [column(r) for r in f.fwd(*point, *direction)]
    gradient = [column(g) for g in f.adj(*point, *weights)]
    left = sum(w @ r for w, r in zip(weights, forward, strict=True))
    right = sum(g @ d for g, d in zip(gradient, direction, strict=True))
    assert left == pytest.approx(right, rel=1e-12)


def test_linearity_is_seen_where_it_is_and_only_there():
    def oscillator(force) -> Model:
        m = Model("Oscillator", "x'' = force")
        x = m.state("x", "m", "Position")
        v = m.state("v", "m/s", "Velocity")
        u = m.input("u", "m", "Input")
        k = m.parameter("k", 2.0, "1/s2", "Stiffness per mass")
        m.der[x] = v
        m.motion(v, mass=k + 1, force=ca.SX(force(m.time, x, v, u, k)))
        return m

    linear = {"affine": lambda t, x, v, u, k: k**2 * (u - x) - v + 3}
    other = {
        "square": lambda t, x, v, u, k: -(x**2),
        "bilinear": lambda t, x, v, u, k: -x * u,
        "driven by time": lambda t, x, v, u, k: ca.sin(t) - x,
        "drifting": lambda t, x, v, u, k: -t * x,
    }
    assert all(functions(oscillator(f)).is_linear for f in linear.values())
    assert not any(functions(oscillator(f)).is_linear for f in other.values())
