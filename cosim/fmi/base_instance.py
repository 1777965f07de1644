"""Instance of an FMU, with the calls common to Co-Simulation and Model Exchange, FMI 2 or 3.

An `Fmu` is loaded for one of the two interface types; `co_simulation.py` and `model_exchange.py` have the calls of one.
"""

import ctypes
from collections.abc import Callable, Iterable, Mapping, Sequence
from ctypes import byref, c_size_t, c_uint, c_void_p
from dataclasses import dataclass, field
from functools import partial
from typing import ClassVar, Literal, Self

import numpy as np

from hfsa.cosim.fmi.access import Access, set_texts, thunk
from hfsa.cosim.fmi.description import Interface
from hfsa.cosim.fmi.fmu import Fmu
from hfsa.cosim.fmi.handle import Handle, State
from hfsa.cosim.fmi.isolation.waiting import INTERRUPTED, LOST, OVERDUE, interruption
from hfsa.cosim.fmi.library import Log, fails
from hfsa.cosim.fmi.step_error import FATAL, StepError, label_of
from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import nearest

Starts = Mapping[str, float | bool | str]
"""Start values by name of the variable."""


@dataclass(frozen=True, eq=False)
class Call:
    """Prepared FMI call: `run()` returns its status; a loop in C uses `function` and `arguments`."""

    instance: "BaseInstance"
    role: str
    function: Callable[..., int] = field(repr=False)
    arguments: tuple = field(repr=False)
    run: Callable[[], int] = field(repr=False)


