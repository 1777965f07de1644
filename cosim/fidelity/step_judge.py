"""Judgement of the communication steps of a scene: the algorithm for `auto`, and warnings before a run.

    with judge(scene, assembly, excited, outputs, band) as found:
        scene, choice, sentences = found.decided(scene)  # scene without `auto`, the choice of algorithm, warnings
        found.step_error(scene, frequency)               # relative error of each response

`assembly` is that of the scene. `excited` holds, by the full name of an input, the assembly with a sine source there,
and for a sweep a lock-in amplifier (`Variants.instrumented`); it is empty where the scene has its own motion. Where
the FMUs lack the required derivatives, the warning contains the reason.
"""

import contextlib
import dataclasses
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.algorithm_choice import NOT_KNOWN, choose, instability, warnings
from hfsa.cosim.analysis.steady_start import SteadyStart, steady_starts
from hfsa.cosim.analysis.step_effect import Excitation, StepAnalysis, entering, motions
from hfsa.cosim.assembly.assemble import Variants
from hfsa.cosim.assembly.build import LOCK_IN
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.co_simulation import Instance, open_instances
from hfsa.cosim.linear.cycle import Source
from hfsa.cosim.linear.linearize import upstream
from hfsa.cosim.masters.algorithms import CANDIDATES, LIMITED
from hfsa.cosim.results.files import AlgorithmChoice
from hfsa.cosim.systems.scene import AUTO, SINE_SOURCE, Scene
from hfsa.cosim.systems.system import System


