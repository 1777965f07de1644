"""A step that would take too long ends with the time reached; ticks that rounding hides are refused."""

import contextlib
import ctypes
import struct

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

HEADER = 72 + 8 + 8 + 8
"""Token, interface, size and checksum before the state block [bytes]."""


@pytest.fixture
def hurried(instance, version):
    """A pendulum that may take ten steps of its solver in each communication step, of 10 s each."""
    it = instance("pendulum", version)
    it.set({"solver.maximum_steps": 10.0, "solver.relative_tolerance": 1e-10})
    return it.initialize()


def test_a_step_without_enough_work_is_discarded_with_the_time_reached(hurried, version):
    with hurried.refused(
        "logStatusDiscard", "10 steps, all that solver.maximum_steps allows, reached only time", "angle"
    ):
        hurried.step(0.0, 10.0)
    reached = hurried.get("time")[0]
    said = float(hurried.messages[-1].split("reached only time ")[1].split(";")[0])
    if version == 3:
        assert reached == 0.0
        assert 0.0 < said < 10.0
    else:
        assert reached == pytest.approx(said, rel=1e-12)
        last = ctypes.c_double()
        hurried.fmu.fmi2GetRealStatus(hurried.fmu.component, 2, ctypes.byref(last))
        assert last.value == reached


def test_the_part_that_was_done_is_right_and_goes_on(hurried, instance, version):
    """In steps as they come, by discards or early returns, the motion is that of one step with enough work."""
    whole = instance("pendulum", version)
    whole.set({"solver.relative_tolerance": 1e-10})
    whole.initialize()
    whole.step(0.0, 1.0)
    if version == 3:
        hurried = early(instance)
    time, parts = 0.0, 0
    while time < 1.0 and parts < 1000:
        time = advance(hurried, version, time, 1.0 - time)
        parts += 1
    assert 3 < parts < 1000
    assert hurried.get("angle", "rate") == pytest.approx(whole.get("angle", "rate"), rel=1e-7)


def early(instance):
    """A hurried pendulum of FMI 3 whose importer allows early return."""
    it = instance("pendulum", 3, earlyReturnAllowed=True)
    it.set({"solver.maximum_steps": 10.0, "solver.relative_tolerance": 1e-10})
    return it.initialize()


def advance(it, version: int, time: float, size: float) -> float:
    """One communication step; the time that it came to."""
    if version == 3:
        _, _, is_early, last = it.fmu.doStep(time, size)
        assert is_early == (last < time + size)
        return last
    with contextlib.suppress(FMICallException):
        it.step(time, size)
    return it.get("time")[0]


def test_ticks_count_too(instance, version):
    """A sampled model without a solver has ten million ticks in a communication step."""
    it = instance("controller", version)
    it.set({"sample_time": 1e-9})
    it.initialize()
    with it.refused("logStatusDiscard", "1e+07 ticks, the most in a communication step, reached only time 0.01"):
        it.step(0.0, 1.0)


@pytest.mark.parametrize("start", [1e300, -1e300, 1e16, 1e13], ids=str)
def test_ticks_that_rounding_hides_are_refused(instance, version, start):
    it = instance("controller", version).initialize(start)
    with it.refused("logStatusError", "apart there"):
        it.step(start, 1e-3 if abs(start) < 1e14 else abs(start))


def test_an_event_at_a_time_without_ticks_is_refused(instance, version):
    it = instance("controller", version, "me").initialize(1e300)
    with it.refused("cannot be told apart"):
        it.update()


@pytest.mark.parametrize("start", [0.0, 1e5, 2.0**20 + 0.1], ids=str)
def test_late_ticks_take_the_inputs_of_their_own_step(instance, version, start):
    """At 1e6 s times are 1e-10 s apart: a tick at a communication point still belongs to the step that begins there."""
    it = instance("controller", version).initialize(start)
    seen = []
    for k in range(200):
        it.set({"error": float(k)})
        it.step(start + k * 1e-3, 1e-3)
        seen.append(it.get("integral")[0])
    assert np.diff(seen) == pytest.approx(1e-3 * np.arange(1, 200), rel=1e-9)


def test_a_lost_step_is_refused(instance, version):
    it = instance("mass_on_spring", version).initialize(1e9)
    with it.refused("times are 1.19209e-07 s apart there"):
        it.step(1e9, 1e-9)


@pytest.mark.parametrize("size", [1e3, 1e15, 1e300, 1.7e308], ids=str)
def test_the_largest_step_comes_to_rest_or_is_refused(instance, version, size):
    """The norm of the matrix times the step overflows: a damped mass is where its base is, or the step says no."""
    it = instance("mass_on_spring", version).initialize()
    it.set({"base.position": 1e-3})
    try:
        it.step(0.0, size)
    except FMICallException:
        assert size > 1e16
        assert it.messages
    else:
        assert it.get("position") == pytest.approx([1e-3], rel=1e-9)


@pytest.mark.parametrize("place", [0, 4, 9, 32, 40, 44, 48, 71], ids=str)
def test_damaged_states_are_refused(instance, version, place):
    """One flipped bit anywhere in the block."""
    it = instance("hybrid", version).initialize()
    state = it.state()
    content = bytearray(it.serialize(state))
    it.free_state(state)
    content[HEADER + place] ^= 4
    with it.refused("damaged", "checksum"):
        it.deserialize(bytes(content))


@pytest.mark.parametrize(
    ("offset", "forged"),
    [
        (0, struct.pack("d", float("nan"))),
        (8, struct.pack("d", float("inf"))),
        (24, struct.pack("d", -1.0)),
        (32, struct.pack("q", -5)),
        (40, struct.pack("i", 3)),
        (40, struct.pack("i", 8)),
        (44, struct.pack("i", 7)),
        (-8, struct.pack("d", float("nan"))),
        (-8, struct.pack("d", -2e-3)),
    ],
    ids=["time", "start", "step", "ticks", "two modes", "mode of the other interface", "once", "parameter", "bound"],
)
def test_forged_states_are_refused(instance, version, offset, forged):
    """A right checksum on a block that no instance ever had."""
    it = instance("hybrid", version).initialize()
    state = it.state()
    content = it.serialize(state)
    it.free_state(state)
    block = bytearray(content[HEADER:])
    place = offset % len(block)
    block[place : place + len(forged)] = forged
    checked = content[: HEADER - 8] + struct.pack("Q", fnv(block)) + bytes(block)
    with it.refused("DeserializeFMUState"):
        it.deserialize(checked)


def fnv(block: bytes) -> int:
    """The 64-bit FNV-1a hash."""
    value = 0xCBF29CE484222325
    for byte in block:
        value = (value ^ byte) * 0x100000001B3 % 2**64
    return value
