"""What `runtime/step.c` is given: the master's prepared calls, and what is done between them, as structures of C.

Every structure points into the arrays that Python's loop uses as well; whatever it points to is kept alive by the
program or by the calls themselves.
"""

import ctypes
from collections.abc import Sequence
from ctypes import POINTER, Structure, addressof, c_double, c_int, c_longlong, c_size_t, c_void_p
from typing import Any, ClassVar

import numpy as np

from hfsa.cosim.actions import algebraic_loop
from hfsa.cosim.actions.algebraic_loop import AlgebraicLoop
from hfsa.cosim.actions.extrapolation import Extrapolate, Remember
from hfsa.cosim.actions.iterated import Converge
from hfsa.cosim.actions.recording import Watch
from hfsa.cosim.actions.schedule import Runnable
from hfsa.cosim.instance import Call


class _Call(Structure):
    _fields_: ClassVar = [
        ("kind", c_int),
        ("function", c_void_p),
        ("component", c_void_p),
        ("references", c_void_p),
        ("n", c_size_t),
        ("values", c_void_p),
        ("detail", c_void_p),
    ]


class _Remember(Structure):
    _fields_: ClassVar = [("bus", c_void_p), ("points", c_void_p), ("n", c_size_t)]


class _Extrapolate(Structure):
    _fields_: ClassVar = [
        ("remember", POINTER(_Remember)),
        ("places", c_void_p),
        ("weights", c_void_p),
        ("derivatives", c_void_p),
        ("n", c_size_t),
        ("setters", POINTER(_Call)),
        ("n_setters", c_size_t),
        ("failing", c_size_t),
    ]


class _Loop(Structure):
    _fields_: ClassVar = [
        ("bus", c_void_p),
        ("places", c_void_p),
        ("inverse", c_void_p),
        ("scale", c_void_p),
        ("guess", c_void_p),
        ("change", c_void_p),
        ("n", c_size_t),
        ("calls", POINTER(_Call)),
        ("n_inner", c_size_t),
        ("n_calls", c_size_t),
        ("failing", c_size_t),
        ("tolerance", c_double),
        ("rounding", c_double),
        ("passes", c_int),
    ]


class _Watch(Structure):
    _fields_: ClassVar = [("values", c_void_p), ("low", c_void_p), ("high", c_void_p), ("n", c_size_t)]


class Cycle(Structure):
    """`Cycle` of step.c."""

    _fields_: ClassVar = [
        ("calls", POINTER(_Call)),
        ("exchange", c_size_t),
        ("record", c_size_t),
        ("end", c_size_t),
        ("bus", _Watch),
        ("row", _Watch),
        ("start_time", c_double),
        ("step_size", c_double),
        ("every", c_longlong),
    ]


class Run(Structure):
    """`Run` of step.c."""

    _fields_: ClassVar = [
        ("count", c_longlong),
        ("next", c_size_t),
        ("phase", c_int),
        ("status", c_int),
        ("time", c_void_p),
        ("values", c_void_p),
        ("rows", c_size_t),
        ("capacity", c_size_t),
    ]


_KINDS = {
    ("get", 2): 0,
    ("set", 2): 0,
    ("get", 3): 1,
    ("set", 3): 1,
    ("step", 2): 2,
    ("step", 3): 3,
    ("input_derivatives", 2): 4,
    ("input_derivatives", 3): 1,
}
_REMEMBER, _EXTRAPOLATE, _LOOP = 5, 6, 7


class Program:
    """Calls for C, in their order.

    Attributes:
        calls: array of them.
    """

    def __init__(self, calls: Sequence[Runnable]):
        self._calls = calls
        self._kept: list[Any] = []
        self._inner: dict[int, tuple[Structure, Sequence[Call]]] = {}
        self._remembered: dict[int, Structure] = {}
        self.calls = self._array(calls)

    def failed(self, index: int) -> Runnable:
        """Return the call of that index, which has told where it failed itself if it is made of several."""
        call = self._calls[index]
        if isinstance(call, Extrapolate | AlgebraicLoop):
            structure, inner = self._inner[id(call)]
            call.failing = inner[structure.failing]
        return call

    def _array(self, calls: Sequence[Runnable]) -> Any:
        return (_Call * len(calls))(*(self._prepared(call) for call in calls))

    def _prepared(self, call: Runnable) -> _Call:
        match call:
            case Remember():
                return _Call(kind=_REMEMBER, detail=addressof(self._remember(call)))
            case Extrapolate():
                return _Call(kind=_EXTRAPOLATE, detail=addressof(self._extrapolate(call)))
            case AlgebraicLoop():
                return _Call(kind=_LOOP, detail=addressof(self._loop(call)))
            case Converge():
                raise TypeError("an iterated step is made in Python")
        function = ctypes.cast(call.function, c_void_p)  # type: ignore[arg-type]
        kind = _KINDS[call.role, call.instance.fmu.version]
        prepared = _Call(kind, function, addressof(call.arguments[0]))
        if call.role == "step":
            return prepared
        references, n, *rest = call.arguments[1:]
        if kind == _KINDS["input_derivatives", 2]:
            orders, *rest = rest
            prepared.detail = addressof(orders)
        prepared.references, prepared.n, prepared.values = addressof(references), n.value, rest[0].value
        return prepared

    def _remember(self, call: Remember) -> Structure:
        if id(call) not in self._remembered:
            self._remembered[id(call)] = _Remember(call.bus.ctypes.data, call.points.ctypes.data, len(call.bus))
        return self._remembered[id(call)]

    def _extrapolate(self, call: Extrapolate) -> Structure:
        structure = _Extrapolate(
            remember=ctypes.pointer(self._remember(call.remember)),
            places=self._places(call.places),
            weights=self._doubles(call.weights),
            derivatives=call.derivatives.ctypes.data,
            n=len(call.places),
            setters=self._array(call.setters),
            n_setters=len(call.setters),
        )
        return self._keep(call, structure, call.setters)

    def _loop(self, call: AlgebraicLoop) -> Structure:
        inner = [action.call for action in (*call.inner, *call.groups)]
        arrays = {name: getattr(call, name).ctypes.data for name in ("bus", "inverse", "scale", "guess", "change")}
        structure = _Loop(
            **arrays,
            places=self._places(call.places),
            n=len(call.places),
            calls=self._array(inner),
            n_inner=len(call.inner),
            n_calls=len(inner),
            tolerance=algebraic_loop.TOLERANCE,
            rounding=algebraic_loop.ROUNDING,
            passes=algebraic_loop.PASSES,
        )
        return self._keep(call, structure, inner)

    def _keep(self, call: Extrapolate | AlgebraicLoop, structure: Structure, inner: Sequence[Call]) -> Structure:
        self._inner[id(call)] = structure, inner
        return structure

    def _places(self, places: np.ndarray) -> int:
        self._kept.append(np.ascontiguousarray(places, dtype=np.uintp))
        return self._kept[-1].ctypes.data

    def _doubles(self, values: np.ndarray) -> int:
        self._kept.append(np.ascontiguousarray(values, dtype=float))
        return self._kept[-1].ctypes.data


def watched(watch: Watch) -> _Watch:
    """Return a watch for C, which must not outlive it."""
    return _Watch(*(array.ctypes.data for array in (watch.values, watch.low, watch.high)), len(watch.values))
