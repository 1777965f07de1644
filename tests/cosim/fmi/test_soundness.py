"""A description whose variables are not what they seem is refused before a run, as `hfsa check` refuses it."""

from pathlib import Path

import pytest

from hfsa.cosim.fmi.description import describe
from hfsa.cosim.systems.errors import StructureError

TWO = """<fmiModelDescription fmiVersion="2.0" modelName="Box" guid="g">
  <CoSimulation modelIdentifier="Box"/>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="x" valueReference="1"><Real/></ScalarVariable>
    <ScalarVariable name="v" valueReference="2"><Real derivative="2"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="4294967295" causality="output"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="4" dependencies="1 2"/></Outputs>
    <Derivatives><Unknown index="3"/></Derivatives>
  </ModelStructure>
</fmiModelDescription>"""

THREE = """<fmiModelDescription fmiVersion="3.0" modelName="Box" instantiationToken="g">
  <CoSimulation modelIdentifier="Box"/>
  <ModelVariables>
    <Float64 name="u" valueReference="0" causality="input" start="0"/>
    <Float64 name="x" valueReference="1"/>
    <Float64 name="v" valueReference="2" derivative="1"/>
    <Float64 name="y" valueReference="4294967295" causality="output"><Alias name="z"/></Float64>
  </ModelVariables>
  <ModelStructure>
    <Output valueReference="4294967295" dependencies="0 1"/>
    <ContinuousStateDerivative valueReference="2"/>
  </ModelStructure>
</fmiModelDescription>"""

FAULTS = {
    "fmi2-wraps": (TWO, "4294967295", "4294967302", r"y has the value reference 4294967302, .* 0 to 4294967295"),
    "fmi2-negative": (TWO, '"4294967295"', '"-1"', "y has the value reference -1"),
    "fmi2-no-reference": (TWO, ' valueReference="1"', "", "x has the value reference None"),
    "fmi2-index-0": (TWO, 'index="4"', 'index="0"', "Outputs names index 0, which no variable has"),
    "fmi2-index--7": (TWO, 'index="4"', 'index="-7"', "Outputs names index -7"),
    "fmi2-index-5": (TWO, 'index="4"', 'index="5"', "Outputs names index 5"),
    "fmi2-derivative-index": (TWO, 'Unknown index="3"', 'Unknown index="30"', "Derivatives names index 30"),
    "fmi2-dependency": (TWO, 'dependencies="1 2"', 'dependencies="1 0"', "Outputs names index 0"),
    "fmi2-derivative": (TWO, 'derivative="2"', 'derivative="0"', "derivative is that of index 0"),
    "fmi2-twins": (TWO, 'name="x"', 'name="u"', "two variables have the name 'u'"),
    "fmi2-type": (TWO, "<Real start", "<Complex start", "u has the type Complex"),
    "fmi2-no-type": (TWO, '<Real start="0"/>', "", "u has no type"),
    "fmi3-wraps": (THREE, "4294967295", "4294967302", "y has the value reference 4294967302"),
    "fmi3-output": (THREE, 'Output valueReference="4294967295"', 'Output valueReference="9"', "names valueReference 9"),
    "fmi3-dependency": (THREE, 'dependencies="0 1"', 'dependencies="0 -7"', "Output names valueReference -7"),
    "fmi3-derivative": (THREE, 'derivative="1"', 'derivative="8"', "derivative is that of valueReference 8"),
    "fmi3-twins": (THREE, 'name="x"', 'name="u"', "two variables have the name 'u'"),
    "fmi3-alias": (THREE, 'Alias name="z"', 'Alias name="u"', "two variables have the name 'u'"),
    "fmi3-type": (THREE, '<Float64 name="x"', '<Float128 name="x"', "x has the type Float128"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_refused_by_name(name, tmp_path: Path):
    text, old, new, message = FAULTS[name]
    assert text.count(old) >= 1
    file = tmp_path / "modelDescription.xml"
    file.write_text(text.replace(old, new))
    with pytest.raises(StructureError, match=rf"{message}.*`hfsa check` lists all faults"):
        describe(file)


@pytest.mark.parametrize("text", [TWO, THREE], ids=["fmi2", "fmi3"])
def test_what_is_sound_is_read(text, tmp_path: Path):
    file = tmp_path / "modelDescription.xml"
    file.write_text(text.replace("<ModelVariables>", "<ModelVariables><!-- the variables -->"))
    found = describe(file)
    assert found.variables["y"].reference == 2**32 - 1
    assert found.states == (("x", "v"),)
