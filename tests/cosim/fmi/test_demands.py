"""What FMUs of others demand by their flags is obeyed, or refused in a sentence: one FMU per flag."""

from collections.abc import Callable
from dataclasses import replace
from math import exp
from pathlib import Path

import numpy as np
import pytest
from foreign_fmu import foreign_fmu

from hfsa.cosim.assembly.build import build
from hfsa.cosim.fmi.co_simulation import Fmu, Instance
from hfsa.cosim.fmi.description import describe
from hfsa.cosim.fmi.step_error import StepError
from hfsa.cosim.masters.algorithms import ALGORITHMS, make_master
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, Connection, System

SOURCE = Path(__file__).with_name("keeper.c")
VERSIONS = pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
HELD = [name for name, row in ALGORITHMS.items() if row.inputs == "held"]
PLAIN = {"canHandleVariableCommunicationStepSize": "true", "canGetAndSetFMUstate": "true"}

Keeper = Callable[..., Path]


@pytest.fixture
def keeper(tmp_path) -> Keeper:
    """Make the FMU of `keeper.c` with a behaviour, flags and a default experiment."""

    def make(version: int, *behaviour: str, experiment: str = "", kind: str = "CoSimulation", **flags: str) -> Path:
        given = {**PLAIN, **flags}
        if version == 3:
            given["canGetAndSetFMUState"] = given.pop("canGetAndSetFMUstate")
        words = " ".join(f'{name}="{value}"' for name, value in given.items() if kind == "CoSimulation")
        folder = tmp_path / f"keeper{len(list(tmp_path.iterdir()))}"
        folder.mkdir()
        text = DESCRIPTIONS[version].format(kind=kind, flags=words, experiment=experiment)
        return foreign_fmu(folder, version, "Keeper", SOURCE, text, *(f"-D{word}" for word in behaviour), "-lm")

    return make


def ring() -> System:
    """Two lags in a ring; the first starts at 1."""
    parts = [Component("a", "a.fmu", start={"y": 1.0}), Component("b", "b.fmu")]
    return System(parts, [Connection("a.y", "b.u"), Connection("b.y", "a.u")])


def record(master, names, steps: int = 20) -> np.ndarray:
    """Return recorded values (steps + 1, n) of a run."""
    recording = master.record(names, rows=steps + 1)
    master.initialize()
    master.advance(steps)
    return recording.values.copy()


def by_hand(steps: int, step_size: float = 0.01) -> np.ndarray:
    """Return both outputs of the ring, (steps + 1, 2), in Jacobi order with held inputs."""
    decay, rows = exp(-50 * step_size), [np.array([1.0, 0.0])]
    for _ in range(steps):
        y, u = rows[-1], rows[-1][::-1]
        rows.append(u + (y - u) * decay)
    return np.array(rows)


# Order of calls -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("behaviour", [(), ("STRICT",), ("SECRET",), ("STRICT", "SECRET")], ids=str)
@pytest.mark.parametrize("way", ["python", "c"])
@VERSIONS
def test_an_fmu_that_keeps_to_the_order_of_calls_runs(opened, keeper, library, version, way, behaviour):
    """No value is fetched after a set without a step between in FMI 2, no input in either: the numbers are the same."""
    if version == 3 and "STRICT" in behaviour:
        pytest.skip("FMI 3 has no such rule")
    file = keeper(version, *behaviour)
    master = make_master(opened({"a": file, "b": file}), ring(), "jacobi", 0.01, library if way == "c" else None)
    found = record(master, ["b.u", "a.y", "b.y", "a.u"])
    expected = by_hand(20)
    np.testing.assert_allclose(found, expected[:, [0, 0, 1, 1]], rtol=1e-13)


@pytest.mark.parametrize("algorithm", HELD)
def test_every_algorithm_with_held_inputs_keeps_to_the_order(opened, keeper, algorithm):
    strict, free = keeper(2, "STRICT", "SECRET"), keeper(2)
    runs = [
        record(make_master(opened({"a": file, "b": file}), ring(), algorithm, 0.01), ["a.y", "b.y"])
        for file in (strict, free)
    ]
    np.testing.assert_array_equal(*runs)


