"""Description of an FMU: its modelDescription.xml as plain data, the same for FMI 2 and FMI 3."""

import re
import zipfile
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import product
from pathlib import Path
from typing import Any, Literal

from fmpy.model_description import BaseUnit, ModelDescription, ModelVariable, Unknown, read_model_description
from lxml import etree

from hfsa.cosim.fmi.demands import Demands, demands
from hfsa.cosim.fmi.soundness import refuse_unsound
from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.errors import StructureError

Interface = Literal["co_simulation", "model_exchange"]
"""Interface type for which an FMU is loaded."""

SOLVER_TOLERANCE, SOLVER_STEP = "solver.relative_tolerance", "solver.maximum_step"
"""Settings of a solver inside an FMU of ours that takes steps of its own."""

SAMPLE_TIME = "sample_time"
"""Parameter [s] that declares the sample time of an FMU; its discrete outputs change at ticks only."""

CONVENTIONS = "hfsa "
"""Beginning of the generation tool of FMUs whose variables' names mean what they mean in FMUs of hfsa."""

NEXT = "next."
"""Prefix of the variable that holds the value of a sampled state after the next tick."""

COUNTERS = (
    "solver.steps",
    "solver.evaluations",
    "solver.rejected_steps",
    "solver.jacobians",
    "solver.factorizations",
)
"""Variables that count the work of the solver inside a Co-Simulation FMU; no value of the model depends on them."""

_MISSING: dict[Interface, str] = {
    "co_simulation": "Co-Simulation interface; expected one, only the monolithic algorithms use the other",
    "model_exchange": "Model Exchange interface, which the monolithic algorithms use; the others co-simulate it",
}

_BASE_UNIT = ("kg", "m", "s", "A", "K", "mol", "cd", "rad", "factor", "offset")


@dataclass(frozen=True)
class Description:
    """One interface of an FMU.

    Attributes:
        file: the `.fmu` file.
        interface: interface type.
        is_co_simulation_only: whether the file offers Co-Simulation only, which need not declare states.
        name: name of the model; `identifier` is the name of the binary, `token` the instantiation token (FMI 2: guid).
        version: 2 or 3.
        variables: every variable by name.
        states: (state, derivative) names of the continuous states, in the order of ModelStructure.
        log_categories: names of its log categories.
        can_restore, can_serialize, has_derivatives: whether it can get and set its state, serialize its state, and
            compute directional derivatives.
        can_interpolate: whether it sets input derivatives by a separate function (FMI 2).
        output_derivative_order: highest order of its output derivatives.
        event_indicators: number of its event indicators.
        needs_completed_steps: whether it needs a call after each completed integrator step.
        start_time, step_size, stop_time: those [s] of its default experiment, `None` where it has none.
        demands: its demands on what runs it.
    """

    file: Path
    interface: Interface
    name: str
    identifier: str
    token: str
    version: int
    variables: dict[str, Connector]
    states: tuple[tuple[str, str], ...]
    log_categories: tuple[str, ...]
    can_restore: bool
    can_serialize: bool
    has_derivatives: bool
    can_interpolate: bool
    output_derivative_order: int
    event_indicators: int
    needs_completed_steps: bool
    demands: Demands
    is_co_simulation_only: bool = False
    start_time: float | None = None
    step_size: float | None = None
    stop_time: float | None = None

    def undeclared(self, outputs: Iterable[str]) -> str:
        """Return a sign of undeclared dynamics behind the outputs, as text; empty where there is none.

        Signs are a clock; a discrete variable that is neither an output with a `sample_time`, nor a sampled state, nor
        a counter; and, of a Co-Simulation only FMU, an output that declares neither an input nor a state as its
        dependency.
        """
        ours = {*self.sampled_states, *(f"{NEXT}{name}" for name in self.sampled_states)}
        for name, v in self.variables.items():
            if name in self._counters:
                continue
            if v.type.startswith("Clock"):
                return f"its clock {name} does not declare when it ticks"
            is_held = self.has_sample_time and (v.causality == "output" or name in ours)
            if v.changes_at_events and v.causality in ("output", "local") and not is_held:
                return f"its {v.causality} {name} is discrete, and no parameter {SAMPLE_TIME} declares when it changes"
        has_input = any(v.causality == "input" for v in self.variables.values())
        if self.is_co_simulation_only and has_input and not self.states and not self.has_sample_time:
            for name in outputs:
                if self.variables[name].dependencies == ():
                    return f"its output {name} declares no input and no state that it depends on"
        return ""

    @property
    def is_ours(self) -> bool:
        """Whether hfsa made it: its tool is hfsa of a version."""
        return bool(re.match(r"hfsa \d", self.demands.tool))

    @property
    def is_sampled(self) -> bool:
        """Whether it is sampled: it has a parameter `sample_time`, and every output is discrete."""
        outputs = [v for v in self.variables.values() if v.causality == "output"]
        return self.has_sample_time and bool(outputs) and all(v.variability == "discrete" for v in outputs)

    @cached_property
    def has_sample_time(self) -> bool:
        """Whether it has a parameter `sample_time` [s]."""
        found = self.variables.get(SAMPLE_TIME)
        return found is not None and found.is_conventional and found.causality == "parameter"

    def input_derivative(self, name: str, order: int) -> str | None:
        """Return the variable that sets a time derivative of an input; `None` where none does.

        In FMI 2 it is the input itself, with the order as an argument of the call; FMI 3 has no such function, and FMUs
        of hfsa have a parameter.
        """
        if self.version == 2:
            return name if self.can_interpolate else None
        parameter = f"input_derivative[{order}].{name}"
        found = self.variables.get(parameter)
        return parameter if found is not None and found.is_conventional else None

    @property
    def counters(self) -> tuple[str, ...]:
        """Names of the counters of its solver, in the order of `COUNTERS`; none in Model Exchange."""
        return self._counters if self.interface == "co_simulation" else ()

    @cached_property
    def _counters(self) -> tuple[str, ...]:
        """Names of the variables that are counters by name and kind."""
        found = [self.variables[name] for name in COUNTERS if name in self.variables]
        own = [v for v in found if v.is_conventional and v.is_real]
        return tuple(v.name for v in own if (v.causality, v.variability) == ("local", "discrete"))

    @property
    def sampled_states(self) -> tuple[str, ...]:
        """Names of its sampled states: each state z has a variable `next.z` with the value after the next tick."""
        known = self.variables
        return tuple(name for name, v in known.items() if v.is_conventional and f"{NEXT}{name}" in known)


