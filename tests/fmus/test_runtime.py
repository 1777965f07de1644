"""Values, modes and messages of an instance; both versions, both interface types."""

import math

import numpy as np
import pytest

from hfsa.components._modelling.functions import functions


def test_outputs_follow_inputs_without_a_step(instance, version):
    it = instance("gain", version).initialize()
    for u in (1.0, -3.0, 0.25):
        it.set({"u": u})
        assert it.get("y", "inverse", "u") == [2 * u, 1 / u, u]


def test_values_equal_the_functions(instance, version, interface, model_name, models, start_values):
    """Derivatives, outputs and next values at the start are what CasADi computes."""
    made, at = functions(models[model_name]()), start_values
    it = instance(model_name, version, interface)
    rng = np.random.default_rng(1)
    at["u"] = rng.uniform(0.5, 1.0, at["u"].shape)
    it.set(dict(zip(it.names("input"), at["u"], strict=True)))
    it.initialize(time=0.7)
    arguments = (0.7, at["x"], at["z"], at["u"], at["p"])
    for function, role in ((made.rhs, "derivative"), (made.out, "output"), (made.tick, "next")):
        values = function(*arguments)
        values = values[0] if isinstance(values, tuple) else values
        np.testing.assert_allclose(it.get(*it.names(role)), np.array(values).ravel(), rtol=1e-13, atol=1e-13)
    assert it.get("time") == [0.7]


def test_strings_and_numbers_that_the_model_was_built_with(instance, version):
    it = instance("pendulum", version).initialize()
    assert it.fmu.getString(it.references("level"))[0] in ("ideal", b"ideal")
    assert it.get("rotation[1]") == [10.0]
    with it.refused("level", "string"):
        it.get("level")
    with it.refused("rotation[1]", "constant"):
        it.set({"rotation[1]": 1.0})
    with it.refused("SetString", "level"):
        it.fmu.setString(it.references("level"), ["rigid"])


def test_other_types_have_no_variables(instance, version):
    it = instance("pendulum", version).initialize()
    (reference,) = it.references("angle")
    calls = ["Boolean"] + (["Integer"] if version == 2 else ["Float32", "Int8", "UInt16", "Int64", "UInt64"])
    for kind in calls:
        assert list(getattr(it.fmu, f"get{kind}")([])) == []
        with it.refused(f"Get{kind}", "angle", "real number"):
            getattr(it.fmu, f"get{kind}")([reference])
        with it.refused(f"Set{kind}", "angle"):
            getattr(it.fmu, f"set{kind}")([reference], [1])


@pytest.mark.parametrize(
    ("name", "value", "word"),
    [
        ("time", 1.0, "independent"),
        ("der(angle)", 1.0, "calculated"),
        ("energy", 1.0, "calculated"),
        ("length", -1.0, "expected 0.01 to 10"),
        ("length", math.nan, "finite"),
        ("damping", math.inf, "finite"),
        ("angle", math.nan, "finite"),
        ("solver.relative_tolerance", 0.0, "above 0"),
    ],
)
def test_a_variable_that_cannot_be_set_is_named(instance, version, name, value, word):
    it = instance("pendulum", version)
    with it.refused("logStatusError: ", name, word):
        it.set({name: value})


def test_unknown_value_references(instance, version):
    it = instance("pendulum", version)
    last = len(it.variables)
    read = it.fmu.getReal if version == 2 else it.fmu.getFloat64
    write = it.fmu.setReal if version == 2 else it.fmu.setFloat64
    with it.refused(f"no value reference {last + 1}", f"1 to {last}"):
        read([last + 1])
    with it.refused("no value reference 0"):
        read([0])
    with it.refused("no value reference 4294967295"):
        write([0xFFFFFFFF], [0.0])


def test_what_may_be_set_when(instance, version):
    it = instance("hybrid", version)
    it.set({"sample_time": 1e-3, "position": 2.0, "force": 1.0, "seen": 5.0, "stiffness": 300.0, "target": 1.0})
    it.initialize()
    it.set({"target": 2.0, "stiffness": 350.0})
    for name in ("sample_time", "position", "force", "seen"):
        with it.refused(name, "in step mode", "until the end of initialization"):
            it.set({name: 1.0})
    assert it.get("sample_time", "position", "seen", "stiffness") == [1e-3, 2.0, 5.0, 350.0]
    it.fmu.terminate()
    with it.refused("target", "after termination", "reset"):
        it.set({"target": 1.0})


