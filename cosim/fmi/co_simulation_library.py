"""Shared library of an FMU in Co-Simulation, for FMI 2 and FMI 3."""

import ctypes
from abc import abstractmethod
from collections.abc import Callable
from ctypes import byref, c_bool, c_double, c_int, c_void_p
from functools import partial
from typing import ClassVar

from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave, fmi3IntermediateUpdateCallback

from hfsa.cosim.fmi.library import EARLY, LOGGER3, TERMINATED, Library, Library2, Library3


class CoSimulationLibrary(Library):
    """The shared library of one FMU in Co-Simulation."""

    @abstractmethod
    def derivatives(self, arguments: tuple, orders: ctypes.Array, values: c_void_p) -> tuple:
        """Return the arguments of `output_derivatives` after the component, from the arguments of the outputs."""

    @abstractmethod
    def input_derivatives(self, arguments: tuple, orders: ctypes.Array) -> tuple:
        """Return the arguments of `input_derivatives` after the component, from the arguments of the variables."""

    @abstractmethod
    def step(
        self, function: Callable[..., int], component: c_void_p, time: c_double, size: c_double, is_final: bool
    ) -> tuple[tuple, Callable[[], int]]:
        """Return (arguments, zero-argument call) of `step`; `is_final` means that no earlier state will be restored."""


class CoSimulation2(Library2, CoSimulationLibrary):
    """FMI 2.0."""

    names: ClassVar[dict[str, str]] = {
        **Library2.names,
        "step": "fmi2DoStep",
        "output_derivatives": "fmi2GetRealOutputDerivatives",
        "input_derivatives": "fmi2SetRealInputDerivatives",
    }
    _kind = FMU2Slave
    _type = 1  # fmi2CoSimulation

    def derivatives(self, arguments, orders, values):
        """Value references, their number, orders, values."""
        return *arguments[:2], orders, values

    def input_derivatives(self, arguments, orders):
        """Value references, their number, orders, values."""
        return *arguments[:2], orders, arguments[2]

    def step(self, function, component, time, size, is_final):
        """Component, time, size, noSetFMUStatePriorToCurrentPoint."""
        arguments = (component, time, size, c_int(is_final))
        return arguments, partial(function, *arguments)


class CoSimulation3(Library3, CoSimulationLibrary):
    """FMI 3.0."""

    names: ClassVar[dict[str, str]] = {
        **Library3.names,
        "step": "fmi3DoStep",
        "output_derivatives": "fmi3GetOutputDerivatives",
        "input_derivatives": "fmi3SetFloat64",
    }
    _kind = FMU3Slave

    def instantiate(self, name, log):
        """Instantiate without event mode, early return and intermediate update."""
        path = f"{self._resources}/".encode()
        nothing = fmi3IntermediateUpdateCallback()
        return self._fmu.fmi3InstantiateCoSimulation(
            name.encode(), self._token, path, False, False, False, False, None, 0, log.environment, LOGGER3, nothing
        )

    def derivatives(self, arguments, orders, values):
        """Value references, their number, orders, values, their number."""
        return *arguments[:2], orders, values, arguments[1]

    def input_derivatives(self, arguments, orders):  # noqa: ARG002
        """The arguments of `values`: the order is part of the variable names."""
        return arguments

    def step(self, function, component, time, size, is_final):
        """Component, time, size, flags.

        A successful step that requests the end of the run has status `TERMINATED`, one that returns early `EARLY`.
        """
        event, terminate, early, last = c_bool(), c_bool(), c_bool(), c_double()
        arguments = (component, time, size, c_bool(is_final), byref(event), byref(terminate), byref(early), byref(last))
        call = partial(function, *arguments)
        return arguments, lambda: call() or (TERMINATED if terminate.value else EARLY if early.value else 0)


CO_SIMULATION: dict[int, type[CoSimulationLibrary]] = {2: CoSimulation2, 3: CoSimulation3}