def describe(file: Path, interface: Interface | None = None) -> Description:
    """Return the description of an FMU, read once per process; `StructureError` with the reason where it cannot run.

    `file` is an FMU, or a modelDescription.xml alone. The default interface is Co-Simulation where the FMU offers it.
    """
    try:
        stat = file.stat()
    except OSError:
        raise StructureError(f"there is no file {file}") from None
    return _interface_description(file, interface, (stat.st_ino, stat.st_mtime_ns, stat.st_size))


@lru_cache(maxsize=1024)
def _read(file: Path, _version: tuple[int, ...]) -> tuple[Any, ModelDescription]:
    """Return the model description of an FMU as XML and from fmpy; a changed file has another `_version`."""
    try:
        if file.suffix == ".xml":
            root = etree.fromstring(file.read_bytes())
        else:
            with zipfile.ZipFile(file) as archive:
                root = etree.fromstring(archive.read("modelDescription.xml"))
        version = str(root.get("fmiVersion"))
        if not version.startswith(("2.", "3.")):
            raise StructureError(f"{file} is an FMU of FMI version {version}; expected 2.0 or 3.0")
        refuse_unsound(file, root)
        return root, read_model_description(str(file), validate=False)
    except StructureError:
        raise
    except Exception as error:  # the parser raises many types for a file that is no FMU
        raise StructureError(f"{file} is not a readable FMU: {error}") from error


@lru_cache(maxsize=1024)
def _interface_description(file: Path, interface: Interface | None, version_of_file: tuple[int, ...]) -> Description:
    """Return the description of one interface of an FMU."""
    root, model = _read(file, version_of_file)
    version = str(root.get("fmiVersion"))
    chosen = interface or ("co_simulation" if model.coSimulation or not model.modelExchange else "model_exchange")
    offered, tag = (
        (model.coSimulation, "CoSimulation") if chosen == "co_simulation" else (model.modelExchange, "ModelExchange")
    )
    if offered is None:
        is_scheduled = root.find("ScheduledExecution") is not None
        also = "; it offers Scheduled Execution, which hfsa does not run" if is_scheduled else ""
        raise StructureError(f"{file} offers no {_MISSING[chosen]}{also}")
    flags = {**root.find(tag).attrib}  # type: ignore[union-attr]
    directional = ("providesDirectionalDerivative", "providesDirectionalDerivatives")  # FMI 2, FMI 3
    return Description(
        file=file,
        interface=chosen,
        name=str(model.modelName),
        identifier=str(offered.modelIdentifier),
        token=str(model.instantiationToken),
        version=int(version[0]),
        variables=_variables(model),
        states=_states(model),
        log_categories=tuple(str(category.name) for category in model.logCategories),
        can_restore=offered.canGetAndSetFMUstate,
        can_serialize=offered.canSerializeFMUstate,
        has_derivatives=any(flags.get(name) in ("true", "1") for name in directional),
        can_interpolate=flags.get("canInterpolateInputs") in ("true", "1"),
        output_derivative_order=model.coSimulation.maxOutputDerivativeOrder if model.coSimulation else 0,
        event_indicators=model.numberOfEventIndicators,
        is_co_simulation_only=model.modelExchange is None,
        needs_completed_steps=bool(model.modelExchange and model.modelExchange.needsCompletedIntegratorStep),
        start_time=_number(getattr(model.defaultExperiment, "startTime", None)),
        step_size=_number(getattr(model.defaultExperiment, "stepSize", None)),
        stop_time=_number(getattr(model.defaultExperiment, "stopTime", None)),
        demands=demands(file, model, flags, chosen == "co_simulation"),
    )


