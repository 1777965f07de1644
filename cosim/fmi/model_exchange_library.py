"""Shared library of an FMU in Model Exchange, for FMI 2 and FMI 3."""

from abc import abstractmethod
from ctypes import byref, c_bool, c_double, c_void_p
from dataclasses import dataclass
from typing import ClassVar

from fmpy.fmi2 import FMU2Model, fmi2EventInfo
from fmpy.fmi3 import FMU3Model

from hfsa.cosim.fmi.library import LOGGER3, TERMINATED, Library, Library2, Library3


@dataclass(frozen=True)
class Update:
    """Result of an update of the discrete states.

    Attributes:
        status: status of the call, `TERMINATED` where the FMU requests the end of the run.
        is_incomplete: whether another update must follow.
        next_event: time of the next event [s], infinite where there is none.
    """

    status: int
    is_incomplete: bool
    next_event: float


class ModelExchangeLibrary(Library):
    """The shared library of one FMU in Model Exchange."""

    @abstractmethod
    def update(self, component: c_void_p) -> Update:
        """Update the discrete states, in event mode."""

    def completed(self, component: c_void_p) -> tuple[int, bool]:
        """Report a completed integrator step; return the status, and whether the FMU requests event mode."""
        event, end = self._boolean(), self._boolean()
        status = self.function("completed")(component, self._boolean(True), byref(event), byref(end))
        return status or (TERMINATED if end.value else 0), bool(event.value)


class ModelExchange2(Library2, ModelExchangeLibrary):
    """FMI 2.0."""

    names: ClassVar[dict[str, str]] = {
        **Library2.names,
        "event_mode": "fmi2EnterEventMode",
        "update": "fmi2NewDiscreteStates",
        "continuous_time_mode": "fmi2EnterContinuousTimeMode",
        "completed": "fmi2CompletedIntegratorStep",
        "time": "fmi2SetTime",
        "states": "fmi2SetContinuousStates",
        "get_states": "fmi2GetContinuousStates",
        "rates": "fmi2GetDerivatives",
        "indicators": "fmi2GetEventIndicators",
        "nominals": "fmi2GetNominalsOfContinuousStates",
    }
    _kind = FMU2Model
    _type = 0  # fmi2ModelExchange

    def update(self, component):
        """Call fmi2NewDiscreteStates."""
        info = fmi2EventInfo()
        status = self.function("update")(component, byref(info))
        time = float(info.nextEventTime) if info.nextEventTimeDefined else float("inf")
        end = TERMINATED if info.terminateSimulation else 0
        return Update(status or end, bool(info.newDiscreteStatesNeeded), time)


class ModelExchange3(Library3, ModelExchangeLibrary):
    """FMI 3.0."""

    names: ClassVar[dict[str, str]] = {
        **Library3.names,
        "event_mode": "fmi3EnterEventMode",
        "update": "fmi3UpdateDiscreteStates",
        "continuous_time_mode": "fmi3EnterContinuousTimeMode",
        "completed": "fmi3CompletedIntegratorStep",
        "time": "fmi3SetTime",
        "states": "fmi3SetContinuousStates",
        "get_states": "fmi3GetContinuousStates",
        "rates": "fmi3GetContinuousStateDerivatives",
        "indicators": "fmi3GetEventIndicators",
        "nominals": "fmi3GetNominalsOfContinuousStates",
    }
    _kind = FMU3Model

    def instantiate(self, name, log):
        """Call fmi3InstantiateModelExchange."""
        path = f"{self._resources}/".encode()
        return self._fmu.fmi3InstantiateModelExchange(
            name.encode(), self._token, path, False, False, log.environment, LOGGER3
        )

    def update(self, component):
        """Call fmi3UpdateDiscreteStates."""
        again, end, nominals, values, defined, time = *(c_bool() for _ in range(5)), c_double()
        flags = (byref(flag) for flag in (again, end, nominals, values, defined))
        status = self.function("update")(component, *flags, byref(time))
        next_event = time.value if defined.value else float("inf")
        return Update(status or (TERMINATED if end.value else 0), again.value, next_event)


MODEL_EXCHANGE: dict[int, type[ModelExchangeLibrary]] = {2: ModelExchange2, 3: ModelExchange3}
