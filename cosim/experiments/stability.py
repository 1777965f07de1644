"""A scene's limits of stability: the longest stable communication step of every algorithm.

found = stability("sdelta_hfsa", {"law": "ctc"})
{limit.algorithm: limit.longest for limit in found.limits}
"""

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hfsa.cosim.analysis.sampling import SamplingLimit, sampling_limit
from hfsa.cosim.analysis.step_limits import StepLimit, step_limits
from hfsa.cosim.assembly.assemble import assemble
from hfsa.cosim.experiments.orders import with_computed_order
from hfsa.cosim.experiments.setup import Setup, Warn, set_up, with_levels
from hfsa.cosim.fidelity.step_judge import with_algorithm
from hfsa.cosim.linear.linearize import linearize
from hfsa.cosim.masters.algorithms import ALGORITHMS, LIMITED
from hfsa.cosim.results.files import AlgorithmChoice, OrderChoice
from hfsa.cosim.systems.scene import AUTO, Scene


@dataclass(frozen=True)
class Stability:
    """Limits of a scene about its equilibrium.

    Attributes:
        title: of the scene.
        algorithm, step_size: its own; step [s].
        limits: longest stable step of each algorithm with a communication step that is given.
        choosing: algorithms that choose their steps.
        sampling: longest stable sample time without communication steps, `None` where nothing is sampled.
        growth: fastest growth without communication steps [1/s], `None` where something is sampled.
        choice: what `auto` took; order: how the order of steps was computed, if it was.
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


def stability(
    scene: str | Path | Scene,
    parameters: Mapping[str, Any] | None = None,
    *,
    algorithm: str | None = None,
    step_size: float | None = None,
    fuse: Sequence[str] = (),
    order: str | None = None,
    warn: Warn = warnings.warn,
    report: Callable[[float, str], None] | None = None,
) -> Stability:
    """Return the longest stable communication step of an algorithm, by default of every one.

    From the one-step matrix of each algorithm on the scene's FMUs, linearised about the equilibrium. Arguments and
    errors are as of `sweep`; `StructureError` also where the scene has no equilibrium.
    """
    setup = set_up(scene, parameters, fuse, order=order, step_size=step_size, algorithm=algorithm)
    for sentence in setup.disagreements:
        warn(sentence)
    return limits_of(setup, algorithm, report)


def limits_of(
    setup: Setup, algorithm: str | None = None, report: Callable[[float, str], None] | None = None
) -> Stability:
    """Return the limits of a setup under one algorithm, `None` or `auto` for all."""
    tell = report or (lambda *_: None)
    scene, _ = with_levels(setup.scene, None)
    scene, order = with_computed_order(scene, setup.order)
    scene, choice = with_algorithm(scene)
    assembly = assemble(scene)
    considered = tuple(ALGORITHMS) if algorithm in (None, AUTO) else (algorithm,)
    limited = [name for name in considered if name in LIMITED]
    with assembly.open() as instances:
        limits = []
        for found in step_limits(assembly.system, instances, scene.step_size, limited):
            limits.append(found)
            tell(len(limits) / (len(limited) + 1), found.algorithm)
        sampling = sampling_limit(assembly.system, instances, scene.outputs)
        growth = None
        if sampling is None:
            poles = linearize(assembly.system, instances, [], scene.outputs).poles
            growth = float(max((pole.real for pole in poles), default=-math.inf))
    choosing = [name for name in considered if name not in LIMITED]
    return Stability(setup.title, scene.algorithm, scene.step_size, limits, choosing, sampling, growth, choice, order)
