"""Access to variables that the functions for real numbers do not serve: other types, and elements of arrays.

    access = Access(instance, variables, values)      # values: float64, one per variable
    access.get(), access.set()                        # -> FMI status

All values are real numbers on this side, false and true 0 and 1. A whole number that a double does not hold, and a real
number that its variable does not take, are errors with a message; nothing is rounded but to Float32. The array of an
element is set as a whole, the other elements as they were set last, or at their start values.

`call` is the same as a prepared call, with a function that the stepping loop in C can call as it calls those of an FMU.
"""

import ctypes
from collections.abc import Callable, Sequence
from ctypes import CFUNCTYPE, c_int, c_size_t, c_uint, c_void_p
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from hfsa.cosim.fmi.library import fails
from hfsa.cosim.systems.connectors import Connector

_FUNCTIONS = {2: {"Enumeration": "Integer"}, 3: {"Enumeration": "Int64"}}
"""Name of a type in the functions of FMI, where it is not that of the type."""

_DTYPES = {
    "Real": np.float64,
    "Float64": np.float64,
    "Float32": np.float32,
    "Integer": np.int32,
    **{f"{sign}{bits}": np.dtype(f"{sign}{bits}".lower()) for sign in ("Int", "UInt") for bits in (8, 16, 32, 64)},
}
"""Type of the values of a function, by the name of the function's type; a Boolean depends on the version."""

_LARGEST = 2**53
"""Whole numbers above it are not all doubles."""

_ERROR = 3

_THUNKS = {
    2: CFUNCTYPE(c_int, c_void_p, c_void_p, c_size_t, c_void_p),
    3: CFUNCTYPE(c_int, c_void_p, c_void_p, c_size_t, c_void_p, c_size_t),
}
"""Types of the functions for real numbers, by version."""


class Owner(Protocol):
    """The instance whose variables an access serves.

    Attributes:
        failing_function: name of the FMI function that returned the last status other than ok.
        interruption: what interrupted a call from C, until its status is checked.
    """

    failing_function: str | None
    interruption: KeyboardInterrupt | None

    @property
    def component(self) -> c_void_p:
        """The instance in the FMU's library."""
        ...

    @property
    def version(self) -> int:
        """Version of FMI, 2 or 3."""
        ...

    def function_named(self, name: str) -> Callable[..., int]:
        """Return the FMU's function of a name."""
        ...

    def array_of(self, variable: Connector, dtype: np.dtype) -> np.ndarray:
        """Return the values (size,) of the array of an element."""
        ...

    def tell(self, message: str) -> None:
        """Add a message to those of the FMU."""
        ...


@dataclass(frozen=True, eq=False)
class _Piece:
    """Variables that one call of one function serves.

    Attributes:
        type: type in the name of the function.
        names: names of the variables; `places` are theirs in the values of the access, `elements` in the buffer.
        buffer: values of the function; `arguments` those of the call after the component.
    """

    type: str
    names: Sequence[str]
    places: np.ndarray
    elements: np.ndarray
    buffer: np.ndarray
    arguments: tuple


