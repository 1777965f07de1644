"""Description of an FMU: its modelDescription.xml as plain data, the same for FMI 2 and FMI 3."""

import gc
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Literal

from hfsa.cosim.archives.archive import Archive, check_regular
from hfsa.cosim.fmi.demands import TRUE, Demands, demands
from hfsa.cosim.fmi.raw_description import RawDescription, read_raw
from hfsa.cosim.fmi.soundness import refuse_unsound
from hfsa.cosim.fmi.variables import CONVENTIONS, SAMPLE_TIME, Variables, number
from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.errors import StructureError

__all__ = [
    "CONVENTIONS",
    "COUNTERS",
    "NEXT",
    "SAMPLE_TIME",
    "SOLVER_STEP",
    "SOLVER_TOLERANCE",
    "Description",
    "Interface",
    "describe",
]

Interface = Literal["co_simulation", "model_exchange"]
"""Interface type for which an FMU is loaded."""

SOLVER_TOLERANCE, SOLVER_STEP = "solver.relative_tolerance", "solver.maximum_step"
"""Settings of a solver inside an FMU of ours that takes steps of its own."""

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

_DOCUMENT = "modelDescription.xml"


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

    def sample_time(self, start: Mapping[str, Any]) -> float | None:
        """Return the time [s] between its ticks with start values by name; `None` where it is not sampled."""
        return float(start.get(SAMPLE_TIME, self.variables[SAMPLE_TIME].start or 0.0)) if self.is_sampled else None

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


@dataclass(frozen=True)
class _Whole:
    """What a description says of all interfaces: its attributes and lists, variables, states and event indicators."""

    raw: RawDescription
    variables: dict[str, Connector]
    states: tuple[tuple[str, str], ...]
    event_indicators: int


def describe(file: Path, interface: Interface | None = None) -> Description:
    """Return the description of an FMU, read once per process; `StructureError` with the reason where it cannot run.

    `file` is an FMU, or a modelDescription.xml alone. The default interface is Co-Simulation where the FMU offers it.
    """
    try:
        stat = file.stat()
    except OSError:
        raise StructureError(f"there is no file {file}") from None
    return _interface_description(file, interface, (stat.st_ino, stat.st_mtime_ns, stat.st_size))


@contextmanager
def _without_collection() -> Iterator[None]:
    """Pause the collection of cycles: looking for them among a million new variables again and again takes seconds."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


@lru_cache(maxsize=1024)
@_without_collection()
def _read(file: Path, _version: tuple[int, ...]) -> _Whole:
    """Return what an FMU describes, for all interfaces; a changed file has another `_version`."""
    if file.suffix == ".xml":
        check_regular(file, str(file))
        with open(file, "rb") as stream:
            raw = read_raw(stream, str(file))
    else:
        with Archive(file, str(file), "FMU") as archive, archive.open(_DOCUMENT, str(file)) as stream:
            raw = read_raw(stream, f"{file}: {_DOCUMENT}")
    refuse_unsound(file, raw)
    found = Variables(raw, f"{file}: {_DOCUMENT}")
    variables, states, indicators = found.connectors, found.states, found.event_indicators
    raw.variables.clear()  # as large as the connectors that were made of them
    raw.unknowns.clear()
    return _Whole(raw, variables, states, indicators)


@lru_cache(maxsize=1024)
def _interface_description(file: Path, interface: Interface | None, version_of_file: tuple[int, ...]) -> Description:
    """Return the description of one interface of an FMU."""
    whole = _read(file, version_of_file)
    raw, offers = whole.raw, whole.raw.interfaces
    one, other = "CoSimulation", "ModelExchange"
    chosen = interface or ("co_simulation" if one in offers or other not in offers else "model_exchange")
    tag = one if chosen == "co_simulation" else other
    if tag not in offers:
        is_scheduled = "ScheduledExecution" in offers
        also = "; it offers Scheduled Execution, which hfsa does not run" if is_scheduled else ""
        raise StructureError(f"{file} offers no {_MISSING[chosen]}{also}")
    flags, experiment = offers[tag], raw.experiment
    is_two = raw.version == 2
    directional = "providesDirectionalDerivative" if is_two else "providesDirectionalDerivatives"
    state = "FMUstate" if is_two else "FMUState"
    return Description(
        file=file,
        interface=chosen,
        name=str(raw.attributes.get("modelName")),
        identifier=flags["modelIdentifier"],
        token=str(raw.attributes.get("guid" if is_two else "instantiationToken")),
        version=raw.version,
        variables=whole.variables,
        states=whole.states,
        log_categories=tuple(raw.categories),
        can_restore=flags.get(f"canGetAndSet{state}") in TRUE,
        can_serialize=flags.get(f"canSerialize{state}") in TRUE,
        has_derivatives=flags.get(directional) in TRUE,
        can_interpolate=flags.get("canInterpolateInputs") in TRUE,
        output_derivative_order=int(number(offers.get(one, {}).get("maxOutputDerivativeOrder")) or 0),
        event_indicators=whole.event_indicators,
        is_co_simulation_only=other not in offers,
        needs_completed_steps=_needs_completed_steps(offers.get(other), is_two),
        start_time=number(experiment.get("startTime")),
        step_size=number(experiment.get("stepSize")),
        stop_time=number(experiment.get("stopTime")),
        demands=demands(file, raw.attributes.get("generationTool", ""), experiment, flags, chosen == "co_simulation"),
    )


def _needs_completed_steps(model_exchange: Mapping[str, str] | None, is_two: bool) -> bool:
    """Whether Model Exchange, if there is any, needs a call after each completed integrator step."""
    if model_exchange is None:
        return False
    if is_two:
        return model_exchange.get("completedIntegratorStepNotNeeded") not in TRUE
    return model_exchange.get("needsCompletedIntegratorStep") in TRUE
