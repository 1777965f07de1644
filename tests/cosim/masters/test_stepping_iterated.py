"""Iterated steps in C: the same bits and messages as in Python, however a run ends."""

import numpy as np
import pytest
from algorithm_groups import ITERATED
from spring_loop import LOOP, loop

from hfsa.components import Model
from hfsa.cosim.actions.algebraic_loop import AlgebraicLoop
from hfsa.cosim.actions.iterated import IteratedStep
from hfsa.cosim.masters.algorithms import ALGORITHMS
from hfsa.cosim.masters.error_controlled import ErrorControlled
from hfsa.cosim.systems.system import Component, Connection, System

VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
each_method = pytest.mark.parametrize("method", ITERATED)
REFUSE, LOSE = 9.0, 10.0
"""Behaviours of the foreign FMU: it cannot get its state, or cannot set it."""


@pytest.fixture
def around(files, foreign, rewritten):
    """The loop, with the position measured by a foreign FMU that integrates velocity and can go back: system, files."""

    def make(version: int, **start: float):
        word = {2: "canGetAndSetFMUstate", 3: "canGetAndSetFMUState"}[version]
        variable = 'canHandleVariableCommunicationStepSize="true"'
        spring = rewritten(foreign[version], variable, f'{variable} {word}="true"')
        components = [Component("plant", "x", start={"x": 1.0}), Component("spring", "x", start=start)]
        connections = [Connection("plant.velocity", "spring.u"), Connection("spring.y", "pd.position"), LOOP[1]]
        found = {"plant": files["Plant", version], "spring": spring, "pd": files["Pd", version]}
        return System([*components, Component("pd", "x")], connections), found

    return make


def run(master):
    recording = master.record(["spring.y", "plant.position"], rows=5)
    master.initialize()
    master.advance(10)
    master.advance(10)
    return recording


@VERSIONS
@each_method
@pytest.mark.parametrize(
    ("behaviour", "ending"),
    [
        (0.0, None),
        (2.0, "discard"),
        (3.0, "error"),
        (4.0, "fatal"),
        (5.0, "terminated"),
        (6.0, "discard"),  # by the controller, which is given no number
        (REFUSE, "error"),
        (LOSE, "error"),
    ],
)
def test_every_end_of_a_run_is_the_same(both, around, version, method, behaviour, ending):
    system, found = around(version, behaviour=behaviour, at=0.05)
    python, c = both(system, found, run, method)
    assert python == c
    failure, rows, time, warnings, _ = python
    if ending is None or (ending == "terminated" and version == 2):  # FMI 2 has no such request
        assert (failure, rows, time) == (None, 21, 0.2)
        assert list(warnings) == ["spring"]  # whose input is held
    else:
        assert failure[1] == ending
        assert 0.03 < failure[2] < 0.06


@VERSIONS
@each_method
def test_a_warning_is_noted_and_the_step_goes_on(both, around, version, method):
    system, found = around(version, u=1.0, behaviour=1.0, at=0.05)
    python, c = both(System(system.components, LOOP), found, run, method)
    assert python == c
    failure, rows, _, warnings, _ = python
    assert (failure, rows) == (None, 21)
    assert warnings["spring"].startswith(f"spring: fmi{version}DoStep: warning at t = 0.05 s: the spring is broken")


@VERSIONS
def test_an_fmu_that_refuses_is_named_with_what_it_refused(both, around, version):
    messages = []
    for behaviour in (REFUSE, LOSE):
        (failure, *_), _ = both(*around(version, behaviour=behaviour, at=0.05), run, "fixed_point")
        messages.append(failure[0].split(" at ")[0])
    functions = {2: ("fmi2GetFMUstate", "fmi2SetFMUstate"), 3: ("fmi3GetFMUState", "fmi3SetFMUState")}[version]
    assert messages == [f"spring: {function}: error" for function in functions]


