"""Statuses that FMI does not know end a run, in both loops and at any call, negative ones too."""

from pathlib import Path

import pytest

from hfsa.cosim.fmi.co_simulation import Fmu, Instance
from hfsa.cosim.fmi.library import fails
from hfsa.cosim.fmi.step_error import StepError
from hfsa.cosim.systems.system import Component, Connection, System

NEGATIVE, BEYOND = 13, 14
LABELS = {NEGATIVE: "status -1", BEYOND: "status 101"}
VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])


@VERSIONS
@pytest.mark.parametrize("behaviour", LABELS, ids=["negative", "beyond"])
@pytest.mark.parametrize("algorithm", ["gauss_seidel", "jacobi", "jacobi_plain", "gauss_seidel_linear"])
def test_an_unknown_status_of_a_step_ends_the_run(both, foreign, version, behaviour, algorithm):
    start = {"behaviour": behaviour, "at": 0.05}
    system = System([Component("a", "x"), Component("b", "x", start=start)], [Connection("a.y", "b.u")])

    def run(master):
        recording = master.record(["b.y"], rows=11)
        master.initialize()
        master.advance(10)
        return recording

    outcomes = both(system, {"a": foreign[version], "b": foreign[version]}, run, algorithm)
    assert outcomes[0] == outcomes[1]
    message, label, time = outcomes[0][0]
    assert (label, round(time, 9)) == (LABELS[behaviour], 0.05)
    assert "the spring is broken" in message


@VERSIONS
def test_a_single_instance_checks_it_too(foreign: dict[int, Path], version):
    with Instance(Fmu.load(foreign[version]), "box") as box:
        box.start(values={"behaviour": NEGATIVE, "at": 0.0})
        with pytest.raises(StepError, match=r"status -1 at t = 0 s: the spring is broken"):
            box.step(0.0, 0.1)


def test_ok_and_warning_alone_go_on():
    assert [status for status in range(-3, 103) if not fails(status)] == [0, 1]
