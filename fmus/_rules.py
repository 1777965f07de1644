"""Rules for modelDescription.xml in addition to its schema and fmpy's validation, one function per rule.

Each rule takes the parsed description and yields problems. `broken_references` takes the XML before parsing, because
fmpy silently resolves an index 0 of FMI 2 to the last variable.
"""

import math
import re
from collections import Counter
from collections.abc import Callable, Iterator

from fmpy.model_description import ModelDescription, ModelVariable, Unknown
from lxml import etree

Rule = Callable[[ModelDescription], Iterator[str]]

_FLOATS = ("Real", "Float32", "Float64")


def broken_references(root: etree._Element) -> Iterator[str]:
    """Indices (FMI 2, from 1) and value references (FMI 3) in ModelStructure and `derivative` refer to variables."""
    variables = root.find("ModelVariables")
    members = [v for v in ([] if variables is None else variables) if v.get("name") is not None]
    if root.get("fmiVersion", "").startswith("2"):
        known, word = {str(k) for k in range(1, len(members) + 1)}, "index"
        slopes = [child for member in members for child in member]
    else:
        known, word = {v.get("valueReference", "") for v in members}, "value reference"
        slopes = members
    for element in slopes:
        reference = element.get("derivative")
        if reference is not None and reference not in known:
            yield f"line {element.sourceline}: derivative refers to {word} {reference}, which no variable has"
    structure = root.find("ModelStructure")
    for element in [] if structure is None else structure.iter("*"):
        own = element.get("index" if word == "index" else "valueReference")
        for reference in [*([] if own is None else [own]), *element.get("dependencies", "").split()]:
            if reference not in known:
                yield f"line {element.sourceline}: {_list(element)} refers to {word} {reference}, which no variable has"


def bounds(description: ModelDescription) -> Iterator[str]:
    """Numbers are finite and min <= start <= max."""
    for variable in description.modelVariables:
        if variable.type not in _FLOATS:
            continue
        low, high = _number(variable.min, -math.inf), _number(variable.max, math.inf)
        if low > high:
            yield f"{_at(variable)}: min {low:g} is above max {high:g}"
        for text in (variable.start or "").split():
            start = float(text)
            if not math.isfinite(start):
                yield f"{_at(variable)}: start is {text}, expected a finite number"
            elif not low <= start <= high:
                yield f"{_at(variable)}: start {start:g} is outside [{low:g}, {high:g}]"


def nominals(description: ModelDescription) -> Iterator[str]:
    """Nominal values are finite and above 0."""
    for variable in description.modelVariables:
        if variable.type in _FLOATS and variable.nominal is not None:
            value = float(variable.nominal)
            if not (math.isfinite(value) and value > 0):
                yield f"{_at(variable)}: nominal is {value:g}, expected above 0"


def derivatives(description: ModelDescription) -> Iterator[str]:
    """A derivative is that of a continuous real variable other than time, and each has at most one."""
    states: list[str] = []
    for slope in description.modelVariables:
        state = slope.derivative
        if state is None or slope.alias is not None:
            continue
        states.append(state.name)
        if state.type not in _FLOATS or state.variability != "continuous" or state.causality == "independent":
            yield f"{_at(slope)}: is the derivative of {state.name}, which cannot be a state"
    for state, count in Counter(states).items():
        if count > 1:
            yield f"{state} has {count} derivatives, expected one"


def structure(description: ModelDescription) -> Iterator[str]:
    """Unknowns are listed once, dependencies once and in ascending order; initial kinds are constant or dependent."""
    place = _places(description)
    for name, unknowns in _lists(description).items():
        for variable, count in Counter(_variable(u).name for u in unknowns).items():
            if count > 1:
                yield f"ModelStructure lists {variable} {count} times among {name}, expected once"
        for unknown in unknowns:
            places = [place[id(v)] for v in unknown.dependencies or []]
            if len(set(places)) < len(places):
                yield f"line {unknown.sourceline}: {_variable(unknown).name} depends on the same known twice"
            if description.fmiMajorVersion == 2 and sorted(places) != places:
                yield f"line {unknown.sourceline}: the dependencies of {_variable(unknown).name} are not ascending"
    for unknown in description.initialUnknowns:
        wrong = sorted({kind for kind in unknown.dependenciesKind or [] if kind not in ("constant", "dependent")})
        if wrong:
            yield (
                f"line {unknown.sourceline}: initial unknown {_variable(unknown).name} has dependenciesKind "
                f"{', '.join(wrong)}, expected constant or dependent"
            )


def knowns(description: ModelDescription) -> Iterator[str]:
    """In FMI 2, knowns of outputs and derivatives are not calculated, except states; initial ones have exact values."""
    if description.fmiMajorVersion != 2:
        return
    slopes = [_variable(unknown).derivative for unknown in description.derivatives]
    states = {state.name for state in slopes if state is not None}
    for unknown in [*description.outputs, *description.derivatives]:
        for known in unknown.dependencies or []:
            if known.causality not in ("input", "independent", "parameter") and known.name not in states:
                yield (
                    f"line {unknown.sourceline}: {_variable(unknown).name} has the dependency {known.name}, "
                    "which is neither input, continuous state, parameter nor time"
                )
    for unknown in description.initialUnknowns:
        for known in unknown.dependencies or []:
            if known.causality not in ("input", "independent") and known.initial != "exact":
                yield (
                    f"line {unknown.sourceline}: initial unknown {_variable(unknown).name} has the dependency "
                    f"{known.name}, which has initial={known.initial}, expected exact"
                )
    place = _places(description)
    order = [place[id(_variable(u))] for u in description.initialUnknowns]
    if sorted(order) != order:
        yield "ModelStructure: InitialUnknowns are not in the order of the variables"


