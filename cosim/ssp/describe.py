"""SystemStructure.ssd and the parameter sets of a scene, as XML of SSP 1.0.

Elements stand in the order of steps, with their outputs and the inputs that something feeds as connectors: any other
input of the list gets a value of another from fmpy. Nothing is connected to the system itself, as libcosim and ecos
refuse that; what the system offers stands in an annotation, in the words of the standard, where fmutool finds it.
Prefixes are those of the standard, and lists have no attributes: the two masters read the text, not the namespaces.
"""

from collections.abc import Collection, Iterable, Mapping
from typing import Any

from lxml import etree

from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.ssp.vocabulary import (
    BASE_UNITS,
    FMU_TYPE,
    HFSA,
    OFFERED,
    OMS,
    OPEN_MODELICA,
    OPEN_SIMULATION_PLATFORM,
    OSP,
    OURS,
    SSC,
    SSD,
    SSV,
)
from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.scene import Scene

_TOOL = "hfsa"
_SET = "start"
"""Name of all parameter sets: ecos joins those of one name and is asked for it, libcosim takes the first."""
_PREFIXES = {"ssc": SSC, "ssd": SSD, "ssv": SSV, "osp": OSP, "oms": OMS, "hfsa": HFSA}


def structure_xml(name: str, scene: Scene, assembly: Assembly, elements: Mapping[str, str], annotation: str) -> bytes:
    """Return the system structure description of a scene.

    `elements` are the names of its components' elements, `annotation` is the text of our annotation.
    """
    root = etree.Element(f"{{{SSD}}}SystemStructureDescription", nsmap=_PREFIXES)
    root.attrib.update({"version": "1.0", "name": name, "generationTool": _TOOL})
    system = etree.SubElement(root, f"{{{SSD}}}System", name=elements_free_name(name, elements.values()))
    inside = etree.SubElement(system, f"{{{SSD}}}Elements")
    used: dict[str, tuple[float, ...]] = {}
    fed = {connection.end for connection in scene.system.connections}
    for component in scene.system.components:
        ports = [port for port in ports_of(assembly.connectors[component.name]) if _is_used(port, component.name, fed)]
        used |= {port.unit: port.base_unit for port in ports if port.unit and port.base_unit}
        element = elements[component.name]
        node = etree.SubElement(inside, f"{{{SSD}}}Component", name=element, type=FMU_TYPE, source=fmu_of(element))
        _add_connectors(node, ports)
        if component.start:
            bindings = etree.SubElement(node, f"{{{SSD}}}ParameterBindings")
            etree.SubElement(bindings, f"{{{SSD}}}ParameterBinding", source=values_of(element))
    _add_connections(system, scene, elements)
    annotations = etree.SubElement(system, f"{{{SSD}}}Annotations")
    _add_master(annotations, scene)
    _add_offered(annotations, system.get("name", ""), scene, elements)
    _add_units(root, f"{{{SSD}}}Units", used)
    experiment = etree.SubElement(root, f"{{{SSD}}}DefaultExperiment", startTime="0.0", stopTime=repr(scene.stop_time))
    noted = etree.SubElement(experiment, f"{{{SSD}}}Annotations")
    algorithm = etree.SubElement(_annotation(noted, OPEN_SIMULATION_PLATFORM), f"{{{OSP}}}Algorithm")
    etree.SubElement(algorithm, f"{{{OSP}}}FixedStepAlgorithm", baseStepSize=repr(scene.step_size))
    own = _annotation(etree.SubElement(root, f"{{{SSD}}}Annotations"), OURS)
    etree.SubElement(own, f"{{{HFSA}}}Scene").text = annotation
    return _text(root)


def parameters_xml(start: Mapping[str, Any], variables: Mapping[str, Connector]) -> bytes:
    """Return the parameter set of a component: start values of its variables, in their units."""
    root = etree.Element(f"{{{SSV}}}ParameterSet", nsmap={"ssc": SSC, "ssv": SSV})
    root.attrib.update({"version": "1.0", "name": _SET, "generationTool": _TOOL})
    inside = etree.SubElement(root, f"{{{SSV}}}Parameters")
    used: dict[str, tuple[float, ...]] = {}
    for name, value in start.items():
        parameter = etree.SubElement(inside, f"{{{SSV}}}Parameter", name=name)
        variable = variables[name]
        kind = _type_of(variable)
        typed = etree.SubElement(parameter, f"{{{SSV}}}{kind}", value=_written(kind, value))
        if kind == "Real" and variable.unit and variable.base_unit:
            typed.set("unit", variable.unit)
            used[variable.unit] = variable.base_unit
    _add_units(root, f"{{{SSV}}}Units", used)
    return _text(root)


def fmu_of(element: str) -> str:
    """Return the place of an element's FMU in the archive."""
    return f"resources/{element}.fmu"


def values_of(element: str) -> str:
    """Return the place of an element's parameter set in the archive."""
    return f"resources/{element}.ssv"