def _variables(model: ModelDescription) -> dict[str, Connector]:
    """Return the variables by name."""
    units = {unit.name: _base_unit(unit.baseUnit) for unit in model.unitDefinitions}
    is_conventional = (model.generationTool or "").startswith(CONVENTIONS)
    ticks = is_conventional and any(v.name == SAMPLE_TIME and v.causality == "parameter" for v in model.modelVariables)
    dependencies = {unknown.variable.name: _inputs(unknown) for unknown in model.outputs if unknown.variable}
    variables = {}
    for v in model.modelVariables:
        declared = v.declaredType
        unit = v.unit or (declared.unit if declared else None)
        held = ticks and v.variability == "discrete"
        nominal = _number(v.nominal or (declared.nominal if declared else None))
        whole = Connector(
            name=v.name,
            reference=v.valueReference,
            causality=str(v.causality),
            variability=str(v.variability),
            type=str(v.type),
            unit=unit,
            base_unit=units.get(unit),
            start=None if v.shape else _number(v.start),
            nominal=nominal or 1.0,
            min=_number(v.min or (declared.min if declared else None)),
            max=_number(v.max or (declared.max if declared else None)),
            dependencies=() if held or v.causality != "output" else dependencies.get(v.name),
            has_nominal=bool(nominal),
            is_relative=bool(v.relativeQuantity or (declared and declared.relativeQuantity)),
            is_conventional=is_conventional,
        )
        variables |= {element.name: element for element in _elements(whole, v)} if v.shape else {v.name: whole}
    return variables


def _elements(array: Connector, variable: ModelVariable) -> list[Connector]:
    """Return the elements of an array variable: `x[1]`, or `x[2,3]`; a single start value is that of all."""
    names = _names_of_elements(variable)
    starts = [_number(word) for word in str(variable.start or "").split()]
    starts = starts * len(names) if len(starts) == 1 else starts
    each: list[float | None] = [*starts] if len(starts) == len(names) else [None] * len(names)
    return [
        replace(array, name=name, start=start, element=i, size=len(names))
        for i, (name, start) in enumerate(zip(names, each, strict=True))
    ]


def _names_of_elements(variable: ModelVariable) -> list[str]:
    """Return the names of the elements of an array, row by row; that of a scalar is its own."""
    indices = product(*(range(1, n + 1) for n in variable.shape or ()))
    return [f"{variable.name}[{','.join(map(str, index))}]" if index else str(variable.name) for index in indices]


def _states(model: ModelDescription) -> tuple[tuple[str, str], ...]:
    """Return the continuous states, each with the name of its derivative."""
    pairs = ((u.variable.derivative, u.variable) for u in model.derivatives if u.variable)
    names = ((_names_of_elements(state), _names_of_elements(rate)) for state, rate in pairs if state)
    return tuple(pair for states, rates in names for pair in zip(states, rates, strict=True))


def _inputs(unknown: Unknown) -> tuple[str, ...] | None:
    """Return the inputs that an unknown depends on, `None` where they are not declared."""
    if unknown.dependencies is None:
        return None
    inputs = (known for known in unknown.dependencies if known.causality == "input")
    return tuple(name for known in inputs for name in _names_of_elements(known))


def _base_unit(base: BaseUnit | None) -> tuple[float, ...] | None:
    """Return exponents, factor and offset of a base unit."""
    return None if base is None else tuple(float(getattr(base, name)) for name in _BASE_UNIT)


def _number(text: str | float | None) -> float | None:
    """Return a number of the description, `None` where it is missing or not a number; true is 1."""
    if text in ("true", "false"):
        return float(text == "true")
    try:
        return None if text is None else float(text)
    except ValueError:
        return None