def units(description: ModelDescription) -> Iterator[str]:
    """Names of units, and of the display units of each, are unique; factors are finite and not 0."""
    for name, count in Counter(unit.name for unit in description.unitDefinitions).items():
        if count > 1:
            yield f"unit {name} is defined {count} times"
    for unit in description.unitDefinitions:
        for name, count in Counter(display.name for display in unit.displayUnits).items():
            if count > 1:
                yield f"unit {unit.name}: display unit {name} is defined {count} times"
        factors = [(f"display unit {d.name}", d.factor) for d in unit.displayUnits]
        if unit.baseUnit is not None:
            factors.append(("base unit", unit.baseUnit.factor))
        for owner, factor in factors:
            if not (math.isfinite(float(factor)) and float(factor) != 0):
                yield f"unit {unit.name}: factor of its {owner} is {factor}, expected finite and not 0"


def aliases(description: ModelDescription) -> Iterator[str]:
    """FMI 2 variables with the same value reference have the same unit, and at most one of them has a start value."""
    if description.fmiMajorVersion != 2:
        return
    groups: dict[tuple[str, int], list[ModelVariable]] = {}
    for variable in description.modelVariables:
        kind = "Integer" if variable.type == "Enumeration" else variable.type
        groups.setdefault((kind, variable.valueReference), []).append(variable)
    for (_, reference), group in groups.items():
        names = ", ".join(v.name for v in group)
        if len({v.unit for v in group}) > 1:
            yield f"value reference {reference} is shared by {names}, whose units differ"
        if sum(v.start is not None and v.variability != "constant" for v in group) > 1:
            yield f"value reference {reference} is shared by {names}, more than one of which has a start value"


def identity(description: ModelDescription) -> Iterator[str]:
    """The FMU has a token and an interface; its model identifiers are C identifiers."""
    if not description.guid:
        yield "the token (guid, instantiationToken) is empty"
    interfaces = [i for i in (description.modelExchange, description.coSimulation) if i is not None]
    if not interfaces and description.scheduledExecution is None:
        yield "there is no interface: neither ModelExchange nor CoSimulation"
    for interface in interfaces:
        word = type(interface).__name__
        if not re.fullmatch(r"[A-Za-z_]\w*", interface.modelIdentifier or "", re.ASCII):
            yield f"{word}: model identifier {interface.modelIdentifier!r} is not a C identifier"
        if interface.canSerializeFMUstate and not interface.canGetAndSetFMUstate:
            yield f"{word}: declares that it can serialise the FMU state, but not that it can get and set it"


def experiment(description: ModelDescription) -> Iterator[str]:
    """The stop time of the default experiment is after its start time, and its step size is positive."""
    given = description.defaultExperiment
    if given is None:
        return
    start, stop, step = (_number(v, None) for v in (given.startTime, given.stopTime, given.stepSize))
    if stop is not None and not stop > (start or 0.0):
        yield f"DefaultExperiment: stopTime {stop:g} is not after startTime {start or 0.0:g}"
    if step is not None and not step > 0:
        yield f"DefaultExperiment: stepSize is {step:g}, expected above 0"


def independent(description: ModelDescription) -> Iterator[str]:
    """At most one variable is independent."""
    names = [v.name for v in description.modelVariables if v.causality == "independent" and v.alias is None]
    if len(names) > 1:
        yield f"{', '.join(names)} are all independent, expected one at most"


def house(description: ModelDescription) -> Iterator[str]:
    """Our own FMUs have descriptions, units, real scalar ports, and all derivatives in ModelStructure."""
    if not is_ours(description):
        return
    listed = {_variable(u).name for u in description.derivatives}
    for variable in description.modelVariables:
        if not variable.description:
            yield f"{_at(variable)}: has no description"
        if variable.type in _FLOATS and variable.variability != "constant" and not variable.unit:
            yield f"{_at(variable)}: has no unit"
        if variable.causality in ("input", "output") and (variable.type not in _FLOATS or variable.shape):
            yield f"{_at(variable)}: is an {variable.causality} that is not a scalar real number"
        if variable.derivative is not None and variable.name not in listed:
            yield f"{_at(variable)}: is a derivative that ModelStructure does not list"


RULES: tuple[Rule, ...] = (
    identity,
    experiment,
    independent,
    bounds,
    nominals,
    units,
    aliases,
    derivatives,
    structure,
    knowns,
    house,
)
"""All rules on a parsed description."""


def is_ours(description: ModelDescription) -> bool:
    """Return whether this package generated the FMU."""
    return (description.generationTool or "").startswith("hfsa ")


def _lists(description: ModelDescription) -> dict[str, list[Unknown]]:
    """Return the lists of unknowns in ModelStructure by name."""
    return {
        "outputs": description.outputs,
        "derivatives": description.derivatives,
        "initial unknowns": description.initialUnknowns,
    }


def _variable(unknown: Unknown) -> ModelVariable:
    """Return the variable of an entry of ModelStructure."""
    assert unknown.variable is not None  # broken_references comes first
    return unknown.variable


def _places(description: ModelDescription) -> dict[int, int]:
    """Return the position of each variable in the list by identity, because invalid files may repeat names."""
    return {id(variable): k for k, variable in enumerate(description.modelVariables)}


def _list(element: etree._Element) -> str:
    """Return the name of the list that contains an element."""
    parent = element.getparent()
    return parent.tag if element.tag == "Unknown" and parent is not None else element.tag


def _at(variable: ModelVariable) -> str:
    """Return the line and the name of a variable, for messages."""
    return f"line {variable.sourceline}: {variable.name}"


def _number(text, otherwise):
    return otherwise if text is None else float(text)
