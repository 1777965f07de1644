"""SUNDIALS' CVODE: the joint equation as an ordinary one, with the connections closed at every evaluation.

The method is that of Adams, of order up to 12: on lightly damped vibration its error is a hundredth of BDF's, at a
third of the cost. Where a fast and well damped mode would keep its steps short, the method is BDF, of order up to 5.
"""

from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.fmi.step_error import StepError
from hfsa.cosim.masters.monolithic.integrator import Integrator, sundials
from hfsa.cosim.masters.monolithic.joint_ode import JointOde
from hfsa.cosim.masters.monolithic.noise import REFUSALS

STIFF = 30.0
"""Ratio of the fastest damped pole to the fastest pole to be resolved, above which BDF takes fewer steps."""

_NEGLIGIBLE = 1e-9
"""Poles below this part of the fastest one are rounding."""


class Cvode(Integrator):
    """Integrator of x' = f(t, x), with an error of 1e-10 over a hundred periods of a vibration.

    Attributes:
        method: that of Adams, or backward differentiation (BDF).
    """

    name: ClassVar[str] = "CVODE"
    tolerance: ClassVar[float] = 3e-14
    noise_share: ClassVar[float] = 1.0
    usual_step: ClassVar[float] = 0.5

    def __init__(self, ode: JointOde):
        super().__init__(ode)
        kind = sundials("cvode", "CVODE")

        def indicate(time: float, z: np.ndarray, indicators: np.ndarray) -> None:
            """Write the event indicators; a function, because the solver stores attributes on it."""
            ode.evaluate(time, z * self._unit)
            indicators[:] = ode.indicate()

        self._solvers = {
            method: kind(
                self._rhs,
                jacfn=self._differentiate,
                method=method,
                rtol=self.tolerance,
                atol=self.tolerance,
                **self._events(indicate),
            )
            for method in ("Adams", "BDF")
        }
        self.method: Literal["Adams", "BDF"] = "Adams"

    @property
    def _solver(self) -> Any:
        return self._solvers[self.method]

    def _start(self, time: float, x: np.ndarray) -> None:
        self._solver.init_step(time, x / self._unit)

    def _rhs(self, time: float, z: np.ndarray, rates: np.ndarray) -> None:
        """Write the right-hand side; NaN, where an FMU refuses a state, makes CVODE try a smaller step."""
        try:
            rates[:] = self._ode.evaluate(time, z * self._unit) / self._unit
        except StepError as error:
            if error.status not in REFUSALS:
                raise
            self._refusal = error
            rates[:] = np.nan

    def _differentiate(self, time: float, z: np.ndarray, _rates: np.ndarray, matrix: np.ndarray) -> None:
        self._ode.evaluate(time, z * self._unit)
        matrix[:, :] = self._ode.jacobian() * self._unit / self._unit[:, None]

    def _prepare(self, step: float, horizon: float) -> None:
        """Choose the method by the poles of the equation."""
        self._choose(np.linalg.eigvals(self._ode.jacobian()), step, horizon)

    def _choose(self, poles: NDArray[np.float64] | NDArray[np.complex128], step: float, horizon: float) -> None:
        """Choose the method by poles [rad/s].

        The steps must resolve the fastest vibration, or without one the slowest pole, or the rate of recording.
        """
        poles = poles[np.abs(poles) > _NEGLIGIBLE * np.abs(poles).max(initial=0.0)]
        is_damped = -poles.real > np.abs(poles.imag)
        damped, others = np.abs(poles[is_damped]), np.abs(poles[~is_damped])
        resolved = others.max() if len(others) else damped.min(initial=1 / step)
        is_stiff = damped.max(initial=0.0) > STIFF * max(resolved, 1 / horizon)
        self.method = "BDF" if is_stiff else "Adams"
