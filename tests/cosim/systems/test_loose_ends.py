"""Loose ends are told by name, start value and the output that was perhaps meant."""

import pytest

from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.loose_ends import loose_ends
from hfsa.cosim.systems.system import Component, Connection, System

JOINT = {
    "torque": Connector("torque", 0, "input", unit="N.m", start=0.0),
    "measured": Connector("measured", 1, "output", unit="rad"),
}
PID = {
    "measured": Connector("measured", 0, "input", unit="rad", start=0.25),
    "command": Connector("command", 1, "output", unit="N.m"),
}
CONNECTORS = {"joint": JOINT, "pid": PID, "spare": JOINT}


def system(*names: str, joined: tuple[tuple[str, str], ...] = ()) -> System:
    """Return a system of foreign components with connections."""
    parts = [Component(name, f"{name}.fmu", start={"torque": 2.0} if name == "spare" else {}) for name in names]
    return System(parts, [Connection(start, end) for start, end in joined])


def test_an_input_that_nothing_feeds_is_told_with_its_value_and_what_was_perhaps_meant():
    found = loose_ends(system("joint", "pid", joined=(("pid.command", "joint.torque"),)), CONNECTORS, [])
    words = "nothing feeds pid.measured (0.25 rad): it keeps its start value"
    assert found == [f"{words}; nothing reads joint.measured, of the same name"]


@pytest.mark.parametrize("used", [["pid.measured"], ["joint.measured", "pid.measured"]], ids=["excited", "both"])
def test_an_excited_input_is_no_loose_end(used):
    assert loose_ends(system("joint", "pid", joined=(("pid.command", "joint.torque"),)), CONNECTORS, used) == []


def test_a_component_that_nothing_connects_is_told():
    joined = ("pid.command", "joint.torque"), ("joint.measured", "pid.measured")
    whole = system("joint", "pid", "spare", joined=joined)
    assert loose_ends(whole, CONNECTORS, []) == [
        "nothing connects or observes the component spare",
        "nothing feeds spare.torque (2 N.m): it keeps its start value",
    ]
    assert loose_ends(whole, CONNECTORS, ["spare.measured", "spare.torque"]) == []


def test_many_inputs_are_counted():
    many = {f"u[{i}].x": Connector(f"u[{i}].x", i, "input", start=float(i)) for i in range(1, 10)}
    (found,) = loose_ends(system("joint"), {"joint": many}, [])
    assert found.endswith("joint.u[6].x (6) and 3 more: they keep their start values")


def test_derivatives_of_an_input_of_a_part_of_ours_are_no_loose_ends():
    own = {name: Connector(name, i, "input", start=0.0) for i, name in enumerate(("x", "x_rate"))}
    assert loose_ends(System([Component("a", "a")]), {"a": own}, ["a.x"]) == []
    (found,) = loose_ends(system("joint"), {"joint": own}, ["joint.x"])
    assert "joint.x_rate" in found
