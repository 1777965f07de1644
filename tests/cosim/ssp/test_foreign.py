"""Packages of other tools: systems within systems, parameters, dictionaries, prefixes, and what is left out.

Each is the loop of `spring_loop` in another guise, so its motion is known in closed form.
"""

import numpy as np
import pytest
from scipy.linalg import expm
from spring_loop import KD, KP, MATRIX, TF, closed_loop
from ssp_by_hand import EXPERIMENT, NAMESPACES, PLAIN, SSP, bound, inline, packed, structure, values

from hfsa.cosim import run
from hfsa.cosim.assembly.packages import package_of

START = inline("x=1")

NESTED = f"""
<ssd:Elements>
  <ssd:System name="machine">
    <ssd:Connectors>
      <ssd:Connector name="push" kind="input"><ssc:Real/></ssd:Connector>
      <ssd:Connector name="where" kind="output"/>
    </ssd:Connectors>
    <ssd:Elements>
      <ssd:System name="axis.one">
        <ssd:Connectors>
          <ssd:Connector name="f" kind="input"/><ssd:Connector name="s" kind="output"/>
        </ssd:Connectors>
        <ssd:Elements>
          <ssd:Component name="plant" source="resources/Plant.fmu">{START}</ssd:Component>
        </ssd:Elements>
        <ssd:Connections>
          <ssd:Connection startConnector="f" endElement="plant" endConnector="force"/>
          <ssd:Connection startElement="plant" startConnector="position" endConnector="s"/>
        </ssd:Connections>
      </ssd:System>
    </ssd:Elements>
    <ssd:Connections>
      <ssd:Connection startConnector="push" endElement="axis.one" endConnector="f"/>
      <ssd:Connection startElement="axis.one" startConnector="s" endConnector="where"/>
    </ssd:Connections>
  </ssd:System>
  <ssd:Component name="pd" source="./resources/../resources/Pd.fmu" type="application/x-fmu-sharedlibrary"/>
</ssd:Elements>
<ssd:Connections>
  <ssd:Connection startElement="pd" startConnector="position" endElement="machine" endConnector="where"/>
  <ssd:Connection startElement="pd" startConnector="force" endElement="machine" endConnector="push"/>
</ssd:Connections>
"""
"""Two systems around the plant, one with a dot in its name; one connection is written from its sink to its source."""

BUS = f"""
<ssd:Elements>
  <ssd:Component name="plant" source="resources/Plant.fmu">{START}</ssd:Component>
  <ssd:SignalDictionaryReference name="here" dictionary="bus"><ssd:Connectors>
    <ssd:Connector name="s" kind="inout"/><ssd:Connector name="f" kind="inout"/>
  </ssd:Connectors></ssd:SignalDictionaryReference>
  <ssd:System name="control"><ssd:Elements>
    <ssd:Component name="pd" source="resources/Pd.fmu"/>
    <ssd:SignalDictionaryReference name="there" dictionary="bus"><ssd:Connectors>
      <ssd:Connector name="s" kind="inout"/><ssd:Connector name="f" kind="inout"/>
    </ssd:Connectors></ssd:SignalDictionaryReference>
  </ssd:Elements><ssd:Connections>
    <ssd:Connection startElement="there" startConnector="s" endElement="pd" endConnector="position"/>
    <ssd:Connection startElement="pd" startConnector="force" endElement="there" endConnector="f"/>
  </ssd:Connections></ssd:System>
</ssd:Elements>
<ssd:Connections>
  <ssd:Connection startElement="plant" startConnector="position" endElement="here" endConnector="s"/>
  <ssd:Connection startElement="here" startConnector="f" endElement="plant" endConnector="force"/>
</ssd:Connections>
<ssd:SignalDictionaries><ssd:SignalDictionary name="bus" source="resources/bus.ssb"/></ssd:SignalDictionaries>
"""
"""The two joined by a dictionary that lies outside of one of them."""


def motion(file, **options):
    """The position of the plant, on the joint equation of both FMUs, and the time."""
    found = run(str(file), algorithm="monolithic", step_size=1e-2, warn=lambda _: None, **options)
    (name,) = (name for name in found.values if name.endswith("plant.position"))
    return found[name], found.time


def follows(file, start=1.0, **options) -> None:
    position, time = motion(file, **options)
    assert len(time) == 51
    np.testing.assert_allclose(position, start * np.array([closed_loop(t) for t in time]), rtol=0, atol=1e-7)


def plain(**more):
    return PLAIN.format(plant=START, **more)


