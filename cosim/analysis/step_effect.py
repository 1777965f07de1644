"""Effect of communication steps on the responses and the stability of a system, computed before a run.

    analysis = StepAnalysis(system, instances, excitations, outputs, band=(1.0, 50.0))
    effect = analysis.effect("gauss_seidel", 50e-6)
    effect.error, effect.worst             # 2.23: the response of one output to one input at one frequency is 223 % off
    effect.hides_instability               # whether an unstable system appears stable with these steps
    analysis.errors("gauss_seidel", 50e-6, frequency)      # |G - H| / |H| of every response at given frequencies

G is the response of the algorithm's one-step matrix (`analysis/stability.py`), H that of the same linearised FMUs
without communication steps (`linear/linearize.py`), both at one operating point. The excitation is a sinusoid with its
derivatives, at unconnected inputs or in place of the outputs of a component without connected inputs (a reference or a
source).

Errors count where |H| is above -40 dB of its largest value over the band; a response that is zero by symmetry is
rounding. H is the reference also where the system is unstable and no simulation settles to it.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.stability import OSCILLATORY, CoupledStep, OneStep
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.linear.blocks import Blocks
from hfsa.cosim.linear.cycle import SINE, Source
from hfsa.cosim.linear.linearize import Growth, Linearization
from hfsa.cosim.signals.excitation import FEWEST_SAMPLES, logarithmic
from hfsa.cosim.signals.frequency_response import negligible
from hfsa.cosim.signals.response_scale import near_modes
from hfsa.cosim.systems.connectors import Connector, connector
from hfsa.cosim.systems.names import companions
from hfsa.cosim.systems.scene import SINE_SOURCE
from hfsa.cosim.systems.system import System

COUNTING = 1e-2
"""Fraction of a response's largest magnitude above which its error counts, -40 dB."""

_POINTS = 40
"""Number of frequencies over a band, in addition to those around modes."""


@dataclass(frozen=True)
class Excitation:
    """A sinusoidal excitation of a system.

    Attributes:
        name: full name of the excited variable, with its `unit` and the `amplitude` in that unit.
        system, instances: the system with the source component.
        source: the source component, with the order of derivative of each of its outputs.
        enters: excited inputs of the system without the source (full names), each with its order of derivative.
        lock_in: name of the lock-in amplifier that measures the outputs; `None` where they are recorded directly.
    """

    name: str
    unit: str
    amplitude: float
    system: System
    instances: Mapping[str, Instance]
    source: Source
    enters: Sequence[tuple[str, int]]
    lock_in: str | None = None


@dataclass(frozen=True)
class StepEffect:
    """Effect of an algorithm at one step size.

    Attributes:
        algorithm, step_size: the algorithm and its step [s].
        error: largest relative error of a response that counts, 0 without any; without excitations that of the rate of
            a mode.
        worst: that response, (output, excited variable, frequency [Hz]), `None` without any.
        own: growth without communication steps.
        growth: growth rate with communication steps [1/s], of the modes that count.
        hides_instability: whether an unstable system appears stable with the steps.
        causes_instability: whether the steps make a stable system unstable, or their passes diverge.
    """

    algorithm: str
    step_size: float
    error: float
    worst: tuple[str, str, float] | None
    own: Growth
    growth: float
    hides_instability: bool
    causes_instability: bool


