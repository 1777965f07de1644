"""The loop that tests of driven inputs share: a mass on a spring, pushed, whose controller follows a reference."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from spring_loop import DAMPING, STIFFNESS

from hfsa.components import Model
from hfsa.cosim.systems.system import Component, Connection, System

KP, KD, TF = 40.0, 2.0, 0.02
"""Gains [N/m], [N.s/m] and the time constant of the derivative's filter [s]."""

REFERENCE, PUSH = "pd.reference", "plant.push"
"""Driven inputs."""

SYSTEM = System(
    [Component("pd", "x"), Component("plant", "x")],
    [Connection("plant.position", "pd.position"), Connection("pd.force", "plant.force")],
)


def follower() -> Model:
    """A controller that follows a reference and its rate; its force follows both directly."""
    m = Model("Follower", "PD controller of a reference")
    r, rate = m.input("reference", "m", "Reference"), m.input("reference_rate", "m/s", "Rate of the reference")
    u = m.input("position", "m", "Measured position")
    w = m.state("filtered", "m", "Filtered position")
    m.der[w] = (u - w) / TF
    m.output("force", KP * (r - u) + KD * (rate - (u - w) / TF), "N", "Force")
    return m


def pushed() -> Model:
    """A mass on a spring with two forces."""
    m = Model("Pushed", "Mass on a spring, driven by a force and pushed by another")
    force, push = m.input("force", "N", "Force of the controller"), m.input("push", "N", "Push")
    x, v = m.state("x", "m", "Position"), m.state("v", "m/s", "Velocity")
    m.der[x] = v
    m.der[v] = force + push - DAMPING * v - STIFFNESS * x
    m.output("position", x, "m", "Position")
    return m


Function = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def solution(reference: Function, push: Function, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the position at times [s], (times,), from rest; `reference` returns the value and the rate, (2, n)."""

    def rates(time: float, y: NDArray[np.float64]) -> list[float]:
        at = np.array([time])
        (r,), (slope,) = reference(at)
        x, v, w = y
        force = KP * (r - x) + KD * (slope - (x - w) / TF)
        return [v, force + float(push(at)[0]) - DAMPING * v - STIFFNESS * x, (x - w) / TF]

    options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-15, "max_step": 0.02}
    return solve_ivp(rates, (0.0, times[-1]), np.zeros(3), t_eval=times, **options).y[0]
