"""Model Exchange instance: values that an integrator sets and reads."""

import ctypes
import math

import numpy as np
import pytest


def pointer(array: np.ndarray):
    """What the FMU takes an array by."""
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


def test_what_is_read_follows_time_and_states(instance, version):
    """No result outlives what it was made from: time, states and inputs change one at a time, read in between."""
    it = instance("pendulum", version, "me")
    it.set({"torque": 2.0})
    it.initialize()
    it.update()
    it.fmu.enterContinuousTimeMode()

    def expected(t, q, w, u):
        return [2 * 9.81 * -math.sin(q) - 0.1 * w + u * math.cos(3 * t), u * math.sin(t) + 0.5 / (1 + q**2)]

    t, q, w, u = 0.0, 0.4, 0.0, 2.0
    for step in range(12):
        if step % 4 == 0:
            t += 0.3
            it.fmu.setTime(t)
        elif step % 4 == 1:
            q, w = q - 0.2, w + 0.1
            it.fmu.setContinuousStates(pointer(np.array([q, w])), 2)
        elif step % 4 == 2:
            u -= 0.5
            it.set({"torque": u})
        else:
            q += 0.05
            it.set({"angle": q})
        assert it.get("der(rate)", "feed") == pytest.approx(expected(t, q, w, u), rel=1e-13)


def test_model_exchange_with_a_runge_kutta_of_the_test(instance, version):
    """States, derivatives, time: RK4 through the functions of Model Exchange equals the closed form."""
    it = instance("mass_on_spring", version, "me")
    it.set({"base.position": 1e-3, "mass.velocity": 0.1})
    it.initialize()
    assert it.update()[0] is False
    it.fmu.enterContinuousTimeMode()
    x, nominals, slopes = (np.zeros(2) for _ in range(3))
    it.fmu.getContinuousStates(pointer(x), 2)
    it.fmu.getNominalsOfContinuousStates(pointer(nominals), 2)
    assert nominals.tolist() == [1e-3, 0.1]
    slope_call = it.fmu.getDerivatives if version == 2 else it.fmu.getContinuousStateDerivatives

    def f(t, x):
        it.fmu.setTime(t)
        it.fmu.setContinuousStates(pointer(x), 2)
        slope_call(pointer(slopes), 2)
        return slopes.copy()

    h = 1e-4
    for k in range(1000):
        k1 = f(k * h, x)
        k2 = f(k * h + h / 2, x + h / 2 * k1)
        k3 = f(k * h + h / 2, x + h / 2 * k2)
        k4 = f(k * h + h, x + h * k3)
        x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        it.fmu.completedIntegratorStep()
    decay, omega = 0.25, math.sqrt(1e4 - 0.0625)
    a, b = -1e-3, (0.1 - 0.25e-3) / omega
    expected = 1e-3 + math.exp(-decay * 0.1) * (a * math.cos(omega * 0.1) + b * math.sin(omega * 0.1))
    assert x[0] == pytest.approx(expected, rel=1e-6)
    with it.refused("expected 2"):
        it.fmu.getContinuousStates(pointer(x), 3)


def test_model_exchange_needs_no_completed_step(instance, version):
    """Derivatives follow the states whether or not a step was completed, and no event is asked for."""
    it = instance("pendulum", version, "me").initialize()
    it.update()
    it.fmu.enterContinuousTimeMode()
    found = []
    for completed in (False, True):
        if completed:
            assert not any(it.fmu.completedIntegratorStep())
        it.fmu.setContinuousStates(pointer(np.array([0.1, 0.2])), 2)
        found.append(it.get("der(angle)", "der(rate)", "energy"))
        it.fmu.setContinuousStates(pointer(np.array([0.5, -0.2])), 2)
        it.get("der(rate)")
    assert found[0] == found[1]


def test_derivatives_that_are_no_numbers_are_discarded(instance, version):
    it = instance("pendulum", version, "me")
    it.set({"torque": math.nan})
    it.initialize()
    slopes = np.zeros(2)
    call = it.fmu.getDerivatives if version == 2 else it.fmu.getContinuousStateDerivatives
    with it.refused("logStatusDiscard", "der(rate)", "nan"):
        call(pointer(slopes), 2)
