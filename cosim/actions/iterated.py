"""Iterative coupling: repeat the step until the inputs assumed at its end equal the outputs computed there.

Over a step from t_k to t_k + H every connected input follows a straight line, from the output at t_k to a guess w of
the output at t_k + H. All instances step, the exchange at t_k + H yields the outputs y(w), and the guess is corrected:

    fixed_point     w <- y(w)
    quasi_newton    w <- w + (1 - dy/dw)^-1 (y(w) - w)

until the change is at most `TOLERANCE` of the value, or of its nominal where that is larger, or at most `ROUNDING` of
it and no longer decreasing. All instances return to their states at t_k before each further pass. The interface
Jacobian dy/dw is that of the linearised FMUs over a step of H. It is computed at the first step, and again where the
passes do not converge or the step size has changed much. The first guess extrapolates the last communication points.

Sampled outputs are held. Where an FMU accepts no input derivatives, its inputs are held at the middle of the line. With
straight lines the coupling is of second order and as stable as the trapezoidal rule.
The stepping loop in C computes the same bits as `IteratedStep.attempt`; `IteratedStep.solve` continues where a new
inverse is needed.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from hfsa.cosim.actions.action import CompositeAction, Group, Transfer, failing_call
from hfsa.cosim.actions.algebraic_loop import STALE, AlgebraicLoop, product
from hfsa.cosim.actions.extrapolation import Extrapolation
from hfsa.cosim.actions.past import Past
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.fmi.co_simulation import Call, StepError
from hfsa.cosim.fmi.library import fails
from hfsa.cosim.systems.errors import StructureError

TOLERANCE = 1e-10
"""Largest last change of a value, relative to the value or its nominal."""

ROUNDING = 1e-6
"""The same for a change that rounding keeps from decreasing further."""

PASSES = {"fixed_point": 200, "quasi_newton": 8}
"""Largest number of passes in a round, by method."""

ROUNDS = {"fixed_point": 1, "quasi_newton": 2}
"""Largest number of rounds, each with its own inverse, by method."""

REUSE = 0.3
"""Relative difference of step sizes up to which an inverse is reused."""

InterfaceJacobian = Callable[["IteratedStep", float], np.ndarray]
"""Function from a step size [s] to dy/dw of the linearised system at the present values, (places, places)."""


class Line:
    """The moving inputs of one instance: straight lines from the last point to the guess, at `places` of the bus.

    Attributes:
        is_able: whether the instance accepts slopes; otherwise `values` are the middles of the lines.
    """

    def __init__(self, wiring: Wiring, instance: str, places: Sequence[int], is_able: bool):
        self.instance, self.places, self.is_able = instance, np.array(places), is_able
        it = wiring.instances[instance]
        handle = it.handle([wiring.split(wiring.connections[i].end)[1] for i in places])
        self.values = handle.values
        self.call = it.derivative_setter(handle, 1) if is_able else it.setter(handle)

    def aim(self, start: np.ndarray, guess: np.ndarray, step_size: float) -> None:
        """Set the line between bus values at the beginning and at the end of the step, (n,) each."""
        first, last = start[self.places], guess[self.places]
        self.values[:] = (last - first) / step_size if self.is_able else (first + last) / 2


@dataclass(slots=True)
class Progress:
    """How far the step under way has come; the stepping loop in C goes on from here, and Python's where it comes back.

    Attributes:
        passes: steps tried since the start.
        before: largest change of the pass before; `inverse_step` is the step size [s] that the inverse is made for.
        next: the next call of the pass.
        tried, rounds: passes of this round, and rounds that did not suffice.
        warning: status of the first call that warned.
    """

    passes: int = 0
    before: float = np.inf
    inverse_step: float = 0.0
    next: int = 0
    tried: int = 0
    rounds: int = 0
    warning: int = 0


class IteratedStep(CompositeAction):
    """The action that steps all continuous instances together, repeated until the coupling converges.

    Attributes:
        method: `fixed_point` or `quasi_newton`.
        lines: moving inputs by instance; `places` are the bus indices of all of them, (n,).
        groups: outputs that a step changes.
        exchange: actions at the end of a step.
        savers, restorers: calls that save and restore the instances' states; `tries` are the calls of a pass.
        guess: bus values at the end of the step; `change` is the correction at `places`, `nominal` the sizes there.
        inverse: (1 - dy/dw)^-1, (n, n).
        attempt: first part of `run`; `stepping.step_in_c` replaces it by the same in C.
    """

    def __init__(self, wiring: Wiring, method: str, jacobian: InterfaceJacobian):
        for stepper in wiring.continuous:
            if not wiring.instances[stepper.instance].fmu.description.can_restore:
                file = wiring.instances[stepper.instance].fmu.description.file.name
                raise StructureError(
                    f"{stepper.instance}: {file} does not offer to get and set its state (canGetAndSetFMUstate), which "
                    "a step taken again needs; algorithms that take each step once are gauss_seidel and jacobi, also "
                    "with _linear and _quadratic"
                )
        self.wiring, self.method, self._jacobian = wiring, method, jacobian
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

    def duplicate(self) -> "IteratedStep":
        """Return an iterated step of the same instances, with its own inverse and history."""
        return IteratedStep(self.wiring, self.method, self._jacobian)

    @property
    def passes(self) -> int:
        """Number of passes since the start."""
        return self.progress.passes

    @property
    def past(self) -> Past:
        """History of the last communication points."""
        return self._past

    @past.setter
    def past(self, points: Iterable[tuple[float, np.ndarray]]) -> None:
        """Replace the history by earlier points, latest first."""
        kept = list(points)
        self._past.clear()
        for time, bus in reversed(kept):
            self._past.take(time, bus)

    def begin(self) -> None:
        """Clear the history and the inverse at the start."""
        self._past.clear()
        self.progress.inverse_step, self.progress.passes = 0.0, 0

    def run(self) -> int:
        """Step to the next communication point; `StepError` where the passes do not converge."""
        time, status = self.wiring.time.value, self.attempt()
        return self.solve(time) if status == STALE else self._checked(status, time)

    def _attempt(self) -> int:
        """Step to the next communication point; return the status, `STALE` where a new inverse is needed first."""
        progress, time = self.progress, self.wiring.time.value
        self._past.take(time, self.wiring.bus)
        progress.warning = self._run(self.savers)
        if fails(progress.warning):
            return progress.warning
        progress.rounds = 0
        self._begin_round(time)
        return self._iterate()

    def solve(self, time: float) -> int:
        """Complete the current step from `time` [s] after a status `STALE`; return 0 or the first warning."""
        status = STALE
        while status == STALE:
            self._resolve(time)
            status = self._iterate()
        return self._checked(status, time)

    def go_back(self) -> None:
        """Restore all instances to the beginning of the step."""
        self._checked(self._run(self.restorers), self.wiring.time.value)

    def _begin_round(self, time: float) -> None:
        """Start a round of passes from the extrapolated guess."""
        self.guess[:] = self._past.predicted(time + self.wiring.step_size.value)
        self.progress.before, self.progress.next, self.progress.tried = np.inf, 0, 0

    def _iterate(self) -> int:
        """Repeat the step until the guess converges; return the status, `STALE` where a new inverse is needed first."""
        wiring, progress, places = self.wiring, self.progress, self.places
        while True:
            if progress.next == 0:
                for line in self.lines:
                    line.aim(self._past.points[0], self.guess, wiring.step_size.value)
            if status := self._complete_pass():
                return status
            if not self._has_inverse():
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
            if fails(status):
                return status
            progress.warning = progress.warning or status

    def _complete_pass(self) -> int:
        """Make the remaining calls of a pass; return `STALE` before an algebraic loop that needs a new inverse."""
        progress = self.progress
        while progress.next < len(self.tries):
            call = self.tries[progress.next]
            status = call.run()
            if status == STALE:
                return STALE
            if status:
                self.failing, progress.warning = failing_call(call), progress.warning or status
                if fails(status):
                    return status
            progress.next += 1
        return 0

    def _has_inverse(self) -> bool:
        """Whether the inverse suits the step size, or none is needed."""
        step_size = self.wiring.step_size.value
        return self.method == "fixed_point" or abs(step_size - self.progress.inverse_step) <= REUSE * step_size

    def _correct(self) -> float:
        """Compute the correction of the guess; return the largest change relative to its size."""
        now = self.wiring.bus[self.places]
        residual = now - self.guess[self.places]
        self.change[:] = residual if self.method == "fixed_point" else product(self.inverse, residual)
        return float(np.max(np.abs(self.change) / np.maximum(np.abs(now), self.nominal), initial=0.0))

    def _resolve(self, time: float) -> None:
        """Resolve a status `STALE`: solve an algebraic loop, compute an inverse or begin another round.

        `StepError` where all rounds are used up.
        """
        progress = self.progress
        if progress.next < len(self.tries):
            loop = self.tries[progress.next]
            assert isinstance(loop, AlgebraicLoop)
            if status := loop.solve(time):
                self.failing, progress.warning = loop.failing, progress.warning or status
            progress.next += 1
        elif not self._has_inverse():
            self._invert(time)
        else:
            progress.rounds += 1
            if progress.rounds == ROUNDS[self.method]:
                raise self._failure(time)
            self.go_back()
            progress.inverse_step = 0.0
            self._begin_round(time)

    def _invert(self, time: float) -> None:
        """Compute the inverse for the step size."""
        step_size = self.wiring.step_size.value
        try:
            self.inverse[:] = np.linalg.inv(np.eye(len(self.places)) - self._jacobian(self, step_size))
        except np.linalg.LinAlgError:
            connection = self.wiring.connections[self.places[0]]
            message = (
                f"{self.method} coupling over {connection} has loop gain 1 over a step of {step_size:.6g} s, and so no "
                "solution or any number of them; another step has one"
            )
            raise StepError(*self.wiring.split(connection.start), "does not converge", time, message) from None
        self.progress.inverse_step = step_size

    def _failure(self, time: float) -> StepError:
        """Return the error for the connection with the largest residual."""
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
