"""Responses of a scene: their predicted error under a configuration, and the error measured at some places.

The prediction is max |G - H| / |H| over the band, with G from the one-step matrix of the configuration and H the linear
response of the scene at its reference levels (`analysis/step_effect.py`). A place is one input and one frequency, where
a sweep would measure a point; there the configuration is co-simulated and its error is that from a reference.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.algorithm_choice import NOT_KNOWN
from hfsa.cosim.analysis.sampling import sample_times
from hfsa.cosim.analysis.step_effect import COUNTING, StepAnalysis
from hfsa.cosim.analysis.step_limits import longest_stable
from hfsa.cosim.assembly.assemble import Variants
from hfsa.cosim.assembly.build import LOCK_IN, with_ports
from hfsa.cosim.fidelity.step_judge import Judge, judge
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.measurement.rig import Bench, Rig, Settings, Task
from hfsa.cosim.results.records import Status
from hfsa.cosim.signals.excitation import FEWEST_SAMPLES
from hfsa.cosim.signals.frequency_response import negligible
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.tradeoff.configuration import Composition, Configuration, Prediction

_PLACES = 3
"""Places of each input that every verification has: both ends of the band and its largest response."""

_LONGEST_WINDOW = 200_000
"""Largest number of steps in a window at a place."""


@dataclass(frozen=True)
class Place:
    """One input and one frequency [Hz]."""

    input: str
    frequency: float

    def __str__(self) -> str:
        return f"{self.frequency:.4g} Hz on {self.input}"


Values = Mapping[Place, NDArray[np.complex128]]
"""Responses of all outputs at places, (outputs,) each."""


class Responses:
    """Responses of a scene at its reference levels, to its inputs over its band.

    Attributes:
        scene: the scene, without fused groups.
        longest_step: longest step [s] that resolves the band.
        unknown: reason why errors are not predicted; empty where they are.
    """

    word = "the linear response"

    def __init__(self, scene: Scene, library: Path | None, stack: ExitStack):
        self.scene, self._library, self._stack = scene, library, stack
        self.longest_step = 1 / (FEWEST_SAMPLES * scene.band[1])
        self._variants: dict[Composition, Variants] = {}
        self._judges: dict[Composition, Judge] = {}
        self._longest: dict[tuple[Composition, str], float] = {}
        own = self._judge(Composition())
        self._own, self.unknown = own.analysis, own.unknown

    @property
    def analysis(self) -> StepAnalysis | None:
        """Linear responses of the scene at its reference levels, `None` where they are not known."""
        return self._own

    # Before a run -----------------------------------------------------------------------------------------------------

    def times(self, composition: Composition) -> Collection[float]:
        """Return the sample times [s] of a composition."""
        assembly = self._variant(composition).plain
        with assembly.open() as instances:
            return sample_times(assembly.system, instances, {}).values()

    def predicted(self, configuration: Configuration) -> Prediction:
        """Return the predicted error of a configuration, unknown with the reason where it is not possible."""
        reference, known = self._own, self._judge(configuration.composition)
        if reference is None or known.analysis is None:
            return Prediction(math.nan, unknown=known.unknown or self.unknown)
        algorithm, step = configuration.algorithm, configuration.step_size
        try:
            if not known.analysis.keeps_stability(algorithm, step):
                return Prediction(math.inf, "its steps change the stability of the system")
            frequency = reference.resolved(step)
            error, worst = reference.largest_error(frequency, known.analysis.stepped(algorithm, step, frequency))
        except NOT_KNOWN as reason:
            return Prediction(math.nan, unknown=str(reason))
        return Prediction(error, "" if worst is None else _words(*worst))

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

    def built(self, configuration: Configuration, excited: str | None = None) -> Assembly:
        """Return the assembly of a configuration with its instruments at one input, by default the first."""
        scene = configuration.of(self.scene)
        variants = Variants(scene, self._variant(configuration.composition).parts)
        whole = variants.instrumented(excited or scene.inputs[0], scene.outputs)
        return with_ports(whole, configuration.algorithm).check()

    # A verification ---------------------------------------------------------------------------------------------------

    def places(self, configurations: Sequence[Configuration]) -> list[Place]:
        """Return the places of a verification: those of the largest predicted errors, and some that all scenes have."""
        low, high = self.scene.band
        shortest = min(configuration.step_size for configuration in configurations)
        lowest = max(low, min(high, 1 / (_LONGEST_WINDOW * shortest)))
        found = [Place(name, f) for name in self.scene.inputs for f in (lowest, math.sqrt(low * high), high)]
        if self._own is None:
            return found
        size = np.abs(self._own.exact(self._own.frequency)).max(axis=1)
        for k, excitation in enumerate(self._own.excitations):
            found.append(Place(excitation.name, float(self._own.frequency[int(np.argmax(size[:, k]))])))
        for configuration in configurations:
            worst = self._worst(configuration)
            found += [worst] if worst is not None else []
        return list(dict.fromkeys(p for p in found if p.frequency >= lowest))

    def exact(self, places: Sequence[Place]) -> Values:
        """Return the linear responses of the scene at places; `StructureError` where they are not known."""
        if self._own is None:
            raise StructureError(f"there is no linear response: {self.unknown}")
        names = [excitation.name for excitation in self._own.excitations]
        return {p: self._own.exact(np.array([p.frequency]))[0, :, names.index(p.input)] for p in places}

    def measured(self, configuration: Configuration, places: Sequence[Place], settled_to: float) -> Values:
        """Return the responses of a configuration at places, measured by stepped sines.

        `settled_to` is the largest remaining transient, relative. Raises `StepError` or `StructureError` where it does
        not run, with a sentence where it does not settle.
        """
        scene, found = configuration.of(self.scene), {}
        settings = Settings("stepped", scene.algorithm, scene.step_size, settled_to)
        for name in dict.fromkeys(place.input for place in places):
            own = [place for place in places if place.input == name]
            frequency = np.array([place.frequency for place in own])
            starts, _ = self._judge(configuration.composition).steady_starts(scene, frequency)
            bench = Bench(
                self.built(configuration, name), tuple(scene.outputs), scene.source.name, LOCK_IN, self._library
            )
            amplitude = float(bench.assembly.system[scene.source.name].start["amplitude"])
            with closing(Rig(bench, settings)) as rig:
                for k, place in enumerate(own):
                    start = starts[name][k] if name in starts else None
                    point = rig.measure(Task(0, k, bench, settings, place.frequency, amplitude, start))
                    if point.status is Status.NOT_SETTLED:
                        raise Unsettled(f"{configuration} at {place}: {point.message}")
                    assert point.response is not None
                    found[place] = point.response
        return found

    def error(self, found: Values, reference: Values) -> tuple[float, str]:
        """Return the largest relative error of responses from reference values, and its place in words.

        Entries count above -40 dB of the largest of their input, as in the prediction.
        """
        largest, where = 0.0, ""
        for place, values in found.items():
            exact = reference[place]
            counts = self._counts(place, reference)
            error = np.where(counts, np.abs(values - exact) / np.where(counts, np.abs(exact), 1.0), 0.0)
            worst = int(np.argmax(error))
            if error[worst] > largest:
                largest, where = float(error[worst]), _words(self.scene.outputs[worst], place.input, place.frequency)
        return largest, where

    def _counts(self, place: Place, reference: Values) -> NDArray[np.bool_]:
        """Return which outputs count at a place, (outputs,)."""
        exact = reference[place]
        if self._own is not None:
            column = [excitation.name for excitation in self._own.excitations].index(place.input)
            size = np.zeros((1, len(exact), len(self._own.excitations)))
            size[0, :, column] = np.abs(exact)
            return self._own.counts(size)[0, :, column]
        rows = np.array([values for other, values in reference.items() if other.input == place.input])
        connectors = self._variant(Composition()).plain
        units = [connectors.connector(name).unit or "1" for name in self.scene.outputs]
        moves = ~negligible(rows[:, :, None], units, [1.0])[:, 0]
        return moves & (np.abs(exact) >= COUNTING * np.abs(rows).max(axis=0)) & (np.abs(exact) > 0)

    def _worst(self, configuration: Configuration) -> Place | None:
        """Return the place of the largest predicted error of a configuration, `None` where it is not known."""
        reference, known = self._own, self._judge(configuration.composition)
        if reference is None or known.analysis is None:
            return None
        try:
            frequency = reference.resolved(configuration.step_size)
            response = known.analysis.stepped(configuration.algorithm, configuration.step_size, frequency)
            _, worst = reference.largest_error(frequency, response)
        except NOT_KNOWN:
            return None
        return None if worst is None else Place(worst[1], worst[2])

    # Assemblies -------------------------------------------------------------------------------------------------------

    def _variant(self, composition: Composition) -> Variants:
        """Return the assemblies of a composition; errors as of `Variants`."""
        if composition not in self._variants:
            self._variants[composition] = Variants(composition.of(self.scene))
        return self._variants[composition]

    def _judge(self, composition: Composition) -> Judge:
        """Return the judgement of a composition's steps; its FMUs stay loaded until the stack ends."""
        if composition not in self._judges:
            variants, scene = self._variant(composition), composition.of(self.scene)
            excited = {name: variants.instrumented(name, scene.outputs) for name in scene.inputs}
            whole = judge(scene, variants.plain.check(), excited, scene.outputs, scene.band)
            self._judges[composition] = self._stack.enter_context(whole)
        return self._judges[composition]


class Unsettled(RuntimeError):
    """Error of a measurement whose transient has not died out."""

    exit_code = 4


def _words(output: str, excited: str, frequency: float) -> str:
    """Return the place of an error in words."""
    return f"{frequency:.4g} Hz, {output} per {excited}"
