"""Driven inputs: inputs that a signal feeds in place of a connection, with their derivatives where the FMU takes them.

    drive = Drive(wiring, {"mass.base.position": signal})
    point = drive.values(drive.ahead)      # sets the values of a communication point
    step = drive.slopes(drive.ahead)       # sets the derivatives for a step that begins there

A signal is known ahead of time, so over a step from t to t + H a driven input is not extrapolated: it follows the line
from u(t) to u(t + H), or where the FMU takes a second derivative the parabola through u(t), u(t + H / 2), u(t + H),

    d1 H = u1 - u0                         d1 H = -3 u0 + 4 u_m - u1,     d2 H^2 = 4 (u0 - 2 u_m + u1)

and where it takes no derivative u(t + H / 2) throughout. An algorithm that holds its inputs holds u(t). At a jump u(t)
is the value after it and u(t + H) the value before. Inputs that take the rate, the acceleration and the jerk of a
driven input (`connectors.derivative_inputs`) get the exact derivatives of its signal, unless something else feeds them.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.actions.feed import Ahead, Now
from hfsa.cosim.actions.feedback import Rates
from hfsa.cosim.actions.schedule import Action
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.signals.drive import Signal
from hfsa.cosim.systems.connectors import derivative_inputs
from hfsa.cosim.systems.errors import StructureError

SAME = 1e-9
"""Fraction of a step within which a jump and a communication point are the same instant."""

Rows = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Function from times [s], (n,), to what is fed at each, (n, width)."""

Feeder = Callable[[Rows, NDArray[np.float64], Sequence], Ahead | Now]
"""Function that returns the action which writes rows into an array and makes calls."""


@dataclass(frozen=True)
class Driven:
    """One driven input: `order` is the derivative of the signal that it takes, 0 for the value."""

    instance: str
    variable: str
    signal: Signal
    order: int

    @property
    def name(self) -> str:
        """Full name of the input."""
        return f"{self.instance}.{self.variable}"


