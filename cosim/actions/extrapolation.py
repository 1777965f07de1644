"""Inputs that move within a step: polynomials through what the outputs that feed them were at communication points.

From t_k on an input is u(t_k + s) = u_k + d1 s + d2 s^2 / 2 for a step of H. With values b at t_k + H of an instance
that has stepped already, h0 at t_k, h1 at t_k - H and h2 at t_k - 2 H:

    order  not yet stepped                            stepped already
    1      d1 H = h0 - h1                             d1 H = b - h0
    2      d1 H = (3 h0 - 4 h1 + h2) / 2              d1 H = (b - h1) / 2
           d2 H^2 = h0 - 2 h1 + h2                    d2 H^2 = b - 2 h0 + h1

Sampled outputs are held. What follows them directly jumps at ticks: it is held too, or, of an instance that has stepped
already, a straight line. h0 is taken after the ticks at t_k, so that no line goes across one.

At the start h1 and h2 are made of the FMUs' output derivatives, passed on in feedthrough order; where an FMU has none
the first step holds its outputs.
"""

from collections.abc import Collection, Sequence
from ctypes import c_double
from dataclasses import dataclass, field

import numpy as np

from hfsa.cosim.actions.action import CompositeAction
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.fmi.co_simulation import Call

# weights of b, h0, h1, h2 in d1 H and d2 H^2
_HELD = ((0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0))
_LINE = ((0.0, 1.0, -1.0, 0.0), (0.0, 0.0, 0.0, 0.0))
_PARABOLA = ((0.0, 1.5, -2.0, 0.5), (0.0, 1.0, -2.0, 1.0))
_LINE_TO_END = ((1.0, -1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0))
_PARABOLA_TO_END = ((0.5, 0.0, -0.5, 0.0), (1.0, -2.0, 1.0, 0.0))
_DEGREES: dict[tuple[tuple[float, ...], ...], int] = {
    _HELD: 0,
    _LINE: 1,
    _LINE_TO_END: 1,
    _PARABOLA: 2,
    _PARABOLA_TO_END: 2,
}


@dataclass(eq=False)
class History(CompositeAction):
    """Keeps the values at the last communication points: `points` is (3, n), h0, h1, h2."""

    bus: np.ndarray
    points: np.ndarray = field(init=False)

    def __post_init__(self):
        self.points = np.zeros((3, len(self.bus)))

    def run(self) -> int:
        """Take the present values for h0."""
        self.points[2] = self.points[1]
        self.points[1] = self.points[0]
        self.points[0] = self.bus
        return 0


@dataclass(eq=False)
class Extrapolate(CompositeAction):
    """Gives the inputs of one instance their derivatives for the step that follows.

    Attributes:
        places: of the inputs on the bus, (n,); `weights` of b, h0, h1, h2 in d1 H and d2 H^2, (2, 4, n).
        derivatives: d1, d2, (2, n); `setters` hand them over, one or two.
    """

    instance: str
    history: History
    step_size: c_double
    places: np.ndarray
    weights: np.ndarray
    derivatives: np.ndarray
    setters: Sequence[Call]

    def run(self) -> int:
        """CompositeAction the derivatives out and hand them over; return the first status that is not ok."""
        h, places, points = self.step_size.value, self.places, self.history.points
        nodes = self.history.bus[places], points[0, places], points[1, places], points[2, places]
        for order, weights, divisor in zip((0, 1), self.weights, (h, h * h), strict=True):
            total = np.zeros(len(places))
            for weight, values in zip(weights, nodes, strict=True):  # in C the sums have this order
                total += weight * values
            self.derivatives[order] = total / divisor
        return self._run(self.setters)


class Extrapolation:
    """The inputs of a system that can move within a step, up to an order of 1 or 2.

    Attributes:
        history: bus values that the polynomials pass through.
        unable: instances with inputs that could move, but whose FMU takes no derivatives of them.
        degree: least degree of the polynomials that such inputs follow, 0 where one is held.
    """

    def __init__(self, wiring: Wiring, order: int):
        self._wiring, self._order = wiring, order
        self.history = History(wiring.bus)
        self._jumping = wiring.jumping()
        self.unable = [
            s.instance for s in wiring.continuous if self.moving(s.instance) and not self.is_able(s.instance)
        ]
        self.degree = 0 if self.unable else order

    def moving(self, instance: str) -> list[int]:
        """Return the places on the bus of an instance's inputs that do more than jump."""
        return [
            i
            for i, connection in enumerate(self._wiring.connections)
            if self._wiring.split(connection.end)[0] == instance and not self._wiring.is_sampled(connection.start)
        ]

    def is_able(self, instance: str) -> bool:
        """Whether an instance takes derivatives of its inputs."""
        return self._wiring.instances[instance].has_input_derivatives(self._inputs(self.moving(instance)), 1)

    def of(self, instance: str, stepped: Collection[str] = ()) -> list[Extrapolate]:
        """Return the action that lets an instance's inputs move, if it has any that can.

        `stepped` are the instances that have stepped already.
        """
        places = self.moving(instance)
        if not places or not self.is_able(instance):
            return []
        it, inputs = self._wiring.instances[instance], self._inputs(places)
        order = self._order if it.has_input_derivatives(inputs, self._order) else 1
        polynomials = [self._weights(i, order, stepped) for i in places]
        self.degree = min(self.degree, *(_DEGREES[polynomial] for polynomial in polynomials))
        weights = np.array(polynomials).transpose(1, 2, 0)
        derivatives = np.zeros((2, len(places)))
        setters = [it.derivative_setter(it.handle(inputs, derivatives[k]), k + 1) for k in range(order)]
        step_size = self._wiring.step_size
        return [Extrapolate(instance, self.history, step_size, np.array(places), weights, derivatives, setters)]

    def _weights(self, place: int, order: int, stepped: Collection[str]) -> tuple[tuple[float, ...], ...]:
        """Return the weights of an input's polynomial, by whether its source has stepped, and jumps."""
        start = self._wiring.connections[place].start
        has_stepped, jumps = self._wiring.split(start)[0] in stepped, start in self._jumping
        if has_stepped:
            return _PARABOLA_TO_END if order == 2 and not jumps else _LINE_TO_END
        if jumps:
            return _HELD
        return _PARABOLA if order == 2 else _LINE

    def _inputs(self, places: Sequence[int]) -> list[str]:
        """Return the inputs at places on the bus."""
        return [self._wiring.split(self._wiring.connections[i].end)[1] for i in places]

    def begin(self) -> None:
        """Make h1 and h2 at the start, where the exchange has just been done."""
        wiring, h = self._wiring, self._wiring.step_size.value
        slopes = np.zeros_like(wiring.bus)
        for group in wiring.groups:
            source = wiring.instances[group.instance]
            places = wiring.places(group)
            smooth = [i for i in places if wiring.connections[i].start not in self._jumping]
            if smooth and source.fmu.description.output_derivative_order:
                names = [wiring.split(wiring.connections[i].start)[1] for i in smooth]
                slopes[smooth] = source.output_derivatives(source.handle(names))
            for transfer in group.transfers:
                target = wiring.instances[transfer.target]
                own = [i for i in self.moving(transfer.target) if i in places]
                if own and self.is_able(transfer.target):
                    handle = target.handle(self._inputs(own), slopes[own])
                    call = target.derivative_setter(handle, 1)
                    target.check(call, call.run())
        # the first step makes them h1 and h2
        self.history.points[:2] = wiring.bus - h * slopes, wiring.bus - 2 * h * slopes
