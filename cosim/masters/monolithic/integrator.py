"""Integration of the joint equation of a system by a solver of SUNDIALS, each state in a unit of its own size.

    integrator = Cvode(ode)                            # `cvode.py`, or `ida.py`
    integrator.begin(t, x, step, stop)                 # at the start of a run
    x = integrator.advance(to, stop)                   # x(to); no FMU is evaluated beyond stop
    integrator.restart(t, x, stop)                     # after an event

Tolerances are relative to the size of each state: its largest value so far, its expected motion by other states, or its
motion by rounding (`noise.py`), whichever is largest. So a machine that moves by 1 nm is integrated as accurately as
one that moves by 1 mm, and noise is not resolved. When a state outgrows its unit, the solver restarts with a larger
one; units are powers of two, so that scaling causes no rounding. Where noise appears later and keeps the steps short,
it is measured again; a run with short steps for another reason ends after `MOST_SHORT_STEPS`.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from importlib import import_module
from typing import Any, ClassVar

import numpy as np

from hfsa.cosim.fmi.step_error import StepError
from hfsa.cosim.masters.monolithic.joint_ode import JointOde
from hfsa.cosim.masters.monolithic.noise import pushes, rounding_noise
from hfsa.cosim.systems.errors import StructureError

SMALLEST = 2.0**-40
"""Size of a state, relative to its nominal, below which it counts as zero."""

GROWTH = 8.0
"""Largest ratio of a state to its unit."""

MOST_STEPS = 10**6
"""Largest number of steps from one point to the next."""

MOST_SHORT_STEPS = 30_000
"""Largest number of short steps from one point to the next."""

_SHORT = 1e-3
"""Average step, relative to the shortest time constant, below which steps are short."""

_WINDOW = 500
"""Steps over which the average is taken."""

_ROOT = 2
"""Status of a solver step that ends at a sign change of an event indicator."""


class Integrator(ABC):
    """Integrator of a joint equation; `StructureError` where SUNDIALS is not installed.

    Attributes:
        name: name of the solver.
        tolerance: local error of a step, relative to the size of a state.
        noise_share: largest share of noise in that error.
        usual_step: longest usual step, relative to the shortest time constant.
        time: time reached by the solver [s].
        wants_event: whether an FMU requires an event there; `deciding` names the FMU whose indicator changed its sign,
            `None` where another condition requires the event.
    """

    name: ClassVar[str]
    tolerance: ClassVar[float]
    noise_share: ClassVar[float]
    usual_step: ClassVar[float]

    def __init__(self, ode: JointOde):
        self._ode = ode
        self.time, self.wants_event = 0.0, False
        self.deciding: str | None = None
        self._stop = 0.0
        n = len(ode.x)
        self._x, self._unit, self._peak = np.zeros(n), np.ones(n), np.zeros(n)
        self._limit = np.zeros(n)  # a larger state has outgrown its unit
        self._span = 1.0
        self._fastest, self._value_noise = 0.0, np.zeros(len(ode.places))
        self._refusal: StepError | None = None

    def begin(self, time: float, x: np.ndarray, step: float, stop: float) -> None:
        """Begin a run at x, (n,), recorded every `step` [s], with the next event or the end at `stop` [s]."""
        self._peak[:] = 0.0
        self._ode.evaluate(time, x)
        self._prepare(step, stop - time)
        self._limit[:], self._fastest, self._span = 0.0, 0.0, min(step, stop - time)
        self.restart(time, x, stop)

    def restart(self, time: float, x: np.ndarray, stop: float) -> None:
        """Restart from x, (n,), at a time [s] after which the equation may differ; it holds up to `stop` [s]."""
        self.time, self._x, self.wants_event, self.deciding, self._stop = time, x, False, None, stop
        if not len(x):
            return
        push = np.abs(self._ode.evaluate(time, x)) / (self._fastest or np.inf)
        if self._fastest:
            push = np.maximum(push, self._driven(time, x))
        self._peak = np.maximum(self._peak, np.maximum(np.abs(x), push))
        if self._is_outgrown:
            self._measure(time, x)
        self._start(time, x)

    def advance(self, to: float, stop: float) -> np.ndarray:
        """Return x at `to`, or at `time` where an FMU requires an event; the solver evaluates up to `stop`.

        Raises `StepError` where an FMU or the solver fails.
        """
        if not len(self._x):
            self.time = to
            return self._x
        steps, begin, window = 0, self.time, self.time
        while self.time < to:
            if steps and steps % _WINDOW == 0:
                if self._are_short(_WINDOW, self.time - window):
                    self._ease(stop)
                window = self.time
            if steps == MOST_STEPS or (steps == MOST_SHORT_STEPS and self._are_short(steps, self.time - begin)):
                self._give_up(steps, begin, to)
            steps += 1
            if self._is_outgrown:
                self.restart(self.time, self._x, stop)
            self._step(to, stop)
            self.wants_event = self._ode.complete_step(self.time, self._x) or self.deciding is not None
            if self.wants_event:
                return self._x
        return self._x if self.time == to else self._states(self._solver.step(to, "normal", stop))

    # Solver -----------------------------------------------------------------------------------------------------------

    @property
    @abstractmethod
    def _solver(self) -> Any:
        """The active solver of scikit-sundae."""

    @abstractmethod
    def _prepare(self, step: float, horizon: float) -> None:
        """Prepare a run from the point of the last evaluation on; arguments as of `begin`."""

    @abstractmethod
    def _start(self, time: float, x: np.ndarray) -> None:
        """Initialise the solver at x, (n,), in the present units."""

    def _events(self, indicate: Callable[..., None]) -> dict[str, Any]:
        """Return the options of a scikit-sundae solver for state events; `indicate` writes the indicators."""
        n = len(self._ode.deciding)
        return {"eventsfn": indicate, "num_events": n} if n else {}

    @property
    def _is_outgrown(self) -> bool:
        return bool((self._peak >= self._limit).any())

    def _states(self, result: Any) -> np.ndarray:
        """Return x, (n,), of a solver result."""
        return self._unit * result.y[: len(self._unit)]

    def _step(self, to: float, stop: float) -> None:
        """Take one step of the solver."""
        result = self._solver.step(to, "onestep", stop)
        if not result.success:
            self._fail(result.message)
        self.time, self._x, self._refusal = float(result.t), self._states(result), None
        is_root = result.status == _ROOT
        self.deciding = self._ode.deciding[int(np.flatnonzero(result.i_events[-1])[0])] if is_root else None
        np.maximum(self._peak, np.abs(self._x), out=self._peak)

    def _measure(self, time: float, x: np.ndarray) -> None:
        """Choose units by the sizes of the states.

        Within the shortest time constant 1 / r a state of size s moves another state by |J| s / r; within a step noise
        in der(x) by rounding moves a state by a fraction of noise / r. r is the spectral radius of |J|, so that sizes
        stay bounded along every cycle of states.
        """
        size = np.maximum(self._peak, SMALLEST * self._ode.nominals())  # an event may change them
        rates, jacobian = np.abs(self._ode.evaluate(time, x)), np.abs(self._ode.jacobian())
        self._fastest = float(np.abs(np.linalg.eigvals(jacobian)).max())
        size = np.maximum(size, self._driven(time, x))
        if self._fastest:
            size = np.maximum(size, rates / self._fastest)
            size = _spread(size, jacobian / self._fastest)
            noise = rounding_noise(self._ode, time, x, size, self._fastest, self._stop)
            # states, and noise with them, may grow until the next measurement
            noise, self._value_noise = np.split(GROWTH / self.noise_share * noise, [len(x)])
            noise *= self.usual_step / self._fastest
            size = _spread(np.maximum(size, noise / self.tolerance), jacobian / self._fastest)
        self._unit = 2.0 ** np.ceil(np.log2(size))
        self._limit = GROWTH * self._unit

    def _driven(self, time: float, x: np.ndarray) -> np.ndarray:
        """Return how far driven inputs push each state within the shortest time constant, (n,).

        Where there is none, within the time from one point to the next. Zero where no input is driven.
        """
        span = min(1 / self._fastest, self._span) if self._fastest else self._span
        return np.abs(self._ode.driven_rates(time, x, span)) * span

    def _are_short(self, steps: int, time: float) -> bool:
        """Whether steps over a time [s] are short compared with the shortest time constant."""
        return time * self._fastest < _SHORT * steps

    def _ease(self, stop: float) -> None:
        """Measure the noise at the present point; where it is larger than before, continue in larger units."""
        unit, self._stop = self._unit, stop
        self._measure(self.time, self._x)
        self._unit, is_more = np.maximum(self._unit, unit), (self._unit > unit).any()
        self._limit = GROWTH * self._unit
        if is_more:
            self._start(self.time, self._x)

    def _give_up(self, steps: int, begin: float, to: float) -> None:
        """Raise `StepError` for too many steps from a point to the next [s], with the reason for short steps."""
        message = f"{steps} steps do not lead to {to:.9g} s, as noise or a fast mode keeps them short"
        if self._fastest:
            mean = (self.time - begin) / steps
            message += f": {mean:.2g} s each, where the fastest mode of the FMUs has {1 / self._fastest:.2g} s"
        self._fail(f"{message}.{self._coarsest()}")

    def _coarsest(self) -> str:
        """Return a sentence on the value whose last digit moves a state most, relative to its size; else empty."""
        self._ode.evaluate(self.time, self._x)
        values = np.abs(self._ode.values)
        moved = (pushes(self._ode) * np.spacing(values) / self._unit[:, None]).max(axis=0, initial=0.0)
        if not moved.any():
            return ""
        worst = int(np.argmax(moved))
        return (
            f" Of the coupling values {self._ode.carried[worst]} is the coarsest: {values[worst]:.3g}, in steps "
            f"of {np.spacing(values[worst]):.2g}. A port that is zero where the machine rests has no such steps; a "
            "larger amplitude reduces their effect, and no algorithm of co-simulation resolves them."
        )

    def _fail(self, message: str) -> None:
        """Raise the refusal of an FMU, else the failure of the solver."""
        if self._refusal is not None:
            raise self._refusal
        worst = self._ode.states[int(np.argmax(np.abs(self._ode.evaluate(self.time, self._x)) / self._unit))]
        raise StepError(
            worst.partition(".")[0],
            self.name,
            "cannot go on",
            self.time,
            f"{message} The state that changes fastest is {worst}",
        )


def _spread(size: np.ndarray, gain: np.ndarray) -> np.ndarray:
    """Return sizes, (n,), increased so that none is smaller than another one times its gain, (n, n)."""
    for _ in range(len(size)):
        size = np.maximum(size, (gain * size).max(axis=1))
    return size


def sundials(module: str, name: str) -> Any:
    """Return a class of scikit-sundae; `StructureError` where that is not installed."""
    try:
        return getattr(import_module(f"sksundae.{module}"), name)  # takes seconds
    except ImportError as error:
        raise StructureError(
            f"algorithms monolithic and monolithic_dae integrate by SUNDIALS, but its package scikit-sundae cannot be "
            f"loaded ({error}). There are wheels of it for x86-64 and macOS; elsewhere it is built where SUNDIALS is "
            "installed. The co-simulation algorithms do not need it"
        ) from None
