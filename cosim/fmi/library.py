"""Shared library of an FMU: one set of roles for the functions of FMI 2 and FMI 3.

This module has the functions common to both interface types, `co_simulation_library.py` and
`model_exchange_library.py` those of one. Only these three use fmpy.fmi2 and fmpy.fmi3. C functions have no declared
argument types: every argument must be a ctypes object of the C type, so that a call converts nothing.
"""

import ctypes
import itertools
import os
import tempfile
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from ctypes import byref, c_bool, c_char_p, c_double, c_int, c_size_t, c_void_p
from pathlib import Path
from typing import Any, ClassVar

import fmpy
from fmpy.fmi2 import (
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)
from fmpy.fmi3 import fmi3LogMessageCallback
from fmpy.logging import addLoggerProxy

from hfsa.cosim.fmi.description import Description
from hfsa.cosim.fmi.isolation.stand_in import StandIn
from hfsa.cosim.systems.errors import StructureError

TERMINATED = 100
"""Status of a successful call in which the FMU requests the end of the run, beside the statuses 0 to 5 of FMI."""

EARLY = 102
"""Status of a successful step of FMI 3 that ended before its end, which nobody had allowed."""

WARNING = 1
"""Status of a call that went well, but for a message."""


def fails(status: int) -> bool:
    """Whether a status is worse than a warning; one that FMI does not know is, negative ones too."""
    return not 0 <= status <= WARNING


_LOG_CATEGORIES = ("logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal")


class Log:
    """Log messages of one instance; `environment` is the pointer that the FMU passes to the logger.

    `callbacks` is the structure of functions to which an FMI 2 instance keeps a pointer. `warned` counts the messages
    with the status of a warning since they were last taken, `warning` is the first of them.
    """

    _open: ClassVar[dict[int, "Log"]] = {}
    _numbers = itertools.count(1)

    def __init__(self):
        self.environment = next(self._numbers)
        self.messages: deque[str] = deque(maxlen=20)
        self.warned, self.warning = 0, ""
        self.callbacks: fmi2CallbackFunctions | None = None
        self._open[self.environment] = self

    def take(self) -> str:
        """Return the messages since the last call as one text."""
        text = "; ".join(self.messages)
        self.messages.clear()
        return text

    def take_warnings(self) -> tuple[int, str]:
        """Return number and first text of the messages with the status of a warning since the last call."""
        found = self.warned, self.warning
        self.warned, self.warning = 0, ""
        return found

    def close(self) -> None:
        """Remove the log from the open ones."""
        self._open.pop(self.environment, None)

    @classmethod
    def write(cls, environment: int | None, status: int, message: bytes | None) -> None:
        """Add a message with a status to the log with an environment."""
        log = cls._open.get(environment or 0)
        if log is None or not message:
            return
        text = message.decode(errors="replace").strip()
        log.messages.append(text)
        if status == WARNING:
            log.warning = log.warning if log.warned else text
            log.warned += 1


_NOEXEC = "failed to map segment"
"""What the linker of a system says of a library in a folder where nothing may be executed."""

LOGGER3 = fmi3LogMessageCallback(
    lambda environment, status, _category, message: Log.write(environment, status, message)
)
"""Logger of FMI 3 instances."""


