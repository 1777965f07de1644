"""What the loop in C, `native/*.c`, is given: the master's prepared calls, and what is done between them.

Every structure points into the arrays that Python's loop uses as well; whatever it points to is kept alive by the
program or by the calls themselves.
"""

import ctypes
from collections.abc import Sequence
from ctypes import Structure, addressof, c_void_p, pointer
from typing import Any

import numpy as np

from hfsa.cosim.actions import algebraic_loop, iterated
from hfsa.cosim.actions.action import failing_call
from hfsa.cosim.actions.algebraic_loop import AlgebraicLoop
from hfsa.cosim.actions.extrapolation import Extrapolate, History
from hfsa.cosim.actions.feedback import Gains, Lines, Rates
from hfsa.cosim.actions.iterated import IteratedStep
from hfsa.cosim.actions.recording import Watch
from hfsa.cosim.actions.schedule import Runnable
from hfsa.cosim.fmi.co_simulation import Call
from hfsa.cosim.masters.native import structures as c

_KINDS = {
    ("get", 2): c.VALUES_2,
    ("set", 2): c.VALUES_2,
    ("get", 3): c.VALUES_3,
    ("set", 3): c.VALUES_3,
    ("step", 2): c.STEP_2,
    ("step", 3): c.STEP_3,
    ("input_derivatives", 2): c.DERIVATIVES_2,
    ("input_derivatives", 3): c.VALUES_3,
    ("directional", 2): c.DIRECTIONAL_2,
    ("directional", 3): c.DIRECTIONAL_3,
    ("save", 2): c.SAVE,
    ("save", 3): c.SAVE,
    ("restore", 2): c.RESTORE,
    ("restore", 3): c.RESTORE,
}


