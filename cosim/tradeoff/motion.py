"""Motion of a scene: its predicted error under a configuration, and the error measured over a run.

The motion is that of the scene's sources, or of a sine at its first input from rest. The prediction is linear: each
motion that a source puts out has a spectrum S(f), and its error at the outputs is the inverse transform of
(G - H) S, with G from the one-step matrix and H without communication steps (`analysis/step_effect.py`). The signals
are continued beyond the end by their mirror image and a rest, so that they are periodic and the end has no jump.

Errors are relative to the largest value of each output. An output that is rounding beside others of its unit does not
count. The reference is the monolithic run.
"""

import dataclasses
import math
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, closing
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.step_effect import StepAnalysis
from hfsa.cosim.analysis.step_limits import fitting
from hfsa.cosim.assembly.assemble import Variants
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.linear.cycle import Source
from hfsa.cosim.masters.algorithms import DEFAULT, open_master
from hfsa.cosim.signals.excitation import logarithmic
from hfsa.cosim.signals.frequency_response import negligible
from hfsa.cosim.signals.response_scale import near_modes
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import System
from hfsa.cosim.tradeoff.configuration import Composition, Configuration, Prediction
from hfsa.cosim.tradeoff.judged import Judged

_POINTS = 2**15
"""Number of intervals of a source's signal, over the run."""

_REST = 0.5
"""Rest after the mirror image of a signal, relative to the run."""

_JUDGED = 0.97
"""Part of a run that is judged: the mirror image begins with a kink, whose spectrum is cut off."""

_STILL = 1e-6
"""Distance of a state from its equilibrium, over its nominal value, up to which it is there."""

_FREQUENCIES = 80
"""Frequencies of the errors of responses, beside those around modes; between them they are interpolated."""

_COARSEST = 64
"""Longest step, over the step of the scene."""

_COMPARED = 8
"""Points of a comparison in the longest step of a verification."""

_LEAST_STEPS = 50
"""Least number of steps in a run."""

_MONOLITHIC, _PATIENCE = "monolithic", 30.0
"""Reference algorithm, and the time [s] after which its run ends, at an earlier time of the motion."""

_TOLERANCE = 1e-3
"""Tolerance of the reference, relative to that of the scene."""

_BLOCKS = 50
"""Number of parts in which the reference runs."""


