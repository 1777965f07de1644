"""A multisine sweep of a scene: its lines, its excitations, its predicted steady states, its runs.

    design = designed(scene, assembly, inputs, requested, options)
    runs = runs_of(design, known, scene, variants, plan, library)

`sweep.py` selects signals and frequencies before, and chooses levels and algorithm as for a stepped sweep.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.algorithm_choice import NOT_KNOWN
from hfsa.cosim.analysis.multisine_start import multisine_start
from hfsa.cosim.analysis.steady_start import SteadyStart
from hfsa.cosim.assembly.assemble import Variants
from hfsa.cosim.assembly.build import with_ports
from hfsa.cosim.assembly.multisine import source_names
from hfsa.cosim.fidelity.step_judge import Judge
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.co_simulation import open_instances
from hfsa.cosim.fmi.description import SAMPLE_TIME
from hfsa.cosim.masters.algorithms import LIMITED
from hfsa.cosim.measurement.multisine import Driven, MultisineSettings, Run
from hfsa.cosim.results.files import Lines, Plan
from hfsa.cosim.signals import multisine as signals
from hfsa.cosim.signals.multisine import Excitation, Grid
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import SAMPLER, Scene
from hfsa.cosim.systems.system import System

INPUTS = ("separate", "together")
"""Runs of a multisine sweep: one for each input, or one for all on interleaved lines; the first is the default."""

MOST_LINES = 120
"""Largest number of lines at one input; the time to compile a source grows with its square."""

_MULTIPLE = 8
"""Numbers of lines with which sources are built, so that few are."""


@dataclass(frozen=True)
class Design:
    """Grid and excitations of a multisine sweep, the latter by input; `together` in one run."""

    grid: Grid
    waves: Mapping[str, Excitation]
    together: bool
    warnings: Sequence[str] = ()

    @property
    def lines(self) -> NDArray[np.int64]:
        """All lines of any input, ascending."""
        return np.unique(np.concatenate([wave.lines for wave in self.waves.values()]))

    @property
    def frequency(self) -> NDArray[np.float64]:
        """Their frequencies [Hz]."""
        return self.grid.frequency(self.lines)

    @property
    def groups(self) -> list[list[str]]:
        """Inputs of each run."""
        return [list(self.waves)] if self.together else [[name] for name in self.waves]

    def in_plan(self, plan: Plan, settings: MultisineSettings) -> Plan:
        """Return a plan at the frequencies of this design, with its excitations and settings."""
        shape = len(self.lines), len(plan.inputs)
        amplitude, phase = np.full(shape, np.nan), np.full(shape, np.nan)
        for i, signal in enumerate(plan.inputs):
            wave = self.waves[signal.name]
            rows = np.searchsorted(self.lines, wave.lines)
            amplitude[rows, i], phase[rows, i] = wave.amplitude, wave.phase
        crest = np.array([self.waves[signal.name].crest_factor for signal in plan.inputs])
        lines = Lines(amplitude, phase, crest)
        return dataclasses.replace(plan, frequency=self.frequency, settings=dataclasses.asdict(settings), lines=lines)

    def settings(self, settings: MultisineSettings) -> MultisineSettings:
        """Return settings with the grid of this design."""
        grid = self.grid
        return dataclasses.replace(settings, window=grid.window, spacing=grid.spacing, measurement_periods=grid.periods)


def designed(
    plan: Plan, assembly: Assembly, scene: Scene, periods: int | None, phases: str, seed: int, inputs: str
) -> Design:
    """Return the design for the frequencies and inputs of a plan; `ValueError` where there is no room for lines."""
    names = [signal.name for signal in plan.inputs]
    together = inputs == INPUTS[1]
    if together and len(names) < 2:
        raise StructureError(f"--inputs together excites several inputs in one run; there is one, {names[0]}")
    count = len(names) if together else 1
    ticks = tick_steps(assembly, scene.step_size)
    grid = signals.design_grid(plan.frequency, scene.step_size, inputs=count, ticks=ticks, periods=periods, seed=seed)
    chosen = signals.choose_lines(grid, plan.frequency, count)
    waves, warnings = {}, []
    for i, signal in enumerate(plan.inputs):
        lines = chosen[i if together else 0]
        if len(lines) > MOST_LINES:
            raise StructureError(f"--points: {len(lines)} lines at one input, expected at most {MOST_LINES}")
        waves[signal.name] = signals.excitation(lines, signal.amplitude, phases, seed + i)
    fewest = min((wave.lines for wave in waves.values()), key=len)
    if sentence := signals.collapsed(plan.frequency, fewest, grid, count):
        warnings.append(sentence)
    return Design(grid, waves, together, tuple(warnings))


def tick_steps(assembly: Assembly, step_size: float) -> int:
    """Return the number of steps after which the pattern of ticks repeats, for sample times that fit the step."""
    found = 1
    for component in assembly.system.components:
        sampled = assembly.connectors[component.name].get(SAMPLE_TIME)
        if sampled is not None and sampled.is_conventional and sampled.causality == "parameter":
            sample_time = component.start.get(SAMPLE_TIME, sampled.start) or step_size
            found = math.lcm(found, max(round(sample_time / step_size), 1))
    return found


def runs_of(
    design: Design,
    known: Judge,
    scene: Scene,
    variants: Variants,
    plan: Plan,
    settings: MultisineSettings,
    library: Path | None,
) -> tuple[list[Run], str]:
    """Return the runs of a design, and why the steady state of some is not known; empty where all are.

    `known` is the judgement of the scene's steps, whose FMUs are loaded.
    """
    outputs = tuple(signal.name for signal in plan.outputs)
    index = {signal.name: i for i, signal in enumerate(plan.inputs)}
    runs, reason = [], ""
    for names in design.groups:
        waves = [design.waves[name] for name in names]
        most = max(len(wave.lines) for wave in waves)
        whole = variants.multisine(names, outputs, -(-most // _MULTIPLE) * _MULTIPLE).check()
        sources = source_names(scene, len(names))
        driven = tuple(
            Driven(source, index[name], wave, tuple(np.searchsorted(design.lines, wave.lines).tolist()))
            for source, name, wave in zip(sources, names, waves, strict=True)
        )
        start = None
        if settings.start == "steady":
            start, why = _start(design, known, scene, whole, driven)
            reason = reason or why
        ready = with_ports(whole, scene.algorithm).check()
        runs.append(Run(ready, outputs, library, settings, design.grid, driven, start))
    return runs, reason


def _start(
    design: Design, known: Judge, scene: Scene, whole: Assembly, driven: Sequence[Driven]
) -> tuple[SteadyStart | None, str]:
    """Return the predicted steady state of a run, or `None` and why it is not known."""
    analysis = known.analysis
    if analysis is None:
        return None, known.unknown
    if scene.algorithm not in LIMITED:
        return None, f"{scene.algorithm} has no one-step matrix"
    instruments = {SAMPLER, *(one.source for one in driven)}
    names = {*(component.name for component in analysis.system.components), *instruments}
    system = System(
        [component for component in whole.system.components if component.name in names],
        [c for c in whole.system.connections if {whole.system.split(end)[0] for end in (c.start, c.end)} <= names],
    )
    lines = {one.source: (design.grid.frequency(one.wave.lines), one.wave.gain) for one in driven}
    with ExitStack() as stack:
        own = stack.enter_context(open_instances({name: whole.files[name] for name in instruments}))
        try:
            base = analysis.coupled.with_algorithm(scene.algorithm)
            instances = {**analysis.instances, **own}
            found = multisine_start(base, system, instances, lines, SAMPLER, scene.step_size)
        except NOT_KNOWN as error:
            return None, str(error)
    return found, "" if found is not None else "a mode of the system does not decay"
