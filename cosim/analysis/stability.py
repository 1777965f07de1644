"""Stability of co-simulation: exact modes, stable steps and frequency response of an algorithm on a linearised system.

    coupled = CoupledStep(system, instances, "gauss_seidel")
    step = coupled.over(50e-6)
    step.modes                        # modes of the one-step matrix, as rates and frequencies
    step.response(frequency)          # the response that a stepped sweep measures, by sine source and lock-in amplifier
    coupled.stability_limits(20e-6, 1e-3, kind="oscillatory")

The algorithm's actions are linear maps on the FMUs linearised at the equilibrium (`linear/cycle.py`). Their product
over one period, the least common multiple of step and sample times, is the one-step matrix. A mode with the eigenvalue
lambda of this matrix grows at the rate log|lambda| / period and oscillates at arg(lambda) / period.

A mode is oscillatory where it oscillates at `OSCILLATORY` or more, else aperiodic. The drift of a free body is
aperiodic, and an algorithm may make it grow slowly at every step, while the oscillatory modes of its springs leave the
unit circle at a definite step. A mode that decays without oscillation is aperiodic too, however fast it decays.
"""

from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np

from hfsa.cosim.actions.iterated import IteratedStep
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.linear.blocks import Block, Blocks, block
from hfsa.cosim.linear.cycle import Layout, Replace, SampleSignals, Source, operations
from hfsa.cosim.linear.linearize import FORGOTTEN, NEUTRAL, Linearization, operating_point
from hfsa.cosim.linear.portions import portions
from hfsa.cosim.masters.algorithms import DEFAULT, algorithm_named
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import System, in_order

OSCILLATORY = 1.0
"""Frequency [Hz] from which on a mode is oscillatory; a slower mode is hard to distinguish from one at 0 Hz."""

ROUNDING = 1e-8
"""Shift by rounding of a free body's double eigenvalue 1."""

Kind = Literal["aperiodic", "oscillatory", "all"]


@dataclass(frozen=True)
class Mode:
    """One eigenvalue of the one-step matrix.

    Attributes:
        multiplier: the eigenvalue, factor of the mode over one period.
        rate: growth rate [1/s]; `frequency` [Hz] >= 0.
        shape: states and sampled values at the beginning of a period, by full name, in their units.
    """

    multiplier: complex
    rate: float
    frequency: float
    shape: Mapping[str, complex]