class Library(ABC):
    """Loaded shared library of one FMU; `names` holds the FMI function of each role."""

    names: ClassVar[dict[str, str]]
    _kind: type
    _boolean: type
    _platform: ClassVar[str]
    """Name of this platform in the paths of binaries."""

    def __init__(self, description: Description, folder: Path, isolation: Path | None = None):
        self._file, self._stand_in = description.file, None
        here = os.getcwd()
        try:
            if isolation is None:
                self._fmu: Any = self._kind(
                    guid=description.token, modelIdentifier=description.identifier, unzipDirectory=str(folder)
                )
            else:
                self._fmu = self._stand_in = StandIn(isolation, self._binary(folder, description.identifier))
        except Exception as error:  # fmpy raises Exception itself, ctypes OSError and AttributeError
            os.chdir(here)  # where fmpy has left it
            raise self._not_loaded(str(error)) from error
        self._name, self._token = description.identifier, description.token.encode()
        self._resources = folder.absolute() / "resources"
        self._categories = [name.encode() for name in description.log_categories if name in _LOG_CATEGORIES]

    def function(self, role: str) -> Callable[..., int]:
        """Return the C function of a role, without argument types."""
        return self.named(self.names[role])

    def named(self, name: str) -> Callable[..., int]:
        """Return the C function of a name, without argument types; `StructureError` where the binary lacks it."""
        try:
            return self._fmu.dll[name]
        except AttributeError:
            raise StructureError(f"the binary of {self._name} lacks {name}, a function of the standard") from None

    def open(self, name: str, log: Log) -> int | None:
        """Return the address of a new instance, `None` where there is none; `StructureError` as at loading."""
        address = self.instantiate(name, log)
        if self._stand_in is not None and address is None and self._stand_in.is_not_loaded:
            raise self._not_loaded(log.take())
        return address

    @abstractmethod
    def instantiate(self, name: str, log: Log) -> int | None:
        """Return the address of a new instance of the interface, or `None`."""

    @abstractmethod
    def set_up(
        self, component: c_void_p, start_time: float, stop_time: float | None, tolerance: float | None = None
    ) -> int:
        """Set up the experiment, before any value is set; return the status."""

    @abstractmethod
    def enter(
        self, component: c_void_p, start_time: float, stop_time: float | None, tolerance: float | None = None
    ) -> int:
        """Enter initialization mode; return the status."""

    @abstractmethod
    def values(self, references: ctypes.Array, count: c_size_t, values: c_void_p) -> tuple:
        """Return the arguments of `get` and `set` that follow the component."""

    @abstractmethod
    def directional(self, unknowns: tuple, knowns: tuple) -> tuple:
        """Return the arguments of `directional` after the component, from the arguments of unknowns and knowns."""

    def enable_logging(self, component: c_void_p) -> None:
        """Enable the log categories of warnings and errors that the FMU has."""
        n = len(self._categories)
        if n:
            categories = (c_char_p * n)(*self._categories)
            self.function("enable_logging")(component, self._boolean(True), c_size_t(n), categories)

    def free(self, component: c_void_p) -> None:
        """Free an instance."""
        free = self.function("free")
        free.restype = None  # type: ignore[attr-defined]
        free(component)
        self.abandon(component)

    def abandon(self, component: c_void_p) -> None:
        """End the process of an instance in one of its own, which nothing may call any more."""
        if self._stand_in is not None and component.value:
            self._stand_in.end(component.value)

    @property
    def is_isolated(self) -> bool:
        """Whether each instance is in a process of its own."""
        return self._stand_in is not None

    def ending(self, component: c_void_p) -> str:
        """Return how the process of an instance has ended, or that of the last one that failed; empty without one."""
        if self._stand_in is None:
            return ""
        return self._stand_in.ending(component.value) if component.value else self._stand_in.failure

    def _binary(self, folder: Path, identifier: str) -> Path:
        """Return the binary of this platform; `FileNotFoundError` where there is none."""
        binary = folder.absolute() / "binaries" / self._platform / f"{identifier}{fmpy.sharedLibraryExtension}"
        if not binary.is_file():
            raise FileNotFoundError(f"Cannot find shared library {binary}.")
        return binary

    def _not_loaded(self, reason: str) -> StructureError:
        """Return the error for a binary that cannot be loaded."""
        place = tempfile.gettempdir()
        advice = f"; no program may run in {place}, and TMPDIR names another folder" if _NOEXEC in reason else ""
        return StructureError(f"{self._file} cannot be loaded on {fmpy.platform_tuple}: {reason}{advice}")

    def close(self) -> None:
        """Unload the library."""
        if self._stand_in is not None:
            self._stand_in.close()
        else:
            self._fmu.freeLibrary()


