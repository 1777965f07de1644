"""Compositions of a scene, built and linearised when first needed: errors, stability and sample times of each."""

import math
from collections.abc import Callable, Collection, Mapping
from contextlib import ExitStack

from hfsa.cosim.analysis.algorithm_choice import NOT_KNOWN
from hfsa.cosim.analysis.sampling import sample_times
from hfsa.cosim.analysis.step_effect import StepAnalysis
from hfsa.cosim.analysis.step_limits import longest_stable
from hfsa.cosim.assembly.assemble import Variants
from hfsa.cosim.assembly.build import with_ports
from hfsa.cosim.fidelity.step_judge import Judge, judge
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.tradeoff.configuration import Composition, Configuration, Prediction

Excite = Callable[[Variants], Mapping[str, Assembly]]
"""Function that returns the assembly of a composition for each excited input; empty for a motion of its own."""


class Judged:
    """Compositions of a scene at reference levels; FMUs stay loaded until the stack ends.

    Attributes:
        scene: the scene, without fused groups.
    """

    def __init__(self, scene: Scene, excite: Excite, stack: ExitStack):
        self.scene, self._excite, self._stack = scene, excite, stack
        self._variants: dict[Composition, Variants] = {}
        self._excited: dict[Composition, Mapping[str, Assembly]] = {}
        self._judges: dict[Composition, Judge] = {}
        self._longest: dict[tuple[Composition, str], float] = {}
        self._ready: dict[tuple[Composition, str, str], Assembly] = {}

    def variants(self, composition: Composition) -> Variants:
        """Return the assemblies of a composition, pruned; errors as of `Variants`."""
        if composition not in self._variants:
            self._variants[composition] = Variants(composition.of(self.scene), keep="needed")
        return self._variants[composition]

    def excited(self, composition: Composition) -> Mapping[str, Assembly]:
        """Return the assembly of a composition by excited input."""
        if composition not in self._excited:
            self._excited[composition] = self._excite(self.variants(composition))
        return self._excited[composition]

    def ready(self, configuration: Configuration, excited: str = "") -> Assembly:
        """Return the assembly of a configuration with what its algorithm needs; without input that of the scene."""
        composition, algorithm = configuration.line
        key = composition, algorithm, excited
        if key not in self._ready:
            whole = self.excited(composition)[excited] if excited else self.variants(composition).plain
            self._ready[key] = with_ports(whole, algorithm).check()
        return self._ready[key]

    def judge(self, composition: Composition) -> Judge:
        """Return the judgement of the steps of a composition."""
        if composition not in self._judges:
            scene, plain = composition.of(self.scene), self.variants(composition).plain.check()
            whole = judge(scene, plain, self.excited(composition), scene.outputs, scene.band)
            self._judges[composition] = self._stack.enter_context(whole)
        return self._judges[composition]

    def algorithm(self, scene: Scene, composition: Composition) -> str:
        """Return the algorithm of a scene, that of `auto` chosen for a composition."""
        return self.judge(composition).with_algorithm(scene)[0].algorithm

    def times(self, composition: Composition) -> Collection[float]:
        """Return the sample times [s] of a composition."""
        assembly = self.variants(composition).plain
        with assembly.open() as instances:
            return sample_times(assembly.system, instances, {}).values()

    def predicted(
        self, configuration: Configuration, largest: Callable[[StepAnalysis], tuple[float, str]]
    ) -> Prediction:
        """Return the prediction of a configuration, from a function of its linear analysis; unknown with the reason."""
        known = self.judge(configuration.composition)
        if known.analysis is None:
            return Prediction(math.nan, unknown=known.unknown)
        try:
            if not known.analysis.keeps_stability(configuration.algorithm, configuration.step_size):
                return Prediction(math.inf, "its steps change the stability of the system")
            return Prediction(*largest(known.analysis))
        except NOT_KNOWN as reason:
            return Prediction(math.nan, unknown=str(reason))

    def margin(self, configuration: Configuration) -> float:
        """Return the longest stable step over that of a configuration; NaN where it is not known."""
        known, line = self.judge(configuration.composition), configuration.line
        if known.analysis is None:
            return math.nan
        try:
            if line not in self._longest:
                coupled, times = known.analysis.coupled, self.times(configuration.composition)
                self._longest[line] = longest_stable(coupled, configuration.algorithm, self.scene.step_size, times)
        except NOT_KNOWN:
            return math.nan
        return self._longest[line] / configuration.step_size
