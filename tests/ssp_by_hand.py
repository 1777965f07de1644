"""Packages (SSP) for tests, written by hand as other tools write them: the loop of `spring_loop` in many guises."""

import zipfile
from collections.abc import Mapping
from pathlib import Path

SSP = "http://ssp-standard.org/SSP1/SystemStructure"
PREFIXES = {"ssd": "Description", "ssc": "Common", "ssv": "ParameterValues", "ssm": "ParameterMapping"}
NAMESPACES = " ".join(f'xmlns:{prefix}="{SSP}{name}"' for prefix, name in PREFIXES.items())

PLAIN = """
<ssd:Elements>
  <ssd:Component name="plant" source="resources/Plant.fmu">{plant}</ssd:Component>
  <ssd:Component name="pd" source="resources/Pd.fmu"/>
</ssd:Elements>
<ssd:Connections>
  <ssd:Connection startElement="plant" startConnector="position" endElement="pd" endConnector="position"/>
  <ssd:Connection startElement="pd" startConnector="force" endElement="plant" endConnector="force"/>
</ssd:Connections>
"""
"""The loop as two components; `{plant}` is what is in the plant."""

EXPERIMENT = '<ssd:DefaultExperiment startTime="0" stopTime="0.5"/>'


def structure(system: str, beside: str = EXPERIMENT, version: str = "1.0") -> str:
    """Return a description with a system and what is beside it."""
    return (
        f'<ssd:SystemStructureDescription {NAMESPACES} version="{version}" name="by hand">'
        f'<ssd:System name="root">{system}</ssd:System>{beside}</ssd:SystemStructureDescription>'
    )


def values(parameters: str, units: str = "") -> str:
    """Return a parameter set: words `name=value`, or `name=value unit`, with definitions of units."""
    rows = []
    for word in parameters.split(","):
        name, _, value = word.strip().partition("=")
        number, _, unit = value.partition(" ")
        unit = f' unit="{unit}"' if unit else ""
        rows.append(f'<ssv:Parameter name="{name}"><ssv:Real value="{number}"{unit}/></ssv:Parameter>')
    units = f"<ssv:Units>{units}</ssv:Units>" if units else ""
    return (
        f'<ssv:ParameterSet {NAMESPACES} version="1.0" name="set">'
        f"<ssv:Parameters>{''.join(rows)}</ssv:Parameters>{units}</ssv:ParameterSet>"
    )


def inline(parameters: str, units: str = "", inside: str = "", prefix: str = "") -> str:
    """Return parameter bindings with one parameter set inline; `inside` is a mapping."""
    prefix = f' prefix="{prefix}"' if prefix else ""
    return (
        f"<ssd:ParameterBindings><ssd:ParameterBinding{prefix}>"
        f"<ssd:ParameterValues>{values(parameters, units)}</ssd:ParameterValues>{inside}"
        "</ssd:ParameterBinding></ssd:ParameterBindings>"
    )


def bound(source: str, attributes: str = "", inside: str = "") -> str:
    """Return parameter bindings with one file."""
    return (
        f'<ssd:ParameterBindings><ssd:ParameterBinding source="{source}" {attributes}>{inside}'
        "</ssd:ParameterBinding></ssd:ParameterBindings>"
    )


def packed(file: Path, content: Mapping[str, str | bytes | Path]) -> Path:
    """Return an archive of texts, bytes and files, by their names in it."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, item in content.items():
            archive.writestr(name, item.read_bytes() if isinstance(item, Path) else item)
    return file
