"""modelDescription.xml: the facts of a model, by the rules of FMI 2 and of FMI 3."""

import os
import subprocess
import sys
from importlib.metadata import version as package_version

import casadi as ca
import numpy as np
import pytest
from fmpy.model_description import read_model_description
from lxml import etree

import hfsa.components
from hfsa.components import Model
from hfsa.components._modelling.catalogue import find
from hfsa.fmus.c_code import generate
from hfsa.fmus.errors import ExportError
from hfsa.fmus.model_description import model_description

VERSIONS = (2, 3)


def everything() -> Model:
    """A model with every kind of quantity and every kind of dependency."""
    m = Model("Everything", 'Has "all" kinds: <a> & b')
    m.information = {"level": "full", "posture.rotation[1]": 10.0}
    scale = m.parameter("scale", 2.0, "1", "Fixed factor", fixed=True)
    stiffness = m.parameter("stiffness", 0.1 + 0.2, "N/m", "Tunable factor", min=0, max=1e6)
    m.sample_time(1e-3)
    held = m.input("held", "m", "Sampled at ticks", start=0.25, nominal=1e-6)
    force = m.input("force[1..2]", "N", "Force")
    q = m.state("q[1..2]", "m", "Displacement", start=[0.5, -1e-7], nominal=1e-6)
    v = m.state("v[1..2]", "m/s", "Rate")
    z = m.sampled_state("z", "m", "Memory", start=3)
    m.der[q] = v
    m.der[v] = ca.vertcat(-stiffness * q[0] + scale * force[0] + z * force[1], ca.sin(q[1]) + m.time * force[0] + v[1])
    m.next[z] = z / 2 + held
    m.output("sum", q[0] + scale * q[1], "m", "Constant and fixed")
    m.output("clock", m.time, "s", "Time")
    m.sampled_output("seen", z + held, "m", "Seen at the last tick", start=7)
    return m


@pytest.fixture(scope="module")
def sources():
    return generate(everything())


@pytest.fixture(scope="module", params=VERSIONS, ids=["fmi2", "fmi3"])
def version(request):
    return request.param


@pytest.fixture(scope="module")
def root(sources, version):
    return etree.fromstring(model_description(everything(), sources, version))


@pytest.fixture(scope="module")
def parsed(sources, version, tmp_path_factory):
    file = tmp_path_factory.mktemp("xml") / "modelDescription.xml"
    file.write_bytes(model_description(everything(), sources, version))
    return read_model_description(str(file), validate=True, validate_variable_names=True, validate_model_structure=True)


def variable(parsed, name):
    return next(v for v in parsed.modelVariables if v.name == name)


def test_every_part_is_valid(part_model, tmp_path):
    sources = generate(part_model)
    for version in VERSIONS:
        file = tmp_path / f"{version}.xml"
        file.write_bytes(model_description(part_model, sources, version))
        read_model_description(str(file), validate=True, validate_variable_names=True, validate_model_structure=True)


@pytest.mark.parametrize(
    ("name", "causality", "variability", "initial", "start"),
    [
        ("time", "independent", "continuous", None, None),
        ("q[1]", "local", "continuous", "exact", "0.5"),
        ("der(q[1])", "local", "continuous", "calculated", None),
        ("z", "local", "discrete", "exact", "3.0"),
        ("next.z", "local", "continuous", "calculated", None),
        ("held", "input", "continuous", "exact", "0.25"),
        ("sum", "output", "continuous", "calculated", None),
        ("seen", "output", "discrete", "exact", "7.0"),
        ("stiffness", "parameter", "tunable", "exact", "0.30000000000000004"),
        ("scale", "parameter", "fixed", "exact", "2.0"),
        ("sample_time", "parameter", "fixed", "exact", "0.001"),
        ("solver.relative_tolerance", "parameter", "fixed", "exact", "1e-08"),
        ("posture.rotation[1]", "local", "constant", "exact", "10.0"),
    ],
)
def test_what_a_variable_is(parsed, name, causality, variability, initial, start):
    found = variable(parsed, name)
    assert (found.causality, found.variability, found.initial) == (causality, variability, initial)
    assert found.start == start


def test_a_derivative_names_its_state(parsed):
    for name in ("q[1]", "q[2]", "v[1]", "v[2]"):
        assert variable(parsed, f"der({name})").derivative.name == name


def test_value_references_are_those_of_the_c_table(parsed, sources):
    found = {v.name: v.valueReference for v in parsed.modelVariables}
    assert found == {v.name: v.reference for v in sources.listed(parsed.fmiMajorVersion)}


