"""The linear method refuses an FMU with undeclared dynamics, whose derivatives are incomplete."""

from pathlib import Path

import numpy as np
import pytest
from foreign_fmu import foreign_fmu

from hfsa.cosim.analysis.stability import CoupledStep
from hfsa.cosim.fmi.co_simulation import open_instances
from hfsa.cosim.fmi.description import describe
from hfsa.cosim.linear.linearize import linear_response, linearize
from hfsa.cosim.results.files import read_sweep
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, System

SOURCE = Path(__file__).with_name("hidden.c")
FLAG = {2: 'providesDirectionalDerivative="true"', 3: 'providesDirectionalDerivatives="true"'}
OUTER = {
    2: '<fmiModelDescription fmiVersion="2.0" modelName="Hidden" guid="{5a1d}">',
    3: '<fmiModelDescription fmiVersion="3.0" modelName="Hidden" instantiationToken="{5a1d}">',
}


def variable(version, name, reference, attributes, kind="real", start=""):
    """Return one variable in XML; `kind` is real, whole, or flag."""
    value = f' start="{start}"' if start != "" else ""
    if version == 3:
        tag = {"real": "Float64", "whole": "Int32", "flag": "Boolean", "clock": "Clock"}[kind]
        return f'<{tag} name="{name}" valueReference="{reference}" {attributes}{value}/>'
    tag = {"real": "Real", "whole": "Integer", "flag": "Boolean"}[kind]
    return f'<ScalarVariable name="{name}" valueReference="{reference}" {attributes}><{tag}{value}/></ScalarVariable>'


def description(version, y='causality="output"', more=(), depends=False, u='causality="input"'):
    """Return a description: u and y, and further variables (name, attributes, kind)."""
    variables = [variable(version, "u", 1, u, start="0"), variable(version, "y", 2, y)]
    variables += [variable(version, name, 3 + i, attributes, kind) for i, (name, attributes, kind) in enumerate(more)]
    follows = (
        'dependencies="1"' if depends else 'dependencies=""',
        'index="2"' if version == 2 else 'valueReference="2"',
    )
    known = "<Outputs><Unknown {1} {0}/></Outputs>" if version == 2 else "<Output {1} {0}/>"
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n{OUTER[version]}'
        f'<CoSimulation modelIdentifier="Hidden" canHandleVariableCommunicationStepSize="true" {FLAG[version]}/>'
        f"<ModelVariables>{''.join(variables)}</ModelVariables>"
        f"<ModelStructure>{known.format(*follows)}</ModelStructure></fmiModelDescription>"
    )


DISCRETE = 'causality="output" variability="discrete"'
HIDING = {
    "a discrete output": ({"y": DISCRETE}, "its output y is discrete, and no parameter sample_time declares when"),
    "a discrete local": (
        {"more": [("k", 'causality="local" variability="discrete"', "real")], "depends": True},
        "its local k is discrete",
    ),
    "a counter": (
        {"more": [("ticks", 'causality="local" variability="discrete"', "whole")], "depends": True},
        "its local ticks is discrete",
    ),
    "a trigger": (
        {"more": [("trigger", 'causality="local" variability="discrete"', "flag")], "depends": True},
        "its local trigger is discrete",
    ),
    "a counter that calls itself smooth": (
        {"more": [("ticks", 'causality="local"', "whole")], "depends": True},
        "its local ticks is discrete",
    ),
    "nothing that its output follows": ({}, "its output y declares no input and no state that it depends on"),
}
OPEN = {
    "a gain": {"depends": True},
    "a gain of a discrete input": {"depends": True, "u": 'causality="input" variability="discrete"'},
    "a gain with parameters and constants": {
        "depends": True,
        "more": [
            ("p", 'causality="parameter" variability="tunable"', "real"),
            ("i", 'causality="parameter" variability="fixed"', "whole"),
            ("c", 'causality="local" variability="constant"', "flag"),
        ],
    },
}

VERSIONS = pytest.mark.parametrize("version", [2, 3])


@pytest.fixture
def fmu(tmp_path):
    def make(version, text, *flags):
        return foreign_fmu(tmp_path, version, "Hidden", SOURCE, text, *flags)

    return make