@pytest.mark.parametrize(
    "system", [plain(), NESTED, BUS], ids=["two_components", "systems_within_systems", "signal_dictionary"]
)
def test_moves_as_the_loop_does(packages, system, in_tmp):
    follows(packages(system))


def test_a_package_without_prefixes_and_optional_parts(loop_files, tmp_path, in_tmp):
    """The default namespace, no connectors, no units, no experiment, SSP 2.0."""
    text = structure(plain(), "", "2.0").replace("<ssd:", "<").replace("</ssd:", "</")
    text = text.replace(f'xmlns:ssd="{SSP}Description"', f'xmlns="{SSP}Description"')
    text = text.replace("ssv:", "q:").replace("xmlns:ssv", "xmlns:q")
    assert "ssd:" not in text
    file = packed(tmp_path / "model.ssp", {"SystemStructure.ssd": text, **loop_files})
    follows(file, stop_time=0.5)


def test_a_package_in_a_package_and_a_description_beside_it(loop_files, tmp_path, in_tmp):
    plant = structure(
        '<ssd:Connectors><ssd:Connector name="f" kind="input"/><ssd:Connector name="s" kind="output"/></ssd:Connectors>'
        '<ssd:Elements><ssd:Component name="plant" source="Plant.fmu"/></ssd:Elements><ssd:Connections>'
        '<ssd:Connection startConnector="f" endElement="plant" endConnector="force"/>'
        '<ssd:Connection startElement="plant" startConnector="position" endConnector="s"/></ssd:Connections>'
    )
    inner = packed(
        tmp_path / "inner.ssp", {"SystemStructure.ssd": plant, "Plant.fmu": loop_files["resources/Plant.fmu"]}
    )
    control = structure(
        '<ssd:Connectors><ssd:Connector name="f" kind="output"/><ssd:Connector name="s" kind="input"/></ssd:Connectors>'
        '<ssd:Elements><ssd:Component name="pd" source="Pd.fmu"/></ssd:Elements><ssd:Connections>'
        '<ssd:Connection startConnector="s" endElement="pd" endConnector="position"/>'
        '<ssd:Connection startElement="pd" startConnector="force" endConnector="f"/></ssd:Connections>'
    )
    outer = f"""
    <ssd:Elements>
      <ssd:Component name="machine" source="resources/inner.ssp">{inline("plant.x=1")}</ssd:Component>
      <ssd:Component name="control" type="application/x-ssp-definition" source="resources/control.ssd"/>
    </ssd:Elements><ssd:Connections>
      <ssd:Connection startElement="machine" startConnector="s" endElement="control" endConnector="s"/>
      <ssd:Connection startElement="control" startConnector="f" endElement="machine" endConnector="f"/>
    </ssd:Connections>"""
    files = {"SystemStructure.ssd": structure(outer), "resources/inner.ssp": inner, "resources/control.ssd": control}
    follows(packed(tmp_path / "outer.ssp", {**files, "resources/Pd.fmu": loop_files["resources/Pd.fmu"]}))


# Parameters -------------------------------------------------------------------------------------------------------

MILLIMETRES = '<ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="0.001"/></ssc:Unit>'
TWICE_AND_ONE_MORE = (
    "<ssd:ParameterMapping><ssm:ParameterMapping version='1.0'><ssm:MappingEntry source='far' target='x'>"
    "<ssc:LinearTransformation factor='2' offset='1'/></ssm:MappingEntry></ssm:ParameterMapping></ssd:ParameterMapping>"
)


def test_a_value_is_converted_and_transformed(read):
    """2000 mm are 2 m, twice that and 1 m more are 5 m; what no entry maps is not applied."""
    found = read(PLAIN.format(plant=inline("far=2000 mm,x=7", MILLIMETRES, TWICE_AND_ONE_MORE)))
    assert found.scene.system["plant"].start == {"x": 5.0}
    assert read(PLAIN.format(plant=inline("x=250 mm", MILLIMETRES))).scene.system["plant"].start == {"x": 0.25}


def test_the_later_and_the_outer_binding_count(read, packages):
    twice = inline("x=1,v=1").replace("</ssd:ParameterBindings>", "") + inline("x=2").replace(
        "<ssd:ParameterBindings>", ""
    )
    assert read(PLAIN.format(plant=twice)).scene.system["plant"].start == {"x": 2.0, "v": 1.0}
    outer = inline("plant.x=3") + PLAIN.format(plant=twice)
    assert read(outer).scene.system["plant"].start == {"x": 3.0, "v": 1.0}


