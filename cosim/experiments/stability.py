"""Stability limits of a scene: the longest stable communication step of every algorithm.

found = stability("sdelta_hfsa", {"law": "ctc"})
{limit.algorithm: limit.longest for limit in found.limits}
"""

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from hfsa.cosim.analysis.sampling import SamplingLimit, sampling_limit
from hfsa.cosim.analysis.step_limits import StepLimit, step_limits
from hfsa.cosim.assembly.assemble import Keep, Variants
from hfsa.cosim.experiments.arguments import checked
from hfsa.cosim.experiments.orders import with_computed_order
from hfsa.cosim.experiments.setup import Setup, Warn, set_up, with_levels
from hfsa.cosim.fidelity.step_judge import with_algorithm
from hfsa.cosim.linear.linearize import linearize
from hfsa.cosim.masters.algorithms import ALGORITHMS, LIMITED
from hfsa.cosim.results.files import AlgorithmChoice, OrderChoice
from hfsa.cosim.signals.prefixes import readable
from hfsa.cosim.systems.notebook import drawn_by, summarized, summary
from hfsa.cosim.systems.scene import AUTO, Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Stability:
    """Stability limits of a scene about its equilibrium.

    Attributes:
        title: title of the scene.
        algorithm, step_size: algorithm and communication step size [s] of the scene.
        limits: longest stable step of each algorithm with a fixed communication step.
        choosing: algorithms that choose their steps.
        sampling: longest stable sample time without communication steps, `None` for a scene without sampled parts.
        growth: fastest growth rate without communication steps [1/s], `None` for a scene with sampled parts.
        choice: choice of `auto`, if any.
        order: computed order of steps, if any.
        left_out: sentence on what was not judged; empty where all was.
    """

    title: str
    algorithm: str
    step_size: float
    limits: Sequence[StepLimit]
    choosing: Sequence[str]
    sampling: SamplingLimit | None
    growth: float | None
    choice: AlgorithmChoice | None = None
    order: OrderChoice | None = None
    left_out: str = ""

    def plot(self) -> "Figure":
        """Return the figure of the longest stable step of each algorithm that can run the scene."""
        longest = {limit.algorithm: limit.longest for limit in self.limits if not limit.message}
        return drawn_by("step_limits", "step_limits_figure")(self.title, self.step_size, longest)

    @summarized
    def _repr_html_(self) -> str:
        """Return the longest stable step of each algorithm."""
        facts = {"algorithm": self.algorithm, "step": readable(self.step_size, "s"), "not judged": self.left_out}
        if self.sampling is not None:
            facts["longest stable sample time"] = readable(self.sampling.longest, "s")
        words = {math.inf: "every step", 0.0: "none"}
        rows = [
            (one.algorithm, one.message or words.get(one.longest) or readable(one.longest, "s")) for one in self.limits
        ]
        return summary(self.title, facts, ["algorithm", ">longest stable step"], rows)


@checked()
def stability(
    scene: str | Path | Scene,
    parameters: Mapping[str, Any] | None = None,
    *,
    algorithm: str | None = None,
    step_size: float | None = None,
    fuse: Sequence[str] = (),
    order: str | None = None,
    keep: Literal["needed", "all"] = "all",
    warn: Warn = warnings.warn,
    report: Callable[[float, str], None] | None = None,
) -> Stability:
    """Return the longest stable communication step of an algorithm (default: of every algorithm).

    It follows from the one-step matrix of the algorithm on the FMUs, linearised about the equilibrium. Arguments and
    errors are those of `sweep`; `StructureError` also for a scene without equilibrium. The whole scene is judged, so
    that no instability hides; with `keep="needed"` what reaches the scene's outputs or a limit flag.
    """
    setup = set_up(scene, parameters, fuse, order=order, step_size=step_size, algorithm=algorithm)
    for sentence in setup.disagreements:
        warn(sentence)
    found = limits_of(setup, algorithm, report, keep)
    if found.left_out:
        warn(found.left_out)
    return found


def limits_of(
    setup: Setup,
    algorithm: str | None = None,
    report: Callable[[float, str], None] | None = None,
    keep: Keep = "all",
) -> Stability:
    """Return the limits of a setup under one algorithm, or all for `None` and `auto`; `keep` is that of `stability`."""
    show = report or (lambda *_: None)
    scene, _ = with_levels(setup.scene, None)
    scene, order = with_computed_order(scene, setup.order)
    scene, choice = with_algorithm(scene)
    variants = Variants(scene, keep=keep)
    assembly = variants.plain
    considered = tuple(ALGORITHMS) if algorithm in (None, AUTO) else (algorithm,)
    limited = [name for name in considered if name in LIMITED]
    with assembly.open() as instances:
        limits = []
        for found in step_limits(assembly.system, instances, scene.step_size, limited):
            limits.append(found)
            show(len(limits) / (len(limited) + 1), found.algorithm)
        sampling = sampling_limit(assembly.system, instances, scene.outputs)
        growth = None
        if sampling is None:
            poles = linearize(assembly.system, instances, [], scene.outputs).poles
            growth = float(max((pole.real for pole in poles), default=-math.inf))
    choosing = [name for name in considered if name not in LIMITED]
    settings = setup.title, scene.algorithm, scene.step_size
    left_out = variants.left_out.warning
    return Stability(*settings, limits, choosing, sampling, growth, choice, order, left_out)
