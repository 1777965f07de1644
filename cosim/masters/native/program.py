"""What the loop in C, `native/*.c`, is given: the master's prepared calls, and what is done between them.

Every structure points into the arrays that Python's loop uses as well; whatever it points to is kept alive by the
program or by the calls themselves. Which structures there are, of which fields and types, is for the headers to say.
"""

import ctypes
from collections.abc import Callable, Mapping, Sequence
from ctypes import addressof, c_void_p
from dataclasses import fields
from typing import Any

import numpy as np

from hfsa.cosim.actions.action import CompositeAction, failing_call
from hfsa.cosim.actions.iterated import Progress
from hfsa.cosim.actions.schedule import Runnable
from hfsa.cosim.fmi.co_simulation import Call
from hfsa.cosim.masters.native.details import detail
from hfsa.cosim.masters.native.library import Library

_PERFORMERS = {
    "get": {2: "hfsa_values_2", 3: "hfsa_values_3"},
    "set": {2: "hfsa_values_2", 3: "hfsa_values_3"},
    "step": {2: "hfsa_step_2", 3: "hfsa_step_3"},
    "input_derivatives": {2: "hfsa_input_derivatives_2", 3: "hfsa_values_3"},
    "directional": {2: "hfsa_directional_2", 3: "hfsa_directional_3"},
    "save": {2: "hfsa_save", 3: "hfsa_save"},
    "restore": {2: "hfsa_restore", 3: "hfsa_restore"},
}
"""What makes a call of an FMU, by its role and the version of FMI: fmi.h."""

_PROGRESS = tuple(field.name for field in fields(Progress))