def test_values_from_files_with_prefixes_and_mappings(read):
    mapping = (
        f"<ssm:ParameterMapping {NAMESPACES} version='1.0'>"
        "<ssm:MappingEntry source='start.far' target='plant.x'/></ssm:ParameterMapping>"
    )
    outer = bound(
        "resources/values.ssv", 'prefix="start."', '<ssd:ParameterMapping source="resources/names.ssm"/>'
    ) + PLAIN.format(plant="")
    found = read(outer, resources__values_dot_ssv=values("far=4,near=5"), resources__names_dot_ssm=mapping)
    assert found.scene.system["plant"].start == {"x": 4.0}


def test_a_parameter_of_a_system_reaches_the_fmus_that_it_is_joined_to(mass_on_spring_files, tmp_path):
    """Through two systems, of which the inner has a unit of its own; 0.5 kN.s/m and twice that."""
    system = """
    <ssd:Connectors><ssd:Connector name="c" kind="parameter"><ssc:Real unit="kN.s/m"/></ssd:Connector></ssd:Connectors>
    {bindings}
    <ssd:Elements>
      <ssd:System name="inner">
        <ssd:Connectors><ssd:Connector name="c" kind="parameter"><ssc:Real/></ssd:Connector></ssd:Connectors>
        <ssd:Elements><ssd:Component name="mass" source="Mass.fmu"/></ssd:Elements>
        <ssd:Connections><ssd:Connection startConnector="c" endElement="mass" endConnector="damping">
          <ssc:LinearTransformation factor="2"/></ssd:Connection></ssd:Connections>
      </ssd:System>
      <ssd:Component name="mass" source="Mass.fmu"/>
    </ssd:Elements>
    <ssd:Connections>
      <ssd:Connection startConnector="c" endElement="inner" endConnector="c"/>
      <ssd:Connection startConnector="c" endElement="mass" endConnector="damping"/>
    </ssd:Connections>"""
    unit = '<ssd:Units><ssc:Unit name="kN.s/m"><ssc:BaseUnit kg="1" s="-1" factor="1000"/></ssc:Unit></ssd:Units>'
    text = structure(system.format(bindings=inline("c=0.5")), f"{unit}{EXPERIMENT}")
    file = packed(tmp_path / "model.ssp", {"SystemStructure.ssd": text, "Mass.fmu": mass_on_spring_files[2]})
    found = package_of(file).scene.system
    assert found["mass"].start == {"damping": 500.0}
    # converted to N.s/m first, then transformed
    assert found["inner_mass"].start == {"damping": 1000.0}


def test_what_names_nothing_is_told(read):
    found = read(inline("plant.y=3,plnt.x=2") + plain())
    assert found.scene.system["plant"].start == {"x": 1.0}
    (remark,) = (remark for remark in found.remarks if "parameters" in remark)
    assert "plant.y" in remark
    assert "plnt.x" in remark


# What a package says of its simulation ------------------------------------------------------------------------------


def test_outputs_of_the_system_are_those_of_the_scene(read):
    ports = '<ssd:Connectors><ssd:Connector name="s" kind="output"/></ssd:Connectors>'
    offered = '<ssd:Connection startElement="plant" startConnector="velocity" endConnector="s"/></ssd:Connections>'
    assert read(ports + plain().replace("</ssd:Connections>", offered)).scene.outputs == ("plant.velocity",)
    everything = ("plant.position", "plant.velocity", "plant.acceleration", "pd.force")
    assert read(plain()).scene.outputs == everything


@pytest.mark.parametrize(
    ("annotation", "step"),
    [
        (
            '<o:Algorithm xmlns:o="http://opensimulationplatform.com/SSP/OSPAnnotations">'
            '<o:FixedStepAlgorithm baseStepSize="2e-3"/></o:Algorithm>',
            2e-3,
        ),
        (
            '<o:SimulationInformation xmlns:o="https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd">'
            '<o:FixedStepMaster description="oms-ma" stepSize="0.003"/></o:SimulationInformation>',
            3e-3,
        ),
        (
            '<o:SimulationInformation name="a" method="oms_ma" fixedStepSize="0.004" '
            'xmlns:o="https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd"/>',
            4e-3,
        ),
    ],
    ids=["open_simulation_platform", "open_modelica", "open_modelica_python"],
)
def test_the_step_of_a_tool_is_taken(read, annotation, step):
    noted = f'<ssd:Annotations><ssc:Annotation type="org.example">{annotation}</ssc:Annotation></ssd:Annotations>'
    found = read(plain(), EXPERIMENT.replace("/>", f">{noted}</ssd:DefaultExperiment>"))
    assert found.scene.step_size == step
    assert found.scene.stop_time == 0.5
    assert [remark.partition(": ")[2] for remark in found.remarks] == ["annotations of org.example are ignored"]