class OneStep:
    """The one-step matrix of an algorithm at one step size.

    Attributes:
        step_size: [s]; the ticks repeat after `steps` steps, a `period` [s].
        matrix: one-step matrix over one period, on the members that act on the next period.
    """

    def __init__(self, layout: Layout, step_size: float):
        self._layout, self.step_size = layout, step_size
        self._operations = operations(layout, step_size)
        self.steps = len(self._operations)
        self.period = self.steps * step_size
        self._whole = whole = np.eye(layout.size)
        whole[[*layout.now, *layout.next]] = 0.0
        for _ in self._run(whole):
            pass
        kept = np.unique(np.concatenate([np.zeros(0, dtype=int), *self._written()]))
        self._memory = 1
        while np.any(dead := ~np.any(whole[np.ix_(kept, kept)], axis=0)):
            kept = kept[~dead]  # overwritten before it is read
            self._memory += 1
        self._kept = kept
        self.matrix = whole[np.ix_(kept, kept)]

    def _written(self) -> list[np.ndarray]:
        """Return the members that operations write; all others stay 0."""
        operations = (operation for step in self._operations for operation in step)
        return [operation.rows for operation in operations if isinstance(operation, Replace)]

    @cached_property
    def _multipliers(self) -> np.ndarray:
        """Eigenvalues of `matrix` without those of overwritten memory."""
        multipliers = np.linalg.eigvals(self.matrix)
        return multipliers[np.abs(multipliers) > FORGOTTEN]

    @cached_property
    def modes(self) -> list[Mode]:
        """All modes, the fastest growing first; one of each conjugate pair."""
        multipliers, vectors = np.linalg.eig(self.matrix)
        values = {(component, name) for component, b in self._layout.blocks.items() for name in b.values}
        places = {f"{c}.{n}": place for (c, n), place in self._layout.place.items() if (c, n) in values}
        found = []
        for multiplier, vector in zip(multipliers, vectors.T, strict=True):
            if abs(multiplier) > FORGOTTEN and multiplier.imag >= 0:
                rate, turn = np.log(abs(multiplier)) / self.period, np.angle(multiplier) / self.period
                everything = self._whole[:, self._kept] @ vector / multiplier
                shape = {name: complex(everything[place]) for name, place in places.items()}
                found.append(Mode(complex(multiplier), float(rate), float(turn / (2 * np.pi)), shape))
        return sorted(found, key=lambda mode: -mode.rate)

    @property
    def spectral_radius(self) -> float:
        """Largest magnitude of an eigenvalue of `matrix`."""
        return max((abs(mode.multiplier) for mode in self.modes), default=0.0)

    def of(self, kind: Kind) -> list[Mode]:
        """Return the modes that are aperiodic, oscillatory, or all."""
        return [m for m in self.modes if kind == "all" or (m.frequency < OSCILLATORY) == (kind == "aperiodic")]

    def growth(self, kind: Kind = "all") -> float:
        """Return the largest rate [1/s] among modes of a kind, -inf if there is none."""
        multipliers = self._multipliers
        turning = np.abs(np.angle(multipliers)) / self.period >= 2 * np.pi * OSCILLATORY
        counted = {"oscillatory": turning, "aperiodic": ~turning, "all": np.full_like(turning, True)}
        counting = multipliers[counted[kind]]
        return float(np.log(np.max(np.abs(counting))) / self.period) if len(counting) else -np.inf

    def is_stable(self, kind: Kind = "all") -> bool:
        """Whether no mode of a kind grows."""
        return self.growth(kind) <= NEUTRAL + ROUNDING / self.period

    def response(self, frequency: Sequence[float] | np.ndarray) -> np.ndarray:
        """Return the steady-state complex amplitude of each observed signal, (frequencies, signals).

        The source excites with amplitude 1 at each `frequency` [Hz]. Raises `StructureError` without a source or
        without observed signals.
        """
        observed = self._layout.observation()
        if observed is None:
            raise StructureError("a response takes a lock-in amplifier or observed outputs")
        omega = 2 * np.pi * np.asarray(frequency, float)
        v = self.periodic(omega)
        phase = np.exp(1j * omega * self.step_size)
        samples = [
            observed.matrix @ now[observed.columns] / phase ** (k + observed.points)
            for k, now in enumerate(self._run(v, omega))
        ]
        return np.mean(samples, axis=0).T

    def periodic(self, omega: np.ndarray) -> np.ndarray:
        """Return the steady-state vector at the beginning of a period, (members, f), complex.

        For a source of amplitude 1 and phase 0 at frequencies omega [rad/s], (f,). `StructureError` without a source.
        """
        layout = self._layout
        if layout.source is None:
            raise StructureError("a response takes a system with a source")
        forced = np.zeros((layout.size, len(omega)), complex)
        for _ in self._run(forced, omega):
            pass
        # in steady state the whole vector turns with the excitation
        turn, kept = np.exp(1j * omega * self.period), self._kept
        v = np.zeros_like(forced)
        for some in portions(len(omega), len(kept)):
            left = turn[some, None, None] * np.eye(len(kept)) - self.matrix
            v[kept, some] = np.linalg.solve(left, forced[kept, some].T[:, :, None])[:, :, 0].T
        for _ in range(self._memory):  # overwritten members follow from the kept ones
            v = (self._whole @ v + forced) / turn
        return v

    @property
    def transition(self) -> np.ndarray:
        """Matrix of the whole vector over one period, without the source, (members, members)."""
        return self._whole

    @property
    def layout(self) -> Layout:
        """Places of the vector's members."""
        return self._layout

    def _run(self, v: np.ndarray, omega: np.ndarray | None = None) -> Iterator[np.ndarray]:
        """Advance vectors v, (size, m), by one period in place; yield them at each sample of the observed signals.

        The source of column j is a sinusoid at `omega[j]` [rad/s] with phase 0 at the beginning; without `omega` it is
        constant.
        """
        now, after = self._layout.now, self._layout.next
        turn = 0.0
        if omega is not None:
            turn = np.exp(1j * omega * self.step_size)
            v[now] = (1j * omega) ** np.arange(len(now))[:, None]
        for step in self._operations:
            v[after] = v[now] * turn
            for operation in step:
                match operation:
                    case Replace(rows, columns, None):
                        v[rows] = v[columns]
                    case Replace(rows, columns, matrix):
                        v[rows] = matrix @ v[columns]
                    case SampleSignals():
                        yield v