class Program:
    """Calls for C, in their order.

    Attributes:
        calls: array of them.
    """

    def __init__(self, calls: Sequence[Runnable]):
        self._calls = calls
        self._kept: list[Any] = []
        self._inner: dict[int, tuple[Any, Sequence[Runnable]]] = {}
        self._remembered: dict[int, c.Remember] = {}
        self.calls = self._array(calls)

    def failed(self, index: int) -> Runnable:
        """Return the call of that index, which has told where it failed itself if it is made of several."""
        self._tell(self._calls[index])
        return self._calls[index]

    def _tell(self, call: Runnable) -> None:
        """Tell a call that is made of several which of them its status is of."""
        if isinstance(call, Call) or id(call) not in self._inner:
            return
        structure, inner = self._inner[id(call)]
        if inner:
            self._tell(inner[structure.failing])
            call.failing = failing_call(inner[structure.failing])

    def _array(self, calls: Sequence[Runnable]) -> Any:
        """Return prepared calls as an array of C."""
        return (c.Call * len(calls))(*(self._prepared(call) for call in calls))

    def _prepared(self, call: Runnable) -> c.Call:
        """Return a call as C knows it, by what makes it."""
        match call:
            case Call():
                return self._function(call)
            case History():
                return self._work(c.REMEMBER, self._remember(call))
            case Extrapolate():
                return self._work(c.EXTRAPOLATE, self._extrapolate(call))
            case AlgebraicLoop():
                return self._work(c.LOOP, self._loop(call))
            case IteratedStep():
                return self._work(c.CONVERGE, self._converge(call))
            case Gains():
                return self._work(c.GAINS, self._gains(call))
            case Rates():
                return self._work(c.RATES, self._rates(call))
            case Lines():
                return self._work(c.LINES, self._lines(call))

    def _work(self, kind: int, structure: Structure) -> c.Call:
        """Return the call of a structure that C works through itself."""
        self._kept.append(structure)
        return c.Call(kind=kind, detail=addressof(structure))

    def _function(self, call: Call) -> c.Call:
        """Return a call of one function of an FMU."""
        kind = _KINDS[call.role, call.instance.fmu.version]
        component, *arguments = call.arguments
        function = ctypes.cast(call.function, c_void_p)  # type: ignore[arg-type]
        prepared = c.Call(kind=kind, function=function, component=addressof(component))
        if call.role == "step":
            prepared.is_final = arguments[2].value
        elif call.role == "save":
            prepared.detail = addressof(arguments[0].contents)
        elif call.role == "restore":
            prepared.detail = addressof(arguments[0])
        elif call.role == "directional":
            unknowns, n, knowns, n_knowns, seed, *rest = arguments
            prepared.detail = addressof(self._keep(c.Knowns(addressof(knowns), n_knowns.value, seed.value)))
            result = rest[0] if kind == c.DIRECTIONAL_2 else rest[1]
            prepared.references, prepared.n, prepared.values = addressof(unknowns), n.value, result.value
        else:
            references, n, *rest = arguments
            if kind == c.DERIVATIVES_2:
                orders, *rest = rest
                prepared.detail = addressof(orders)
            prepared.references, prepared.n, prepared.values = addressof(references), n.value, rest[0].value
        return prepared

    def _remember(self, call: History) -> c.Remember:
        """Return the structure of points that several actions share."""
        if id(call) not in self._remembered:
            self._remembered[id(call)] = c.Remember(call.bus.ctypes.data, call.points.ctypes.data, len(call.bus))
        return self._remembered[id(call)]

    def _extrapolate(self, call: Extrapolate) -> Structure:
        structure = c.Extrapolate(
            remember=pointer(self._remember(call.history)),
            places=self._places(call.places),
            weights=self._doubles(call.weights),
            derivatives=call.derivatives.ctypes.data,
            n=len(call.places),
        )
        return self._made_of(call, structure, call.setters)

    def _loop(self, call: AlgebraicLoop) -> Structure:
        structure = c.Loop(
            **_data(call, "bus", "inverse", "scale", "guess", "change"),
            places=self._places(call.places),
            n=len(call.places),
            n_inner=len(call.inner),
            tolerance=algebraic_loop.TOLERANCE,
            rounding=algebraic_loop.ROUNDING,
            passes=algebraic_loop.PASSES,
        )
        return self._made_of(call, structure, [action.call for action in (*call.inner, *call.groups)])

    def _converge(self, call: IteratedStep) -> Structure:
        """Return an iterated step, with all that one pass of it calls."""
        past = call.past
        lines = [
            c.Line(self._places(line.places), line.values.ctypes.data, len(line.places), line.is_able)
            for line in call.lines
        ]
        structure = c.Converge(
            progress=pointer(call.progress),
            past=c.Past(*_data(past, "times", "points").values(), pointer(past.known), len(call.guess)),
            bus=call.wiring.bus.ctypes.data,
            **_data(call, "guess", "change", "nominal"),
            places=self._places(call.places),
            n=len(call.places),
            lines=(c.Line * len(lines))(*lines),
            n_lines=len(lines),
            n_instances=len(call.savers),
            tolerance=iterated.TOLERANCE,
            rounding=iterated.ROUNDING,
            reuse=iterated.REUSE,
            passes=iterated.PASSES[call.method],
        )
        if call.method == "quasi_newton":
            structure.inverse = call.inverse.ctypes.data
        return self._made_of(call, structure, [*call.savers, *call.restorers, *call.tries])

    def _gains(self, call: Gains) -> Structure:
        structure = c.Gains(
            **_data(call, "gains", "derivatives"),
            n=len(call.gains),
            entries=self._places(call.entries),
            places=self._places(call.places),
            n_entries=len(call.entries),
        )
        return self._made_of(call, structure, call.calls)

    def _rates(self, call: Rates) -> Structure:
        structure = c.Rates(
            **_data(call, "rates", "fed", "result"),
            feeding=self._places(call.feeding),
            n_feeding=len(call.feeding),
            places=self._places(call.places),
            n=len(call.places),
        )
        return self._made_of(call, structure, call.calls)

    def _lines(self, call: Lines) -> Structure:
        structure = c.Lines(
            **_data(call, "bus", "before", "rates", "slopes", "gains"),
            places=self._places(call.places),
            is_known=self._places(call.is_known),
            n=len(call.places),
            own=self._places(call.own),
            n_own=len(call.own),
        )
        return self._made_of(call, structure, [call.setter])

    def _made_of(self, call: Runnable, structure: Any, inner: Sequence[Runnable]) -> Structure:
        """Return the structure of a call with the calls that it is made of."""
        structure.calls, structure.n_calls = self._array(inner), len(inner)
        self._inner[id(call)] = structure, inner
        return structure

    def _places(self, places: np.ndarray) -> int:
        """Return the address of places, which are kept alive."""
        return self._keep(np.ascontiguousarray(places, dtype=np.uintp)).ctypes.data

    def _doubles(self, values: np.ndarray) -> int:
        """Return the address of numbers, which are kept alive."""
        return self._keep(np.ascontiguousarray(values, dtype=float)).ctypes.data

    def _keep(self, kept: Any) -> Any:
        """Keep something alive as long as the program."""
        self._kept.append(kept)
        return kept


def _data(owner: Any, *names: str) -> dict[str, int]:
    """Return where arrays of an object are, by the name that they have in C as well."""
    return {name: getattr(owner, name).ctypes.data for name in names}


def watched(watch: Watch) -> c.Watch:
    """Return a watch for C, which must not outlive it."""
    return c.Watch(*(array.ctypes.data for array in (watch.values, watch.low, watch.high)), len(watch.values))
