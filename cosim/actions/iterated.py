"""Iterated coupling: a step is taken again and again until its inputs end at what the outputs come to.

Over a step from t_k to t_k + H every input that another instance feeds follows a straight line, from what was put out
at t_k to a guess w of what will be put out at t_k + H. All instances step, the exchange at t_k + H tells y(w), and the
guess is made better:

    fixed_point     w <- y(w)
    quasi_newton    w <- w + (1 - dy/dw)^-1 (y(w) - w)

until the change is at most `TOLERANCE` of the value, or of its nominal where that is more, or at most `ROUNDING` of it
and getting no smaller; each time the instances go back to their states at t_k. dy/dw is that of the linearised FMUs
over a step of H; it is made at the first step, and anew where it does not serve or the step has changed much. The first
guess goes on as the values have come.

Sampled outputs are held as ever. Where an FMU takes no derivatives of its inputs, they are held at the middle of the
line. With straight lines the coupling is of second order, like the trapezoidal rule, and as stable.

`IteratedStep.attempt` is what the stepping loop in C does as well, with the same bits, up to where an inverse is to be made
or the passes do not suffice; `IteratedStep.solve` goes on from there.
"""

import ctypes
from collections.abc import Callable, Iterable, Sequence
from ctypes import c_double, c_int, c_longlong, c_size_t
from typing import ClassVar

import numpy as np

from hfsa.cosim.actions.action import CompositeAction, Group, Transfer, failing_call
from hfsa.cosim.actions.algebraic_loop import STALE, AlgebraicLoop, product
from hfsa.cosim.actions.extrapolation import Extrapolation
from hfsa.cosim.actions.past import Past
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.fmi.co_simulation import Call, StepError
from hfsa.cosim.systems.errors import StructureError

TOLERANCE = 1e-10
"""Largest last change of a value, relative to the value or its nominal."""

ROUNDING = 1e-6
"""Largest last change of a value that rounding keeps from getting smaller, likewise."""

PASSES = {"fixed_point": 200, "quasi_newton": 8}
"""Steps tried with one guess improving the other, by method."""

ROUNDS = {"fixed_point": 1, "quasi_newton": 2}
"""Rounds of as many passes, each with an inverse of its own, by method."""

REUSE = 0.3
"""Relative difference of steps up to which an inverse serves both."""

Gradient = Callable[["IteratedStep", float], np.ndarray]
"""From a step size [s] to dy/dw of the linearised system at the present values, (places, places)."""


class Line:
    """The inputs of one instance that follow straight lines: from the last point to a guess, in `places` of the bus.

    Attributes:
        is_able: whether it takes their slopes; otherwise `values` are the lines' middles.
    """

    def __init__(self, wiring: Wiring, instance: str, places: Sequence[int], is_able: bool):
        self.instance, self.places, self.is_able = instance, np.array(places), is_able
        it = wiring.instances[instance]
        handle = it.handle([wiring.split(wiring.connections[i].end)[1] for i in places])
        self.values = handle.values
        self.call = it.derivative_setter(handle, 1) if is_able else it.setter(handle)

    def aim(self, start: np.ndarray, guess: np.ndarray, step_size: float) -> None:
        """Lay the line from values on the bus at the beginning to values at the end, (n,) each."""
        first, last = start[self.places], guess[self.places]
        self.values[:] = (last - first) / step_size if self.is_able else (first + last) / 2


class Progress(ctypes.Structure):
    """How far the step under way has come, for both stepping loops: `Progress` of runtime/iterated.h."""

    _fields_: ClassVar = [
        ("passes", c_longlong),
        ("before", c_double),
        ("inverse_step", c_double),
        ("next", c_size_t),
        ("tried", c_int),
        ("rounds", c_int),
        ("warning", c_int),
    ]


