"""Instance of an FMU in Model Exchange, FMI 2 or 3, for an external integrator.

    fmu = Fmu.load("SDelta.fmi3.fmu", "model_exchange")
    robot = ModelExchangeInstance(fmu, "robot")
    robot.enter(0.0, 1.0, {"damping_ratio": 0.01})     # as in Co-Simulation
    robot.exit()                                       # into event mode
    robot.update()                                     # -> time of the next event; includes a tick at the start
    robot.continuous_time_mode()
    x = robot.states()
    calls = robot.time_setter(time), robot.state_setter(x), robot.rate_getter(rates)   # for every evaluation
    robot.event_mode()                                 # at an event, followed by update and continuous_time_mode

Events are due at `next_event`, where `complete_step` returns true, and where an event indicator changes its sign; the
integrator locates that instant (`indicator_getter`). Inputs and outputs pass through handles, as in Co-Simulation.
"""

import math
from ctypes import c_double, c_size_t, c_void_p
from typing import ClassVar

import numpy as np

from hfsa.cosim.fmi.base_instance import BaseInstance, Call
from hfsa.cosim.fmi.description import Interface
from hfsa.cosim.fmi.fmu import Fmu
from hfsa.cosim.fmi.model_exchange_library import ModelExchangeLibrary
from hfsa.cosim.fmi.step_error import StepError

MOST_UPDATES = 100
"""Largest number of updates of the discrete states in one event."""


class ModelExchangeInstance(BaseInstance):
    """Model Exchange instance.

    Attributes:
        size: number n of continuous states.
        indicators: number k of event indicators.
        next_event: time of the next event [s], from the last update.
    """

    interface: ClassVar[Interface] = "model_exchange"
    _library: ModelExchangeLibrary

    def __init__(self, fmu: Fmu, name: str):
        super().__init__(fmu, name)
        self.size = len(fmu.description.states)
        self.indicators = fmu.description.event_indicators
        self.next_event = math.inf

    # Modes ------------------------------------------------------------------------------------------------------------

    def event_mode(self) -> None:
        """Enter event mode, from continuous-time mode."""
        self._call("event_mode")

    def update(self) -> float:
        """Update the discrete states, in event mode, until they are consistent; return the time of the next event [s].

        `StepError` after `MOST_UPDATES` updates, or where the FMU requests the end of the run.
        """
        for _ in range(MOST_UPDATES):
            found = self._library.update(self._component)
            self._check("update", found.status)
            if not found.is_incomplete:
                self.next_event = found.next_event
                return found.next_event
        raise StepError(
            self.name,
            self._library.names["update"],
            "does not settle",
            self.time,
            f"after {MOST_UPDATES} updates it still requests another",
        )

    def continuous_time_mode(self) -> None:
        """Enter continuous-time mode, from event mode after an update."""
        self._call("continuous_time_mode")

    def complete_step(self) -> bool:
        """Report a completed integrator step to the FMU; return whether it requests an event now."""
        if not self.fmu.description.needs_completed_steps:
            return False
        status, wants_event = self._library.completed(self._component)
        self._check("completed", status)
        return wants_event

    # Integration ------------------------------------------------------------------------------------------------------

    def states(self) -> np.ndarray:
        """Return the continuous states, (n,), in the order of the description's `states`."""
        return self._column("get_states")

    def nominals(self) -> np.ndarray:
        """Return the absolute nominal values of the continuous states, (n,)."""
        return np.abs(self._column("nominals"))

    def time_setter(self, time: c_double) -> Call:
        """Return the prepared call that sets the time to the value of `time` at the time of the call."""
        return self._call_of("time", time)

    def state_setter(self, values: np.ndarray) -> Call:
        """Return the prepared call that sets the continuous states from an array, (n,)."""
        return self._array_call("states", values)

    def rate_getter(self, values: np.ndarray) -> Call:
        """Return the prepared call that writes the derivatives of the states to an array, (n,)."""
        return self._array_call("rates", values)

    def indicator_getter(self, values: np.ndarray) -> Call:
        """Return the prepared call that writes the event indicators to an array, (k,)."""
        return self._array_call("indicators", values, self.indicators)

    def stepper(self, time: c_double, _step_size: c_double) -> Call:
        """Return the prepared call that sets the time: the part of a step that an external integrator leaves."""
        return self.time_setter(time)

    def _column(self, role: str) -> np.ndarray:
        """Return the values (n,) that a call writes, one per continuous state."""
        values = np.zeros(self.size)
        if self.size:
            call = self._array_call(role, values)
            self.check(call, call.run())
        return values

    def _array_call(self, role: str, values: np.ndarray, size: int | None = None) -> Call:
        """Return the prepared call with an array of n values, or of `size` values."""
        size = self.size if size is None else size
        if values.shape != (size,) or values.dtype != np.float64 or not values.flags.c_contiguous:
            raise ValueError(f"{role} of {self.name} must be a contiguous float64 array of shape ({size},)")
        return self._call_of(role, values.ctypes.data_as(c_void_p), c_size_t(size))
