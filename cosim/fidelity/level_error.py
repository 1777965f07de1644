"""Error of a cheaper level of fidelity: the difference of a system's response or motion from that of a reference.

    reference = reference_of(scene, library)                # the scene at its reference levels
    reference.error(cheaper)                                # 0.012: 1.2 %

For a scene with inputs the error is that of its response H(f), outputs over inputs, from the FMUs' directional
derivatives, at frequencies over the band and dense around every mode of both systems:

    error = max |H - H_ref| / h        h = |H_ref|, its notches filled (`signals/response_scale.py`)

Entries that are zero by symmetry do not count. An output that depends on no state and no input, but does at the
reference, is missing: an error of 1, whether the inputs reach it or not.

Where the two systems differ in a nonlinear FMU, the response depends on the amplitude as well. The effect of the
amplitude on the response and on harmonics is measured for both systems (`fidelity/nonlinearity.py`) at the ends of the
band and at the peak of the response, and its difference relative to h is added to the error. This takes a
co-simulation, so it is done only where the linear error is within the tolerance and an FMU's Jacobian changes enough
over the amplitudes of its states and inputs, which follow from the linear response. The threshold is a thousandth of
the tolerance, reduced by the ratio of the smallest entry to the largest in its unit; behind a resonance of 40 dB such a
change has an effect of a tenth of the tolerance.

For a scene with its own motion the error is the largest difference of an output at any time from 0 to the stop time,
relative to the peak of the output.
"""

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.assembly.assemble import assemble
from hfsa.cosim.assembly.build import build, with_ports
from hfsa.cosim.fidelity.nonlinearity import AmplitudeEffect, measure_amplitude_effect, nonlinearity
from hfsa.cosim.fidelity.step_judge import with_algorithm
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.linear.linearize import entering, linearize, sinusoids, upstream
from hfsa.cosim.masters.algorithms import open_master
from hfsa.cosim.measurement.sweep import LinearSweep, plan_sweep
from hfsa.cosim.measurement.task import REST, Settings
from hfsa.cosim.signals.excitation import FEWEST_SAMPLES, logarithmic
from hfsa.cosim.signals.frequency_response import negligible
from hfsa.cosim.signals.response_scale import Scale, near_modes
from hfsa.cosim.systems.connectors import Connector, connector
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import System

_POINTS = 400
_LONGEST_PERIOD = 5000
"""Largest number of steps in a period of a co-simulated sine: lower frequencies of a wide band would take minutes."""


class Reference(Protocol):
    """Response or motion of a scene at its reference levels."""

    def error(self, system: System) -> float:
        """Return the relative error of a system that differs in levels only.

        Raises `StructureError` where the system cannot be wired, linearised or compared; `StepError` where it does not
        run.
        """
        ...


def reference_of(scene: Scene, library: Path | None, start: str = REST) -> Reference:
    """Return the reference of a scene; `library` is the stepping loop in C, `None` for Python's.

    `start` is the state in which sines begin, one of `STARTS`, where the effect of the amplitude is measured.
    Raises `StructureError` where the scene has no response or motion at its reference levels.
    """
    return ReferenceResponses(scene, library, start) if scene.inputs else ReferenceMotion(scene, library)


_NOTHING = 1e-12
"""Amplitude of an output, relative to its nominal, below which it is rounding."""

_NONLINEAR = 1e-3
"""Nonlinearity of an FMU, relative to the tolerance, above which it is not linear."""