class IteratedStep(CompositeAction):
    """All instances that are not sampled step together, as often as it takes: an action of the master.

    Attributes:
        method: `fixed_point` or `quasi_newton`.
        lines: inputs that move, by instance; `places` of all of them on the bus, (n,).
        groups: what may have changed afterwards.
        exchange: at the end of a step.
        savers, restorers: keep the states of the instances, and bring them back; `tries` are the calls of a pass.
        guess: of the bus at the end; `change` is what it is to change by in `places`, `nominal` the values' there.
        inverse: (1 - dy/dw)^-1, (n, n).
        attempt: what `run` begins with; `stepping.step_in_c` puts the same in C in its place.
    """

    def __init__(self, wiring: Wiring, method: str, gradient: Gradient):
        for stepper in wiring.continuous:
            if not wiring.instances[stepper.instance].fmu.description.can_restore:
                file = wiring.instances[stepper.instance].fmu.description.file.name
                raise StructureError(
                    f"{stepper.instance}: {file} does not offer to get and set its state (canGetAndSetFMUstate), which "
                    "a step taken again needs; algorithms that take each step once are gauss_seidel and jacobi, also "
                    "with _linear and _quadratic"
                )
        self.wiring, self.method, self._gradient = wiring, method, gradient
        extrapolation = Extrapolation(wiring, 1)
        self.unable = extrapolation.unable
        self.lines: list[Line] = []
        for stepper in wiring.continuous:
            if places := extrapolation.moving(stepper.instance):
                is_able = extrapolation.is_able(stepper.instance)
                self.lines.append(Line(wiring, stepper.instance, places, is_able))
        self.places = np.concatenate([np.zeros(0, dtype=int), *(line.places for line in self.lines)])
        self.groups = [group for stepper in wiring.continuous for group in stepper.groups]
        names = [wiring.split(wiring.connections[i].start) for i in self.places]
        self.nominal = np.array([abs(wiring.connectors[component][name].nominal) for component, name in names])
        instances = [wiring.instances[stepper.instance] for stepper in wiring.continuous]
        slots = [it.slot() for it in instances]
        self.savers = [it.saver(slot) for it, slot in zip(instances, slots, strict=True)]
        self.restorers = [it.restorer(slot) for it, slot in zip(instances, slots, strict=True)]
        self.exchange: Sequence[Group | Transfer | AlgebraicLoop] = list(wiring.exchange())
        self.tries: Sequence[Call | AlgebraicLoop] = [
            *(line.call for line in self.lines),
            *(it.stepper(wiring.time, wiring.step_size, is_final=False) for it in instances),
            *(action.call for action in self.exchange),
        ]
        self._past = Past(len(wiring.bus))
        n = len(self.places)
        self.guess, self.change, self.inverse = np.zeros(len(wiring.bus)), np.zeros(n), np.zeros((n, n))
        self.progress = Progress()
        self.attempt: Callable[[], int] = self._attempt

    def another(self) -> "IteratedStep":
        """Return one more iteration of the same steps, with an inverse and a past of its own."""
        return IteratedStep(self.wiring, self.method, self._gradient)

    @property
    def passes(self) -> int:
        """Steps tried since the start."""
        return self.progress.passes

    @property
    def past(self) -> Past:
        """The last communication points; others may be put in their place."""
        return self._past

    @past.setter
    def past(self, points: Iterable[tuple[float, np.ndarray]]) -> None:
        """Go back to points that were known before, latest first."""
        kept = list(points)
        self._past.clear()
        for time, bus in reversed(kept):
            self._past.take(time, bus)

    def begin(self) -> None:
        """Forget what was before the start."""
        self._past.clear()
        self.progress.inverse_step, self.progress.passes = 0.0, 0

    def run(self) -> int:
        """Step to the next communication point; `StepError` where no guess is good enough."""
        time, status = self.wiring.time.value, self.attempt()
        return self.solve(time) if status == STALE else self._checked(status, time)

    def _attempt(self) -> int:
        """Step to the next communication point; `STALE` where something is to be made anew before that."""
        progress, time = self.progress, self.wiring.time.value
        self._past.take(time, self.wiring.bus)
        progress.warning = self._run(self.savers)
        if progress.warning > 1:
            return progress.warning
        progress.rounds = 0
        self._begin_round(time)
        return self._iterate()

    def solve(self, time: float) -> int:
        """Go on with the step from `time` [s] on that is under way, where neither loop can as it is."""
        status = STALE
        while status == STALE:
            self._renew(time)
            status = self._iterate()
        return self._checked(status, time)

    def go_back(self) -> None:
        """Bring all instances back to the beginning of the step."""
        self._checked(self._run(self.restorers), self.wiring.time.value)

    def _begin_round(self, time: float) -> None:
        """Guess that values go on as they have come."""
        self.guess[:] = self._past.predicted(time + self.wiring.step_size.value)
        self.progress.before, self.progress.next, self.progress.tried = np.inf, 0, 0

    def _iterate(self) -> int:
        """Try steps until the guess is good enough; `STALE` where something is to be made anew before that."""
        wiring, progress, places = self.wiring, self.progress, self.places
        while True:
            if progress.next == 0:
                for line in self.lines:
                    line.aim(self._past.points[0], self.guess, wiring.step_size.value)
            if status := self._go_on():
                return status
            if not self._serves():
                return STALE
            largest = self._correct()
            progress.passes += 1
            progress.tried += 1
            if largest <= TOLERANCE or progress.before / 2 < largest <= ROUNDING:
                return progress.warning
            if not np.isfinite(largest) or progress.tried == PASSES[self.method]:
                return STALE
            self.guess[places] += self.change
            progress.before, progress.next = largest, 0
            status = self._run(self.restorers)
            if status > 1:
                return status
            progress.warning = progress.warning or status

    def _go_on(self) -> int:
        """Make the calls of a pass that are still to be made; `STALE` where the next is a loop to be solved anew."""
        progress = self.progress
        while progress.next < len(self.tries):
            call = self.tries[progress.next]
            status = call.run()
            if status == STALE:
                return STALE
            if status:
                self.failing, progress.warning = failing_call(call), progress.warning or status
                if status > 1:
                    return status
            progress.next += 1
        return 0

    def _serves(self) -> bool:
        """Whether there is an inverse for the step's size, or none is needed."""
        step_size = self.wiring.step_size.value
        return self.method == "fixed_point" or abs(step_size - self.progress.inverse_step) <= REUSE * step_size

    def _correct(self) -> float:
        """Find by how much the guess is to change; return the largest change relative to its size."""
        now = self.wiring.bus[self.places]
        residual = now - self.guess[self.places]
        self.change[:] = residual if self.method == "fixed_point" else product(self.inverse, residual)
        return float(np.max(np.abs(self.change) / np.maximum(np.abs(now), self.nominal), initial=0.0))

    def _renew(self, time: float) -> None:
        """Do what keeps the iteration from going on: solve a loop, make an inverse, begin another round, or give up."""
        progress = self.progress
        if progress.next < len(self.tries):
            loop = self.tries[progress.next]
            assert isinstance(loop, AlgebraicLoop)
            if status := loop.solve(time):
                self.failing, progress.warning = loop.failing, progress.warning or status
            progress.next += 1
        elif not self._serves():
            self._invert(time)
        else:
            progress.rounds += 1
            if progress.rounds == ROUNDS[self.method]:
                raise self._failure(time)
            self.go_back()
            progress.inverse_step = 0.0
            self._begin_round(time)

    def _invert(self, time: float) -> None:
        """Make the inverse for the step's size."""
        step_size = self.wiring.step_size.value
        try:
            self.inverse[:] = np.linalg.inv(np.eye(len(self.places)) - self._gradient(self, step_size))
        except np.linalg.LinAlgError:
            connection = self.wiring.connections[self.places[0]]
            message = (
                f"{self.method} coupling over {connection} has loop gain 1 over a step of {step_size:.6g} s, and so no "
                "solution or any number of them; another step has one"
            )
            raise StepError(*self.wiring.split(connection.start), "does not converge", time, message) from None
        self.progress.inverse_step = step_size

    def _failure(self, time: float) -> StepError:
        """Return the error of the connection whose residual is largest."""
        wiring = self.wiring
        now, guess = wiring.bus[self.places], self.guess[self.places]
        size = np.maximum(np.abs(now), self.nominal)
        worst = int(np.argmax(np.nan_to_num(np.abs(now - guess) / size, nan=np.inf)))
        connection = wiring.connections[self.places[worst]]
        source, output = wiring.split(connection.start)
        return StepError(
            source,
            output,
            "does not converge",
            time,
            f"{self.method} coupling over {connection}: residual {now[worst] - guess[worst]:.3g} at value "
            f"{guess[worst]:.6g} after {PASSES[self.method] * ROUNDS[self.method]} passes over a step of "
            f"{wiring.step_size.value:.6g} s; a smaller step helps"
            + (", or quasi_newton" if self.method == "fixed_point" else ""),
        )