@pytest.mark.parametrize("version", VERSIONS, ids=["fmi2", "fmi3"])
def test_who_made_it_and_when(monkeypatch, version):
    """A date is there where the builder gives one; the same model gives the same bytes."""
    model = find([hfsa.components])["sdelta"].model("rigid", **{"posture.rotation": "10,0,0"})
    made = generate(model)
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
    root = etree.fromstring(model_description(model, made, version))
    assert (root.get("license"), root.get("author")) == ("BSD-3-Clause", "The hfsa developers")
    assert root.get("version") == package_version("hfsa")
    assert root.get("generationTool") == f"hfsa {package_version('hfsa')}"
    assert root.get("copyright").startswith("Copyright")
    assert root.get("generationDateAndTime") is None
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    root = etree.fromstring(model_description(model, made, version))
    assert root.get("generationDateAndTime") == "2023-11-14T22:13:20Z"
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    with pytest.raises(ExportError, match=r"\$SOURCE_DATE_EPOCH is 'yesterday', expected whole seconds"):
        model_description(model, made, version)


def test_nothing_is_claimed_of_a_model_of_ones_own(root):
    assert not {"author", "version", "license", "copyright"} & set(root.attrib)


def test_structural_arguments_have_sentence_and_unit(tmp_path):
    model = find([hfsa.components])["sdelta"].model("rigid", **{"posture.rotation": "10,0,0"})
    file = tmp_path / "modelDescription.xml"
    file.write_bytes(model_description(model, generate(model), 2))
    description = read_model_description(str(file), validate=True)
    found = {v.name: v for v in description.modelVariables}
    assert (found["payload.mass"].unit, found["payload.mass"].description) == ("kg", "Mass; 0 for the platform alone")
    assert (found["posture.rotation[1]"].unit, found["posture.rotation[1]"].start) == ("deg", "10.0")
    (degree,) = [unit for unit in description.unitDefinitions if unit.name == "deg"]
    assert (degree.baseUnit.rad, degree.baseUnit.factor) == (1, np.pi / 180)


def test_a_value_reference_is_the_position_of_a_number(parsed, root):
    """Some tools take the dependencies of FMI 3, which are value references, for positions."""
    for place, found in enumerate(parsed.modelVariables, 1):
        assert found.type == "String" or found.valueReference == place
    listed = [e.get("valueReference") or e.get("index") for e in root.find("ModelStructure").iter() if e.attrib]
    assert {parsed.modelVariables[int(reference) - 1].causality for reference in listed} == {"output", "local"}


def test_texts_are_variables_in_fmi_2_and_annotations_in_fmi_3(parsed, root):
    """CasADi refuses a whole file of FMI 3 with a String in it."""
    if parsed.fmiMajorVersion == 2:
        found = variable(parsed, "level")
        assert (found.type, found.causality, found.variability, found.start) == ("String", "local", "constant", "full")
        return
    assert {v.type for v in parsed.modelVariables} == {"Float64"}
    (text,) = root.iterfind("Annotations/Annotation[@type='org.hfsa.texts']/Constant")
    assert (text.get("name"), text.get("value")) == ("level", "full")


def test_derivatives_of_inputs_are_parameters_behind_all_others_in_fmi_3(parsed, sources):
    """So the two descriptions count the same: FMI 2, which has a function for them, lists none."""
    names = [v.name for v in parsed.modelVariables]
    inputs = ["held", "force[1]", "force[2]"]
    expected = [f"input_derivative[{order}].{name}" for order in (1, 2) for name in inputs]
    if parsed.fmiMajorVersion == 2:
        assert not set(names) & set(expected)
        return
    assert names[-6:] == expected
    for name, unit in (("input_derivative[1].force[2]", "N/s"), ("input_derivative[2].held", "m/s2")):
        found = variable(parsed, name)
        assert (found.causality, found.variability, found.start) == ("parameter", "tunable", "0.0")
        assert found.unit == unit
        assert "until changed" in found.description


def test_bounds_nominals_and_texts(parsed):
    stiffness = variable(parsed, "stiffness")
    assert (float(stiffness.min), float(stiffness.max)) == (0.0, 1e6)
    assert float(variable(parsed, "q[2]").nominal) == 1e-6
    assert parsed.description == 'Has "all" kinds: <a> & b'
    assert all(v.description for v in parsed.modelVariables)


def dependencies(unknowns):
    return {
        u.variable.name: {d.name: kind for d, kind in zip(u.dependencies, u.dependenciesKind, strict=True)}
        for u in unknowns
    }