@dataclass(frozen=True)
class _Linearized:
    """A linearised system whose first outputs are those of the scene, and the nonlinearity of each component."""

    sweep: LinearSweep
    outputs: int
    nonlinearity: Mapping[str, float]

    def response(self, frequency: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Return the scene's responses at frequencies [Hz], (frequencies, outputs, inputs)."""
        return self.sweep.response(frequency)[:, : self.outputs]

    @property
    def constant_outputs(self) -> set[int]:
        """Indices of the scene's outputs that depend on no state and no input."""
        follows = np.hstack([self.sweep.found.C, self.sweep.found.D])[: self.outputs].any(axis=1)
        return set(np.flatnonzero(~follows).tolist())

    def nonlinear(self, most: float) -> set[str]:
        """Return the components with a nonlinearity above `most`."""
        return {name for name, nonlinearity in self.nonlinearity.items() if nonlinearity > most}


class ReferenceResponses:
    """Reference responses of a scene with inputs."""

    def __init__(self, scene: Scene, library: Path | None, start: str):
        self._scene, self._library, self._start = scene, library, start
        assembly = build(scene.system).check()
        self._grid = logarithmic(*scene.band, _POINTS)
        arguments = (scene.inputs, scene.outputs, self._grid, scene.amplitude)
        self._inputs = plan_sweep(assembly, *arguments, Settings(method="linear")).inputs
        self._reference = self._linearized(assembly)
        self._size = np.abs(self._reference.response(self._grid))
        amplitudes = [signal.amplitude for signal in self._inputs]
        self._counts = _counting(self._size, scene, assembly, amplitudes)
        self._scale = Scale(self._grid, self._size)
        self._linear_up_to = _NONLINEAR * scene.tolerance * self._smallest(assembly, amplitudes)

    def error(self, system: System) -> float:
        """Return the error of a system; raises as `Reference.error`."""
        found = self._linearized(build(system).check())
        if found.sweep.growth and not self._reference.sweep.growth:
            raise StructureError(f"a mode grows by {found.sweep.growth:.3g} 1/s, which none of the reference does")
        if found.constant_outputs - self._reference.constant_outputs:
            return 1.0
        frequency = self._frequencies(self._reference.sweep, found.sweep)
        reference = self._reference.response(frequency)
        difference = np.abs(found.response(frequency) - reference) / self._scale.at(frequency, reference)
        error = float(difference[:, self._counts].max())
        differing = {c.name for c in system.components if c != self._scene.system[c.name]}
        nonlinear = found.nonlinear(self._linear_up_to)
        if error <= self._scene.tolerance and differing & (nonlinear | self._reference.nonlinear(self._linear_up_to)):
            error += self._amplitude_error(system if nonlinear else None)
        return error

    def _linearized(self, assembly: Assembly) -> _Linearized:
        """Return a system linearised at its operating point."""
        scene = self._scene
        system = upstream(assembly.system, [*scene.inputs, *scene.outputs])
        with assembly.of(system).open() as instances:
            columns, orders = sinusoids(system, instances, scene.inputs)
            feeding = [connection.start for connection in system.connections]
            found = LinearSweep(linearize(system, instances, columns, [*scene.outputs, *feeding]), orders)
            swing = self._swing(found, system, instances)
            nonlinearities = {}
            for name, instance in instances.items():
                own = {variable: size for (owner, variable), size in swing.items() if owner == name}
                seen = dict.fromkeys(v for o, v in map(system.split, found.found.outputs) if o == name)
                nonlinearities[name] = nonlinearity(instance, own, list(seen))
            return _Linearized(found, len(scene.outputs), nonlinearities)

    def _swing(
        self, found: LinearSweep, system: System, instances: Mapping[str, Instance]
    ) -> dict[tuple[str, str], float]:
        """Return the largest amplitude over the band of each state and input, by component and variable.

        With ticks the amplitude of a state is its nominal.
        """
        linear, amplitudes = found.found, np.array([signal.amplitude for signal in self._inputs])
        states, inputs, n = np.zeros(len(linear.states)), np.zeros(len(linear.inputs)), len(linear.states)
        if linear.is_sampled:
            variables = {name: instance.fmu.variables for name, instance in instances.items()}
            states = np.array([abs(connector(system, variables, name).nominal) for name in linear.states])
        for frequency in self._frequencies(found):
            omega = 2 * np.pi * frequency
            enters = entering(np.array([omega]), found.orders, len(linear.inputs))[0] * amplitudes
            inputs = np.maximum(inputs, np.abs(enters).max(axis=1))
            if not linear.is_sampled:
                x = np.linalg.solve(1j * omega * np.eye(n) - linear.A, linear.B @ enters)
                states = np.maximum(states, np.abs(x).max(axis=1))
        reached = np.abs(found.response(self._grid) * amplitudes).max(axis=(0, 2))
        outputs = dict(zip(linear.outputs, reached.tolist(), strict=True))
        fed = {connection.end: outputs[connection.start] for connection in system.connections}
        named = dict(zip([*linear.states, *linear.inputs], [*states.tolist(), *inputs.tolist()], strict=True))
        return {system.split(name): size for name, size in {**named, **fed}.items()}

    def _smallest(self, assembly: Assembly, amplitudes: Sequence[float]) -> float:
        """Return the smallest entry that counts, relative to the largest in its unit."""
        units = [assembly.connector(name).unit for name in self._scene.outputs]
        size = self._size.max(axis=0) * amplitudes
        largest = np.array([max(size[i].max() for i, u in enumerate(units) if u == unit) for unit in units])
        return float((size / np.maximum(largest, np.finfo(float).tiny)[:, None])[self._counts].min())

    def _frequencies(self, *systems: LinearSweep) -> NDArray[np.float64]:
        """Return the grid [Hz], and frequencies around the modes of systems."""
        poles = np.concatenate([system.found.poles for system in systems])
        return np.unique(np.concatenate([self._grid, near_modes(poles, self._scene.band)]))

    def _amplitude_error(self, system: System | None) -> float:
        """Return the error of a system in the effect of the amplitude; `None` stands for a linear system."""
        frequency, reference = self._co_simulated, self._effect
        response, harmonics = reference.response, reference.harmonics
        if system is not None:
            other = measure_amplitude_effect(
                replace(self._scene, system=system), self._inputs, frequency, self._library, reference.start
            )
            response, harmonics = response - other.response, harmonics - other.harmonics
        size = self._scale.at(frequency, self._reference.response(frequency))
        return float(((np.abs(response) + np.abs(harmonics)) / size)[:, self._counts].max())

    @cached_property
    def _co_simulated(self) -> NDArray[np.float64]:
        """Frequencies [Hz] of the co-simulated sines: the ends of the band, and the highest peak."""
        step_size, (low, high) = self._scene.step_size, self._scene.band
        last = min(high, 1 / (FEWEST_SAMPLES * step_size))
        first = min(max(low, 1 / (_LONGEST_PERIOD * step_size)), last)
        size = self._size[:, self._counts]
        peak = float(self._grid[(size / np.median(size, axis=0)).max(axis=1).argmax()])
        return np.unique(np.array([first, min(max(peak, first), last), last]))

    @cached_property
    def _effect(self) -> AmplitudeEffect:
        """Effect of the amplitude on the reference response."""
        return measure_amplitude_effect(self._scene, self._inputs, self._co_simulated, self._library, self._start)


class ReferenceMotion:
    """Reference motion of a scene without inputs."""

    def __init__(self, scene: Scene, library: Path | None):
        self._scene, self._library = scene, library
        self._algorithm = with_algorithm(scene)[0].algorithm
        self._reference = self._outputs(scene.system)
        assembly = build(scene.system).check()
        self._counts = _counting(np.abs(self._reference)[:, :, None], scene, assembly, [1.0])[:, 0]

    def error(self, system: System) -> float:
        """Return the error of a system; raises as `Reference.error`."""
        reference = self._reference[:, self._counts]
        difference = np.abs(self._outputs(system)[:, self._counts] - reference).max(axis=0)
        return float((difference / np.abs(reference).max(axis=0)).max())

    def _outputs(self, system: System) -> NDArray[np.float64]:
        """Return the scene's outputs at every communication point, (points, outputs)."""
        scene = self._scene
        steps = max(round(scene.stop_time / scene.step_size), 1)
        build(system).check()  # before parts are fused, for messages with the names of the scene
        assembly = with_ports(assemble(replace(scene, system=system)), self._algorithm)
        with closing(open_master(assembly, self._algorithm, scene.step_size, self._library)) as master:
            recording = master.record(scene.outputs, rows=steps + 1)
            master.initialize(stop_time=max(scene.stop_time, steps * scene.step_size))
            master.advance(steps)
            return recording.values.copy()


def _counting(
    size: NDArray[np.float64], scene: Scene, assembly: Assembly, amplitudes: Sequence[float]
) -> NDArray[np.bool_]:
    """Return whether each entry is not zero by symmetry, (outputs, inputs); `StructureError` where all are zero.

    Outputs of different units are compared relative to the largest nominal in their unit.
    """
    found: list[Connector] = [assembly.connector(name) for name in scene.outputs]
    units = [output.unit or "1" for output in found]
    nominal = np.array([max(abs(o.nominal) for o in found if (o.unit or "1") == unit) for unit in units])
    size = size / nominal[:, None]
    counts = ~negligible(size, units, amplitudes) & ((size * amplitudes).max(axis=0) > _NOTHING)
    if not counts.any():
        raise StructureError("no output of the scene moves, so that there is nothing to compare levels by")
    return counts