def answer(file):
    system = System([Component("p", str(file))])
    with open_instances({"p": file}) as instances:
        return linear_response(system, instances, ["p.u"], ["p.y"], np.array([1.0, 10.0]))[:, 0, 0]


@VERSIONS
@pytest.mark.parametrize("case", HIDING)
def test_hidden_dynamics_have_no_linear_response(fmu, version, case):
    given, words = HIDING[case]
    file = fmu(version, description(version, **given))
    with pytest.raises(StructureError) as error:
        answer(file)
    assert f"p (Hidden.fmu): {words}" in str(error.value)
    assert "a stepped sweep measures one" in str(error.value)
    # of its stability nothing is known either
    system = System([Component("p", str(file))])
    with open_instances({"p": file}) as instances:
        if "output y declares" not in words:  # which is asked of outputs that lead somewhere
            with pytest.raises(StructureError, match="undeclared dynamics"):
                CoupledStep(system, instances)
        with pytest.raises(StructureError, match="undeclared dynamics"):
            linearize(system, instances, [], ["p.y"])


def test_a_clock_of_fmi_3_is_none_that_is_known(fmu):
    clock = 'causality="output" intervalVariability="triggered"'
    with pytest.raises(StructureError, match=r"p \(Hidden.fmu\): its clock tick does not declare when it ticks"):
        answer(fmu(3, description(3, more=[("tick", clock, "clock")], depends=True)))


@VERSIONS
@pytest.mark.parametrize("case", OPEN)
def test_what_declares_what_it_follows_has_one(fmu, version, case):
    file = fmu(version, description(version, **OPEN[case]), "-DSTATIC")
    assert answer(file) == pytest.approx([2.0, 2.0])


@VERSIONS
def test_ours_declare_all_that_they_have(part_files, version):
    found = describe(part_files[version])
    assert found.undeclared(name for name, v in found.variables.items() if v.causality == "output") == ""


@VERSIONS
def test_a_stepped_sweep_measures_it_and_says_what_is_missing(hfsa, tmp_path, fmu, version):
    """Its y follows u with a delay and its integral: (2 + 20/100 z/(z - 1)) and a hold, at a tick every 10 ms."""
    file = fmu(version, description(version, **HIDING["a discrete output"][0]))
    (tmp_path / "pi.toml").write_text(
        f"""
        inputs = ["p.u"]
        outputs = ["p.y"]
        band = [1.0, 5.0]
        amplitude = {{ "1" = 1.0 }}
        step_size = 1e-3
        stop_time = 1.0
        [[components]]
        name = "p"
        part = "{file}"
        """
    )
    code, out, err = hfsa("sweep", "pi.toml", "--method", "linear", "-o", "linear.h5")
    assert (code, out) == (2, "")
    assert "error: p (Hidden.fmu): its output y is discrete" in err
    assert not Path("linear.h5").exists()
    code, _, err = hfsa("sweep", "pi.toml", "--points", "3", "--grid", "log", "-j", "1", "-o", "stepped.h5")
    assert code == 0
    assert "there is no linear response to compare with: p (Hidden.fmu): its output y is discrete" in err
    bode = read_sweep("stepped.h5")
    assert bode.theory is None
    f, ticks = bode.frequency, 0.01
    z = np.exp(2j * np.pi * f * ticks)
    expected = abs((2 + 0.2 * z / (z - 1)) * np.sinc(f * ticks))
    assert abs(bode.response[:, 0, 0]) == pytest.approx(expected, rel=1e-2)


def test_what_lies_beside_the_way_from_inputs_to_outputs_hides_what_it_likes(fmu, mass_on_spring_files):
    """It has no effect on the response."""
    system = System([Component("mass", "mass_on_spring"), Component("p", "hidden")])
    files = {"mass": mass_on_spring_files[2], "p": fmu(2, description(2, **HIDING["a discrete output"][0]))}
    with open_instances(files) as instances:
        found = linearize(system, instances, ["mass.base.position"], ["mass.position"])
    assert np.abs(found.poles) == pytest.approx([100.0, 100.0], rel=1e-3)