def test_names_are_legal_and_told(read):
    found = read(NESTED)
    assert [component.name for component in found.scene.system.components] == ["machine_axis_one_plant", "pd"]
    assert "element machine.axis.one.plant is the component machine_axis_one_plant" in found.remarks[0]


def test_a_package_runs_by_its_path_and_takes_parameters(packages, in_tmp):
    file = packages(plain())
    follows(file, start=3.0, parameters={"plant.x": 3.0})
    assert package_of(file).scene.system["plant"].start == {"x": 1.0}


# Transformations ------------------------------------------------------------------------------------------------------


def test_transformations_along_a_connection_are_composed(packages, in_tmp):
    """The force is halved, offset and doubled again on its way into the system: 2 (f / 2 + 3) - 6 = f."""
    changed = NESTED.replace(
        '<ssd:Connection startConnector="f" endElement="plant" endConnector="force"/>',
        '<ssd:Connection startConnector="f" endElement="plant" endConnector="force">'
        '<ssc:LinearTransformation factor="0.5" offset="3"/></ssd:Connection>',
    )
    connection = package_of(packages(changed)).scene.system.connections[0]
    assert (connection.end, connection.factor, connection.offset) == ("machine_axis_one_plant.force", 0.5, 3.0)
    changed = changed.replace(
        '<ssd:Connection startElement="pd" startConnector="force" endElement="machine" endConnector="push"/>',
        '<ssd:Connection startElement="pd" startConnector="force" endElement="machine" endConnector="push">'
        '<ssc:LinearTransformation factor="2" offset="-6"/></ssd:Connection>',
    )
    file = packages(changed)
    assert not any(c.is_transformed for c in package_of(file).scene.system.connections)
    follows(file)


def test_a_gain_of_the_package_is_a_gain_of_the_loop(packages, in_tmp):
    """Twice the force on the plant is the loop with twice the gains, as on a mass of its own stiffness."""
    doubled = plain().replace(
        'endElement="plant" endConnector="force"/>',
        'endElement="plant" endConnector="force"><ssc:LinearTransformation factor="2"/></ssd:Connection>',
    )
    position, time = motion(packages(doubled))
    slope = -2 * (KP + KD / TF)
    matrix = MATRIX + np.array([[0, 0, 0], [slope / 2, 0, KD / TF], [0, 0, 0]])
    exact = [(expm(matrix * t) @ [1.0, 0.0, 0.0])[0] for t in time]
    np.testing.assert_allclose(position, exact, rtol=0, atol=1e-7)


KILONEWTONS = '<ssd:Units><ssc:Unit name="kN"><ssc:BaseUnit kg="1" m="1" s="-2" factor="1000"/></ssc:Unit></ssd:Units>'


@pytest.mark.parametrize(
    ("words", "inside", "factor"),
    [("", "", 1.0), ('suppressUnitConversion="true"', "", 1e-3), ("", '<ssc:LinearTransformation factor="2"/>', 2.0)],
    ids=["there_and_back", "not_converted_on_the_way_back", "converted_and_transformed"],
)
def test_units_of_systems_on_the_way(read, words, inside, factor):
    """The force passes a connector of a system in kN: N to kN, transformed, and kN to N."""
    changed = NESTED.replace(
        '<ssd:Connector name="push" kind="input"><ssc:Real/>',
        '<ssd:Connector name="push" kind="input"><ssc:Real unit="kN"/>',
    ).replace(
        '<ssd:Connector name="f" kind="input"/>',
        '<ssd:Connector name="f" kind="input"><ssc:Real unit="kN"/></ssd:Connector>',
    )
    changed = changed.replace(
        '<ssd:Connection startConnector="f" endElement="plant" endConnector="force"/>',
        f'<ssd:Connection startConnector="f" endElement="plant" endConnector="force" {words}>{inside}</ssd:Connection>',
    )
    connection = read(changed, f"{KILONEWTONS}{EXPERIMENT}").scene.system.connections[0]
    assert connection.end == "machine_axis_one_plant.force"
    assert connection.factor == pytest.approx(factor, rel=1e-14)
    assert connection.offset == 0