class Drive:
    """The driven inputs of a system, which are not connected.

    Attributes:
        inputs: all of them, the derivatives included, those of one instance together.
        array: their present values, (n,).
        warnings: a sentence for each instance whose driven inputs are held over a step, as it takes no derivatives.

    Raises:
        StructureError: an input that a connection feeds, or that is no input.
    """

    def __init__(self, wiring: Wiring, signals: Mapping[str, Signal]):
        self._wiring = wiring
        found = driven_inputs(wiring, signals)
        order = list(wiring.instances)
        self.inputs = sorted(found, key=lambda one: order.index(one.instance))
        self.array = np.zeros(len(self.inputs))
        self.signals = dict(signals)
        self.warnings: dict[str, str] = {}

    @property
    def names(self) -> list[str]:
        """Full names of all driven inputs."""
        return [one.name for one in self.inputs]

    def present(self, name: str) -> NDArray[np.float64]:
        """Return the part of `array` that has the value of an input, (1,)."""
        place = self.names.index(name)
        return self.array[place : place + 1]

    def starts(self, time: float) -> dict[str, float]:
        """Return the values at the start [s] by full name."""
        return dict(zip(self.names, self.at(np.array([time]))[0].tolist(), strict=True))

    def at(self, time: NDArray[np.float64], side: float = 1.0) -> NDArray[np.float64]:
        """Return the values at times [s], (times, n), after a jump, or with `side` -1 before it."""
        return self._of(self.inputs, time, side * self._margin(time))

    def within(self, time: NDArray[np.float64], begin: float, end: float) -> NDArray[np.float64]:
        """Return the values at times [s], (times, n), by the pieces in force between two jumps."""
        margin = self._margin(time)
        return self._of(self.inputs, time, np.clip(time, begin + margin, end - margin) - time)

    def is_rough(self, begin: float, end: float) -> bool:
        """Whether an input is held over steps, or a signal jumps or bends between two times [s]."""
        return bool(self.warnings) or any(len(signal.breaks(begin, end)) for signal in self.signals.values())

    def next_break(self, after: float) -> float:
        """Return the time [s] of the next jump of a value or a rate after a time, infinite if there is none."""
        later = after + float(self._margin(np.array([after]))[0])
        found = (signal.breaks(later, np.inf) for signal in self.signals.values())
        return min((float(times[0]) for times in found if len(times)), default=np.inf)

    def values(self, feeder: Feeder) -> Ahead | Now:
        """Return the action that sets the values of all driven inputs at a communication point."""
        calls = []
        for instance, places in self._places(self.inputs).items():
            it = self._wiring.instances[instance]
            names = [self.inputs[i].variable for i in places]
            calls.append(it.setter(it.handle(names, self.array[places[0] : places[-1] + 1])))
        action = feeder(self.at, self.array, calls)
        ends = {one.name for one in self.inputs}
        action.affected = self._wiring.following(ends)
        return action

    def slopes(self, feeder: Feeder) -> list[Ahead | Now]:
        """Return the actions that let the inputs of an instance move over the next step, one for each instance."""
        moving = [o for o in self.inputs if self._wiring.connectors[o.instance][o.variable].is_real]
        actions: list[Ahead | Now] = []
        for instance, places in self._places(moving).items():
            description = self._wiring.instances[instance].fmu.description
            if not description.is_sampled:
                actions.append(self._moved(instance, [moving[i] for i in places], feeder))
        return actions

    def with_rates(self, step: Iterable[Action], feeder: Feeder) -> list[Action]:
        """Return the actions of a step in which rates of outputs contain those of the driven inputs."""
        found: list[Action] = []
        for action in step:
            own = [one for one in self.inputs if isinstance(action, Rates) and one.instance == action.group.instance]
            own = [one for one in own if self._wiring.connectors[one.instance][one.variable].is_real]
            if isinstance(action, Rates) and own:
                action = action.again([one.variable for one in own])
                found.append(feeder(partial(self._secants, own), action.driven, []))
            found.append(action)
        return found

    def _moved(self, instance: str, moving: list[Driven], feeder: Feeder) -> Ahead | Now:
        """Return the action that lets inputs of one instance move over the next step."""
        it, names = self._wiring.instances[instance], [one.variable for one in moving]
        n = len(moving)
        array = np.zeros(2 * n)
        if not it.has_input_derivatives(names, 1):
            self.warnings[instance] = (
                f"{instance}: {it.fmu.description.file.name} takes no derivatives of its inputs: its driven inputs are "
                "held over each step at their value in the middle, and outputs that follow them at once are late"
            )
            middle = it.handle(names)
            return feeder(partial(self._middles, moving), middle.values, [it.setter(middle)])
        orders = 2 if it.has_input_derivatives(names, 2) else 1
        parts = [it.handle(names, array[k * n : (k + 1) * n]) for k in range(orders)]
        calls = [it.derivative_setter(part, k + 1) for k, part in enumerate(parts)]
        rows = self._parabolas if orders == 2 else self._lines
        return feeder(partial(rows, moving), array, calls)

    @property
    def _step(self) -> float:
        """Present step size [s]."""
        return self._wiring.step_size.value

    def _middles(self, moving: Sequence[Driven], time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values in the middle of steps that begin at times, (times, n)."""
        return self._of(moving, time + self._step / 2, np.zeros(len(time)))

    def _parabolas(self, moving: Sequence[Driven], time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the first and second derivatives over steps that begin at times, (times, 2 n)."""
        h = self._step
        u0, u1 = self._ends(moving, time)
        um = self._middles(moving, time)
        return np.hstack([(-3 * u0 + 4 * um - u1) / h, 4 * (u0 - 2 * um + u1) / (h * h)])

    def _lines(self, moving: Sequence[Driven], time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the slopes over steps that begin at times, and zeros, (times, 2 n)."""
        slopes = self._secants(moving, time)
        return np.hstack([slopes, 0 * slopes])

    def _secants(self, moving: Sequence[Driven], time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the slopes over steps that begin at times, (times, n)."""
        u0, u1 = self._ends(moving, time)
        return (u1 - u0) / self._step

    def _ends(self, moving: Sequence[Driven], time: NDArray[np.float64]) -> list[NDArray[np.float64]]:
        """Return the values at the beginning and at the end of steps, within them, (times, n) each."""
        margin = self._margin(time)
        return [self._of(moving, time, margin), self._of(moving, time + self._step, -margin)]

    def _margin(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how near to times two instants are the same [s], (times,)."""
        return np.maximum(SAME * self._step, 8 * np.spacing(np.abs(time)))

    @staticmethod
    def _of(inputs: Sequence[Driven], time: NDArray[np.float64], shift: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what inputs take at times, by the pieces in force a `shift` [s] later, (times, inputs)."""
        found = np.zeros((len(time), len(inputs)))
        known: dict[int, NDArray[np.float64]] = {}
        for i, one in enumerate(inputs):
            if id(one.signal) not in known:
                try:
                    known[id(one.signal)] = one.signal.derivatives(time, shift)
                except ValueError as error:
                    raise StepError(one.instance, one.variable, "not driven", float(time[0]), str(error)) from error
            found[:, i] = known[id(one.signal)][one.order]
        return found

    @staticmethod
    def _places(inputs: Sequence[Driven]) -> dict[str, list[int]]:
        """Return the consecutive places of the inputs of each instance."""
        places: dict[str, list[int]] = {}
        for i, one in enumerate(inputs):
            places.setdefault(one.instance, []).append(i)
        return places


def driven_inputs(wiring: Wiring, signals: Mapping[str, Signal]) -> list[Driven]:
    """Return the inputs that signals feed, by full name, and those that take their derivatives.

    Raises `StructureError` for a name that is no input, or is fed by a connection.
    """
    fed = {connection.end for connection in wiring.connections} | set(signals)
    found = []
    for name, signal in signals.items():
        instance, variable = wiring.split(name)
        known = wiring.connectors[instance]
        if variable not in known or known[variable].causality != "input":
            raise StructureError(f"{name} is no input, and cannot be driven")
        if any(connection.end == name for connection in wiring.connections):
            raise StructureError(f"{name} is fed by a connection and cannot be driven")
        found.append(Driven(instance, variable, signal, 0))
        companions = list(derivative_inputs(known, variable).items())
        orders = ("rate", "acceleration", "jerk")
        for port, other in companions:
            order = orders.index(port) + 1
            if f"{instance}.{other}" not in fed and order <= signal.known:
                found.append(Driven(instance, other, signal, order))
    return found
