"""What an instance does: values, modes, ticks, derivatives, FMU states, messages; both versions, both interfaces."""

import ctypes
import math

import numpy as np
import pytest

from hfsa.components._functions import functions

INTERFACES = ["me", "cs"]
DOUBLES = ctypes.POINTER(ctypes.c_double)


def starts(model) -> dict[str, np.ndarray]:
    """Start values by argument of the model's functions."""
    kinds = {"x": ("state",), "z": ("sampled_state",), "u": ("input",), "p": ("parameter",)}
    return {key: np.array([q.start for q in model.of(*kind)]) for key, kind in kinds.items()}


# Values and modes -----------------------------------------------------------------------------------------------------


def test_outputs_follow_inputs_without_a_step(instance, version):
    it = instance("gain", version).initialize()
    for u in (1.0, -3.0, 0.25):
        it.set({"u": u})
        assert it.get("y", "inverse", "u") == [2 * u, 1 / u, u]


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


@pytest.mark.parametrize("interface", INTERFACES)
def test_values_equal_the_functions(instance, version, interface, model_name, models):
    """Derivatives, outputs and next values at the start are what CasADi computes."""
    model = models[model_name]()
    made, at = functions(model), starts(model)
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
    last = len(it.variables) - 1
    read = it.fmu.getReal if version == 2 else it.fmu.getFloat64
    write = it.fmu.setReal if version == 2 else it.fmu.setFloat64
    with it.refused(f"no value reference {last + 1}", f"0 to {last}"):
        read([last + 1])
    with it.refused("no value reference 4294967295"):
        write([0xFFFFFFFF], [0.0])


def test_what_may_be_set_when(instance, version):
    it = instance("hybrid", version)
    it.set({"sample_time": 1e-3, "position": 2.0, "force": 1.0, "seen": 5.0, "stiffness": 300.0, "target": 1.0})
    it.initialize()
    it.set({"target": 2.0, "stiffness": 350.0})
    for name in ("sample_time", "position", "force", "seen"):
        with it.refused(name, "in step mode", "until initialization is over"):
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


# Steps ----------------------------------------------------------------------------------------------------------------


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


# Derivatives ----------------------------------------------------------------------------------------------------------

KNOWNS = ("time", "state", "sampled_state", "input", "parameter")
UNKNOWNS = ("derivative", "output", "next", "sampled_output")


def jacobian(it) -> tuple[np.ndarray, list[str], list[str]]:
    """Column by column; unknowns and knowns by role, as the model's functions have them."""
    unknowns, knowns = ([name for role in roles for name in it.names(role)] for roles in (UNKNOWNS, KNOWNS))
    columns = [it.forward(unknowns, [known], [1.0]) for known in knowns]
    return np.array(columns).T, unknowns, knowns


@pytest.mark.parametrize("interface", INTERFACES)
def test_forward_derivatives_equal_finite_differences(instance, version, interface, model_name, models):
    """At time 0.7, with every known and every unknown: the tick map too."""
    model = models[model_name]()
    made, at = functions(model), starts(model)
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


@pytest.mark.parametrize("interface", INTERFACES)
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


# FMU states -----------------------------------------------------------------------------------------------------------


def drive(it, first: int, last: int, step_size: float = 7e-4) -> list[list[float]]:
    """Steps with moving inputs for each, and all that can be seen after each of them."""
    watched = it.names("time", "state", "sampled_state", "output", "sampled_output", "derivative", "next", "input")
    seen = []
    for k in range(first, last):
        phases = {name: 0.1 * k + i for i, name in enumerate(it.names("input"))}
        it.set({name: 0.2 + math.cos(phase) for name, phase in phases.items()})
        it.move({name: (math.sin(phase), -1e3 * math.cos(phase)) for name, phase in phases.items()})
        it.step(k * step_size, step_size)
        seen.append(it.get(*watched))
    return seen


def test_a_restored_state_repeats_bit_for_bit(instance, version, model_name):
    it = instance(model_name, version).initialize()
    drive(it, 0, 5)
    every = [v.name for v in it.variables if v.role.value != "text"]
    state, seen = it.state(), it.get(*every)
    first = drive(it, 5, 25)
    it.set(dict.fromkeys(it.names("input"), 9.0))
    if "stiffness" in it.names("parameter"):
        it.set({"stiffness": 1.0})
    assert it.get(*every) != seen
    it.restore(state)
    assert it.get(*every) == seen
    assert drive(it, 5, 25) == first
    it.free_state(state)


def test_a_serialized_state_carries_over(instance, version, model_name):
    it, other = instance(model_name, version).initialize(), instance(model_name, version)
    drive(it, 0, 5)
    state = it.state()
    content = it.serialize(state)
    received = other.deserialize(content)
    other.restore(received)
    assert drive(other, 5, 25) == drive(it, 5, 25)
    other.free_state(received)
    it.free_state(state)


def test_a_foreign_state_is_refused(instance, version):
    """Bytes of another model, another interface, cut short, or with another token."""
    it = instance("pendulum", version).initialize()
    state = it.state()
    content = it.serialize(state)
    it.free_state(state)
    for other in (instance("pendulum", version, "me"), instance("two_link", version)):
        state = other.state()
        foreign = other.serialize(state)
        other.free_state(state)
        with it.refused():
            it.deserialize(foreign)
    with it.refused("expected"):
        it.deserialize(content[:-8])
    with it.refused("another model, build or interface"):
        it.deserialize(bytes([content[0] ^ 1]) + content[1:])


def test_a_state_keeps_the_mode(instance, version):
    it = instance("hybrid", version)
    state = it.state()
    it.initialize()
    it.step(0.0, 1e-3)
    it.restore(state)
    it.set({"position": 3.0})
    it.initialize()
    assert it.get("position") == [3.0]
    it.free_state(state)


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


# Model Exchange -------------------------------------------------------------------------------------------------------


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


def pointer(array: np.ndarray):
    return array.ctypes.data_as(DOUBLES)
