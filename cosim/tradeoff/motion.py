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
from collections.abc import Collection, Mapping, Sequence
from contextlib import ExitStack, closing
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.algorithm_choice import NOT_KNOWN
from hfsa.cosim.analysis.sampling import sample_times
from hfsa.cosim.analysis.step_effect import StepAnalysis
from hfsa.cosim.analysis.step_limits import longest_stable
from hfsa.cosim.assembly.assemble import Variants
from hfsa.cosim.assembly.build import with_ports
from hfsa.cosim.fidelity.step_judge import Judge, judge
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.masters.algorithms import DEFAULT, open_master
from hfsa.cosim.signals.excitation import logarithmic
from hfsa.cosim.signals.frequency_response import negligible
from hfsa.cosim.signals.response_scale import near_modes
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import System
from hfsa.cosim.tradeoff.configuration import Composition, Configuration, Prediction

_POINTS = 2**16
"""Number of intervals of a source's signal, over the run."""

_REST = 0.5
"""Rest after the mirror image of a signal, relative to the run."""

_FREQUENCIES = 80
"""Frequencies of the errors of responses, beside those around modes; between them they are interpolated."""

_COARSEST, _FINEST = 64, 16
"""Range of steps, over and under the step of the scene."""

_LEAST_STEPS = 50
"""Least number of steps in a run."""

_MONOLITHIC, _TOLERANCE = "monolithic", 1e-9
"""Reference algorithm, and its relative tolerance."""