def test_calls_in_a_wrong_mode_say_which_is_right(instance, version):
    it = instance("pendulum", version)
    with it.refused("DoStep", "before initialization", "in step mode only"):
        it.step(0.0, 1e-3)
    with it.refused("Terminate"):
        it.fmu.terminate()
    with it.refused("ExitInitializationMode", "in initialization mode only"):
        it.fmu.exitInitializationMode()
    it.initialize()
    with it.refused("EnterInitializationMode" if version == 3 else "SetupExperiment", "before initialization only"):
        it.initialize()
    me = instance("pendulum", version, "me").initialize()
    with me.refused("EnterEventMode", "in continuous-time mode only"):
        me.fmu.enterEventMode()
    me.fmu.enterContinuousTimeMode()
    with me.refused("discrete states", "in continuous-time mode", "in event mode only"):
        me.update()
    with me.refused("time cannot be nan"):
        me.fmu.setTime(math.nan)


def test_a_foreign_token_is_refused(compiled, models, instance, version, capfd):
    it = instance("gain", version)
    sources, path = compiled(models["pendulum"]())
    with pytest.raises(Exception, match="nstantiate"):
        type(it)(type(sources)(**{**vars(sources), "token": "x" * 64}), path, version, "cs")


def test_reset_is_a_new_instance(instance, version):
    it = instance("hybrid", version)
    it.set({"stiffness": 100.0, "target": 1.0})
    it.initialize(time=3.0)
    it.step(3.0, 0.01, 7)
    it.fmu.reset()
    fresh = instance("hybrid", version)
    names = it.names("state", "sampled_state", "input", "sampled_output", "parameter")
    assert it.get(*names) == fresh.get(*names)
    for one in (it, fresh):
        one.initialize()
        one.step(0.0, 0.01, 5)
    assert it.get(*names) == fresh.get(*names)


def test_two_instances_do_not_disturb_each_other(instance, version, model_name):
    """Interleaved steps of two differently driven instances give what each gives alone."""
    inputs, watched = None, None
    results = {}
    for together in (False, True):
        pair = [instance(model_name, version).initialize() for _ in range(2)]
        inputs = pair[0].names("input")
        watched = pair[0].names("state", "sampled_state", "output", "sampled_output")
        order = [(k, i) for k in range(40) for i in (0, 1)] if together else [(k, i) for i in (0, 1) for k in range(40)]
        for k, i in order:
            pair[i].set({name: 0.1 + 0.3 * i + math.sin(k * (i + 1)) for name in inputs})
            pair[i].step(k * 1e-3, 1e-3)
        results[together] = [one.get(*watched) for one in pair]
    assert results[True] == results[False]
    assert results[True][0] != results[True][1]


def test_times_that_cannot_be(instance, version):
    it = instance("gain", version)
    with it.refused("start time is nan"):
        it.initialize(time=math.nan)
    with it.refused("stop time is 1", "start time 2"):
        it.initialize(time=2.0, stop_time=1.0)


# Messages -------------------------------------------------------------------------------------------------------------


def test_messages_respect_logging(instance, version):
    quiet = instance("gain", version, logging=False)
    for category, heard in (
        (None, 0),
        ("logStatusDiscard", 1),
        ("logStatusError", 0),
    ):
        if category:
            quiet.fmu.setDebugLogging(True, [category])
        quiet.messages.clear()
        with pytest.raises(Exception, match="discard"):
            quiet.get("inverse")
        assert len(quiet.messages) == heard
    quiet.fmu.setDebugLogging(True, [])
    with quiet.refused("inverse"):
        quiet.get("inverse")
    with quiet.refused("no log category noise", "logStatusDiscard and logStatusError"):
        quiet.fmu.setDebugLogging(True, ["noise"])
    quiet.fmu.setDebugLogging(False, [])
    quiet.messages.clear()
    with pytest.raises(Exception, match="discard"):
        quiet.get("inverse")
    assert not quiet.messages


def test_calls_that_an_fmu_does_not_offer(instance):
    it = instance("controller", 3).initialize()
    for call in (it.fmu.enterConfigurationMode, it.fmu.exitConfigurationMode):
        with it.refused("structural parameters"):
            call()
    (reference,) = it.references("command")
    with it.refused("GetClock", "command"):
        it.fmu.getClock([reference])
    it.fmu.enterStepMode()