@VERSIONS
def test_a_step_that_does_not_converge_is_told_alike(both, files, version):
    python, c = both(*loop(files, version), lambda master: run_plain(master, 10), "fixed_point", 0.3)
    assert python == c
    words, status, _ = python[0]
    assert status == "does not converge"
    assert "after 200 passes over a step of 0.3 s; a smaller step helps, or quasi_newton" in words
    assert abs(float(words.split("residual ")[1].split()[0])) > 1.0


@VERSIONS
@each_method
def test_what_is_no_number_does_not_converge(both, around, version, method):
    """A second foreign FMU uses the value like any other."""
    _, found = around(version)
    components = [Component("spring", "x", start={"u": 1.0, "behaviour": 6.0, "at": 0.05}), Component("other", "x")]
    system = System(components, [Connection("spring.y", "other.u")])
    found = dict.fromkeys(("spring", "other"), found["spring"])
    python, c = both(system, found, lambda master: run_plain(master, 10, "other.y"), method)
    assert python == c
    assert python[0][1:] == ("does not converge", pytest.approx(0.05))
    assert "residual nan" in python[0][0]


def run_plain(master, steps: int, name: str = "plant.position"):
    recording = master.record([name], rows=steps)
    master.initialize()
    master.advance(steps)
    return recording


@VERSIONS
@each_method
def test_an_instance_made_anew_gives_states_of_its_own(both, around, version, method):
    """The foreign FMU cannot reset: its component and its states are others in the second run."""

    def run_twice(master):
        first = run(master).values.copy()
        assert np.array_equal(run(master).values, first)
        return master._recording

    python, c = both(*around(version), run_twice, method)
    assert python == c


@VERSIONS
@pytest.mark.parametrize("controller", ["Pd", "SampledPd"])
def test_steps_that_follow_their_error_have_the_same_bits(files, opened, library, version, controller):
    system, found = loop(files, version, controller)
    ends = []
    for way in (None, library):
        master = ErrorControlled(opened(found), system, ALGORITHMS["error_controlled"], 5e-3, 1e-5, way)
        recording = run_plain(master, 40)
        ends.append((recording.values.tobytes(), master.wiring.bus.tobytes(), master.taken, master.tried))
    assert ends[0] == ends[1]
    assert ends[0][2] < ends[0][3]


# Loops within the exchange --------------------------------------------------------------------------------------------


def curved() -> Model:
    """A force that opposes the acceleration, and follows it less and less the larger it is."""
    m = Model("Curved", "Curved mass")
    a = m.input("acceleration", "m/s2", "Acceleration")
    m.output("force", -10 * a / (1 + (a / 3) ** 2) ** 0.5, "N", "Force")
    return m


@VERSIONS
@each_method
def test_a_curved_loop_is_solved_anew_wherever_it_must_be(both, files, exported, monkeypatch, version, method):
    """Within a step in C as in Python; with equal steps the inverse is computed once."""
    solved = {AlgebraicLoop: 0, IteratedStep: 0}
    for kind in solved:

        def counted(self, time, kind=kind, solve=kind.solve):
            solved[kind] += 1
            return solve(self, time)

        monkeypatch.setattr(kind, "solve", counted)
    system = System(
        [Component("plant", "x", start={"x": 1.0}), Component("mass", "x")],
        [Connection("plant.acceleration", "mass.acceleration"), Connection("mass.force", "plant.force")],
    )
    found = {"plant": files["Plant", version], "mass": exported(curved())[version]}
    counts = []

    def swing(master):
        recording = master.record(["plant.x", "mass.force"], rows=201)
        master.initialize()
        before = dict(solved)
        master.advance(200)
        assert (recording["plant.x"] < 0).any()
        counts.append({kind: solved[kind] - before[kind] for kind in solved})
        return recording

    python, c = both(system, found, swing, method)
    assert python == c
    assert python[0] is None
    assert counts[0][AlgebraicLoop] == counts[1][AlgebraicLoop] > 2
    assert counts[0][IteratedStep] == counts[1][IteratedStep]