@pytest.mark.parametrize("way", ["python", "c"])
def test_an_fmu_that_declares_no_dependencies_is_strict_where_its_component_says_so(
    opened, keeper, rewritten, library, way
):
    """Locals are then fetched right after the step as well."""
    file = rewritten(keeper(2, "STRICT", "SECRET"), ' dependencies=""', "")
    row, names = library if way == "c" else None, ["a.y", "b.y"]
    with pytest.raises(StepError):
        record(make_master(opened({"a": file, "b": file}), ring(), "jacobi", 0.01, row), names)
    system = System([replace(part, calls="strict") for part in ring().components], ring().connections)
    found = record(make_master(opened({"a": file, "b": file}), system, "jacobi", 0.01, row), [*names, "a.tolerance"])
    np.testing.assert_allclose(found[:, :2], by_hand(20), rtol=1e-13)


# Steps ----------------------------------------------------------------------------------------------------------------


@VERSIONS
def test_a_constant_step_is_refused_where_steps_are_chosen(opened, keeper, version):
    file = keeper(version, "CONSTANT", canHandleVariableCommunicationStepSize="false")
    with pytest.raises(StructureError, match=r"a: Keeper\.fmu takes communication steps of one size only"):
        make_master(opened({"a": file, "b": file}), ring(), "error_controlled", 0.01)
    found = record(make_master(opened({"a": file, "b": file}), ring(), "jacobi", 0.01), ["a.y", "b.y"])
    np.testing.assert_allclose(found, by_hand(20), rtol=1e-13)


@pytest.mark.parametrize(
    ("step", "words"),
    [
        pytest.param(0.02, None, id="equal"),
        pytest.param(0.06, None, id="three"),
        pytest.param(0.03, "the nearest one is 0.04 s", id="between"),
        pytest.param(0.001, "the nearest one is 0.02 s", id="below"),
    ],
)
def test_a_communication_step_is_a_multiple_of_the_fmus_own(opened, keeper, step, words):
    file = keeper(3, fixedInternalStepSize="0.02")
    master = make_master(opened({"a": file, "b": file}), ring(), "jacobi", step)
    if words is None:
        master.initialize()
    else:
        with pytest.raises(StructureError, match=rf"0\.02 s \(fixedInternalStepSize\).*{step:g} s: .*{words}"):
            master.initialize()
    with pytest.raises(StructureError, match="chooses its communication steps"):
        make_master(opened({"a": file, "b": file}), ring(), "error_controlled", step)


@pytest.mark.parametrize("way", ["python", "c"])
def test_error_control_sees_what_is_recorded_of_an_fmu_without_states(opened, keeper, library, way):
    """A lag behind a sine of 20 Hz: the error is proportional to the tolerance of a run."""
    omega, rate = 2 * np.pi * 20, 50.0
    source = Component("source", "sine_source", start={"frequency": 20.0, "ramp": 0.0})
    system = System([source, Component("lag", "lag.fmu")], [Connection("source.value", "lag.u")])
    files = {"source": build(System([source])).files["source"], "lag": keeper(2)}
    for tolerance in (1e-3, 1e-4, 1e-5):
        master = make_master(
            opened(files), system, "error_controlled", 5e-3, library if way == "c" else None, 100 * tolerance
        )
        recording = master.record(["lag.y"], rows=101)
        master.initialize()
        master.advance(100)
        t = recording.time
        exact = rate * np.sin(omega * t) - omega * np.cos(omega * t) + omega * np.exp(-rate * t)
        exact *= rate / (rate**2 + omega**2)
        error = abs(recording["lag.y"] - exact).max() / abs(exact).max()
        assert tolerance < error < 10 * tolerance