@dataclass
class StepAnalysis:
    """A system with excitations and outputs; `instances` by component, with directional derivatives.

    Attributes:
        excitations: sinusoidal excitations; without any, modes are compared.
        outputs: full names of the observed outputs.
        band: lowest and highest frequency [Hz].
        ignored: outputs whose errors do not count.
    """

    system: System
    instances: Mapping[str, Instance]
    excitations: Sequence[Excitation]
    outputs: Sequence[str]
    band: tuple[float, float]
    ignored: Collection[str] = ()
    _coupled_steps: dict[str, list[CoupledStep]] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self):
        self.coupled = CoupledStep(self.system, self.instances)
        self._exact = {e.source.component: self._without(e) for e in self.excitations}

    def effect(self, algorithm: str, step_size: float) -> StepEffect:
        """Return the effect of an algorithm at a step [s].

        Raises `StructureError` where the algorithm cannot run the system or the step does not fit the sample times.
        """
        coupled, own = self.coupled.with_algorithm(algorithm), self.coupled.exact.growth
        one = coupled.over(step_size)
        if self.excitations:
            error, worst = self._largest(algorithm, step_size)
        else:
            error, worst = mode_error(coupled.exact.poles, one, self.band[0]), None
        hides, causes = self._changes_of_stability(coupled, one)
        return StepEffect(algorithm, step_size, error, worst, own, one.growth(coupled.counting), hides, causes)

    def keeps_stability(self, algorithm: str, step_size: float) -> bool:
        """Whether an algorithm at a step [s] neither hides nor causes an instability; raises as `effect`."""
        coupled = self.coupled.with_algorithm(algorithm)
        return not any(self._changes_of_stability(coupled, coupled.over(step_size)))

    def _changes_of_stability(self, coupled: CoupledStep, one: OneStep) -> tuple[bool, bool]:
        """Return whether steps hide an instability of the system, and whether they cause one."""
        own = coupled.exact.growth
        if own:
            # free motion may grow slowly because of the steps alone: that does not reveal an oscillatory instability
            return one.is_stable("oscillatory" if own.frequency >= OSCILLATORY else "all"), False
        return False, not (one.is_stable(coupled.counting) and coupled.converges(one.step_size))

    def errors(self, algorithm: str, step_size: float, frequency: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return |G - H| / |H| at frequencies [Hz], (frequencies, outputs, excitations); NaN where H is negligible."""
        exact = self.exact(frequency)
        difference = np.abs(self.stepped(algorithm, step_size, frequency) - exact)
        moves = np.broadcast_to(self._moves, exact.shape)
        return np.divide(difference, np.abs(exact), out=np.full(exact.shape, np.nan), where=moves & (exact != 0))

    def exact(self, frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Return H at frequencies [Hz], (frequencies, outputs, excitations)."""
        found = np.zeros((len(frequency), len(self.outputs), len(self.excitations)), complex)
        omega = 2j * np.pi * np.asarray(frequency, float)
        whole: dict[str, NDArray[np.complex128]] = {}
        for k, excitation in enumerate(self.excitations):
            source = excitation.source.component
            linear = self._exact[source]
            if source not in whole:
                whole[source] = linear.response(frequency, [(i,) for i in range(len(linear.inputs))])
            for name, order in excitation.enters:
                place = linear.inputs.index(".".join(self.system.split(name)))
                found[:, self._rows(excitation), k] += omega[:, None] ** order * whole[source][:, :, place]
        return found

    def stepped(self, algorithm: str, step_size: float, frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Return G at frequencies [Hz], (frequencies, outputs, excitations); raises as `effect`."""
        found = np.zeros((len(frequency), len(self.outputs), len(self.excitations)), complex)
        for k, (excitation, coupled) in enumerate(zip(self.excitations, self.coupled_steps(algorithm), strict=True)):
            found[:, self._rows(excitation), k] = coupled.over(step_size).response(frequency)
        return found

    def counts(self, size: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return whether the error of each entry of magnitudes, (frequencies, outputs, excitations), counts."""
        found = (size >= COUNTING * np.abs(self._answer).max(axis=0)) & self._moves
        found[:, [name in self.ignored for name in self.outputs]] = False
        return found

    def at(self, frequency: float) -> "StepAnalysis":
        """Return the same analysis at a single frequency [Hz]."""
        other = copy(self)
        other._moves = self._moves
        other.frequency = np.array([frequency])
        other._answer = self.exact(other.frequency)
        return other

    @property
    def jumping(self) -> set[str]:
        """Outputs that change at ticks: their recorded samples are correct, but lag behind a sinusoid."""
        found = set()
        for excitation in self.excitations:
            linear = self._exact[excitation.source.component]
            held = np.flatnonzero(linear.C[:, len(linear.states) :].any(axis=1))
            found |= {self._answering(excitation)[row] for row in held}
        return found

    def coupled_steps(self, algorithm: str) -> list[CoupledStep]:
        """Return the coupled step of an algorithm for each excitation."""
        if algorithm not in self._coupled_steps:
            base = self.coupled.with_algorithm(algorithm)
            self._coupled_steps[algorithm] = [self._with(base, excitation) for excitation in self.excitations]
        return self._coupled_steps[algorithm]

    def _with(self, base: CoupledStep, excitation: Excitation) -> CoupledStep:
        """Return a coupled step with one excitation."""
        system, instances, source = excitation.system, excitation.instances, excitation.source
        if excitation.lock_in is not None:
            return base.excited(system, instances, source, lock_in=excitation.lock_in)
        return base.excited(system, instances, source, observed=self._answering(excitation))

    def _answering(self, excitation: Excitation) -> list[str]:
        """Return the outputs of all components except the source."""
        return [self.outputs[row] for row in self._rows(excitation)]

    def _rows(self, excitation: Excitation) -> list[int]:
        """Return the indices of these outputs."""
        source = excitation.source.component
        return [i for i, name in enumerate(self.outputs) if self.system.split(name)[0] != source]

    def _without(self, excitation: Excitation) -> Linearization:
        """Return the linearised system without a source, from all inputs that the source excites."""
        source = excitation.source.component
        rest = without(self.system, source)
        ends = [
            ".".join(self.system.split(name))
            for other in self.excitations
            if other.source.component == source
            for name, _ in other.enters
        ]
        blocks = Blocks(rest, self.instances, list(dict.fromkeys(ends)), self._answering(excitation))
        return Linearization(blocks.close(), self.coupled.operating_point)

    @cached_property
    def frequency(self) -> NDArray[np.float64]:
        """Frequencies [Hz] of the comparison: over the band, and dense around modes."""
        grid = logarithmic(*self.band, _POINTS)
        return np.unique(np.concatenate([grid, near_modes(self.coupled.exact.poles, self.band)]))

    @cached_property
    def _answer(self) -> NDArray[np.complex128]:
        """H at these frequencies, (frequencies, outputs, excitations)."""
        return self.exact(self.frequency)

    @cached_property
    def _moves(self) -> NDArray[np.bool_]:
        """Whether each response is not zero by symmetry, (outputs, excitations)."""
        variables = {name: instance.fmu.variables for name, instance in self.instances.items()}
        units = [connector(self.system, variables, name).unit or "1" for name in self.outputs]
        return ~negligible(self._answer, units, np.array([e.amplitude for e in self.excitations]))

    def _largest(self, algorithm: str, step_size: float) -> tuple[float, tuple[str, str, float] | None]:
        """Return the largest error that counts, and its response."""
        frequency = self.resolved(step_size)
        return self.largest_error(frequency, self.stepped(algorithm, step_size, frequency))

    def resolved(self, step_size: float) -> NDArray[np.float64]:
        """Return the frequencies [Hz] of the comparison that a step [s] resolves; empty where it resolves none."""
        return self.frequency[self.frequency <= 1 / (FEWEST_SAMPLES * step_size) * (1 + 1e-9)]

    def largest_error(
        self, frequency: NDArray[np.float64], response: NDArray[np.complex128]
    ) -> tuple[float, tuple[str, str, float] | None]:
        """Return the largest error that counts of a response, (frequencies, outputs, excitations), and where it is.

        The place is (output, excited variable, frequency [Hz]), `None` where no entry counts; the error is infinite
        without frequencies [Hz].
        """
        if not len(frequency):
            return math.inf, None
        exact = self.exact(frequency)
        size = np.abs(exact)
        counts = self.counts(size)
        if not counts.any():
            return 0.0, None
        error = np.divide(np.abs(response - exact), size, out=np.zeros(size.shape), where=counts)
        k, output, source = (int(i) for i in np.unravel_index(int(np.argmax(error)), error.shape))
        worst = self.outputs[output], self.excitations[source].name, float(frequency[k])
        return float(error[k, output, source]), worst


def motions(system: System, instances: Mapping[str, Instance]) -> list[Excitation]:
    """Return excitations by the components without connected inputs, each motion with its derivatives.

    An output is the derivative of another where its name says so (`names.companions`) in an FMU that follows our
    conventions, or where it is that of a sine source.
    """
    found, fed = [], {system.split(connection.end)[0] for connection in system.connections}
    for component in system.components:
        own, connected = instances[component.name].fmu, _connected_outputs(system, component.name)
        if component.name in fed or own.description.states or own.description.has_sample_time or not connected:
            continue
        for orders in _families(connected, own.variables, is_sine=component.part == SINE_SOURCE):
            first = min(orders, key=orders.__getitem__)
            name, unit = f"{component.name}.{first}", own.variables[first].unit or "1"
            found.append(entering(name, unit, 1.0, system, instances, Source(component.name, orders)))
    return found


def entering(
    name: str,
    unit: str,
    amplitude: float,
    system: System,
    instances: Mapping[str, Instance],
    source: Source,
    lock_in: str | None = None,
) -> Excitation:
    """Return the excitation of a system by one of its components; arguments are the attributes of `Excitation`."""
    enters = []
    for connection in system.connections:
        component, variable = system.split(connection.start)
        to_amplifier = system.split(connection.end)[0] == lock_in
        if component == source.component and variable in source.orders and not to_amplifier:
            enters.append((connection.end, source.orders[variable]))
    return Excitation(name, unit, amplitude, system, instances, source, enters, lock_in)


def _connected_outputs(system: System, component: str) -> list[str]:
    """Return the connected outputs of a component, each once."""
    starts = [system.split(connection.start) for connection in system.connections]
    return sorted({variable for owner, variable in starts if owner == component})


def _families(outputs: Sequence[str], known: Mapping[str, Connector], is_sine: bool) -> list[dict[str, int]]:
    """Return families of outputs, each a motion and its derivatives with their orders."""
    if is_sine:
        return [{name: SINE[name] for name in outputs if name in SINE}]
    derivatives = {c: (name, order) for name in outputs for order, c in enumerate(companions(name), 1)}
    of = {name: derivatives[name] for name in outputs if name in derivatives and known[name].is_conventional}
    families = {name: {name: 0} for name in outputs if name not in of}
    for name, (base, order) in of.items():
        if base in families:
            families[base][name] = order
    return list(families.values())


def without(system: System, component: str) -> System:
    """Return the system without a component and its connections."""
    kept = [c for c in system.components if c.name != component]
    inner = [c for c in system.connections if component not in (system.split(c.start)[0], system.split(c.end)[0])]
    return System(kept, inner)


def mode_error(poles: NDArray[np.complex128], one: OneStep, lowest: float) -> float:
    """Return the largest relative error of the modes of a one-step matrix, matched one to one with the exact modes.

    Only those of the exact `poles` [1/s] count that the step resolves. The error is relative to the magnitude of the
    pole, or to 2 pi `lowest` [Hz] where that is larger; it is infinite where modes are missing.
    """
    from scipy.optimize import linear_sum_assignment  # a quarter of a second that few answers should wait for

    poles = poles[(poles.imag >= 0) & (np.abs(poles) * one.step_size <= 1)]
    found = np.array([mode.multiplier for mode in one.modes])
    if len(found) < len(poles):
        return math.inf
    ratio = found[None, :] * np.exp(-poles[:, None] * one.period)
    size = np.maximum(np.abs(poles), 2 * np.pi * lowest)
    error = np.abs(np.log(ratio)) / one.period / size[:, None]
    return float(error[linear_sum_assignment(error)].max(initial=0.0))
