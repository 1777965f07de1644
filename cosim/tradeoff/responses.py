"""Responses of a scene: their predicted error under a configuration, and the error measured at some places.

The prediction is max |G - H| / |H| over the band, with G from the one-step matrix of the configuration and H the linear
response of the scene at its reference levels (`analysis/step_effect.py`). A place is one input and one frequency, where
a sweep would measure a point; there the configuration is co-simulated and its error is that from a reference.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.step_effect import COUNTING, StepAnalysis
from hfsa.cosim.assembly.assemble import Variants
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.description import SAMPLE_TIME
from hfsa.cosim.measurement.rig import Rig
from hfsa.cosim.measurement.task import Bench, Settings, Task
from hfsa.cosim.results.records import Status
from hfsa.cosim.signals.excitation import FEWEST_SAMPLES
from hfsa.cosim.signals.frequency_response import negligible
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import LOCK_IN, Scene
from hfsa.cosim.systems.system import System
from hfsa.cosim.tradeoff.configuration import Composition, Configuration, Prediction
from hfsa.cosim.tradeoff.judged import Judged

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
        self.scene, self._library = scene, library
        self.longest_step = 1 / (FEWEST_SAMPLES * scene.band[1])
        self._judged = Judged(scene, self._excited, stack)
        self._worst: dict[Configuration, Place] = {}
        own = self._judged.judge(Composition())
        self._own, self.unknown = own.analysis, own.unknown
        self.times, self.margin, self.algorithm = self._judged.times, self._judged.margin, self._judged.algorithm

    # Before a run -----------------------------------------------------------------------------------------------------

    def predicted(self, configuration: Configuration) -> Prediction:
        """Return the predicted error of a configuration, unknown with the reason where it is not possible."""
        if configuration.step_size > self.longest_step * (1 + 1e-9):
            return Prediction(math.inf, f"its step does not resolve {self.scene.band[1]:.4g} Hz")
        return self._judged.predicted(configuration, partial(self._largest, configuration))

    def built(self, configuration: Configuration, excited: str | None = None) -> Assembly:
        """Return the assembly of a configuration with its instruments at one input, by default the first."""
        ready = self._judged.ready(configuration, excited or self.scene.inputs[0])
        return _sampling(ready, configuration.step_size)

    def _largest(self, configuration: Configuration, analysis: StepAnalysis) -> tuple[float, str]:
        """Return the largest predicted error, and its place in words; the place is kept for a verification."""
        if self._own is None:
            return math.nan, ""
        frequency = self._own.resolved(configuration.step_size)
        response = analysis.stepped(configuration.algorithm, configuration.step_size, frequency)
        error, worst = self._own.largest_error(frequency, response)
        if worst is None:
            return error, ""
        self._worst[configuration] = Place(*worst[1:])
        return error, _words(*worst)

    def _excited(self, variants: Variants) -> Mapping[str, Assembly]:
        """Return the assembly of a composition with its instruments, by excited input."""
        return {name: variants.instrumented(name, self.scene.outputs) for name in self.scene.inputs}

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
        found += [self._worst[c] for c in configurations if c in self._worst]
        return list(dict.fromkeys(p for p in found if p.frequency >= lowest))

    def duration(self, places: Sequence[Place]) -> float:
        """Return the simulated time [s] of one window at each place."""
        return sum(1 / place.frequency for place in places)

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
            starts, _ = self._judged.judge(configuration.composition).steady_starts(scene, frequency)
            bench = Bench(
                self.built(configuration, name), tuple(scene.outputs), scene.source.name, LOCK_IN, self._library
            )
            amplitude = float(bench.assembly.system[scene.source.name].start["amplitude"])
            with closing(Rig(bench, settings)) as rig:
                for k, place in enumerate(own):
                    start = starts[name][k] if name in starts else None
                    point = rig.measure(Task(0, k, bench, settings, place.frequency, amplitude, start))
                    if point.status is Status.NOT_SETTLED:
                        raise UnsettledError(f"{configuration} at {place}: {point.message}")
                    assert point.response is not None
                    found[place] = point.response
        return found

    def extrapolated(self, fine: Values, coarse: Values) -> Values:
        """Return responses without an error of first order, from those of a step and of twice that step."""
        return {place: 2 * fine[place] - coarse[place] for place in coarse}

    def error(self, found: Values, reference: Values) -> tuple[float, str]:
        """Return the largest relative error of responses from reference values, and its place in words.

        Entries count above -40 dB of the largest of their input, as in the prediction.
        """
        largest, where = 0.0, ""
        for place, values in found.items():
            exact = reference[place]
            counts = self._counts(place, reference)
            error = np.where(counts, np.abs(values - exact) / np.where(counts, np.abs(exact), 1.0), 0.0)
            error = np.nan_to_num(error, nan=math.inf)  # a response that is no number is no small error
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
        connectors = self._judged.variants(Composition()).plain
        units = [connectors.connector(name).unit or "1" for name in self.scene.outputs]
        moves = ~negligible(rows[:, :, None], units, [1.0])[:, 0]
        return moves & (np.abs(exact) >= COUNTING * np.abs(rows).max(axis=0)) & (np.abs(exact) > 0)


class UnsettledError(RuntimeError):
    """Error of a measurement whose transient has not died out."""

    exit_code = 4


def _sampling(assembly: Assembly, step_size: float) -> Assembly:
    """Return an assembly whose lock-in amplifier samples at every step [s]."""
    system = assembly.system
    components = [
        dataclasses.replace(c, start={**c.start, SAMPLE_TIME: step_size}) if c.name == LOCK_IN else c
        for c in system.components
    ]
    return dataclasses.replace(assembly, system=System(components, system.connections))


def _words(output: str, excited: str, frequency: float) -> str:
    """Return the place of an error in words."""
    return f"{frequency:.4g} Hz, {output} per {excited}"