def test_dependencies_of_outputs_and_derivatives(parsed):
    """Read off the equations by hand; a sampled output is held, so nothing moves it at a communication point."""
    assert dependencies(parsed.outputs) == {
        "sum": {"q[1]": "constant", "q[2]": "fixed"},
        "clock": {"time": "constant"},
        "seen": {},
    }
    assert dependencies(parsed.derivatives) == {
        "der(q[1])": {"v[1]": "constant"},
        "der(q[2])": {"v[2]": "constant"},
        "der(v[1])": {"q[1]": "tunable", "force[1]": "fixed", "force[2]": "discrete"},
        "der(v[2])": {"time": "dependent", "q[2]": "dependent", "v[2]": "constant", "force[1]": "dependent"},
    }


def test_initial_unknowns(parsed):
    """During initialization parameters and sampled states are known too, and a held output has its start value."""
    found = dependencies(parsed.initialUnknowns)
    assert list(found) == ["der(q[1])", "der(q[2])", "der(v[1])", "der(v[2])", "sum", "clock"]
    assert found["der(v[1])"] == dict.fromkeys(("q[1]", "z", "force[1]", "force[2]", "scale", "stiffness"), "dependent")
    assert found["sum"] == {"q[1]": "constant", "q[2]": "dependent", "scale": "dependent"}


def test_units_by_base_units(root):
    units = {u.get("name"): u for u in root.iterfind("UnitDefinitions/Unit")}
    assert dict(units["N/m"].find("BaseUnit").attrib) == {"kg": "1", "s": "-2"}
    assert dict(units["m/s2"].find("BaseUnit").attrib) == {"m": "1", "s": "-2"}
    assert dict(units["1"].find("BaseUnit").attrib) == {}
    display = {d.get("name"): float(d.get("factor")) for d in units["m"].iterfind("DisplayUnit")}
    assert display == {"mm": 1e3, "um": 1e6}


def test_capability_flags(root, version):
    exchange, cosimulation = root.find("ModelExchange").attrib, root.find("CoSimulation").attrib
    state = "FMUstate" if version == 2 else "FMUState"
    slope = "providesDirectionalDerivative" + ("" if version == 2 else "s")
    for flags in (exchange, cosimulation):
        assert flags["modelIdentifier"] == "Everything"
        for name in (f"canGetAndSet{state}", f"canSerialize{state}", slope):
            assert flags[name] == "true"
        assert (flags.get("providesAdjointDerivatives") == "true") == (version == 3)
    assert cosimulation["canHandleVariableCommunicationStepSize"] == "true"
    assert cosimulation["maxOutputDerivativeOrder"] == "1"
    assert cosimulation.get("canInterpolateInputs") == ("true" if version == 2 else None)
    assert exchange.get("completedIntegratorStepNotNeeded") == ("true" if version == 2 else None)


def test_default_experiment(parsed):
    experiment = parsed.defaultExperiment
    assert float(experiment.stepSize) == 1e-3
    assert float(experiment.stopTime) >= 1.0


def oscillator(stiffness: float) -> Model:
    m = Model("Oscillator", "Undamped")
    x, v = m.state("x", "m", "Displacement"), m.state("v", "m/s", "Rate")
    m.der[x], m.der[v] = v, -stiffness * x
    return m


@pytest.mark.parametrize("omega", [1e-2, 30.0, 2 * np.pi * 5e3])
def test_the_default_experiment_shows_the_oscillation(omega, tmp_path):
    file = tmp_path / "modelDescription.xml"
    model = oscillator(omega**2)
    file.write_bytes(model_description(model, generate(model), 2))
    experiment = read_model_description(str(file)).defaultExperiment
    period, step, stop = 2 * np.pi / omega, float(experiment.stepSize), float(experiment.stopTime)
    assert period / 60 <= step <= period / 20 * (1 + 1e-9)
    assert 5 * period <= stop <= 100 * period


def test_the_same_model_gives_the_same_bytes(sources, version):
    """Also in another process, whose sets and dictionaries are in another order."""
    code = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from test_model_description import everything, generate, model_description\n"
        "m = everything(); sys.stdout.buffer.write(model_description(m, generate(m), int(sys.argv[2])))"
    )
    command = [sys.executable, "-c", code, os.path.dirname(__file__), str(version)]
    there = subprocess.run(
        command, capture_output=True, check=True, env={**os.environ, "PYTHONHASHSEED": "7"}, timeout=120
    )
    assert there.stdout == model_description(everything(), sources, version)