@dataclass(frozen=True)
class Judge:
    """Judgement of a scene's steps: the analysis of its linearised FMUs, or the reason `unknown` why there is none."""

    analysis: StepAnalysis | None
    unknown: str = ""

    def decided(
        self, scene: Scene, offered: Collection[str] = CANDIDATES, frequency: float | None = None
    ) -> tuple[Scene, AlgorithmChoice | None, list[str]]:
        """Return the scene with an algorithm in place of `auto`, the choice, and the warnings.

        The choice is `None` where the scene names an algorithm; `offered` are the algorithms to choose from. The
        warnings are about all frequencies, or about a single one [Hz]. Where nothing is known, the choice contains the
        reason.
        """
        scene, choice = self.with_algorithm(scene, offered)
        if self.analysis is not None:
            return scene, choice, self._warnings(self.analysis, scene, frequency)
        unknown = f"the error of the communication steps is not known: {self.unknown}"
        return scene, choice, [] if choice or scene.algorithm not in LIMITED else [unknown]

    def with_algorithm(
        self, scene: Scene, offered: Collection[str] = CANDIDATES
    ) -> tuple[Scene, AlgorithmChoice | None]:
        """Return the scene with an algorithm in place of `auto`, and the choice, as `decided`."""
        if scene.algorithm != AUTO:
            return scene, None
        if self.analysis is None:
            choice = AlgorithmChoice(CANDIDATES[0], scene.step_size, scene.tolerance, unknown=self.unknown)
        else:
            choice = choose(self.analysis, scene.step_size, scene.tolerance, offered)
        return dataclasses.replace(scene, algorithm=choice.algorithm), choice

    def _warnings(self, analysis: StepAnalysis, scene: Scene, frequency: float | None) -> list[str]:
        """Return the warnings about a scene's algorithm and step."""
        if scene.algorithm not in LIMITED:
            return instability(analysis)
        analysed = analysis if frequency is None else analysis.at(frequency)
        try:
            effect = analysed.effect(scene.algorithm, scene.step_size)
        except NOT_KNOWN as error:
            return [f"the error of the communication steps is not known: {error}"]
        return warnings(analysed, effect, scene.tolerance)

    def step_error(self, scene: Scene, frequency: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Return the relative error of each response, (frequencies, outputs, inputs); `None` where it is not known.

        The error is NaN where a response is zero by symmetry.
        """
        if self.analysis is None or scene.algorithm not in LIMITED:
            return None
        try:
            return self.analysis.errors(scene.algorithm, scene.step_size, frequency)
        except NOT_KNOWN:
            return None

    def steady_starts(
        self, scene: Scene, frequency: NDArray[np.float64]
    ) -> tuple[dict[str, Sequence[SteadyStart]], str]:
        """Return the steady states at frequencies [Hz] by excited input, and why those of others are not known."""
        if self.analysis is None:
            return {}, self.unknown
        if scene.source.part != SINE_SOURCE:
            return {}, f"the source {scene.source.part} raises its amplitude by itself"
        if scene.algorithm not in LIMITED:
            return {}, f"{scene.algorithm} has no one-step matrix"
        found, reason = {}, ""
        try:
            coupled = self.analysis.coupled_steps(scene.algorithm)
            for excitation, one in zip(self.analysis.excitations, coupled, strict=True):
                starts = steady_starts(one, scene.step_size, frequency, excitation.amplitude)
                if starts is None:
                    reason = "a mode of the system does not decay"
                elif excitation.lock_in is not None:
                    found[excitation.name] = starts
        except NOT_KNOWN as error:
            return {}, str(error)
        return found, reason


@contextlib.contextmanager
def judge(
    scene: Scene,
    assembly: Assembly,
    excited: Mapping[str, Assembly],
    outputs: Sequence[str],
    band: tuple[float, float],
) -> Iterator[Judge]:
    """Yield the judgement of a scene's steps; FMUs are loaded until the end of the `with`."""
    with ExitStack() as stack:
        found = Judge(None, "nothing is known of an empty system")
        # components that lead to no output need no derivatives
        leading = upstream(assembly.system, [*outputs, *excited])
        is_part = len(leading.components) < len(assembly.system.components)
        for considered in (assembly, assembly.of(leading)) if is_part else (assembly,):
            try:
                found = Judge(_analysis_of(scene, considered, excited, outputs, band, stack))
                break
            except NOT_KNOWN as error:
                found = Judge(None, str(error))
        yield found


def with_algorithm(scene: Scene) -> tuple[Scene, AlgorithmChoice | None]:
    """Return a scene with an algorithm in place of `auto`, chosen for its inputs, outputs and band, and the choice."""
    if scene.algorithm != AUTO:
        return scene, None
    variants = Variants(scene)
    excited = {name: variants.instrumented(name) for name in scene.inputs}
    with judge(scene, variants.plain, excited, scene.outputs, scene.band) as found:
        return found.with_algorithm(scene)


def _analysis_of(
    scene: Scene,
    assembly: Assembly,
    excited: Mapping[str, Assembly],
    outputs: Sequence[str],
    band: tuple[float, float],
    stack: ExitStack,
) -> StepAnalysis:
    """Return the analysis of an assembly's FMUs, which are loaded until the stack ends."""
    instances: dict[str, Instance] = dict(stack.enter_context(assembly.open()))
    if not excited:
        found = motions(assembly.system, instances)
    else:
        instruments: dict[tuple[str, Path], Instance] = {}
        found = [_excitation(scene, name, whole, instances, instruments, stack) for name, whole in excited.items()]
    analysis = StepAnalysis(assembly.system, instances, found, outputs, band)
    if not any(excitation.lock_in for excitation in found):
        analysis.ignored = analysis.jumping
    return analysis


def _excitation(
    scene: Scene,
    name: str,
    excited: Assembly,
    instances: Mapping[str, Instance],
    instruments: dict[tuple[str, Path], Instance],
    stack: ExitStack,
) -> Excitation:
    """Return the excitation at one input; instruments with the same file are loaded once."""
    system, own = excited.system, dict(instances)
    for component in (scene.source.name, LOCK_IN):
        if component in excited.files:
            key = component, excited.files[component]
            if key not in instruments:
                instruments[key] = stack.enter_context(open_instances({component: key[1]}))[component]
            own[component] = instruments[key]
    connections = [c for c in system.connections if {system.split(c.start)[0], system.split(c.end)[0]} <= set(own)]
    reduced = System([c for c in system.components if c.name in own], connections)
    source = reduced[scene.source.name]
    lock_in = LOCK_IN if LOCK_IN in own else None
    unit = str(source.arguments.get("unit", "1"))
    return entering(name, unit, source.start["amplitude"], reduced, own, Source(source.name), lock_in)