def test_error_control_refuses_an_fmu_of_which_it_sees_nothing(opened, keeper):
    system = System([Component("a", "a.fmu", start={"u": 1.0})])
    master = make_master(opened({"a": keeper(2)}), system, "error_controlled", 0.01)
    with pytest.raises(StructureError, match=r"a: Keeper\.fmu shows no states, and none of its outputs is connected"):
        master.initialize()
    master.record(["a.y"], rows=2)
    master.initialize()


# Instances ------------------------------------------------------------------------------------------------------------


@VERSIONS
def test_one_instance_per_process(keeper, version):
    """A second is refused while the first lives; without the flag both live."""
    fmu = Fmu.load(keeper(version, "ONCE", canBeInstantiatedOnlyOncePerProcess="true"))
    first = Instance(fmu, "p")
    with pytest.raises(StructureError, match=r"q: Keeper\.fmu can be instantiated only once per process .*, and p is"):
        Instance(fmu, "q")
    first.start()
    first.start()  # a reset instance is the same one
    first.close()
    Instance(fmu, "q").close()
    free = Fmu.load(keeper(version))
    with Instance(free, "p"), Instance(free, "q"):
        pass


@VERSIONS
def test_a_tool_that_is_not_there_is_named(keeper, version):
    fmu = Fmu.load(keeper(version, "TOOL", needsExecutionTool="true"))
    with pytest.raises(StepError, match=r"p: instantiation: no instance: it runs only where Maker 1\.0 is installed"):
        Instance(fmu, "p")


@VERSIONS
@pytest.mark.parametrize(
    ("experiment", "expected"),
    [pytest.param("", -1.0, id="none"), pytest.param('<DefaultExperiment tolerance="1e-7"/>', 1e-7, id="given")],
)
def test_the_tolerance_of_the_default_experiment_is_handed_over(keeper, version, experiment, expected):
    with Instance(Fmu.load(keeper(version, experiment=experiment)), "p") as it:
        it.start()
        assert it.get(it.handle(["tolerance"]))[0] == expected


@VERSIONS
def test_without_get_and_set_of_the_state_a_step_is_not_taken_again(opened, keeper, version):
    file = keeper(version, canGetAndSetFMUstate="false")
    with pytest.raises(StructureError, match=r"does not offer to get and set its state \(canGetAndSetFMUstate\)"):
        make_master(opened({"a": file, "b": file}), ring(), "quasi_newton", 0.01)


def test_memory_functions_that_an_fmu_cannot_use_are_no_matter(keeper):
    with Instance(Fmu.load(keeper(2, canNotUseMemoryManagementFunctions="true")), "p") as it:
        it.start()
        it.step(0.0, 0.01)


def test_scheduled_execution_is_refused(keeper):
    with pytest.raises(StructureError, match=r"offers no Co-Simulation interface.*; it offers Scheduled Execution"):
        describe(keeper(3, kind="ScheduledExecution"), "co_simulation")


DESCRIPTIONS = {
    2: """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Keeper" guid="k" generationTool="Maker 1.0">
  <{kind} modelIdentifier="Keeper" {flags}/>
  {experiment}
  <ModelVariables>
    <ScalarVariable name="u" valueReference="1" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="2" causality="output" initial="exact"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="tolerance" valueReference="3" causality="local"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="2" dependencies=""/></Outputs></ModelStructure>
</fmiModelDescription>
""",
    3: """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Keeper" instantiationToken="k" generationTool="Maker 1.0">
  <{kind} modelIdentifier="Keeper" {flags}/>
  {experiment}
  <ModelVariables>
    <Float64 name="u" valueReference="1" causality="input" start="0"/>
    <Float64 name="y" valueReference="2" causality="output" initial="exact" start="0"/>
    <Float64 name="tolerance" valueReference="3" causality="local"/>
  </ModelVariables>
  <ModelStructure><Output valueReference="2" dependencies=""/></ModelStructure>
</fmiModelDescription>
""",
}
