"""A solver of SUNDIALS on the joint equation of a system, each state in a unit of its own size.

    integrator = Cvode(ode)                            # `cvode.py`, or `ida.py`
    integrator.begin(t, x, step, stop)                 # at the start of a run
    x = integrator.advance(to, stop)                   # x(to); no FMU is asked for anything beyond stop
    integrator.restart(t, x, stop)                     # after an event

Tolerances are relative to the size of each state: the largest value that it has had so far, or what the others are
about to bring it to, or what rounding moves it by (`noise.py`), whichever is more. So a machine that moves by 1 nm is
integrated as accurately as one that moves by 1 mm, and nobody resolves noise. When a state outgrows its unit, the
solver goes on with a larger one; units are powers of two, so that nothing is rounded. Where noise comes only later, and
keeps the steps short, it is measured again; what else keeps them short ends the run after `MOST_SHORT_STEPS`.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from importlib import import_module
from typing import Any, ClassVar

import numpy as np

from hfsa.cosim.fmi.base_instance import StepError
from hfsa.cosim.masters.monolithic.joint_ode import JointOde
from hfsa.cosim.masters.monolithic.noise import pushes, rounding_noise
from hfsa.cosim.systems.errors import StructureError

SMALLEST = 2.0**-40
"""Size of a state, relative to its nominal, below which it is taken for zero."""

GROWTH = 8.0
"""How much a state may outgrow its unit."""

MOST_STEPS = 10**6
"""Steps from one point to the next after which there is no going on."""

MOST_SHORT_STEPS = 30_000
"""The same of steps that are short."""

_SHORT = 1e-3
"""Steps relative to that time, on average, that something keeps short."""

_WINDOW = 500
"""Steps over which the average is taken."""

_ROOT = 2
"""Status of a step that ends where an event indicator changes its sign."""


class Integrator(ABC):
    """Integrates a joint equation; `StructureError` where SUNDIALS is not installed.

    Attributes:
        name: of the solver.
        tolerance: local error of a step, relative to the size of a state.
        noise_share: how much of that error noise may be at most.
        usual_step: longest usual step, relative to the shortest time in which anything happens.
        time: to which the solver has come [s].
        wants_event: whether an FMU wants an event there; `deciding` names it where its indicators tell so, else None.
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
        self._limit = np.zeros(n)  # above which a state has outgrown its unit
        self._fastest, self._value_noise = 0.0, np.zeros(len(ode.places))
        self._refusal: StepError | None = None

    def begin(self, time: float, x: np.ndarray, step: float, stop: float) -> None:
        """Begin a run at x, (n,), that is looked at every `step` [s] and comes to its next event, or end, at `stop`."""
        self._peak[:] = 0.0
        self._ode.evaluate(time, x)
        self._prepare(step, stop - time)
        self._limit[:], self._fastest = 0.0, 0.0
        self.restart(time, x, stop)

    def restart(self, time: float, x: np.ndarray, stop: float) -> None:
        """Go on from x, (n,), at a time [s] from which on, as far as `stop`, the equation may be another."""
        self.time, self._x, self.wants_event, self.deciding, self._stop = time, x, False, None, stop
        if not len(x):
            return
        push = np.abs(self._ode.evaluate(time, x)) / (self._fastest or np.inf)
        self._peak = np.maximum(self._peak, np.maximum(np.abs(x), push))
        if self._is_outgrown:
            self._measure(time, x)
        self._start(time, x)

    def advance(self, to: float, stop: float) -> np.ndarray:
        """Return x at `to`, or at `time` where an FMU wants an event; the solver looks ahead as far as `stop`.

        `StepError` where an FMU fails, or the solver cannot go on.
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

    # Frame ------------------------------------------------------------------------------------------------------------

    @property
    @abstractmethod
    def _solver(self) -> Any:
        """The solver of scikit-sundae that is at work."""

    @abstractmethod
    def _prepare(self, step: float, horizon: float) -> None:
        """Make what suits a run from the point of the last evaluation on; as `begin`."""

    @abstractmethod
    def _start(self, time: float, x: np.ndarray) -> None:
        """Let the solver begin anew at x, (n,), in the present units."""

    def _events(self, indicate: Callable[..., None]) -> dict[str, Any]:
        """Return what a solver of scikit-sundae takes to look for state events, by what writes the indicators."""
        n = len(self._ode.deciding)
        return {"eventsfn": indicate, "num_events": n} if n else {}

    @property
    def _is_outgrown(self) -> bool:
        return bool((self._peak >= self._limit).any())

    def _states(self, result: Any) -> np.ndarray:
        """Return x, (n,), of what the solver has found."""
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

        Within the shortest time 1 / r in which anything happens, a state of size s moves another by |J| s / r, and
        within a step rounding, which makes noise in der(x), moves it by a part of noise / r. With r the spectral radius
        of |J| no chain of states goes round and grows.
        """
        size = np.maximum(self._peak, SMALLEST * self._ode.nominals())  # an event may change them
        rates, jacobian = np.abs(self._ode.evaluate(time, x)), np.abs(self._ode.jacobian())
        self._fastest = float(np.abs(np.linalg.eigvals(jacobian)).max())
        if self._fastest:
            size = np.maximum(size, rates / self._fastest)
            size = _spread(size, jacobian / self._fastest)
            noise = rounding_noise(self._ode, time, x, size, self._fastest, self._stop)
            # until it is measured again what moves may have grown, and its noise with it
            noise, self._value_noise = np.split(GROWTH / self.noise_share * noise, [len(x)])
            noise *= self.usual_step / self._fastest
            size = _spread(np.maximum(size, noise / self.tolerance), jacobian / self._fastest)
        self._unit = 2.0 ** np.ceil(np.log2(size))
        self._limit = GROWTH * self._unit

    def _are_short(self, steps: int, time: float) -> bool:
        """Whether steps that lead over a time [s] are short beside what the equation has to show."""
        return time * self._fastest < _SHORT * steps

    def _ease(self, stop: float) -> None:
        """Measure the noise where the solver has come to; where it is more than before, go on in larger units."""
        unit, self._stop = self._unit, stop
        self._measure(self.time, self._x)
        self._unit, is_more = np.maximum(self._unit, unit), (self._unit > unit).any()
        self._limit = GROWTH * self._unit
        if is_more:
            self._start(self.time, self._x)

    def _give_up(self, steps: int, begin: float, to: float) -> None:
        """Raise that there is no going on from a point to the next [s], and what keeps the steps short."""
        message = f"{steps} steps do not lead to {to:.9g} s, as noise or a fast mode keeps them short"
        if self._fastest:
            mean = (self.time - begin) / steps
            message += f": {mean:.2g} s each, where the fastest mode of the FMUs has {1 / self._fastest:.2g} s"
        self._fail(f"{message}.{self._coarsest()}")

    def _coarsest(self) -> str:
        """Return a sentence on the value whose last digit moves a state most, beside the state's size; else nothing."""
        self._ode.evaluate(self.time, self._x)
        values = np.abs(self._ode.values)
        moved = (pushes(self._ode) * np.spacing(values) / self._unit[:, None]).max(axis=0, initial=0.0)
        if not moved.any():
            return ""
        worst = int(np.argmax(moved))
        return (
            f" Of what passes between them {self._ode.carried[worst]} is the coarsest: {values[worst]:.3g}, in steps "
            f"of {np.spacing(values[worst]):.2g}. A port that counts from where the machine rests, zero there, has no "
            "such steps; a larger amplitude makes them matter less, and no algorithm of co-simulation resolves them."
        )

    def _fail(self, message: str) -> None:
        """Raise what kept the solver from going on."""
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
    """Return sizes, (n,), none of which is smaller than another one times its gain, (n, n)."""
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
            "installed. The algorithms of co-simulation do without"
        ) from None
