"""What communication steps do to a system's responses and to its stability, known before anything runs.

    question = Question(system, instances, excitations, outputs, band=(1.0, 50.0))
    effect = question.effect("gauss_seidel", 50e-6)
    effect.error, effect.worst             # 2.23: the response of one output to one input at one frequency is 223 % off
    effect.is_hidden                       # whether the steps make a system look stable that is not
    question.errors(cycle, frequency)      # |G - H| / |H| of every response at given frequencies

G is the response that the algorithm's one-step matrix gives (`analysis/stability.py`), H that of the same linearised
FMUs without communication steps (`linear/linearize.py`), both at one operating point. Excited are free inputs, or what
a component that nothing feeds puts out by itself, a reference or a source: it is taken for a sinusoid with its
derivatives.

Of errors those count whose |H| is above -40 dB of its largest over the band; a response that is zero by symmetry is
rounding. H is the truth also where the system is unstable, and nothing settles to it.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from hfsa.cosim.analysis.stability import OSCILLATORY, Cycle, OneStep
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.linear.blocks import Blocks
from hfsa.cosim.linear.cycle import SINE, Source
from hfsa.cosim.linear.linearize import Growth, Linearization
from hfsa.cosim.signals.excitation import FEWEST_SAMPLES, logarithmic
from hfsa.cosim.signals.frequency_response import negligible
from hfsa.cosim.signals.response_scale import near_modes
from hfsa.cosim.systems.connectors import connector
from hfsa.cosim.systems.names import companions
from hfsa.cosim.systems.scene import SINE_SOURCE
from hfsa.cosim.systems.system import System

COUNTING = 1e-2
"""Part of a response's largest magnitude above which its error counts, -40 dB."""

_POINTS = 40
"""Frequencies over a band; those around modes come on top."""


