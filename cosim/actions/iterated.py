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
"""

from collections.abc import Callable, Sequence

import numpy as np

from hfsa.cosim.actions.action import Group, Transfer, Work
from hfsa.cosim.actions.algebraic_loop import STALE, AlgebraicLoop
from hfsa.cosim.actions.extrapolation import Extrapolation
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.instance import Call, State, StepError
from hfsa.cosim.system import StructureError

TOLERANCE = 1e-10
"""Largest last change of a value, relative to the value or its nominal."""

ROUNDING = 1e-6
"""Largest last change of a value that rounding keeps from getting smaller, likewise."""

PASSES = {"fixed_point": 200, "quasi_newton": 8}
"""Steps tried with one guess improving the other, by method."""

REUSE = 0.3
"""Relative difference of steps up to which an inverse serves both."""

Gradient = Callable[["Converge", float], np.ndarray]
"""From a step size [s] to dy/dw of the linearised system at the present values, (places, places)."""


class Line:
    """The inputs of one instance that follow straight lines: from `start` to a guess, in `places` of the bus."""

    def __init__(self, wiring: Wiring, instance: str, places: Sequence[int], is_able: bool):
        self.instance, self.places, self.is_able = instance, np.array(places), is_able
        it = wiring.instances[instance]
        handle = it.handle([wiring.split(wiring.connections[i].end)[1] for i in places])
        self._values = handle.values
        self.call = it.derivative_setter(handle, 1) if is_able else it.setter(handle)

    def aim(self, start: np.ndarray, guess: np.ndarray, step_size: float) -> None:
        """Lay the line from values on the bus at the beginning to values at the end, (n,) each."""
        first, last = start[self.places], guess[self.places]
        self._values[:] = (last - first) / step_size if self.is_able else (first + last) / 2


class Converge(Work):
    """All instances that are not sampled step together, as often as it takes: an action of the master.

    Attributes:
        method: `fixed_point` or `quasi_newton`.
        lines: inputs that move, by instance; `places` of all of them on the bus.
        groups: what may have changed afterwards.
        exchange: at the end of a step.
        passes: steps tried in all.
        past: the last communication points, latest first: time [s] and bus.
    """

    def __init__(self, wiring: Wiring, method: str, gradient: Gradient):
        for stepper in wiring.others:
            if not wiring.instances[stepper.instance].fmu.description.can_restore:
                file = wiring.instances[stepper.instance].fmu.description.file.name
                raise StructureError(
                    f"{stepper.instance}: {file} does not offer to get and set its state (canGetAndSetFMUstate), which "
                    "a step taken again needs; algorithms that take each step once are gauss_seidel and jacobi, also "
                    "with _linear and _quadratic"
                )
        self._wiring, self.method, self._gradient = wiring, method, gradient
        extrapolation = Extrapolation(wiring, 1)
        self.unable = extrapolation.unable
        self.lines: list[Line] = []
        for stepper in wiring.others:
            if places := extrapolation.moving(stepper.instance):
                is_able = extrapolation.is_able(stepper.instance)
                self.lines.append(Line(wiring, stepper.instance, places, is_able))
        self.places = np.concatenate([np.zeros(0, dtype=int), *(line.places for line in self.lines)])
        self.groups = [group for stepper in wiring.others for group in stepper.groups]
        names = [wiring.split(wiring.connections[i].start) for i in self.places]
        self._nominal = np.array([abs(wiring.connectors[component][name].nominal) for component, name in names])
        self._instances = [wiring.instances[stepper.instance] for stepper in wiring.others]
        self._steps = [it.stepper(wiring.time, wiring.step_size, is_final=False) for it in self._instances]
        self._states: list[State] = []
        self.exchange: Sequence[Group | Transfer | AlgebraicLoop] = list(wiring.exchange())
        self.passes = 0
        self.past: list[tuple[float, np.ndarray]] = []
        self._inverse, self._inverse_step = np.zeros((0, 0)), 0.0

    def begin(self) -> None:
        """Forget what was before the start."""
        self.past.clear()
        self._inverse_step, self.passes = 0.0, 0

    def run(self) -> int:
        """Step to the next communication point; `StepError` where no guess is good enough."""
        wiring = self._wiring
        time, h, start = wiring.time.value, wiring.step_size.value, wiring.bus.copy()
        self.past = [(time, start), *self.past[:2]]
        self._save()
        guess = self.predicted(time + h)
        for is_last in (False, True):
            before = np.inf
            for _ in range(PASSES[self.method]):
                self._step(start, guess, h)
                change = self._change(wiring.bus[self.places] - guess[self.places], h)
                size = np.maximum(np.abs(wiring.bus[self.places]), self._nominal)
                largest = float(np.max(np.abs(change) / size, initial=0.0))
                if largest <= TOLERANCE or before / 2 < largest <= ROUNDING:
                    return 0
                if not np.isfinite(largest):
                    break
                guess[self.places] += change
                before = largest
                self.go_back()
            if is_last or self.method == "fixed_point":
                break
            self._inverse_step = 0.0
        raise self._failure(time, guess)

    def predicted(self, time: float) -> np.ndarray:
        """Return the bus at a time, on the polynomial through the last points."""
        times = [t for t, _ in self.past]
        result = np.zeros_like(self._wiring.bus)
        for i, (t, values) in enumerate(self.past):
            weight = np.prod([(time - s) / (t - s) for j, s in enumerate(times) if j != i])
            result += weight * values
        return result

    def go_back(self) -> None:
        """Bring all instances back to the beginning of the step."""
        for it, state in zip(self._instances, self._states, strict=True):
            it.restore(state)

    def _save(self) -> None:
        if not self._states:
            self._states = [it.save() for it in self._instances]
            self._savers = [it.saver(s) for it, s in zip(self._instances, self._states, strict=True)]
        for call in self._savers:
            self._make(call)

    def _step(self, start: np.ndarray, guess: np.ndarray, step_size: float) -> None:
        """Step all instances along the lines, and exchange values at the end."""
        for line in self.lines:
            line.aim(start, guess, step_size)
            self._make(line.call)
        for call in self._steps:
            self._make(call)
        for action in self.exchange:
            if isinstance(action, AlgebraicLoop):
                if action.run() == STALE:
                    action.solve(self._wiring.time.value)
            else:
                self._make(action.call)
        self.passes += 1

    def _change(self, residual: np.ndarray, step_size: float) -> np.ndarray:
        """Return by how much the guess is to change."""
        if self.method == "fixed_point":
            return residual
        if not abs(step_size - self._inverse_step) <= REUSE * step_size:
            self._inverse = np.linalg.inv(np.eye(len(self.places)) - self._gradient(self, step_size))
            self._inverse_step = step_size
        return self._inverse @ residual

    def _make(self, call: Call) -> None:
        if status := call.run():
            call.instance.time = self._wiring.time.value
            call.instance.check(call, status)

    def _failure(self, time: float, guess: np.ndarray) -> StepError:
        wiring = self._wiring
        residual = wiring.bus[self.places] - guess[self.places]
        size = np.maximum(np.abs(wiring.bus[self.places]), self._nominal)
        worst = int(np.argmax(np.nan_to_num(np.abs(residual) / size, nan=np.inf)))
        connection = wiring.connections[self.places[worst]]
        source, output = wiring.split(connection.start)
        passes = PASSES[self.method] * (1 if self.method == "fixed_point" else 2)
        return StepError(
            source,
            output,
            "does not converge",
            time,
            f"{self.method} coupling over {connection}: residual {residual[worst]:.3g} at value {guess[worst]:.6g} "
            f"after {passes} passes over a step of {wiring.step_size.value:.6g} s; a smaller step helps"
            + (", or quasi_newton" if self.method == "fixed_point" else ""),
        )