class BaseInstance:
    """Instance of an FMU, reset before each run (an FMU that cannot reset is instantiated again).

    Attributes:
        interface: interface type of the instance.
        fmu: the FMU.
        name: name in messages.
        time: last communication point [s], `None` before initialization.
    """

    interface: ClassVar[Interface]

    def __init__(self, fmu: Fmu, name: str):
        if fmu.description.interface != self.interface:
            loaded = fmu.description.interface
            raise StructureError(
                f"{name}: {fmu.description.file.name} is loaded for {loaded}, expected {self.interface}"
            )
        self.fmu = fmu
        self.name = name
        self.time: float | None = None
        self._library = fmu.library
        self._log = Log()
        self._component = c_void_p()
        self._states: list[State] = []
        self._named: dict[str, Callable[..., int]] = {}
        self._arrays: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        self.failing_function: str | None = None
        self.interruption: KeyboardInterrupt | None = None
        self._functions = {role: self._library.function(role) for role in self._library.names}
        self._instantiate()

    # Life -------------------------------------------------------------------------------------------------------------

    def enter(self, start_time: float = 0.0, stop_time: float | None = None, values: Starts | None = None):
        """Set up, set start values of parameters, inputs and states (in units, or texts) and enter initialization mode.

        An instance that has run is reset first, which discards all values set before.
        """
        if not self._is_fresh:
            self._reset()
        self._is_fresh = False
        self.time = start_time
        times = start_time, stop_time, self.fmu.description.demands.tolerance
        self._check("setup", self._library.set_up(self._component, *times))
        for array, starts in self._arrays.values():
            array[:] = starts
        for name in values or ():
            self._check_settable(name)
        texts = {name: value for name, value in (values or {}).items() if isinstance(value, str)}
        numbers = {name: float(value) for name, value in (values or {}).items() if name not in texts}
        if texts:
            self._set_texts(texts)
        if numbers:
            self.set(self.handle(numbers), list(numbers.values()))
        self._check("enter", self._library.enter(self._component, *times))

    def exit(self) -> None:
        """Leave initialization mode: the instance is ready to step."""
        self._call("exit")

    def start(self, start_time: float = 0.0, stop_time: float | None = None, values: Starts | None = None):
        """Enter and leave initialization mode, for a single instance."""
        self.enter(start_time, stop_time, values)
        self.exit()

    def close(self) -> None:
        """Free the instance and its saved states; a second call does nothing."""
        self._free()
        self._log.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    # Values -----------------------------------------------------------------------------------------------------------

    def handle(self, names: Iterable[str], values: np.ndarray | None = None) -> Handle:
        """Return a handle of variables that are numbers: value references, and an array (n,) of their values.

        `values` may be a contiguous part of another array: a connected output and input can share it, which saves a
        copy.
        """
        names = tuple(names)
        for name in names:
            self._check_known(name)
        n = len(names)
        references = (c_uint * n)(*[self.fmu.variables[name].reference for name in names])
        if values is None:
            values = np.zeros(n)
        if values.shape != (n,) or values.dtype != np.float64 or not values.flags.c_contiguous:
            raise ValueError(f"values of {self.name} must be a contiguous float64 array of shape ({n},)")
        # the array of references and data_as keep their memory alive
        arguments = self._library.values(references, c_size_t(n), values.ctypes.data_as(c_void_p))
        variables = [self.fmu.variables[name] for name in names]
        access = None if all(v.is_real for v in variables) else Access(self, variables, values)
        return Handle(names, references, values, arguments, access)

    def get(self, handle: Handle) -> np.ndarray:
        """Read the handle's variables into its array and return that array."""
        if handle.names:
            self._use(self.getter(handle)) if handle.access else self._call("get", *handle.arguments)
        return handle.values

    def set(self, handle: Handle, values: Sequence[float] | np.ndarray | None = None) -> None:
        """Set the handle's variables from its array, after writing `values` to it."""
        if values is not None:
            handle.values[:] = values
        if handle.names:
            self._use(self.setter(handle)) if handle.access else self._call("set", *handle.arguments)

    def getter(self, handle: Handle) -> Call:
        """Return the prepared call of `get`."""
        return self._prepared("get", handle)

    def setter(self, handle: Handle) -> Call:
        """Return the prepared call of `set`."""
        return self._prepared("set", handle)

    def served(self, handle: Handle, run: Callable[[], int]) -> Call:
        """Return the prepared call that writes the handle's array by a function of ours in the place of the FMU's."""
        function = thunk(run, self)
        return Call(self, "get", function, (self._component, *handle.arguments), run)

    def check(self, call: Call, status: int) -> None:
        """Raise `StepError` for the status of a prepared call, unless it is ok or a warning."""
        self._check(call.role, status)

    def warning(self, call: Call) -> str:
        """Return the message for a prepared call that returned a warning."""
        at = "" if self.time is None else f" at t = {self.time:.9g} s"
        self._log.take_warnings()
        return f"{self.name}: {self._function_of(call.role)}: warning{at}: {self._log.take() or 'without a message'}"

    def logged_warnings(self) -> tuple[int, str]:
        """Return number and first message of the warnings logged by calls that returned ok, since the last call."""
        count, text = self._log.take_warnings()
        return count, f"{self.name}: logged a warning: {text}" if count else ""

    def directional(self, unknowns: Handle, knowns: Handle) -> Call:
        """Return the prepared call of a directional derivative: seed in the array of knowns, result in the other.

        `StructureError` where the FMU has no directional derivatives.
        """
        if not self.fmu.description.has_derivatives:
            raise self._unsupported("directional derivatives", "providesDirectionalDerivative(s)")
        for handle in (unknowns, knowns):
            if handle.access is not None:
                name = next(name for name in handle.names if not self.fmu.variables[name].is_real)
                kind = self._kind(name)
                raise StructureError(f"{self.name}.{name} has no derivatives: {kind}, expected a scalar Real")
        return self._call_of("directional", *self._library.directional(unknowns.arguments, knowns.arguments))

    def jacobian(self, unknowns: Sequence[str], knowns: Sequence[str]) -> np.ndarray:
        """Return the Jacobian of unknowns with respect to knowns from directional derivatives, (unknowns, knowns)."""
        rows, columns = self.handle(unknowns), self.handle(knowns)
        call = self.directional(rows, columns)
        result = np.zeros((len(rows.names), len(columns.names)))
        if result.size:
            for j in range(len(columns.names)):
                columns.values[:] = 0.0
                columns.values[j] = 1.0
                self.check(call, call.run())
                result[:, j] = rows.values
        return result

    # FMU state --------------------------------------------------------------------------------------------------------

    def save(self) -> State:
        """Return a copy of the complete FMU state, for `restore`."""
        state = self.slot()
        self._call("save", byref(state.pointer))
        return state

    def slot(self) -> State:
        """Return an empty state for a `saver` to write; `StructureError` where the FMU cannot save its state."""
        if not self.fmu.description.can_restore:
            raise self._unsupported("to get and set its state", "canGetAndSetFMUstate")
        self._states.append(State(c_void_p()))
        return self._states[-1]

    def restore(self, state: State) -> None:
        """Restore a saved state, bit for bit."""
        self._call("restore", state.pointer)

    def saver(self, state: State) -> Call:
        """Return the prepared call that saves the present state, replacing a saved one."""
        return self._call_of("save", ctypes.pointer(state.pointer))

    def restorer(self, state: State) -> Call:
        """Return the prepared call of `restore`; it restores what is saved when it runs."""
        return self._call_of("restore", state.pointer)

    def release(self, state: State) -> None:
        """Free a saved state."""
        self._states.remove(state)
        self._free_state(state)

    def serialize(self, state: State) -> bytes:
        """Return a saved state as bytes, for `deserialize` of any instance of the same FMU."""
        if not self.fmu.description.can_serialize:
            raise self._unsupported("to serialize its state", "canSerializeFMUstate")
        size = c_size_t()
        self._call("size", state.pointer, byref(size))
        buffer = ctypes.create_string_buffer(size.value)
        self._call("serialize", state.pointer, buffer, size)
        return buffer.raw

    def deserialize(self, data: bytes) -> State:
        """Return the state of bytes from `serialize`; `StepError` where they are not a state of this FMU."""
        state = State(c_void_p())
        buffer = ctypes.create_string_buffer(data, len(data))
        self._call("deserialize", buffer, c_size_t(len(data)), byref(state.pointer))
        self._states.append(state)
        return state

    # Calls ------------------------------------------------------------------------------------------------------------

    def _call(self, role: str, *arguments) -> None:
        """Call a function; `StepError` as `_check`."""
        status = self._functions[role](self._component, *arguments)
        if status:
            self._check(role, status)

    def _check(self, role: str, status: int) -> None:
        """Raise `StepError` with the log messages for a status worse than a warning, or what interrupted the call."""
        if not fails(status):
            return
        if status == INTERRUPTED:
            raise interruption()
        if self.interruption is not None:
            interrupted, self.interruption = self.interruption, None
            raise interrupted
        messages = [self._log.take()]
        if status in (LOST, OVERDUE):
            messages.insert(0, self._library.ending(self._component))
        if status == FATAL:
            self._library.abandon(self._component)
            self._component.value = None  # the standards allow no further call, not even to free it
        raise StepError(
            self.name, self._function_of(role), label_of(status), self.time, "; ".join(filter(None, messages))
        )

    def _function_of(self, role: str) -> str:
        """Return the FMI function of a role, or that which failed among those of an access."""
        name, self.failing_function = self.failing_function or self._library.names[role], None
        return name

    def _use(self, call: Call) -> None:
        """Run a prepared call; `StepError` as `_check`."""
        if status := call.run():
            self._check(call.role, status)

    def _prepared(self, role: Literal["get", "set"], handle: Handle) -> Call:
        """Return the prepared call that reads or sets the variables of a handle."""
        if handle.access is None:
            return self._call_of(role, *handle.arguments)
        run = handle.access.get if role == "get" else handle.access.set
        return Call(self, role, handle.access.functions[role], (self._component, *handle.arguments), run)

    # Of an access -----------------------------------------------------------------------------------------------------

    @property
    def component(self) -> c_void_p:
        """The instance in the FMU's library."""
        return self._component

    @property
    def version(self) -> int:
        """Version of FMI, 2 or 3."""
        return self.fmu.version

    def function_named(self, name: str) -> Callable[..., int]:
        """Return the FMU's function of a name."""
        if name not in self._named:
            self._named[name] = self._library.named(name)
        return self._named[name]

    def array_of(self, variable: Connector, dtype: np.dtype) -> np.ndarray:
        """Return the values (size,) of the array of an element, one array for all accesses; it begins at its starts."""
        if variable.reference not in self._arrays:
            starts = np.zeros(variable.size, dtype)
            for other in self.fmu.variables.values():
                if other.reference == variable.reference and other.element is not None and other.start is not None:
                    starts[other.element] = other.start
            self._arrays[variable.reference] = (starts.copy(), starts)
        return self._arrays[variable.reference][0]

    def tell(self, message: str) -> None:
        """Add a message to those of the FMU."""
        self._log.messages.append(message)

    def _set_texts(self, texts: Mapping[str, str]) -> None:
        """Set string variables."""
        name = f"fmi{self.fmu.version}SetString"
        pairs = [(self.fmu.variables[variable].reference, text) for variable, text in texts.items()]
        if status := set_texts(self.function_named(name), self._component, self.fmu.version, pairs):
            self.failing_function = name
            self._check("set", status)
            self.failing_function = None

    def _call_of(self, role: str, *arguments) -> Call:
        """Return the prepared call of a function of this instance."""
        function, arguments = self._functions[role], (self._component, *arguments)
        return Call(self, role, function, arguments, partial(function, *arguments))

    def _instantiate(self) -> None:
        """Instantiate the FMU; `StepError` where it returns no instance."""
        demands = self.fmu.description.demands
        if demands.is_once_per_process and self.fmu.holder is not None and not self._library.is_isolated:
            raise demands.second_instance(self.name, self.fmu.holder)
        self._component.value = self._library.open(self.name, self._log)
        if not self._component.value:
            reasons = self._library.ending(self._component), self._log.take(), demands.absent_tool
            message = "; ".join(filter(None, reasons))
            raise StepError(self.name, "instantiation", "no instance", None, message)
        self.fmu.holder = self.name
        self._is_fresh = True
        self._library.enable_logging(self._component)

    def _reset(self) -> None:
        """Reset the instance, or instantiate it again where the FMU cannot reset."""
        self._log.take()
        if not self._component.value or fails(self._functions["reset"](self._component)):
            self._free()
            self._instantiate()

    def _free(self) -> None:
        """Free the instance and its states."""
        for state in self._states:
            self._free_state(state)
        if self._component.value:
            self._library.free(self._component)
            self.fmu.holder = None
        self._component.value = None

    def _free_state(self, state: State) -> None:
        """Free the contents of a saved state, so that another can be saved in it."""
        if state.pointer and self._component:
            self._call("release", byref(state.pointer))
        state.pointer.value = None

    def _check_known(self, name: str) -> None:
        """Raise `StructureError` for a variable that does not exist or is no number."""
        variable = self.fmu.variables.get(name)
        if variable is None:
            raise StructureError(f"{self.name} has no variable {name!r}{nearest(name, self.fmu.variables)}")
        if not variable.is_number:
            raise StructureError(f"{self.name}.{name} is of type {variable.type}, expected a number")

    def _kind(self, name: str) -> str:
        """Return what a variable is that has no derivatives."""
        variable = self.fmu.variables[name]
        return f"it is of type {variable.type}" if variable.element is None else "it is an element of an array"

    def _check_settable(self, name: str) -> None:
        """Raise `StructureError` for a variable that can never be set."""
        if not (name in self.fmu.variables and self.fmu.variables[name].type == "String"):
            self._check_known(name)
        variable = self.fmu.variables[name]
        if (variable.start is None and variable.type != "String") or variable.variability == "constant":
            raise StructureError(
                f"{self.name}.{name} is a {variable.variability} {variable.causality} without a start value; "
                "expected a parameter, an input or a state"
            )

    def _unsupported(self, what: str, flag: str) -> StructureError:
        """Return the error for a capability that the FMU does not declare by its flag."""
        return StructureError(f"{self.name}: {self.fmu.description.file.name} does not offer {what} ({flag})")
