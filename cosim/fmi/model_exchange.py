"""One instance of an FMU in Model Exchange, FMI 2 or 3, as whoever integrates it sees it.

    fmu = Fmu.load("SDelta.fmi3.fmu", "model_exchange")
    robot = ModelExchangeInstance(fmu, "robot")
    robot.enter(0.0, 1.0, {"damping_ratio": 0.01})     # as in Co-Simulation
    robot.exit()                                       # into event mode
    robot.update()                                     # -> when it wants its next event; a tick at the start is done
    robot.continuous_time_mode()
    x = robot.states()
    calls = robot.time_setter(time), robot.state_setter(x), robot.rate_getter(rates)   # prepared, for every evaluation
    robot.event_mode()                                 # at an event; then update, and back

An event is due at `next_event`, where `complete_step` wants one, and where one of the FMU's event indicators changes
its sign: whoever integrates looks for that instant (`indicator_getter`).

Inputs and outputs pass through handles, as in Co-Simulation.
"""

import math
from ctypes import c_double, c_size_t, c_void_p
from typing import ClassVar

import numpy as np

from hfsa.cosim.fmi.base_instance import BaseInstance, Call, Fmu, StepError
from hfsa.cosim.fmi.description import Interface
from hfsa.cosim.fmi.model_exchange_library import ModelExchangeLibrary

MOST_UPDATES = 100
"""Updates of the discrete states after which an event must be complete."""


class ModelExchangeInstance(BaseInstance):
    """One Model Exchange instance.

    Attributes:
        size: number n of its continuous states; `indicators` is the number k of its event indicators.
        next_event: when it wants its next event [s], as of the last update.
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
        """Update the discrete states, in event mode, until that is complete; return when the next event is due [s].

        `StepError` where that has no end, or where the FMU asks to end the run.
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
            f"after {MOST_UPDATES} updates it still wants another",
        )

    def continuous_time_mode(self) -> None:
        """Enter continuous-time mode, from event mode after an update."""
        self._call("continuous_time_mode")

    def complete_step(self) -> bool:
        """Tell the FMU of a completed step of the integrator; whether it wants an event now."""
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
        """Return the nominal values of the continuous states, (n,), not below 0."""
        return np.abs(self._column("nominals"))

    def time_setter(self, time: c_double) -> Call:
        """Return the prepared call that sets the time to whatever `time` holds when it runs."""
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
        """Return what is left of a step where another integrates: the prepared call that sets the time."""
        return self.time_setter(time)

    def _column(self, role: str) -> np.ndarray:
        """Return what a call fills a column of the states' size with, (n,)."""
        values = np.zeros(self.size)
        if self.size:
            call = self._array_call(role, values)
            self.check(call, call.run())
        return values

    def _array_call(self, role: str, values: np.ndarray, size: int | None = None) -> Call:
        """Return the prepared call that passes an array of all states, or of `size` values."""
        size = self.size if size is None else size
        if values.shape != (size,) or values.dtype != np.float64 or not values.flags.c_contiguous:
            raise ValueError(f"{role} of {self.name} must be a contiguous float64 array of shape ({size},)")
        return self._call_of(role, values.ctypes.data_as(c_void_p), c_size_t(size))