class Access:
    """Values of variables of any type of number, (n,), read and set together."""

    def __init__(self, instance: Owner, variables: Sequence[Connector], values: np.ndarray):
        self._instance, self._values, self._version = instance, values, instance.version
        groups: dict[tuple[str, int | None], list[int]] = {}
        for place, variable in enumerate(variables):
            kind = _FUNCTIONS[self._version].get(variable.type, variable.type)
            groups.setdefault((kind, None if variable.element is None else variable.reference), []).append(place)
        self._pieces = [
            self._piece(kind, [variables[i] for i in places], places) for (kind, _), places in groups.items()
        ]
        # C calls these; they live as long as the access
        self.functions = {
            "get": thunk(self.get, instance),
            "set": thunk(self.set, instance),
        }

    def get(self) -> int:
        """Read the variables into the values; return the status."""
        warning = 0
        for piece in self._pieces:
            status = self._call("Get", piece)
            if fails(status):
                return status
            warning = warning or status
            found = piece.buffer[piece.elements]
            if piece.type in ("Int64", "UInt64"):
                for name, value in zip(piece.names, found.tolist(), strict=True):
                    if abs(value) > _LARGEST:
                        message = f"{name} is {value}, beyond 2^53, where a double skips whole numbers"
                        return self._refuse("Get", piece, message)
            self._values[piece.places] = found
        return warning

    def set(self) -> int:
        """Set the variables from the values; return the status."""
        warning = 0
        for piece in self._pieces:
            numbers = self._values[piece.places]
            if message := self._misfit(piece, numbers):
                return self._refuse("Set", piece, message)
            piece.buffer[piece.elements] = numbers
            status = self._call("Set", piece)
            if fails(status):
                return status
            warning = warning or status
        return warning

    def _misfit(self, piece: _Piece, numbers: np.ndarray) -> str:
        """Return the sentence on the first number that a variable does not take; empty where all fit."""
        if piece.type == "Boolean":
            fits, expected = np.isin(numbers, (0.0, 1.0)), "0 or 1"
        elif piece.buffer.dtype.kind in "iu":
            limits = np.iinfo(piece.buffer.dtype)
            fits = (numbers == np.rint(numbers)) & (numbers >= limits.min) & (numbers <= limits.max)
            fits &= np.abs(numbers) <= _LARGEST
            expected = f"a whole number of type {piece.type}"
        else:
            return ""
        wrong = np.flatnonzero(~fits)
        return f"{piece.names[wrong[0]]} is set to {numbers[wrong[0]]:.9g}, expected {expected}" if wrong.size else ""

    def _call(self, verb: str, piece: _Piece) -> int:
        """Call the function of a piece; return the status."""
        name = f"fmi{self._version}{verb}{piece.type}"
        status = self._instance.function_named(name)(self._instance.component, *piece.arguments)
        if status:
            self._instance.failing_function = name
        return status

    def _refuse(self, verb: str, piece: _Piece, message: str) -> int:
        """Leave a message for the error that follows; return its status."""
        self._instance.failing_function = f"fmi{self._version}{verb}{piece.type}"
        self._instance.tell(message)
        return _ERROR

    def _piece(self, kind: str, variables: Sequence[Connector], places: Sequence[int]) -> _Piece:
        """Return the piece of variables of one type, or of elements of one array."""
        dtype = np.dtype(_DTYPES[kind]) if kind != "Boolean" else np.dtype(np.int32 if self._version == 2 else np.bool_)
        first = variables[0]
        if first.element is None:
            references, buffer = [v.reference for v in variables], np.zeros(len(variables), dtype)
            elements = range(len(variables))
        else:
            references, buffer = [first.reference], self._instance.array_of(first, dtype)
            elements = [v.element for v in variables]
        own = (c_uint * len(references))(*references)
        arguments: tuple = (own, c_size_t(len(references)), buffer.ctypes.data_as(c_void_p))
        if self._version == 3:
            arguments = (*arguments, c_size_t(len(buffer)))
        return _Piece(kind, [v.name for v in variables], np.array(places), np.array(list(elements)), buffer, arguments)


def thunk(run: Callable[[], int], owner: Owner) -> Any:
    """Return a call as a function of C, of the type of those for real numbers.

    No exception passes through C: what it raises becomes an error status, and a message; an interruption is kept by the
    owner, which raises it for that status.
    """

    def called(*_: Any) -> int:
        """Return the status of the call."""
        try:
            return run()
        except KeyboardInterrupt as interruption:
            owner.interruption = interruption
        except Exception as error:
            owner.tell(str(error))
        return _ERROR

    return _THUNKS[owner.version](called)


def set_texts(function: Callable[..., int], component: c_void_p, version: int, texts: Sequence[tuple[int, str]]) -> int:
    """Set string variables, (value reference, text) each; return the status."""
    n = len(texts)
    references = (c_uint * n)(*[reference for reference, _ in texts])
    values = (ctypes.c_char_p * n)(*[text.encode() for _, text in texts])
    more = (c_size_t(n),) if version == 3 else ()
    return function(component, references, c_size_t(n), values, *more)