class Motion:
    """Motion of a scene at its reference levels.

    Attributes:
        scene: the scene, without fused groups.
        longest_step: longest step [s] that is evaluated.
        unknown: reason why errors are not predicted; empty where they are.
    """

    word = "the monolithic run"

    def __init__(self, scene: Scene, library: Path | None, stack: ExitStack):
        self.scene, self._library, self._stack = scene, library, stack
        self._variants: dict[Composition, Variants] = {}
        self._judges: dict[Composition, Judge] = {}
        self._longest: dict[tuple[Composition, str], float] = {}
        self.longest_step = min(_COARSEST * scene.step_size, scene.stop_time / _LEAST_STEPS)
        own = self._judge(Composition())
        self._own, self.unknown = own.analysis, own.unknown
        if self._own is not None and not self._own.excitations:
            self._own, self.unknown = None, "no component without inputs moves the others"
        self._spectra: Spectra | None = None

    # Before a run -----------------------------------------------------------------------------------------------------

    def times(self, composition: Composition) -> Collection[float]:
        """Return the sample times [s] of a composition."""
        assembly = self._variant(composition).plain
        with assembly.open() as instances:
            return sample_times(assembly.system, instances, {}).values()

    def predicted(self, configuration: Configuration) -> Prediction:
        """Return the predicted error of a configuration, unknown with the reason where it is not possible."""
        own, known = self._own, self._judge(configuration.composition)
        if own is None or known.analysis is None:
            return Prediction(math.nan, unknown=known.unknown or self.unknown)
        algorithm, step = configuration.algorithm, configuration.step_size
        try:
            if not known.analysis.keeps_stability(algorithm, step):
                return Prediction(math.inf, "its steps change the stability of the system")
            if self._spectra is None:
                self._spectra = Spectra(own, self._source_signals())
            error, output = self._spectra.error(known.analysis, algorithm, step)
        except NOT_KNOWN as reason:
            return Prediction(math.nan, unknown=str(reason))
        return Prediction(error, output)

    def margin(self, configuration: Configuration) -> float:
        """Return the longest stable step over that of a configuration; NaN where it is not known."""
        known = self._judge(configuration.composition)
        if known.analysis is None:
            return math.nan
        line = configuration.line
        try:
            if line not in self._longest:
                coupled, times = known.analysis.coupled, self.times(configuration.composition)
                self._longest[line] = longest_stable(coupled, configuration.algorithm, self.scene.step_size, times)
        except NOT_KNOWN:
            return math.nan
        return self._longest[line] / configuration.step_size

    def built(self, configuration: Configuration) -> Assembly:
        """Return the assembly of a configuration, with a sine source where the scene has inputs."""
        scene = configuration.of(self.scene)
        variants = Variants(scene, self._variant(configuration.composition).parts)
        return with_ports(self._moved(variants), configuration.algorithm).check()

    # A verification ---------------------------------------------------------------------------------------------------

    def places(self, configurations: Sequence[Configuration]) -> float:
        """Return the longest step [s] of configurations: outputs are compared about as often."""
        return max(configuration.step_size for configuration in configurations)

    def exact(self, spacing: float) -> "Outputs":
        """Return the outputs of the monolithic run; `StructureError` where it is not possible."""
        configuration = Configuration(Composition(), _MONOLITHIC, spacing / 8)
        return self._run(configuration, spacing)

    def measured(self, configuration: Configuration, spacing: float, settled_to: float) -> "Outputs":  # noqa: ARG002
        """Return the outputs of a configuration that is run; raises `StepError` where that fails."""
        return self._run(configuration, spacing)

    def error(self, found: "Outputs", reference: "Outputs") -> tuple[float, str]:
        """Return the largest error of outputs, relative to the largest value of each, and where it is, in words."""
        time = found.time
        exact = reference.at(time)
        connectors = self._variant(Composition()).plain
        units = [connectors.connector(name).unit or "1" for name in self.scene.outputs]
        peak = np.abs(reference.values).max(axis=0)
        counts = ~negligible(peak[None, :, None], units, [1.0])[:, 0] & (peak > 0)
        ignored = self._own.ignored if self._own is not None else ()
        counts &= [name not in ignored for name in self.scene.outputs]
        if not counts.any():
            return 0.0, ""
        error = np.where(counts, np.abs(found.values - exact) / np.where(counts, peak, 1.0), 0.0)
        k, output = (int(i) for i in np.unravel_index(int(np.argmax(error)), error.shape))
        return float(error[k, output]), f"{time[k]:.4g} s, {self.scene.outputs[output]}"

    def _run(self, configuration: Configuration, spacing: float) -> "Outputs":
        """Return the outputs of a configuration at its own points."""
        step = configuration.step_size
        steps = max(round(self.scene.stop_time / step), 1)
        every = max(1, math.floor(spacing / 8 / step * (1 + 1e-9)))
        with closing(
            open_master(self.built(configuration), configuration.algorithm, step, self._library, _TOLERANCE)
        ) as master:
            recording = master.record(self.scene.outputs, rows=steps // every + 1, every=every)
            master.initialize(stop_time=max(self.scene.stop_time, steps * step))
            master.advance(steps)
            return Outputs(recording.time.copy(), recording.values.copy())

    # Assemblies -------------------------------------------------------------------------------------------------------

    def _source_signals(self) -> "Signals":
        """Return the signals of the sources over the run."""
        assert self._own is not None
        assembly = self._moved(self._variant(Composition()))
        names = dict.fromkeys(excitation.source.component for excitation in self._own.excitations)
        alone = assembly.of(System([assembly.system[name] for name in names]))
        spacing = self.scene.stop_time / _POINTS
        signals = [_lowest(excitation) for excitation in self._own.excitations]
        with closing(open_master(alone, DEFAULT, spacing, self._library)) as master:
            recording = master.record(signals, rows=_POINTS + 1)
            master.initialize(stop_time=self.scene.stop_time)
            master.advance(_POINTS)
            return Signals(spacing, recording.values.copy())

    def _moved(self, variants: Variants) -> Assembly:
        """Return the assembly of a scene, with a sine source at its first input where it has inputs."""
        scene = self.scene
        return variants.driven(scene.inputs[0], scene.band[0]) if scene.inputs else variants.plain

    def _variant(self, composition: Composition) -> Variants:
        """Return the assemblies of a composition; errors as of `Variants`."""
        if composition not in self._variants:
            self._variants[composition] = Variants(composition.of(self.scene))
        return self._variants[composition]

    def _judge(self, composition: Composition) -> Judge:
        """Return the judgement of a composition's steps; its FMUs stay loaded until the stack ends."""
        if composition not in self._judges:
            variants, scene = self._variant(composition), composition.of(self.scene)
            excited = {scene.inputs[0]: self._moved(variants)} if scene.inputs else {}
            whole = judge(scene, variants.plain.check(), excited, scene.outputs, scene.band)
            self._judges[composition] = self._stack.enter_context(whole)
        return self._judges[composition]


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
    """Signals of sources, (points, excitations), at a `spacing` [s] over the run."""

    spacing: float
    values: NDArray[np.float64]

    @property
    def continued(self) -> NDArray[np.float64]:
        """The signals from their first value on, with mirror image and rest, (longer, excitations)."""
        moved = self.values - self.values[0]
        rest = np.zeros((round(_REST * len(moved)), moved.shape[1]))
        return np.concatenate([moved[:-1], moved[::-1], rest])


class Spectra:
    """Spectra of the signals of a motion, and the linear outputs of the reference."""

    def __init__(self, own: StepAnalysis, signals: Signals):
        continued = signals.continued
        self._own, self._length, self._points = own, len(continued), len(signals.values)
        self._spectra = np.fft.rfft(continued, axis=0)
        self._frequency = np.fft.rfftfreq(len(continued), signals.spacing)
        low, high = self._frequency[1], self._frequency[-1] / 2
        self._coarse = np.unique(
            np.concatenate([logarithmic(low, high, _FREQUENCIES), near_modes(own.coupled.exact.poles, (low, high))])
        )
        self._exact = own.exact(self._coarse)
        self._peak = np.abs(self._outputs(self._coarse, self._exact)).max(axis=0)

    def error(self, analysis: StepAnalysis, algorithm: str, step: float) -> tuple[float, str]:
        """Return the largest error of the outputs over the run, relative to the peak of each, and the output."""
        known = self._coarse <= 0.5 / step * (1 - 1e-9)
        frequency = self._coarse[known]
        difference = analysis.stepped(algorithm, step, frequency) - self._exact[known]
        size = np.abs(self._outputs(frequency, difference)).max(axis=0)
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


def _lowest(excitation: object) -> str:
    """Return the full name of the output of a source that is the signal itself, without derivatives."""
    source = excitation.source  # type: ignore[attr-defined]
    name = min(source.orders, key=source.orders.__getitem__)
    return f"{source.component}.{name}"


def _unit(own: StepAnalysis, name: str) -> str:
    """Return the unit of an output."""
    component, variable = own.system.split(name)
    return own.instances[component].fmu.variables[variable].unit or "1"
