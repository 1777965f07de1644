"""Steps and ticks of an instance, and their failures; both versions."""

import math

import numpy as np
import pytest


def test_steps_that_cannot_be_are_refused_with_the_reason(instance, version):
    it = instance("mass_on_spring", version).initialize(stop_time=0.01)
    for step in (0.0, -1e-3, math.nan, math.inf):
        with it.refused("step above 0"):
            it.step(0.0, step)
    with it.refused("from 0.5", "ended at 0"):
        it.step(0.5, 1e-3)
    with it.refused("stop time 0.01"):
        it.step(0.0, 0.02)
    it.step(0.0, 0.01)
    assert it.get("time") == [0.01]


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_an_input_that_is_no_number_stops_the_step(instance, version, value):
    it = instance("mass_on_spring", version).initialize()
    it.step(0.0, 1e-3)
    before = it.get("mass.position", "time")
    it.set({"base.position": value})
    with it.refused("logStatusError", "base.position", str(value).lstrip("-")):
        it.step(1e-3, 1e-3)
    assert it.get("mass.position", "time") == before
    it.set({"base.position": 1.0})
    it.step(1e-3, 1e-3)


def test_a_result_that_is_no_number_is_named(instance, version):
    it = instance("gain", version).initialize()
    it.set({"u": 0.0})
    assert it.get("y") == [0.0]
    with it.refused("logStatusDiscard", "derivative for inverse is"):
        it.forward(["inverse"], ["u"], [1.0])
    with it.refused("logStatusDiscard", "inverse", "inf"):
        it.get("inverse")


def test_a_tick_that_gives_no_number_is_named(instance, version):
    it = instance("controller", version)
    it.set({"gain": 1e308, "integral": 10.0})
    it.initialize()
    with it.refused("logStatusError", "command is inf", "time 0"):
        it.step(0.0, 1e-3)
    assert it.get("integral", "command", "time") == [10.0, -1.0, 0.0]
    me = instance("controller", version, "me")
    me.set({"gain": 1e308, "integral": 10.0})
    me.initialize()
    with me.refused("command is inf"):
        me.update()


def test_a_step_that_blows_up_leaves_the_instance_as_it_was(instance, version):
    """With mu = 1e9, far beyond rk4's stability, the state overflows within one step."""
    it = instance("van_der_pol", version)
    it.set({"mu": 1e9, "solver.maximum_step": 1e-3})
    it.initialize()
    with it.refused("state x is", "0.1"):
        it.step(0.0, 0.1)
    assert it.get("x", "v", "time") == [2.0, 0.0, 0.0]


def test_the_communication_step_may_vary(instance, version):
    """Any division of an interval gives the same motion."""
    ends = []
    for steps in ([0.5], [0.1, 0.15, 0.25], [0.001] * 500):
        it = instance("mass_on_spring", version).initialize()
        it.set({"base.position": 1e-3})
        time = 0.0
        for step in steps:
            it.step(time, step)
            time = it.get("time")[0]
        ends.append(it.get("mass.position", "mass.velocity"))
    np.testing.assert_allclose(ends[1:], [ends[0]] * 2, rtol=1e-10)


def test_last_successful_time(instance):
    it = instance("gain", 2).initialize()
    it.step(0.0, 0.5)
    assert it.fmu.getRealStatus(2) == 0.5
    assert it.fmu.getBooleanStatus(3) is False
    with it.refused("status"):
        it.fmu.getIntegerStatus(0)
    with it.refused("pending"):
        it.fmu.cancelStep()
    it3 = instance("gain", 3).initialize()
    assert it3.fmu.doStep(0.0, 0.5)[-1] == 0.5


# Ticks ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [1, 2, 5, 0.5, 0.2, 0.01])
def test_ticks_are_the_same_for_any_communication_step(instance, version, ratio):
    """A tick at the beginning of a step belongs to it, one at its end to the next; nothing changes between ticks."""
    it = instance("controller", version)
    it.set({"error": 1.0})
    it.initialize(time=0.3)
    assert it.get("command") == [-1.0]
    h = 1e-3 * ratio
    for k in range(round(20 / ratio)):
        it.step(0.3 + k * h, h)
        ticks = math.ceil((k + 1) * ratio - 1e-9)
        before = 0.25 + (ticks - 1) * 1e-3
        command = 20 * before + math.cos(0.3 + (ticks - 1) * 1e-3)
        assert it.get("integral", "command") == pytest.approx([before + 1e-3, command], rel=1e-12)


def test_a_tick_is_an_event_of_model_exchange(instance, version):
    it = instance("controller", version, "me")
    it.set({"error": 1.0})
    it.initialize(time=0.1)
    assert it.get("integral", "command") == [0.25, -1.0]
    for n in range(1, 4):
        assert it.update() == (True, pytest.approx(0.1 + n * 1e-3))
        assert it.update() == (True, pytest.approx(0.1 + n * 1e-3))
        tick = 0.1 + (n - 1) * 1e-3
        before = 0.25 + (n - 1) * 1e-3
        assert it.get("integral", "command") == pytest.approx([before + 1e-3, 20 * before + math.cos(tick)])
        it.fmu.enterContinuousTimeMode()
        it.fmu.setTime(0.1 + n * 1e-3)
        it.fmu.enterEventMode()


def test_next_values_are_what_a_tick_would_give(instance, version):
    it = instance("hybrid", version).initialize()
    it.step(0.0, 3e-3)
    (expected,) = it.get("next.force")
    it.step(3e-3, 1e-3)
    (before,) = it.get("next.force")
    it.step(4e-3, 1e-6)
    assert it.get("force") == [before]
    assert before != expected


@pytest.mark.parametrize("parts", [1, 2, 7])
def test_ticks_of_a_mixed_model_are_independent_of_the_steps(instance, version, parts):
    """One step over 20 ticks, and steps that cut each sample time, follow the same motion."""
    whole = instance("hybrid", version).initialize()
    whole.set({"target": 0.3})
    whole.step(0.0, 0.04)
    cut = instance("hybrid", version).initialize()
    cut.set({"target": 0.3})
    cut.step(0.0, 2e-3 / parts, 20 * parts)
    names = whole.names("state", "sampled_state", "output", "sampled_output")
    np.testing.assert_allclose(cut.get(*names), whole.get(*names), rtol=1e-11)