class CoupledStep:
    """A communication step of an algorithm on a system linearised at its equilibrium.

    `system` may contain a sine source and a lock-in amplifier, named by `source` and `lock_in`; they take part in
    responses only. `starts` holds start values by full name. Raises `StructureError` as `linearize`.

    Attributes:
        operating_point: states, sampled states and sampled outputs at the equilibrium, by full name.
        exact: the same system without communication steps, without inputs and outputs.
        counting: kind of the modes that must not grow: all, or oscillatory ones where some motion is free, because an
            algorithm may make free motion grow slowly at every step.
    """

    def __init__(
        self,
        system: System,
        instances: Mapping[str, Instance],
        algorithm: str = DEFAULT,
        *,
        source: str | None = None,
        lock_in: str | None = None,
        starts: Mapping[str, float] | None = None,
    ):
        self._system, self._instances, self._algorithm = system, instances, algorithm
        self._source, self._lock_in = Source(source) if source else None, lock_in
        self._observed: tuple[tuple[str, str], ...] = ()
        instruments = {source, lock_in}
        components = [component for component in system.components if component.name not in instruments]
        inner = [c for c in system.connections if not {system.split(c.start)[0], system.split(c.end)[0]} & instruments]
        plain = System(components, inner)
        every = Blocks(plain, instances, [], [])
        self.operating_point = operating_point(plain, instances, every, starts or {})
        self.counting: Kind = "oscillatory" if every.is_free else "all"
        self.exact = Linearization(every.close(), self.operating_point)
        self._arrange(self._linearized())

    def excited(
        self,
        system: System,
        instances: Mapping[str, Instance],
        source: Source,
        *,
        lock_in: str | None = None,
        observed: Sequence[str] = (),
    ) -> "CoupledStep":
        """Return the same step with one component as the source of a sinusoid.

        Its response is that of the lock-in amplifier's signals, or of the `observed` outputs (full names). `system` is
        the system of this step, possibly with instruments, which `instances` then contain as well.
        """
        other = copy(self)
        other._system, other._instances = system, instances
        other._source, other._lock_in, other._observed = source, lock_in, tuple(map(system.split, observed))
        other._arrange(other._linearized())
        return other

    def _linearized(self) -> dict[str, Block]:
        """Return the linearised FMUs without instruments, from connected inputs to connected or observed outputs."""
        system = self._system
        fed = [system.split(c.end) for c in system.connections]
        shown = [*(system.split(c.start) for c in system.connections), *self._observed]
        instruments = {self._source.component if self._source else None, self._lock_in}
        return {
            name: block(self._instances[name], _of(name, fed), _of(name, shown))
            for name in (component.name for component in system.components)
            if name not in instruments
        }

    def _arrange(self, blocks: Mapping[str, Block]) -> None:
        """Create the layout of linearised FMUs that step in the order of the system."""
        self._blocks = blocks
        observation = self._source, self._lock_in, self._observed
        row = algorithm_named(self._algorithm)
        self._layout = row.layout_of(self._system, self._instances, blocks, *observation)

    def with_algorithm(self, algorithm: str) -> "CoupledStep":
        """Return the step of another algorithm on the same linearised FMUs; raises as the constructor."""
        other = copy(self)
        other._algorithm = algorithm
        other._arrange(self._blocks)
        return other

    def in_order(self, names: Sequence[str]) -> "CoupledStep":
        """Return the step with components in another order (`system.in_order`) on the same linearised FMUs."""
        other = copy(self)
        other._system = in_order(self._system, names)
        other._arrange(self._blocks)
        return other

    def over(self, step_size: float) -> OneStep:
        """Return the one-step matrix at a step size [s]; `StructureError` where it does not fit the sample times."""
        return OneStep(self._layout, step_size)

    def is_stable(self, step_size: float) -> bool:
        """Whether no mode of the kind `counting` grows at a step [s], and its passes converge; raises as `over`."""
        return self.over(step_size).is_stable(self.counting) and self.converges(step_size)

    def converges(self, step_size: float) -> bool:
        """Whether the passes of a `fixed_point` step [s] converge; true for other algorithms."""
        return self.contraction(step_size) < 1

    def contraction(self, step_size: float) -> float:
        """Return the asymptotic factor of the error from pass to pass of a `fixed_point` step [s]; 0 for others.

        Ticks take place before the passes.
        """
        for action in self._layout.cycle:
            if isinstance(action, IteratedStep) and action.method == "fixed_point":
                steps = [self._layout.step(other.instance, step_size, 0) for other in self._layout.wiring.continuous]
                jacobian = self._layout.interface_jacobian(action, step_size, steps)
                return float(np.max(np.abs(np.linalg.eigvals(jacobian)), initial=0.0))
        return 0.0

    def stability_limits(
        self, shortest: float, longest: float, *, kind: Kind = "all", points: int = 60, accuracy: float = 1e-6
    ) -> list[float]:
        """Return the steps [s] within a range at which stability of a kind of modes is lost or regained, ascending.

        The range is scanned at `points` steps in geometric progression, and each change is bisected to a relative
        `accuracy`. For systems without ticks only, where every step size is possible.
        """
        steps = np.geomspace(shortest, longest, points)
        stable = [self.over(step).is_stable(kind) for step in steps]
        limits = []
        for (low, high), (was, now) in zip(pairwise(steps), pairwise(stable), strict=True):
            while was != now and high - low > accuracy * high:
                middle = (low + high) / 2
                low, high = (middle, high) if self.over(middle).is_stable(kind) == was else (low, middle)
            if was != now:
                limits.append(float((low + high) / 2))
        return limits


def _of(component: str, variables: Sequence[tuple[str, str]]) -> list[str]:
    """Return the variables of a component among pairs (component, variable)."""
    return [variable for owner, variable in variables if owner == component]