class Program:
    """Calls for C, in their order.

    Attributes:
        calls: array of them.
    """

    def __init__(self, calls: Sequence[Runnable], library: Library):
        self._calls, self._library, self._ffi, self._c = calls, library, library.ffi, library.c
        self._kept: list[Any] = []
        self._work_of: dict[int, tuple[Any, Any]] = {}
        self._inner: dict[int, tuple[Any, Sequence[Runnable]]] = {}
        self._progress: list[tuple[Progress, Any]] = []
        self.calls = self._array(calls)

    def run(self, function: Callable[..., int], *arguments: Any) -> int:
        """Call C, which begins steps anew, but takes over what iterations keep from one step to the next."""
        for progress, shared in self._progress:
            shared.passes, shared.inverse_step = progress.passes, progress.inverse_step
        try:
            return function(*arguments)
        finally:
            for progress, shared in self._progress:
                progress.passes = shared.passes

    def failed(self, index: int) -> Runnable:
        """Return the call of that index, which Python may report or go on with: it knows how far C has come with it."""
        for progress, shared in self._progress:
            for name in _PROGRESS:
                setattr(progress, name, getattr(shared, name))
        self._tell(self._calls[index])
        return self._calls[index]

    def structure(self, name: str, fields: Mapping[str, Any]) -> Any:
        """Return a new structure of the headers: arrays, actions and other structures are pointed to, or copied in."""
        made = self._keep(self._ffi.new(f"{name} *"))
        self._fill(made, name, fields)
        return made

    def _tell(self, call: Runnable) -> None:
        """Tell a call that is made of several which of them its status is of."""
        if isinstance(call, Call) or id(call) not in self._inner:
            return
        structure, calls = self._inner[id(call)]
        failing = calls[structure.failing]
        self._tell(failing)
        call.failing = failing_call(failing)

    # Calls ------------------------------------------------------------------------------------------------------------

    def _array(self, calls: Sequence[Runnable]) -> Any:
        """Return prepared calls as an array of C."""
        array = self._keep(self._ffi.new("Call[]", len(calls)))
        for made, call in zip(array, calls, strict=True):
            if isinstance(call, Call):
                self._call_function(made, call)
            else:
                made.perform, made.detail = self._work(call)
        return array

    def _work(self, action: CompositeAction) -> tuple[Any, Any]:
        """Return what performs an action and the structure that it takes; several others may share it."""
        if id(action) not in self._work_of:
            performer, name, fields, calls = detail(action)
            made = self.structure(name, fields)
            if calls:
                made.calls, made.n_calls = self._array(calls), len(calls)
                self._inner[id(action)] = made, calls
            self._work_of[id(action)] = getattr(self._c, performer), made
        return self._work_of[id(action)]

    def _call_function(self, made: Any, call: Call) -> None:
        """Prepare a call of one function of an FMU."""
        cast, kinds, version = self._ffi.cast, self._library.fields("Call"), call.instance.fmu.version
        component, *arguments = call.arguments
        made.perform = getattr(self._c, _PERFORMERS[call.role][version])
        made.function = cast(kinds["function"], c_void_p.from_buffer(call.function).value)  # type: ignore[arg-type]
        made.component = cast(kinds["component"], addressof(component))
        if call.role == "step":
            made.is_final = arguments[2].value
        elif call.role == "save":
            made.detail = cast(kinds["detail"], addressof(arguments[0].contents))
        elif call.role == "restore":
            made.detail = cast(kinds["detail"], addressof(arguments[0]))
        else:
            references, n, *rest = arguments
            if call.role == "directional":
                knowns, n_knowns, seed, *rest = rest if version == 2 else (*rest[:3], *rest[4:])
                made.detail = self._knowns(knowns, n_knowns.value, seed.value)
            elif call.role == "input_derivatives" and version == 2:
                orders, *rest = rest
                made.detail = cast(kinds["detail"], addressof(orders))
            made.references, made.n = cast(kinds["references"], addressof(references)), n.value
            made.values = cast(kinds["values"], rest[0].value or 0)

    def _knowns(self, references: ctypes.Array, n: int, seed: int | None) -> Any:
        """Return what an FMU is differentiated by."""
        cast, kinds = self._ffi.cast, self._library.fields("Knowns")
        at = cast(kinds["references"], addressof(references))
        return self.structure("Knowns", {"references": at, "n": n, "seed": cast(kinds["seed"], seed or 0)})

    # Structures -------------------------------------------------------------------------------------------------------

    def _fill(self, made: Any, name: str, fields: Mapping[str, Any]) -> None:
        """Fill in a structure of that name."""
        kinds = self._library.fields(name)
        for field, value in fields.items():
            if isinstance(value, dict):
                self._fill(getattr(made, field), kinds[field].cname, value)
            else:
                setattr(made, field, self._pointed(value, kinds[field]))

    def _pointed(self, value: Any, kind: Any) -> Any:
        """Return what a field of a kind holds: a number as it is, or where something is."""
        if isinstance(value, int | float):
            return value
        if isinstance(value, np.ndarray):
            return self._numbers(value, kind)
        if isinstance(value, CompositeAction):
            return self._work(value)[1]
        if isinstance(value, Progress):
            self._progress.append((value, self.structure(kind.item.cname, {})))
            return self._progress[-1][1]
        if isinstance(value, list):
            array = self._keep(self._ffi.new(f"{kind.item.cname}[]", len(value)))
            for made, fields in zip(array, value, strict=True):
                self._fill(made, kind.item.cname, fields)
            return array
        return value

    def _numbers(self, values: np.ndarray, kind: Any) -> Any:
        """Return where the numbers of an array are: its own, or those of a copy where they are places."""
        array, dtype = self._library.arrays[kind]
        if values.dtype != dtype:
            if dtype != np.uintp:
                raise TypeError(f"an array of {values.dtype} where the headers have {kind.cname}")
            values = values.astype(dtype, "C")
        return self._keep(self._ffi.from_buffer(array, values))

    def _keep(self, kept: Any) -> Any:
        """Keep something alive as long as the program."""
        self._kept.append(kept)
        return kept
