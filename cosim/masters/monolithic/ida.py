"""SUNDIALS' IDA: the joint equation as a differential-algebraic one, with the coupling values among its unknowns.

    x' - f(t, x, w) = 0,     w - g(t, x, w) = 0

with the states x and the values w that flow between the FMUs. All FMUs are evaluated independently of each other, and
Newton's method on the whole equation, with the FMUs' partial derivatives, closes the connections and algebraic loops.

At the start, and after every event, w are the values of an exchange with algebraic loops solved, and w' are finite
differences along the solution. The unit of a value follows from its effect on the states: within the shortest time
constant 1 / r an error of the value within the tolerance moves no state by more than the tolerance. Noise of a value is
not resolved. The method is BDF, of order up to 5.
"""

from typing import Any, ClassVar

import numpy as np

from hfsa.cosim.fmi.step_error import StepError
from hfsa.cosim.masters.monolithic.integrator import GROWTH, Integrator, sundials
from hfsa.cosim.masters.monolithic.joint_ode import JointOde
from hfsa.cosim.masters.monolithic.noise import REFUSALS

_AHEAD = 1e-6
"""Interval of the difference for w', relative to the shortest time constant."""

_UNIMPORTANT = 1e12
"""Largest unit of a value without effect on the states, relative to its size."""


class Ida(Integrator):
    """Integrator of F(t, [x; w], [x'; w']) = 0."""

    name: ClassVar[str] = "IDA"
    tolerance: ClassVar[float] = 1e-11
    noise_share: ClassVar[float] = 0.01
    usual_step: ClassVar[float] = 0.02

    def __init__(self, ode: JointOde):
        super().__init__(ode)
        n, m = len(ode.x), len(ode.places)
        self._units, self._longest = np.ones(n + m), 1.0

        def indicate(time: float, z: np.ndarray, _slopes: np.ndarray, indicators: np.ndarray) -> None:
            """Write the event indicators; a function, because the solver stores attributes on it."""
            self._evaluate(time, z)
            indicators[:] = ode.indicate()

        self._ida = sundials("ida", "IDA")(
            self._residual,
            jacfn=self._differentiate,
            rtol=self.tolerance,
            atol=self.tolerance,
            algebraic_idx=list(range(n, n + m)) or None,
            **self._events(indicate),
        )

    @property
    def _solver(self) -> Any:
        return self._ida

    def _prepare(self, step: float, horizon: float) -> None:
        """Set the longest interval [s] of the difference for w'."""
        self._longest = min(step, horizon)

    def _start(self, time: float, x: np.ndarray) -> None:
        """Start the solver with values and slopes that satisfy the equations."""
        rates, w = self._ode.evaluate(time, x).copy(), self._ode.values
        ahead = _AHEAD * min(1 / self._fastest if self._fastest else np.inf, self._longest)
        self._ode.evaluate(time + ahead, x + ahead * rates)
        slopes = (self._ode.values - w) / ahead
        self._ode.evaluate(time, x)
        self._units = np.concatenate([self._unit, self._value_units(x, w)])
        self._ida.init_step(time, np.concatenate([x, w]) / self._units, np.concatenate([rates, slopes]) / self._units)

    def _value_units(self, x: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Return the units of the values w, (m,), at the point of the last evaluation, which was at x."""
        joint, n = self._ode.partials(), len(self._unit)
        closing = np.linalg.inv(np.eye(len(w)) - joint[n:, n:])
        followed = np.abs(closing @ joint[n:, :n]) @ self._unit
        pushed = np.abs(joint[:n, n:] @ closing) / self._unit[:, None]
        pushed = pushed.max(axis=0, initial=0.0)
        harmless = np.full(len(w), np.inf)
        np.divide(self._fastest or 1 / self._longest, pushed, out=harmless, where=pushed > 0)
        own = np.maximum(np.abs(w), followed)
        size = np.maximum(own, self._ode.value_nominals)
        unit = np.maximum(own, np.minimum(harmless, _UNIMPORTANT * size))
        # a motion smaller than the last digit of its sum comes in jumps, which smooth lines may not show
        jumps = np.abs(closing) @ np.spacing(np.abs(w)) + np.abs(closing @ joint[n:, :n]) @ np.spacing(np.abs(x))
        jumps *= GROWTH / self.noise_share
        unit = np.maximum(unit, np.maximum(self._value_noise, jumps) / self.tolerance)
        return 2.0 ** np.ceil(np.log2(unit))

    def _evaluate(self, time: float, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return x' and the outputs at unknowns in their units."""
        n, y = len(self._unit), z * self._units
        return self._ode.evaluate_open(time, y[:n], y[n:])

    def _residual(self, time: float, z: np.ndarray, slopes: np.ndarray, residual: np.ndarray) -> None:
        """Write the residual; NaN, where an FMU refuses a state, makes IDA try a smaller step."""
        n = len(self._unit)
        try:
            rates, found = self._evaluate(time, z)
        except StepError as error:
            if error.status not in REFUSALS:
                raise
            self._refusal = error
            residual[:] = np.nan
            return
        residual[:n] = slopes[:n] - rates / self._unit
        residual[n:] = z[n:] - found / self._units[n:]

    def _differentiate(
        self,
        time: float,
        z: np.ndarray,
        _slopes: np.ndarray,
        _residual: np.ndarray,
        slope_weight: float,
        matrix: np.ndarray,
    ) -> None:
        """Write the derivative of the residual by z, plus `slope_weight` times that by the slopes."""
        n = len(self._unit)
        self._evaluate(time, z)
        matrix[:, :] = -self._ode.partials() * self._units / self._units[:, None]
        matrix[range(n), range(n)] += slope_weight
        matrix[range(n, len(z)), range(n, len(z))] += 1.0