def ports_of(variables: Mapping[str, Connector]) -> list[Connector]:
    """Return the inputs and outputs of an FMU that are single numbers."""
    ports = [v for v in variables.values() if v.causality in ("input", "output")]
    return [v for v in ports if v.is_number and v.element is None]


def _is_used(port: Connector, component: str, fed: Collection[str]) -> bool:
    """Whether a port is an output, or an input that something feeds."""
    return port.causality == "output" or f"{component}.{port.name}" in fed


def elements_free_name(name: str, taken: Iterable[str]) -> str:
    """Return a name of the system that no element has."""
    return f"{name}_system" if name in taken else name


def _add_connectors(node: etree._Element, ports: Iterable[Connector]) -> None:
    """Add the connectors of a component."""
    connectors = etree.SubElement(node, f"{{{SSD}}}Connectors")
    for port in ports:
        connector = etree.SubElement(connectors, f"{{{SSD}}}Connector", name=port.name, kind=port.causality)
        kind = _type_of(port)
        typed = etree.SubElement(connector, f"{{{SSC}}}{kind}")
        if kind == "Real" and port.unit and port.base_unit:
            typed.set("unit", port.unit)


def _add_connections(system: etree._Element, scene: Scene, elements: Mapping[str, str]) -> None:
    """Add the connections of a system, if it has any."""
    if not scene.system.connections:
        return
    inside = etree.SubElement(system, f"{{{SSD}}}Connections")
    for connection in scene.system.connections:
        (start, output), (end, entry) = scene.system.split(connection.start), scene.system.split(connection.end)
        node = etree.SubElement(inside, f"{{{SSD}}}Connection", startElement=elements[start], startConnector=output)
        node.attrib.update({"endElement": elements[end], "endConnector": entry})


def _add_offered(annotations: etree._Element, system: str, scene: Scene, elements: Mapping[str, str]) -> None:
    """Add the outputs of the scene, and its inputs that nothing feeds, as connections of the system of a name."""
    inside = etree.SubElement(_annotation(annotations, OFFERED), f"{{{SSD}}}Connections")
    fed = {connection.end for connection in scene.system.connections}
    sides = [(name, "end", "start") for name in scene.inputs if name not in fed]
    sides += [(name, "start", "end") for name in scene.outputs]
    for name, own, other in sides:
        component, variable = scene.system.split(name)
        node = etree.SubElement(inside, f"{{{SSD}}}Connection")
        node.attrib.update({f"{own}Element": elements[component], f"{own}Connector": variable})
        node.set(f"{other}Connector", f"{system}.{elements[component]}.{variable}")


def _add_master(annotations: etree._Element, scene: Scene) -> None:
    """Add what OMSimulator takes for its step, by functions in Python (the attributes) and in C (the node inside)."""
    inside = etree.SubElement(_annotation(annotations, OPEN_MODELICA), f"{{{OMS}}}Annotations")
    step = repr(scene.step_size)
    solver = {"name": "oms_ma_default", "method": "oms_ma", "fixedStepSize": step}
    information = etree.SubElement(inside, f"{{{OMS}}}SimulationInformation", solver)
    etree.SubElement(
        information,
        f"{{{OMS}}}FixedStepMaster",
        description="oms-ma",
        stepSize=step,
        absoluteTolerance="1e-6",
        relativeTolerance="1e-6",
    )


def _annotation(annotations: etree._Element, kind: str) -> etree._Element:
    """Return a new annotation of a type."""
    return etree.SubElement(annotations, f"{{{SSC}}}Annotation", type=kind)


def _add_units(root: etree._Element, tag: str, used: Mapping[str, tuple[float, ...]]) -> None:
    """Add the units of a document, if it uses any."""
    if not used:
        return
    units = etree.SubElement(root, tag)
    for name, base in sorted(used.items()):
        unit = etree.SubElement(units, f"{{{SSC}}}Unit", name=name)
        *exponents, factor, offset = base
        named = zip(BASE_UNITS, exponents, strict=True)
        exponents = {key: str(int(exponent)) for key, exponent in named if exponent}
        scale = {
            key: repr(value)
            for key, value, usual in (("factor", factor, 1.0), ("offset", offset, 0.0))
            if value != usual
        }
        etree.SubElement(unit, f"{{{SSC}}}BaseUnit", {**exponents, **scale})


def _type_of(variable: Connector) -> str:
    """Return the type of SSP 1.0 that a variable has; an enumeration is the number of its item."""
    if variable.type in ("Boolean", "String"):
        return variable.type
    return "Real" if variable.type.startswith(("Real", "Float")) else "Integer"


def _written(kind: str, value: Any) -> str:
    """Return a value as XML Schema writes it; numbers keep every bit."""
    if kind == "Boolean":
        return "true" if value else "false"
    if kind == "Real":
        return repr(float(value))
    return str(int(value)) if kind == "Integer" else str(value)


def _text(root: etree._Element) -> bytes:
    """Return a document as text."""
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)
