"""modelDescription.xml of an exported model, for FMI 2 and FMI 3, from one list of variables.

The versions differ in format: FMI 2 nests `<Real>` in `<ScalarVariable>`, FMI 3 has `<Float64>`. In `derivative` and
ModelStructure FMI 2 has indices of variables from 1, FMI 3 value references, the same numbers here. Only FMI 3 lists
the derivatives of inputs; texts are variables of FMI 2 and annotations of FMI 3. A date is told only by
`$SOURCE_DATE_EPOCH`: the same model and version of this package give the same bytes.
"""

import math
import os
from dataclasses import asdict
from datetime import UTC, datetime
from importlib.metadata import version as package_version
from typing import Literal

from lxml import etree

from hfsa.components import Model
from hfsa.components._modelling.argument_docs import DEGREE
from hfsa.components._modelling.units import BASE
from hfsa.components._modelling.units import unit as parse_unit
from hfsa.fmus._dependencies import Dependency, dependencies
from hfsa.fmus._experiment import default_experiment
from hfsa.fmus._platforms import PLATFORMS
from hfsa.fmus._sundials import LIBRARIES
from hfsa.fmus._variables import Role, Variable
from hfsa.fmus.c_code import Sources
from hfsa.fmus.compile import source_files
from hfsa.fmus.errors import ExportError

Version = Literal[2, 3]

_ATTRIBUTES = {
    Role.TIME: ("independent", "continuous", None),
    Role.STATE: ("local", "continuous", "exact"),
    Role.DERIVATIVE: ("local", "continuous", "calculated"),
    Role.SAMPLED_STATE: ("local", "discrete", "exact"),
    Role.NEXT: ("local", "continuous", "calculated"),
    Role.INPUT: ("input", "continuous", None),
    Role.OUTPUT: ("output", "continuous", "calculated"),
    Role.SAMPLED_OUTPUT: ("output", "discrete", "exact"),
    Role.PARAMETER: ("parameter", "tunable", None),
    Role.SOLVER: ("parameter", "fixed", None),
    Role.COUNTER: ("local", "discrete", "calculated"),
    Role.INPUT_DERIVATIVE: ("parameter", "tunable", None),
    Role.CONSTANT: ("local", "constant", None),
    Role.TEXT: ("local", "constant", None),
}
"""Causality, variability and `initial` by role; `None` if the standard defines `initial`."""

TEXTS = "org.hfsa.texts"
"""Type of the annotation of FMI 3 that has the structural arguments which are texts."""

_STRUCTURE = {
    2: {"outputs": "Outputs", "derivatives": "Derivatives", "initial": "InitialUnknowns"},
    3: {"outputs": "Output", "derivatives": "ContinuousStateDerivative", "initial": "InitialUnknown"},
}


def model_description(model: Model, sources: Sources, version: Version) -> bytes:
    """Return modelDescription.xml of `model` as UTF-8, with variables, token and C files from `sources`."""
    root = etree.Element("fmiModelDescription", _head(model, sources.token, version))
    _interfaces(root, sources, version)
    _units(root, sources.listed(version))
    _log_categories(root)
    experiment = default_experiment(model, sources.functions)
    step, stop = _number(experiment.step_size), _number(experiment.stop_time)
    etree.SubElement(root, "DefaultExperiment", {"startTime": "0.0", "stopTime": stop, "stepSize": step})
    _model_variables(root, sources.listed(version), version)
    _model_structure(root, sources, version)
    if version == 3:
        _annotations(root, sources.variables)
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def build_description(sources: Sources) -> bytes:
    """Return sources/buildDescription.xml of FMI 3: the files and libraries to rebuild the binary on each platform.

    A platform has one configuration. C compilers for Windows have no library of mathematics to name.
    """
    root = etree.Element("fmiBuildDescription", {"fmiVersion": "3.0"})
    for platform in PLATFORMS.values():
        more = {"modelIdentifier": sources.name, "platform": platform.name}
        build = etree.SubElement(root, "BuildConfiguration", more)
        files = etree.SubElement(build, "SourceFileSet", {"language": "C99"})
        for name in translation_units(sources):
            etree.SubElement(files, "SourceFile", {"name": name})
        for name in LIBRARIES if sources.needs_cvode else ():
            _library(build, f"sundials_{name}", "SUNDIALS 6 or later")
        if platform.has_libm:
            _library(build, "m", "C mathematics library")
    return etree.tostring(root, xml_declaration=True, encoding="UTF-8", pretty_print=True)


