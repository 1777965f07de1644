"""Statuses that FMI does not know end a run, in both loops and at any call, negative ones too."""

from pathlib import Path

import pytest

from hfsa.cosim.fmi.co_simulation import Fmu, Instance
from hfsa.cosim.fmi.library import fails
from hfsa.cosim.fmi.step_error import StepError
from hfsa.cosim.systems.system import Component, Connection, System

NEGATIVE, BEYOND, MUTTER = 13, 14, 15
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


@VERSIONS
@pytest.mark.parametrize("algorithm", ["gauss_seidel", "jacobi"])
def test_warnings_that_are_only_logged_are_counted(both, foreign, version, algorithm):
    """The step returns ok, so that nothing in the loops sees them."""
    system = System([Component("a", "x"), Component("b", "x", start={"behaviour": MUTTER, "at": 0.05})], [])

    def run(master):
        recording = master.record(["b.y"], rows=11)
        master.initialize()
        for _ in range(5):
            master.advance(2)
        told.append(dict(master.told))
        return recording

    told: list[dict] = []
    both(system, {"a": foreign[version], "b": foreign[version]}, run, algorithm)
    assert told[0] == told[1]
    count, sentence = told[0]["b"]
    assert list(told[0]) == ["b"]
    assert count == 5
    assert sentence == f"b: logged a warning: {'it creaks' if version == 2 else 'the spring creaks'}"


@pytest.mark.parametrize("verb", ["run", "sweep"])
def test_the_user_hears_of_them_through_a_process_of_their_own(hfsa, box, foreign, verb):
    words = ["--points", "2", "-j", "1"] if verb == "sweep" else ["--stop", "0.5"]
    code, _, err = hfsa(verb, box(foreign[2], behaviour=MUTTER, at=0.2), *words, "-o", "out.h5")
    assert code in (0, 1), err
    (line,) = [line for line in err.splitlines() if "creaks" in line]
    assert "box: logged a warning: it creaks" in line
    assert int(line.split("; ")[1].split()[0]) > 1