class Library2(Library):
    """FMI 2.0."""

    names: ClassVar[dict[str, str]] = {
        "setup": "fmi2SetupExperiment",
        "enter": "fmi2EnterInitializationMode",
        "exit": "fmi2ExitInitializationMode",
        "reset": "fmi2Reset",
        "free": "fmi2FreeInstance",
        "enable_logging": "fmi2SetDebugLogging",
        "get": "fmi2GetReal",
        "set": "fmi2SetReal",
        "save": "fmi2GetFMUstate",
        "restore": "fmi2SetFMUstate",
        "release": "fmi2FreeFMUstate",
        "size": "fmi2SerializedFMUstateSize",
        "serialize": "fmi2SerializeFMUstate",
        "deserialize": "fmi2DeSerializeFMUstate",
        "directional": "fmi2GetDirectionalDerivative",
    }
    _type: int
    _boolean = c_int
    _platform = fmpy.platform

    def instantiate(self, name, log):
        """Instantiate with the project's logger and the C library's memory functions."""
        log.callbacks = fmi2CallbackFunctions(_logger2, _allocate, _release, componentEnvironment=log.environment)
        uri = self._resources.as_uri().encode()
        return self._fmu.fmi2Instantiate(name.encode(), self._type, self._token, uri, byref(log.callbacks), 0, 0)

    def set_up(self, component, start_time, stop_time, tolerance=None):
        """Call fmi2SetupExperiment, at which some FMUs take their own start values again."""
        stop = (c_int(stop_time is not None), c_double(stop_time or 0.0))
        given = (c_int(tolerance is not None), c_double(tolerance or 0.0))
        return self.function("setup")(component, *given, c_double(start_time), *stop)

    def enter(self, component, start_time, stop_time, tolerance=None):  # noqa: ARG002 (FMI 3 takes them here)
        """Call fmi2EnterInitializationMode."""
        return self.function("enter")(component)

    def values(self, references, count, values):
        """Value references, their number, values."""
        return references, count, values

    def directional(self, unknowns, knowns):
        """Unknowns and knowns with their numbers, seed, sensitivity."""
        return *unknowns[:2], *knowns[:2], knowns[2], unknowns[2]


class Library3(Library):
    """FMI 3.0."""

    names: ClassVar[dict[str, str]] = {
        "enter": "fmi3EnterInitializationMode",
        "exit": "fmi3ExitInitializationMode",
        "reset": "fmi3Reset",
        "free": "fmi3FreeInstance",
        "enable_logging": "fmi3SetDebugLogging",
        "get": "fmi3GetFloat64",
        "set": "fmi3SetFloat64",
        "save": "fmi3GetFMUState",
        "restore": "fmi3SetFMUState",
        "release": "fmi3FreeFMUState",
        "size": "fmi3SerializedFMUStateSize",
        "serialize": "fmi3SerializeFMUState",
        "deserialize": "fmi3DeserializeFMUState",
        "directional": "fmi3GetDirectionalDerivative",
    }
    _boolean = c_bool
    _platform = fmpy.platform_tuple

    def set_up(self, component, start_time, stop_time, tolerance=None):  # noqa: ARG002 (FMI 2 takes them here)
        """Do nothing: FMI 3 has no such call."""
        return 0

    def enter(self, component, start_time, stop_time, tolerance=None):
        """Call fmi3EnterInitializationMode."""
        stop = (c_bool(stop_time is not None), c_double(stop_time or 0.0))
        given = (c_bool(tolerance is not None), c_double(tolerance or 0.0))
        return self.function("enter")(component, *given, c_double(start_time), *stop)

    def values(self, references, count, values):
        """Value references, their number, values, their number."""
        return references, count, values, count

    def directional(self, unknowns, knowns):
        """Unknowns and knowns with their numbers, seed and sensitivity with theirs."""
        return *unknowns[:2], *knowns[:2], knowns[2], knowns[1], unknowns[2], unknowns[1]


_allocate = ctypes.cast(fmpy.calloc, fmi2CallbackAllocateMemoryTYPE)
_release = ctypes.cast(fmpy.free, fmi2CallbackFreeMemoryTYPE)
_python_logger2 = fmi2CallbackLoggerTYPE(
    lambda environment, _name, status, _category, message: Log.write(environment, status, message)
)
# the proxy of fmpy, in C, formats the printf arguments that Python cannot receive
_proxied = fmi2CallbackFunctions(_python_logger2, _allocate, _release)
addLoggerProxy(byref(_proxied))
_logger2 = _proxied.logger
