"""FMU states of an instance: saved, restored, serialised, and refused by another FMU."""

import math


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
    every = [v.name for v in it.variables if v.role.value not in ("text", "counter")]
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