def _library(build: etree._Element, name: str, description: str) -> None:
    """Add a library that the system has."""
    etree.SubElement(build, "Library", {"name": name, "external": "true", "description": description})


def translation_units(sources: Sources) -> list[str]:
    """Return the names of the C files to compile, in alphabetical order."""
    return sorted(name for name in source_files(sources) if name.endswith(".c"))


def _head(model: Model, token: str, version: Version) -> dict[str, str]:
    """Return the attributes of the root element."""
    return {
        "fmiVersion": "2.0" if version == 2 else "3.0",
        "modelName": model.name,
        "guid" if version == 2 else "instantiationToken": token,
        "description": model.description,
        **_credits(model),
        "generationTool": f"hfsa {package_version('hfsa')}",
        "variableNamingConvention": "structured",
        **({"numberOfEventIndicators": "0"} if version == 2 else {}),
    }


def _credits(model: Model) -> dict[str, str]:
    """Return author, version, licence and copyright, as far as the model's part tells them, and the date."""
    told = {**asdict(model.origin.credits), "generationDateAndTime": _date()}
    return {name: text for name, text in told.items() if text}


def _date() -> str:
    """Return the date that `$SOURCE_DATE_EPOCH` gives, seconds since 1970, else none: equal models give equal files."""
    text = os.environ.get("SOURCE_DATE_EPOCH", "").strip()
    if not text:
        return ""
    try:
        return datetime.fromtimestamp(int(text), UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    except (ValueError, OverflowError, OSError):
        raise ExportError(f"$SOURCE_DATE_EPOCH is {text!r}, expected whole seconds since 1970") from None


def _interfaces(root: etree._Element, sources: Sources, version: Version) -> None:
    """Add Model Exchange and Co-Simulation with their capability flags and, in FMI 2, source files."""
    both = {"modelIdentifier": sources.name}
    if version == 2:
        both |= dict.fromkeys(
            (
                "canNotUseMemoryManagementFunctions",
                "canGetAndSetFMUstate",
                "canSerializeFMUstate",
                "providesDirectionalDerivative",
            ),
            "true",
        )
        exchange = {"completedIntegratorStepNotNeeded": "true"}
        cosimulation = {"canInterpolateInputs": "true"}
    else:
        both |= dict.fromkeys(
            (
                "canGetAndSetFMUState",
                "canSerializeFMUState",
                "providesDirectionalDerivatives",
                "providesAdjointDerivatives",
            ),
            "true",
        )
        exchange = {"needsCompletedIntegratorStep": "false"}
        cosimulation = {
            "hasEventMode": "false",
            "mightReturnEarlyFromDoStep": "false",
            "providesIntermediateUpdate": "true",
            "canReturnEarlyAfterIntermediateUpdate": "true",
        }
    cosimulation |= {"canHandleVariableCommunicationStepSize": "true", "maxOutputDerivativeOrder": "1"}
    for name, flags in (("ModelExchange", exchange), ("CoSimulation", cosimulation)):
        interface = etree.SubElement(root, name, both | flags)
        if version == 2:
            files = etree.SubElement(interface, "SourceFiles")
            for file in translation_units(sources):
                etree.SubElement(files, "File", {"name": file})


def _units(root: etree._Element, variables: list[Variable]) -> None:
    """Add the definitions of the units of the variables."""
    definitions = etree.SubElement(root, "UnitDefinitions")
    for name in sorted({v.unit for v in variables if v.unit}):
        element = etree.SubElement(definitions, "Unit", {"name": name})
        if name == DEGREE:
            etree.SubElement(element, "BaseUnit", {"rad": "1", "factor": _number(math.pi / 180)})
            continue
        unit = parse_unit(name)
        if unit.exponents is None:
            continue
        powers = {base: str(power) for base, power in zip(BASE, unit.exponents, strict=True) if power}
        etree.SubElement(element, "BaseUnit", powers)
        for display, factor in unit.display:
            etree.SubElement(element, "DisplayUnit", {"name": display, "factor": _number(factor)})


def _log_categories(root: etree._Element) -> None:
    """Add the log categories."""
    categories = etree.SubElement(root, "LogCategories")
    for name, description in (
        ("logStatusDiscard", "Reason why a step cannot be completed"),
        ("logStatusError", "Reason why a call failed"),
    ):
        etree.SubElement(categories, "Category", {"name": name, "description": description})


def _model_variables(root: etree._Element, variables: list[Variable], version: Version) -> None:
    """Add all variables, derivatives with references to their states."""
    element = etree.SubElement(root, "ModelVariables")
    states = [v for v in variables if v.role is Role.STATE]
    for variable in variables:
        state = states[variable.index] if variable.role is Role.DERIVATIVE else None
        _variable(element, variable, None if state is None else str(state.reference), version)


def _variable(parent: etree._Element, variable: Variable, derivative: str | None, version: Version) -> None:
    """Add one variable; `derivative` is the reference to its state, for the derivative of a state."""
    causality, variability, initial = _ATTRIBUTES[variable.role]
    if variable.fixed:
        variability = "fixed"
    common = {
        "name": variable.name,
        "valueReference": str(variable.reference),
        "description": variable.description,
        "causality": causality,
        "variability": variability,
    }
    if initial is not None:
        common["initial"] = initial
    if variable.role is Role.TEXT:
        etree.SubElement(etree.SubElement(parent, "ScalarVariable", common), "String", {"start": str(variable.start)})
        return
    real = _real(variable)
    if derivative is not None:
        real["derivative"] = derivative
    if version == 2:
        etree.SubElement(etree.SubElement(parent, "ScalarVariable", common), "Real", real)
    else:
        etree.SubElement(parent, "Float64", common | real)


def _real(variable: Variable) -> dict[str, str]:
    """Return the attributes of a number: unit, bounds, nominal and start; nominal 1 is the default of the standard."""
    attributes = {"unit": variable.unit} if variable.unit else {}
    if variable.min is not None:
        attributes["min"] = _number(variable.min)
    if variable.max is not None:
        attributes["max"] = _number(variable.max)
    if variable.nominal != 1.0:
        attributes["nominal"] = _number(variable.nominal)
    if variable.start is not None:
        attributes["start"] = _number(float(variable.start))
    return attributes


def _model_structure(root: etree._Element, sources: Sources, version: Version) -> None:
    """Add outputs, derivatives and initial unknowns with their dependencies.

    Knowns are time, states and inputs, for initial unknowns also parameters and sampled states. For initial unknowns
    the standard has only the kinds `constant` and `dependent`.
    """
    structure = etree.SubElement(root, "ModelStructure")
    depends = dependencies(sources.functions, sources.variables)
    outputs = [v for v in sources.variables if v.role in (Role.OUTPUT, Role.SAMPLED_OUTPUT)]
    derivatives = [v for v in sources.variables if v.role is Role.DERIVATIVE]
    unknowns = [v for v in sources.variables if v.role in (Role.OUTPUT, Role.DERIVATIVE)]
    running = (Role.TIME, Role.STATE, Role.INPUT)
    for key, members in (("outputs", outputs), ("derivatives", derivatives), ("initial", unknowns)):
        if not members:
            continue
        name = _STRUCTURE[version][key]
        parent = etree.SubElement(structure, name) if version == 2 else structure
        for member in members:
            row = depends[member.reference]
            if key == "initial":
                row = [Dependency(d.known, "constant" if d.kind == "constant" else "dependent") for d in row]
            else:
                row = [d for d in row if d.known.role in running]
            attributes = {
                "index" if version == 2 else "valueReference": str(member.reference),
                "dependencies": " ".join(str(d.known.reference) for d in row),
                "dependenciesKind": " ".join(d.kind for d in row),
            }
            etree.SubElement(parent, "Unknown" if version == 2 else name, attributes)


def _annotations(root: etree._Element, variables: list[Variable]) -> None:
    """Add the texts of the model as annotations of FMI 3."""
    texts = [v for v in variables if v.role is Role.TEXT]
    if not texts:
        return
    annotation = etree.SubElement(etree.SubElement(root, "Annotations"), "Annotation", {"type": TEXTS})
    for text in texts:
        more = {"name": text.name, "value": str(text.start), "description": text.description}
        etree.SubElement(annotation, "Constant", more)


def _number(value: float) -> str:
    """Return the shortest decimal text of exactly this number."""
    return repr(float(value))
