"""Choices of a scene: the compositions of its FMUs, from levels and fused groups, that are worth a prediction.

Levels: the reference are the levels of the scene, and for `auto` the last one; the cheapest levels within the tolerance
are chosen as `auto` chooses them (`fidelity/levels.py`). Groups: none, those of the scene, the parts on each feedback
loop, all continuous parts, and all parts.
"""

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from hfsa.components import ModelError
from hfsa.cosim.assembly.assemble import Variants
from hfsa.cosim.fidelity import levels
from hfsa.cosim.fidelity.nonlinearity import STEADY
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.results.records import LevelChoice
from hfsa.cosim.systems.cycles import on_cycles
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.tradeoff.configuration import Composition
from hfsa.fmus.errors import ExportError

REFUSALS = (StructureError, ModelError, StepError, ExportError)
"""Errors of a composition that cannot be built or run."""


@dataclass(frozen=True)
class Choices:
    """Compositions of a scene, the reference first.

    Attributes:
        scene: the scene at its reference levels, without fused groups.
        compositions: those that can be built.
        own: the composition of the scene itself.
        levels: choice of each component with cheaper levels.
        reference_levels: level of each of these components in the reference.
        refusals: reason by what cannot be built, or compared.
    """

    scene: Scene
    compositions: Sequence[Composition]
    own: Composition
    levels: Mapping[str, LevelChoice]
    reference_levels: Mapping[str, str]
    refusals: Mapping[str, str]


def choices_of(scene: Scene, library: Path | None, report: Callable[[str], None]) -> Choices:
    """Return the choices of a scene for its tolerance; `report` receives what is under way.

    Raises as `Variants` where the scene cannot be built at its reference levels.
    """
    ladders = levels.ladders_below(scene)
    highest = {name: ladder[-1] for name, ladder in ladders.items()}
    reference = levels.with_levels_at(scene, highest)
    own_fuse, reference = scene.fuse, dataclasses.replace(reference, fuse=())
    refusals: dict[str, str] = {}
    chosen: Mapping[str, LevelChoice] = {}
    if ladders:
        report("levels")
        try:
            chosen = levels.choose_among(reference, ladders, library, STEADY)
        except (*REFUSALS, ArithmeticError) as error:
            refusals["levels"] = str(error)
    lower = tuple((name, choice.level) for name, choice in chosen.items() if choice.level != highest[name])
    variants = Variants(reference, keep="needed")
    groups = list(_groups(variants.parts))
    found: list[Composition] = []
    for of_level in dict.fromkeys([(), lower]):
        for group in dict.fromkeys([(), tuple(map(tuple, own_fuse)), *groups]):
            composition = Composition(of_level, group)
            report(str(composition))
            try:
                Variants(composition.of(reference), variants.parts, keep="needed").plain.check()
            except REFUSALS as error:
                refusals[str(composition)] = str(error)
                continue
            found.append(composition)
    own = tuple((name, level) for name, level in lower if name in levels.automatic(scene))
    return Choices(reference, found, Composition(own, tuple(map(tuple, own_fuse))), chosen, highest, refusals)


def _groups(parts: Assembly) -> Iterator[tuple[tuple[str, ...], ...]]:
    """Yield groups to fuse: the parts on each loop, all continuous parts, all parts; each connected, of two or more."""
    system = parts.system
    ours = [c.name for c in system.components if not c.is_foreign]
    continuous = [name for name in ours if not parts.descriptions[name].is_sampled]
    edges = {(system.split(c.start)[0], system.split(c.end)[0]) for c in system.connections}
    loops = tuple(group for group in on_cycles(continuous, edges) if len(group) > 1)
    for found in (loops, _connected(continuous, edges), _connected(ours, edges)):
        if found:
            yield found


def _connected(names: Sequence[str], edges: set[tuple[str, str]]) -> tuple[tuple[str, ...], ...]:
    """Return the groups of two or more names that connections join, in their order."""
    either = edges | {(end, start) for start, end in edges}
    return tuple(group for group in on_cycles(names, either) if len(group) > 1)
