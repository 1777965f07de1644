"""SUNDIALS' CVODE on the joint equation of a system, each state in a unit of its own size.

    integrator = Integrator(ode)
    integrator.begin(t, x, step, horizon)              # at the start of a run
    x = integrator.advance(to, stop)                   # x(to); no FMU is asked for anything beyond stop
    integrator.restart(t, x)                           # after an event

Tolerances are relative to the size of each state: the largest value that it has had so far, or what the others are
about to bring it to, or what rounding moves it by, whichever is more. So a machine that moves by 1 nm is integrated as
accurately as one that moves by 1 mm, and nobody resolves noise. When a state outgrows its unit, CVODE goes on with a
larger one; units are powers of two, so that nothing is rounded.

The method is that of Adams, of order up to 12: on vibration with little damping its error is a hundredth of BDF's, at a
third of the cost. Where a fast and well damped mode would keep its step short, it is BDF, of order up to 5.
"""

import math
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim._fmi.instance import StepError
from hfsa.cosim._joint_ode import JointOde
from hfsa.cosim.system import StructureError

if TYPE_CHECKING:
    from sksundae.cvode import CVODE

TOLERANCE = 3e-14
"""Local error of a step, relative to the size of a state: 1e-10 over a hundred periods of a vibration."""

SMALLEST = 2.0**-40
"""Size of a state, relative to its nominal, below which it is taken for zero."""

GROWTH = 8.0
"""How much a state may outgrow its unit."""

STIFF = 30.0
"""Ratio of the fastest damped pole to what is to be followed from which on BDF takes fewer steps."""

_REFUSALS = ("discard", "does not converge")
"""What an FMU, or an algebraic loop, may say of a state that a shorter step does not come to."""

_STEP = 0.1
"""Usual step of CVODE, relative to the shortest time in which anything happens."""

_LINES = 3
"""Lines along which noise is measured."""

_NEGLIGIBLE = 1e-9
"""Poles below this part of the fastest one are rounding."""


