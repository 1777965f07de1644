"""Input extrapolation: polynomials through the values of the feeding outputs at the last communication points.

Over a step H from t_k on an input is u(t_k + s) = u_k + d1 s + d2 s^2 / 2. Its derivatives follow from the values of
the feeding output: h0 at t_k, h1 at t_k - H, h2 at t_k - 2 H, and b at t_k + H where the source has stepped already:

    order  source not yet stepped                     source stepped already
    1      d1 H = h0 - h1                             d1 H = b - h0
    2      d1 H = (3 h0 - 4 h1 + h2) / 2              d1 H = (b - h1) / 2
           d2 H^2 = h0 - 2 h1 + h2                    d2 H^2 = b - 2 h0 + h1

Sampled outputs are held. Outputs with direct feedthrough from them jump at ticks: they are held too, or follow a
straight line where their instance has stepped already. h0 is recorded after the ticks at t_k, so that no polynomial
crosses a tick.

At the start h1 and h2 follow from the FMUs' output derivatives, passed on in feedthrough order; the first step holds
the outputs of an FMU without them.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np

from hfsa.cosim.actions.action import CompositeAction
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.fmi.co_simulation import Call, Number

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
    """Bus values at the last communication points: `points` holds h0, h1, h2, (3, n)."""

    bus: np.ndarray
    points: np.ndarray = field(init=False)

    def __post_init__(self):
        self.points = np.zeros((3, len(self.bus)))

    def run(self) -> int:
        """Record the present values as h0."""
        self.points[2] = self.points[1]
        self.points[1] = self.points[0]
        self.points[0] = self.bus
        return 0


@dataclass(eq=False)
class Extrapolate(CompositeAction):
    """Sets the derivatives of one instance's inputs for the next step.

    Attributes:
        places: indices of the inputs on the bus, (n,); `weights` of b, h0, h1, h2 in d1 H and d2 H^2, (2, 4, n).
        derivatives: d1, d2, (2, n); `setters` set them, one or two.
    """

    instance: str
    history: History
    step_size: Number
    places: np.ndarray
    weights: np.ndarray
    derivatives: np.ndarray
    setters: Sequence[Call]

    def run(self) -> int:
        """Compute and set the derivatives; return the first status that is not ok."""
        h, places, points = self.step_size.value, self.places, self.history.points
        nodes = self.history.bus[places], points[0, places], points[1, places], points[2, places]
        for order, weights, divisor in zip((0, 1), self.weights, (h, h * h), strict=True):
            total = np.zeros(len(places))
            for weight, values in zip(weights, nodes, strict=True):  # in C the sums have this order
                total += weight * values
            self.derivatives[order] = total / divisor
        return self._run(self.setters)


class Extrapolation:
    """Extrapolation of the inputs of a system by polynomials of order 1 or 2.

    Attributes:
        history: bus values that the polynomials pass through.
        unable: instances with moving inputs whose FMU accepts no input derivatives; these inputs are held.
        degree: least degree of the polynomials, 0 where an input is held.
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
        """Return the bus indices of an instance's inputs that change between ticks, and are real numbers."""
        wiring, places = self._wiring, []
        for i, connection in enumerate(wiring.connections):
            target, name = wiring.split(connection.end)
            if target == instance and wiring.connectors[target][name].is_real:
                places += [] if wiring.is_sampled(connection.start) else [i]
        return places

    def is_able(self, instance: str) -> bool:
        """Whether an instance accepts derivatives of its moving inputs."""
        return self._wiring.instances[instance].has_input_derivatives(self._inputs(self.moving(instance)), 1)

    def of(self, instance: str, stepped: Collection[str] = ()) -> list[Extrapolate]:
        """Return the action that extrapolates an instance's inputs; none where no input can move.

        `stepped` names the instances that have stepped already.
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
        """Return the weights of an input's polynomial; they depend on whether its source has stepped, and jumps."""
        start = self._wiring.connections[place].start
        has_stepped, jumps = self._wiring.split(start)[0] in stepped, start in self._jumping
        if has_stepped:
            return _PARABOLA_TO_END if order == 2 and not jumps else _LINE_TO_END
        if jumps:
            return _HELD
        return _PARABOLA if order == 2 else _LINE

    def _inputs(self, places: Sequence[int]) -> list[str]:
        """Return the names of the inputs at places on the bus."""
        return [self._wiring.split(self._wiring.connections[i].end)[1] for i in places]

    def begin(self) -> None:
        """Compute h1 and h2 at the start, right after the first exchange."""
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
        # the first step shifts them to h1 and h2
        self.history.points[:2] = wiring.bus - h * slopes, wiring.bus - 2 * h * slopes