@dataclass(frozen=True)
class Excitation:
    """One sinusoid that enters a system.

    Attributes:
        name: of what is excited, full, with its `unit` and the `amplitude` in it.
        system, instances: with the component that puts the sinusoid out.
        source: that component, and the derivatives that its outputs are.
        enters: unconnected inputs of the system without the source (full names), each with the derivative that enters.
        lock_in: an amplifier in the system whose signals are the outputs; without one they are as they are recorded.
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
class Effect:
    """What an algorithm with a step does.

    Attributes:
        algorithm, step_size: [s].
        error: largest relative error of a response that counts, 0 where there is none; without excitations that of
            the rate of a mode.
        worst: that response, (output, what is excited, frequency [Hz]), `None` where there is none.
        own: growth without communication steps.
        growth: with them [1/s], of the modes that count.
        is_hidden: whether the steps make a system look stable that is not.
        is_made: whether they make one unstable that is not, or a pass of theirs diverges.
    """

    algorithm: str
    step_size: float
    error: float
    worst: tuple[str, str, float] | None
    own: Growth
    growth: float
    is_hidden: bool
    is_made: bool


@dataclass
class Question:
    """A system and what is wanted of it; `instances` are of its components, with directional derivatives.

    Attributes:
        excitations: what enters; without any, modes are compared.
        outputs: full names of what answers.
        band: lowest and highest frequency [Hz].
        ignored: outputs whose errors do not count.
    """

    system: System
    instances: Mapping[str, Instance]
    excitations: Sequence[Excitation]
    outputs: Sequence[str]
    band: tuple[float, float]
    ignored: Collection[str] = ()
    _cycles: dict[str, list[Cycle]] = field(default_factory=dict, init=False, repr=False)

    def __post_init__(self):
        self.cycle = Cycle(self.system, self.instances)
        self._exact = {e.source.component: self._without(e) for e in self.excitations}

    def effect(self, algorithm: str, step_size: float) -> Effect:
        """Return what an algorithm does with a step [s].

        `StructureError` where the algorithm is not offered or the step does not fit the sample times.
        """
        cycle, own = self.cycle.with_algorithm(algorithm), self.cycle.exact.growth
        one = cycle.over(step_size)
        if self.excitations:
            error, worst = self._largest(algorithm, step_size)
        else:
            error, worst = mode_error(cycle.exact.poles, one, self.band[0]), None
        # a free motion may grow slowly by the steps alone, which shows no instability that oscillates
        is_hidden = bool(own) and one.is_stable("oscillatory" if own.frequency >= OSCILLATORY else "all")
        is_made = not own and not (one.is_stable(cycle.counting) and cycle.converges(step_size))
        return Effect(algorithm, step_size, error, worst, own, one.growth(cycle.counting), is_hidden, is_made)

    def errors(self, algorithm: str, step_size: float, frequency: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return |G - H| / |H| at frequencies [Hz], (frequencies, outputs, excitations); NaN where H is negligible."""
        exact = self.exact(frequency)
        difference = np.abs(self.stepped(algorithm, step_size, frequency) - exact)
        moves = np.broadcast_to(self._moves, exact.shape)
        return np.divide(difference, np.abs(exact), out=np.full(exact.shape, np.nan), where=moves & (exact != 0))

    def exact(self, frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Return H at frequencies [Hz], output per excitation, (frequencies, outputs, excitations)."""
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
        """Return G at frequencies [Hz], shaped as H; errors as of `effect`."""
        found = np.zeros((len(frequency), len(self.outputs), len(self.excitations)), complex)
        for k, (excitation, cycle) in enumerate(zip(self.excitations, self._excited(algorithm), strict=True)):
            found[:, self._rows(excitation), k] = cycle.over(step_size).response(frequency)
        return found

    def at(self, frequency: float) -> "Question":
        """Return the same question, of one frequency [Hz] alone."""
        other = copy(self)
        other._moves = self._moves
        other.frequency = np.array([frequency])
        other._answer = self.exact(other.frequency)
        return other

    @property
    def jumping(self) -> set[str]:
        """Outputs that change at ticks: what is recorded of them is right, but for a sinusoid a sample lags them."""
        found = set()
        for excitation in self.excitations:
            linear = self._exact[excitation.source.component]
            held = np.flatnonzero(linear.C[:, len(linear.states) :].any(axis=1))
            found |= {self._answering(excitation)[row] for row in held}
        return found

    def _excited(self, algorithm: str) -> list[Cycle]:
        """Return the algorithm's cycle for each excitation."""
        if algorithm not in self._cycles:
            base = self.cycle.with_algorithm(algorithm)
            self._cycles[algorithm] = [self._with(base, excitation) for excitation in self.excitations]
        return self._cycles[algorithm]

    def _with(self, base: Cycle, excitation: Excitation) -> Cycle:
        """Return a cycle with one excitation."""
        system, instances, source = excitation.system, excitation.instances, excitation.source
        if excitation.lock_in is not None:
            return base.excited(system, instances, source, lock_in=excitation.lock_in)
        return base.excited(system, instances, source, observed=self._answering(excitation))

    def _answering(self, excitation: Excitation) -> list[str]:
        """Return the outputs that do not belong to the source itself."""
        return [self.outputs[row] for row in self._rows(excitation)]

    def _rows(self, excitation: Excitation) -> list[int]:
        """Return the places of these outputs."""
        source = excitation.source.component
        return [i for i, name in enumerate(self.outputs) if self.system.split(name)[0] != source]

    def _without(self, excitation: Excitation) -> Linearization:
        """Return the system without a source, from all inputs that any excitation of it enters."""
        source = excitation.source.component
        rest = without(self.system, source)
        ends = [
            ".".join(self.system.split(name))
            for other in self.excitations
            if other.source.component == source
            for name, _ in other.enters
        ]
        blocks = Blocks(rest, self.instances, list(dict.fromkeys(ends)), self._answering(excitation))
        return Linearization(blocks.close(), self.cycle.operating_point)

    @cached_property
    def frequency(self) -> NDArray[np.float64]:
        """Frequencies [Hz] that are looked at: over the band, and close together around modes."""
        grid = logarithmic(*self.band, _POINTS)
        return np.unique(np.concatenate([grid, near_modes(self.cycle.exact.poles, self.band)]))

    @cached_property
    def _answer(self) -> NDArray[np.complex128]:
        """H at these frequencies."""
        return self.exact(self.frequency)

    @cached_property
    def _moves(self) -> NDArray[np.bool_]:
        """Which responses are not zero by symmetry, (outputs, excitations)."""
        variables = {name: instance.fmu.variables for name, instance in self.instances.items()}
        units = [connector(self.system, variables, name).unit or "1" for name in self.outputs]
        return ~negligible(self._answer, units, np.array([e.amplitude for e in self.excitations]))

    def _largest(self, algorithm: str, step_size: float) -> tuple[float, tuple[str, str, float] | None]:
        """Return the largest error that counts, and of which response it is."""
        resolved = self.frequency <= 1 / (FEWEST_SAMPLES * step_size) * (1 + 1e-9)
        if not resolved.any():
            return math.inf, None
        frequency, size = self.frequency[resolved], np.abs(self._answer[resolved])
        counts = (size >= COUNTING * np.abs(self._answer).max(axis=0)) & self._moves
        counts[:, [name in self.ignored for name in self.outputs]] = False
        if not counts.any():
            return 0.0, None
        difference = np.abs(self.stepped(algorithm, step_size, frequency) - self._answer[resolved])
        error = np.divide(difference, size, out=np.zeros(size.shape), where=counts)
        k, output, source = (int(i) for i in np.unravel_index(int(np.argmax(error)), error.shape))
        worst = self.outputs[output], self.excitations[source].name, float(frequency[k])
        return float(error[k, output, source]), worst


def motions(system: System, instances: Mapping[str, Instance]) -> list[Excitation]:
    """Return what components that nothing feeds put out by themselves, each motion with its derivatives.

    An output is the derivative of another where it is named so (`system.companions`), or is a sine source's.
    """
    found, fed = [], {system.split(connection.end)[0] for connection in system.connections}
    for component in system.components:
        own, shown = instances[component.name].fmu, _shown(system, component.name)
        if component.name in fed or own.description.states or own.description.has_sample_time or not shown:
            continue
        for orders in _families(shown, is_sine=component.part == SINE_SOURCE):
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


def _shown(system: System, component: str) -> list[str]:
    """Return the connected outputs of a component, each once."""
    starts = [system.split(connection.start) for connection in system.connections]
    return sorted({variable for owner, variable in starts if owner == component})


def _families(outputs: Sequence[str], is_sine: bool) -> list[dict[str, int]]:
    """Return outputs that are one motion and its derivatives, by order."""
    if is_sine:
        return [{name: SINE[name] for name in outputs if name in SINE}]
    derivatives = {c: (name, order) for name in outputs for order, c in enumerate(companions(name), 1)}
    of = {name: derivatives[name] for name in outputs if name in derivatives}
    families = {name: {name: 0} for name in outputs if name not in of}
    for name, (base, order) in of.items():
        if base in families:
            families[base][name] = order
    return list(families.values())


def without(system: System, component: str) -> System:
    """Return the system without a component and what it is joined by; itself where it has no such component."""
    kept = [c for c in system.components if c.name != component]
    inner = [c for c in system.connections if component not in (system.split(c.start)[0], system.split(c.end)[0])]
    return System(kept, inner)


def mode_error(poles: NDArray[np.complex128], one: OneStep, lowest: float) -> float:
    """Return the largest relative error of a mode of a one-step matrix, each exact one having one to itself.

    Those of the exact `poles` [1/s] count that a step resolves. An error is relative to the mode's rate, or where that
    is slower, to 2 pi `lowest` [Hz]; it is infinite where modes are lacking.
    """
    poles = poles[(poles.imag >= 0) & (np.abs(poles) * one.step_size <= 1)]
    found = np.array([mode.multiplier for mode in one.modes])
    if len(found) < len(poles):
        return math.inf
    ratio = found[None, :] * np.exp(-poles[:, None] * one.period)
    size = np.maximum(np.abs(poles), 2 * np.pi * lowest)
    error = np.abs(np.log(ratio)) / one.period / size[:, None]
    return float(error[linear_sum_assignment(error)].max(initial=0.0))