class Motion:
    """Motion of a scene at its reference levels.

    Attributes:
        scene: the scene, without fused groups.
        longest_step: longest step [s] that is evaluated.
        unknown: reason why errors are not predicted; empty where they are.
    """

    word = "the monolithic run"

    def __init__(self, scene: Scene, library: Path | None, stack: ExitStack):
        self.scene, self._library = scene, library
        self._input = scene.inputs[0] if scene.inputs else ""
        self.longest_step = min(_COARSEST * scene.step_size, scene.stop_time / _LEAST_STEPS)
        self._judged = Judged(scene, self._excited, stack)
        own = self._judged.judge(Composition())
        self._own, self.unknown = own.analysis, own.unknown
        if self._own is not None and not self._own.excitations:
            self._own, self.unknown = None, "no component without inputs moves the others"
        self.times, self.margin, self.algorithm = self._judged.times, self._judged.margin, self._judged.algorithm

    # Before a run -----------------------------------------------------------------------------------------------------

    def predicted(self, configuration: Configuration) -> Prediction:
        """Return the predicted error of a configuration, unknown with the reason where it is not possible."""
        if self._own is None:
            return Prediction(math.nan, unknown=self.unknown)
        algorithm, step = configuration.algorithm, configuration.step_size
        return self._judged.predicted(configuration, lambda analysis: self._spectra.error(analysis, algorithm, step))

    def built(self, configuration: Configuration) -> Assembly:
        """Return the assembly of a configuration, with a sine source where the scene has inputs."""
        return self._judged.ready(configuration, self._input)

    @cached_property
    def _spectra(self) -> "Spectra":
        """Spectra of the sources over the run."""
        assert self._own is not None
        return Spectra(self._own, self._source_signals(self._own))

    def _excited(self, variants: Variants) -> Mapping[str, Assembly]:
        """Return the assembly of a composition with a sine source; empty for a scene with a motion of its own."""
        return {self._input: variants.driven(self._input, self.scene.band[0])} if self._input else {}

    def _source_signals(self, own: StepAnalysis) -> "Signals":
        """Return the signals of the sources over the run."""
        assembly = self.built(Configuration(Composition(), DEFAULT, self.scene.step_size))
        names = dict.fromkeys(excitation.source.component for excitation in own.excitations)
        alone = assembly.of(System([assembly.system[name] for name in names]))
        spacing = self.scene.stop_time / _POINTS
        signals = [_lowest(excitation.source) for excitation in own.excitations]
        with closing(open_master(alone, DEFAULT, spacing, self._library)) as master:
            recording = master.record(signals, rows=_POINTS + 1)
            master.initialize(stop_time=self.scene.stop_time)
            master.advance(_POINTS)
            values = recording.values.copy()
        return Signals(spacing, values, values[0] if self._starts_at_rest(own) else np.zeros(values.shape[1]))

    def _starts_at_rest(self, own: StepAnalysis) -> bool:
        """Whether the states start at their equilibrium, so that the first value of a signal excites nothing."""
        for name, value in own.coupled.operating_point.items():
            component, variable = own.system.split(name)
            known = own.instances[component].fmu.variables[variable]
            start = float(own.system[component].start.get(variable, known.start or 0.0))
            if abs(value - start) > _STILL * max(abs(known.nominal), abs(start)):
                return False
        return True

    # A verification ---------------------------------------------------------------------------------------------------

    def places(self, configurations: Sequence[Configuration]) -> float:
        """Return the longest step [s] of configurations: outputs are compared about as often."""
        return max(configuration.step_size for configuration in configurations)

    def duration(self, places: float) -> float:  # noqa: ARG002
        """Return the simulated time [s] of a run."""
        return self.scene.stop_time

    def exact(self, places: float) -> "Outputs":
        """Return the outputs of the monolithic run, as far as it comes; `StructureError` where it is not possible."""
        scene, step = self.scene, fitting(places / _COMPARED, self.times(Composition()))
        steps, begin = max(round(scene.stop_time / step), 1), time.monotonic()
        assembly = self.built(Configuration(Composition(), _MONOLITHIC, step))
        with closing(open_master(assembly, _MONOLITHIC, step, self._library, _TOLERANCE * scene.tolerance)) as master:
            recording = master.record(scene.outputs, rows=steps + 1)
            master.initialize(stop_time=max(scene.stop_time, steps * step))
            block = max(1, steps // _BLOCKS)
            for first in range(0, steps, block):
                master.advance(min(block, steps - first))
                if time.monotonic() - begin > _PATIENCE and first + block < steps:
                    self.word = f"the monolithic run, up to {master.time:.3g} of {scene.stop_time:.3g} s"
                    break
            return Outputs(recording.time.copy(), recording.values.copy())

    def extrapolated(self, fine: "Outputs", coarse: "Outputs") -> "Outputs":
        """Return outputs without an error of first order, from those of a step and of twice that step."""
        return Outputs(coarse.time, 2 * fine.at(coarse.time) - coarse.values)

    def error(self, found: "Outputs", reference: "Outputs") -> tuple[float, str]:
        """Return the largest error of outputs, relative to the largest value of each, and where it is, in words."""
        at = found.time[found.time <= reference.time[-1] * (1 + 1e-12)]
        exact = reference.at(at)
        connectors = self._judged.variants(Composition()).plain
        units = [connectors.connector(name).unit or "1" for name in self.scene.outputs]
        peak = np.abs(reference.values).max(axis=0)
        counts = ~negligible(peak[None, :, None], units, [1.0])[:, 0] & (peak > 0)
        ignored = self._own.ignored if self._own is not None else ()
        counts &= [name not in ignored for name in self.scene.outputs]
        if not counts.any():
            return 0.0, ""
        error = np.where(counts, np.abs(found.values[: len(at)] - exact) / np.where(counts, peak, 1.0), 0.0)
        k, output = (int(i) for i in np.unravel_index(int(np.argmax(error)), error.shape))
        return float(error[k, output]), f"{at[k]:.4g} s, {self.scene.outputs[output]}"

    def measured(self, configuration: Configuration, places: float, settled_to: float) -> "Outputs":  # noqa: ARG002
        """Return the outputs of a configuration at some of its points; raises `StepError` where it does not run."""
        step = configuration.step_size
        steps = max(round(self.scene.stop_time / step), 1)
        every = max(1, math.floor(places / _COMPARED / step * (1 + 1e-9)))
        with closing(
            open_master(self.built(configuration), configuration.algorithm, step, self._library, self.scene.tolerance)
        ) as master:
            recording = master.record(self.scene.outputs, rows=steps // every + 1, every=every)
            master.initialize(stop_time=max(self.scene.stop_time, steps * step))
            master.advance(steps)
            return Outputs(recording.time.copy(), recording.values.copy())


@dataclasses.dataclass(frozen=True)
class Outputs:
    """Outputs of a run: `time` [s], (points,), and `values`, (points, outputs)."""

    time: NDArray[np.float64]
    values: NDArray[np.float64]

    def at(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values at times [s], between points by cubic interpolation, (times, outputs)."""
        if len(time) == len(self.time) and np.allclose(time, self.time, rtol=1e-12, atol=0.0):
            return self.values
        from scipy.interpolate import CubicSpline  # costly to import

        return np.asarray(CubicSpline(self.time, self.values)(np.minimum(time, self.time[-1])))


@dataclasses.dataclass(frozen=True)
class Signals:
    """Signals of sources over a run.

    Attributes:
        spacing: time [s] between two points.
        values: (points, excitations).
        rest: values before the run, (excitations,).
    """

    spacing: float
    values: NDArray[np.float64]
    rest: NDArray[np.float64]

    @property
    def continued(self) -> NDArray[np.float64]:
        """The signals as deviations from rest, with mirror image and rest, (longer, excitations)."""
        from scipy.fft import next_fast_len  # costly to import

        moved = self.values - self.rest
        both = np.concatenate([moved[:-1], moved[::-1]])
        whole = int(next_fast_len(round((1 + _REST / 2) * len(both)), real=True) or len(both))
        return np.concatenate([both, np.zeros((whole - len(both), moved.shape[1]))])


class Spectra:
    """Spectra of the signals of a motion, and the linear outputs of the reference."""

    def __init__(self, own: StepAnalysis, signals: Signals):
        continued: NDArray[np.float64] = signals.continued
        self._own, self._length, self._points = own, len(continued), len(signals.values)
        self._spectra = np.fft.rfft(continued, axis=0)
        self._frequency = np.fft.rfftfreq(len(continued), signals.spacing)
        low, high = self._frequency[1], self._frequency[-1] / 2
        self._coarse = np.unique(
            np.concatenate([logarithmic(low, high, _FREQUENCIES), near_modes(own.coupled.exact.poles, (low, high))])
        )
        self._peak = np.abs(self._outputs(self._coarse, own.exact(self._coarse))).max(axis=0)

    def error(self, analysis: StepAnalysis, algorithm: str, step: float) -> tuple[float, str]:
        """Return the largest error of the outputs over the run, relative to the peak of each, and the output."""
        modes = analysis.coupled.with_algorithm(algorithm).over(step).modes
        poles = np.array([complex(mode.rate, 2 * np.pi * mode.frequency) for mode in modes])
        known = self._coarse[self._coarse <= 0.5 / step * (1 - 1e-9)]
        frequency = np.unique(np.concatenate([known, near_modes(poles, (known[0], known[-1]))]))
        difference = analysis.stepped(algorithm, step, frequency) - self._own.exact(frequency)
        size = np.abs(self._outputs(frequency, difference)[: round(_JUDGED * self._points)]).max(axis=0)
        units = [_unit(self._own, name) for name in self._own.outputs]
        counts = ~negligible(self._peak[None, :, None], units, [1.0])[:, 0] & (self._peak > 0)
        counts &= [name not in self._own.ignored for name in self._own.outputs]
        error = np.where(counts, size / np.where(counts, self._peak, 1.0), 0.0)
        worst = int(np.argmax(error))
        return float(error[worst]), self._own.outputs[worst]

    def _outputs(self, frequency: NDArray[np.float64], response: NDArray[np.complex128]) -> NDArray[np.float64]:
        """Return the outputs over the run for a response at some frequencies [Hz], zero beyond, (points, outputs)."""
        inside = (self._frequency > 0) & (self._frequency <= frequency[-1])
        at = np.log(np.maximum(self._frequency[inside], frequency[0]))
        transformed = np.zeros((len(self._frequency), response.shape[1]), complex)
        for output in range(response.shape[1]):
            for source in range(response.shape[2]):
                values = response[:, output, source]
                if values.any():
                    found = np.interp(at, np.log(frequency), values)
                    transformed[inside, output] += found * self._spectra[inside, source]
            transformed[0, output] = (response[0, output].real * self._spectra[0].real).sum()
        return np.fft.irfft(transformed, self._length, axis=0)[: self._points]


def _lowest(source: Source) -> str:
    """Return the full name of the output of a source that is the signal itself, without derivatives."""
    name = min(source.orders, key=source.orders.__getitem__)
    return f"{source.component}.{name}"


def _unit(own: StepAnalysis, name: str) -> str:
    """Return the unit of an output."""
    component, variable = own.system.split(name)
    return own.instances[component].fmu.variables[variable].unit or "1"
