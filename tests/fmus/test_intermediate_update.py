"""Intermediate update and early return of FMI 3: an importer sees inside a communication step, and may end it there."""

import numpy as np
import pytest
from fmpy import read_model_description

LONG = 0.5
"""Length of a communication step with many steps of the solver inside [s]."""


class Listener:
    """Keeps time and a value at each point inside a step, and ends the step where `ends` says so of the value."""

    def __init__(self, name: str, ends=lambda _: False):
        self.name, self.ends = name, ends
        self.rows: list[tuple[float, float]] = []
        self.it = None

    def __call__(self, _env, time, can_set, can_get, finished, may_end, end, _end_time):
        assert (can_set, can_get, finished) == (False, True, True)
        (value,) = self.it.get(self.name)
        self.rows.append((time, value))
        if self.ends(value):
            assert may_end
            end[0] = True


@pytest.fixture
def listening(instance):
    """Return an initialized instance of a model with a listener to one of its variables."""

    def make(model, name, ends=lambda _: False, settings=None, may_end=True):
        listener = Listener(name, ends)
        listener.it = it = instance(model, 3, intermediateUpdate=listener, earlyReturnAllowed=may_end)
        it.set(settings or {})
        it.initialize()
        return it, listener

    return make


@pytest.mark.parametrize("model", ["pendulum", "van_der_pol", "two_link"])
def test_outputs_inside_a_step_are_those_of_shorter_steps(listening, instance, model):
    """At each point the outputs are those of an instance that has stepped to there; inputs move on a line."""
    name = {"pendulum": "feed", "van_der_pol": "y", "two_link": "energy"}[model]
    entry = {"pendulum": "torque", "van_der_pol": "u", "two_link": "torque[1]"}[model]
    it, listener = listening(model, name, settings={entry: 0.3, f"input_derivative[1].{entry}": 2.0})
    it.step(0.0, LONG)
    times = [time for time, _ in listener.rows]
    assert len(times) > 5
    assert times == sorted(set(times))
    assert times[0] > 0
    assert times[-1] < LONG
    other = instance(model, 3)
    other.set({entry: 0.3, f"input_derivative[1].{entry}": 2.0})
    other.initialize()
    for (time, value), before in zip(listener.rows, [0.0, *times], strict=False):
        other.step(before, time - before)
        assert value == pytest.approx(other.get(name)[0], rel=1e-5, abs=1e-7)


@pytest.mark.parametrize("model", ["pendulum", "van_der_pol", "hybrid", "chain", "controller"])
def test_listening_changes_no_bit(listening, instance, model):
    it, listener = listening(model, "time")
    other = instance(model, 3).initialize()
    for one in (it, other):
        one.step(0.0, 0.0125, 3)
    names = it.names("state", "sampled_state", "output")
    assert it.get(*names) == other.get(*names)
    assert all(time == value for time, value in listener.rows)


def test_points_inside_a_step_of_a_sampled_model_are_its_ticks(listening):
    """`hybrid` is linear, so that its solver takes one step from tick to tick, 2 ms apart."""
    it, listener = listening("hybrid", "position")
    it.step(0.0, 0.009)
    np.testing.assert_allclose([time for time, _ in listener.rows], [0.002, 0.004, 0.006, 0.008], rtol=1e-10)


def test_a_limit_is_met_where_it_is_crossed(listening, instance):
    """A master that ends the step at the first point beyond a limit, of steps of at most 0.1 ms, has it to 0.1 ms."""
    it, listener = listening("pendulum", "angle", lambda angle: angle < 0.1, {"solver.maximum_step": 1e-4})
    event, terminate, early, last = it.fmu.doStep(0.0, LONG)
    assert (event, terminate, early) == (False, False, True)
    assert last == listener.rows[-1][0] == it.get("time")[0] < LONG
    assert it.get("angle")[0] < 0.1 <= listener.rows[-2][1]
    assert last - listener.rows[-2][0] <= 1e-4 * (1 + 1e-9)
    # from there it goes on to where it would have been
    listener.ends = lambda _: False
    assert it.fmu.doStep(last, LONG - last)[2:] == (False, LONG)
    whole = instance("pendulum", 3)
    whole.set({"solver.maximum_step": 1e-4})
    whole.initialize().step(0.0, LONG)
    np.testing.assert_allclose(it.get("angle", "rate"), whole.get("angle", "rate"), rtol=1e-8)


def test_inputs_have_the_values_of_the_end(listening):
    """Inputs that move on a line stop where the step stops."""
    settings = {"torque": 1.0, "input_derivative[1].torque": 4.0, "solver.maximum_step": 0.01}
    it, listener = listening("pendulum", "torque", lambda torque: torque > 1.2, settings)
    _, _, early, last = it.fmu.doStep(0.0, LONG)
    assert early
    assert it.get("torque")[0] == pytest.approx(1.0 + 4.0 * last, rel=1e-12)
    assert all(value == pytest.approx(1.0 + 4.0 * time, rel=1e-12) for time, value in listener.rows)


def test_ticks_are_the_same_however_steps_are_ended(listening, instance):
    it, listener = listening("controller", "integral", lambda _: True, {"error": 1.0})
    time = 0.0
    while time < 0.0105 - 1e-9:
        time = it.fmu.doStep(time, 0.0105 - time)[-1]
    whole = instance("controller", 3)
    whole.set({"error": 1.0})
    whole.initialize().step(0.0, 0.0105)
    assert len(listener.rows) == 10
    assert it.get("integral", "command") == whole.get("integral", "command")


def test_only_reading_is_possible_inside_a_step(listening):
    """Setting, stepping and leaving are refused with the mode in the message; the step goes on."""
    it, listener = listening("pendulum", "angle")

    def attempt(_):
        for call in (lambda: it.set({"torque": 1.0}), lambda: it.step(0.0, 0.1), lambda: it.fmu.terminate()):
            with it.refused("in intermediate update mode"):
                call()
        return False

    listener.ends = attempt
    it.step(0.0, 0.1)
    assert listener.rows


def test_who_may_not_end_a_step_does_not(instance):
    asked = []

    def insist(_env, time, _set, _get, _finished, may_end, end, _end_time):
        asked.append((time, may_end))
        end[0] = True

    it = instance("pendulum", 3, intermediateUpdate=insist).initialize()
    assert it.fmu.doStep(0.0, LONG)[2:] == (False, LONG)
    assert len(asked) > 5
    assert not any(may_end for _, may_end in asked)


def test_the_description_says_so(mass_on_spring_files):
    flags = read_model_description(mass_on_spring_files[3]).coSimulation
    assert flags.providesIntermediateUpdate
    assert flags.canReturnEarlyAfterIntermediateUpdate