class Integrator:
    """Integrates a joint equation; `StructureError` where SUNDIALS is not installed.

    Attributes:
        method: of Adams, or backward differentiation (BDF).
        time: to which CVODE has come [s].
        wants_event: whether an FMU wants an event there.
    """

    def __init__(self, ode: JointOde):
        self._ode = ode
        self._solvers = {method: _solver(self._rhs, self._differentiate, method) for method in ("Adams", "BDF")}
        self.method: Literal["Adams", "BDF"] = "Adams"
        self.time, self.wants_event = 0.0, False
        n = len(ode.x)
        self._x, self._unit, self._peak, self._nominal = np.zeros(n), np.ones(n), np.zeros(n), np.ones(n)
        self._limit = np.zeros(n)  # above which a state has outgrown its unit
        self._fastest = 0.0
        self._refusal: StepError | None = None

    def begin(self, time: float, x: np.ndarray, step: float, horizon: float) -> None:
        """Begin a run at x, (n,), that is looked at every `step` [s] and has its next event within `horizon` [s]."""
        self._peak[:] = 0.0
        self._nominal = self._ode.nominals()
        self._ode.evaluate(time, x)
        self._choose(np.linalg.eigvals(self._ode.jacobian()), step, horizon)
        self._limit[:], self._fastest = 0.0, 0.0
        self.restart(time, x)

    def restart(self, time: float, x: np.ndarray) -> None:
        """Go on from x, (n,), at a time [s] from which on the equation may be another."""
        self.time, self._x, self.wants_event = time, x, False
        if not len(x):
            return
        push = np.abs(self._ode.evaluate(time, x)) / (self._fastest or np.inf)
        self._peak = np.maximum(self._peak, np.maximum(np.abs(x), push))
        if self._is_outgrown:
            self._measure(time, x)
        self._solver.init_step(time, x / self._unit)

    def advance(self, to: float, stop: float) -> np.ndarray:
        """Return x at `to`, or at `time` where an FMU wants an event; CVODE looks ahead as far as `stop`.

        `StepError` where an FMU fails, or CVODE cannot go on.
        """
        if not len(self._x):
            self.time = to
            return self._x
        while self.time < to:
            if self._is_outgrown:
                self.restart(self.time, self._x)
            self._step(to, stop)
            self.wants_event = self._ode.complete_step(self.time, self._x)
            if self.wants_event:
                return self._x
        return self._x if self.time == to else self._unit * self._solver.step(to, "normal", stop).y

    # Frame ------------------------------------------------------------------------------------------------------------

    @property
    def _solver(self) -> "CVODE":
        return self._solvers[self.method]

    @property
    def _is_outgrown(self) -> bool:
        return bool((self._peak >= self._limit).any())

    def _step(self, to: float, stop: float) -> None:
        """Take one step of CVODE."""
        result = self._solver.step(to, "onestep", stop)
        if not result.success:
            self._fail(result.message)
        self.time, self._x, self._refusal = float(result.t), self._unit * result.y, None
        np.maximum(self._peak, np.abs(self._x), out=self._peak)

    def _rhs(self, time: float, z: np.ndarray, rates: np.ndarray) -> None:
        """What CVODE integrates; it tries a smaller step where an FMU refuses a state."""
        try:
            rates[:] = self._ode.evaluate(time, z * self._unit) / self._unit
        except StepError as error:
            if error.status not in _REFUSALS:
                raise
            self._refusal = error
            rates[:] = np.nan

    def _differentiate(self, time: float, z: np.ndarray, _rates: np.ndarray, matrix: np.ndarray) -> None:
        self._ode.evaluate(time, z * self._unit)
        matrix[:, :] = self._ode.jacobian() * self._unit / self._unit[:, None]

    def _choose(self, poles: NDArray[np.float64] | NDArray[np.complex128], step: float, horizon: float) -> None:
        """Choose the method by the poles [rad/s] of the equation at the start.

        What is to be followed is the fastest vibration; where there is none, the slowest pole, or what can be seen.
        """
        poles = poles[np.abs(poles) > _NEGLIGIBLE * np.abs(poles).max(initial=0.0)]
        is_damped = -poles.real > np.abs(poles.imag)
        damped, others = np.abs(poles[is_damped]), np.abs(poles[~is_damped])
        followed = others.max() if len(others) else damped.min(initial=1 / step)
        is_stiff = damped.max(initial=0.0) > STIFF * max(followed, 1 / horizon)
        self.method = "BDF" if is_stiff else "Adams"

    def _measure(self, time: float, x: np.ndarray) -> None:
        """Choose units by the sizes of the states.

        Within the shortest time 1 / r in which anything happens, a state of size s moves another by |J| s / r, and
        within a step rounding, which makes noise in der(x), moves it by a part of noise / r. With r the spectral radius
        of |J| no chain of states goes round and grows.
        """
        size = np.maximum(self._peak, SMALLEST * self._nominal)
        rates, jacobian = np.abs(self._ode.evaluate(time, x)), np.abs(self._ode.jacobian())
        self._fastest = float(np.abs(np.linalg.eigvals(jacobian)).max())
        if self._fastest:
            size = np.maximum(size, rates / self._fastest)
            size = _spread(size, jacobian / self._fastest)
            noise = self._noise(time, x, size) * _STEP / self._fastest
            size = _spread(np.maximum(size, noise / TOLERANCE), jacobian / self._fastest)
        self._unit = 2.0 ** np.ceil(np.log2(size))
        self._limit = GROWTH * self._unit

    def _noise(self, time: float, x: np.ndarray, size: np.ndarray) -> np.ndarray:
        """Return the standard deviation of the noise that rounding makes in der(x), (n,), where states have a size.

        Sixth differences along a line leave nothing of a smooth function, and amplify noise by a known factor (Moré and
        Wild, Estimating computational noise, 2011). Of several lines the least counts: one may cross a kink.
        """
        found = []
        for direction in np.random.default_rng(0).uniform(-1, 1, (_LINES, len(x))):
            try:
                line = [self._ode.evaluate(time, x + (1 + 1e-3 * k) * size * direction).copy() for k in range(9)]
            except StepError as error:
                if error.status not in _REFUSALS:
                    raise
                continue
            differences = np.diff(np.array(line), 6, axis=0)
            found.append(np.sqrt(np.mean(differences**2, axis=0) / math.comb(12, 6)))
        return np.min(found, axis=0) if found else np.zeros(len(x))

    def _fail(self, message: str) -> None:
        """Raise what kept CVODE from going on."""
        if self._refusal is not None:
            raise self._refusal
        worst = self._ode.states[int(np.argmax(np.abs(self._ode.evaluate(self.time, self._x)) / self._unit))]
        raise StepError(
            worst.partition(".")[0],
            "CVODE",
            "cannot go on",
            self.time,
            f"{message} The state that changes fastest is {worst}",
        )


def _spread(size: np.ndarray, gain: np.ndarray) -> np.ndarray:
    """Return sizes, (n,), none of which is smaller than another one times its gain, (n, n)."""
    for _ in range(len(size)):
        size = np.maximum(size, (gain * size).max(axis=1))
    return size


def _solver(rhs: Any, jacobian: Any, method: str) -> "CVODE":
    """Return a solver whose tolerances suit states in units of their own; they are given by the first one."""
    try:
        from sksundae.cvode import CVODE  # takes seconds
    except ImportError as error:
        raise StructureError(
            f"algorithm monolithic integrates by SUNDIALS, but its package scikit-sundae cannot be loaded ({error}). "
            "There are wheels of it for x86-64 and macOS; elsewhere it is built where SUNDIALS is installed. The "
            "algorithms of co-simulation do without"
        ) from None
    return CVODE(rhs, jacfn=jacobian, method=method, rtol=TOLERANCE, atol=TOLERANCE)
