"""Level `auto`: the cheapest level of a component with an error within the scene's tolerance.

    scene = at_highest(scene)                     # every `auto` at its part's last level that may be joined here
    choices = choose(scene, library)              # for the inputs, outputs, band and tolerance of the scene
    scene = with_chosen(scene, choices)               # `choices["sensor"]` has the reason

The reference is the scene with every `auto` at the last level of its part's ladder that the levels of the others
permit. Each
component is evaluated alone, all others at the reference, by the error of `fidelity/level_error.py`; its cheapest level
within the tolerance is chosen. Several components are then evaluated together. While their common error exceeds the
tolerance, the component with the largest error of its own changes to its next better level. The error of the reference
is 0, so a choice always exists.

A level is a candidate if the scene can be built, wired and linearised with it. A level without an output that the scene
records has an error of 100 %. A start value that a level does not have is omitted if another level of the part has it.
"""

import dataclasses
import hashlib
import itertools
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from hfsa.components import ModelError
from hfsa.components._modelling.cache import cache_folder, keep
from hfsa.components._modelling.catalogue import part_named
from hfsa.cosim.assembly.fmu_cache import fmu_file, own_parts
from hfsa.cosim.assembly.level_rules import check_levels
from hfsa.cosim.assembly.models import AUTO, available_parts, level_of
from hfsa.cosim.assembly.sources import sources
from hfsa.cosim.fidelity.level_error import Reference, reference_of
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.fmi.description import describe
from hfsa.cosim.measurement.task import REST
from hfsa.cosim.results.records import LevelChoice, SystemRecord
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.scene_file import scene_text
from hfsa.cosim.systems.system import Component, System


def automatic(scene: Scene) -> list[str]:
    """Return the names of the components with level `auto`."""
    return [component.name for component in scene.system.components if component.level == AUTO]


def at_highest(scene: Scene) -> Scene:
    """Return the scene with every automatic component at the last level of its part that may be joined.

    Raises `StructureError` for a part without levels, and where no levels may be joined.
    """
    return _at(scene, {name: levels[-1] for name, levels in _ladders(scene).items()})


def _ladders(scene: Scene) -> dict[str, Sequence[str]]:
    """Return the levels of each automatic component up to its last one that may be joined with the others'.

    Where no levels of the ladders may be joined, all levels of the parts are tried.
    """
    components = [scene.system[name] for name in automatic(scene)]
    try:
        return _joinable(scene, {component.name: _levels(component) for component in components})
    except StructureError:
        every = {c.name: part_named(c.part, available_parts()).levels for c in components if _levels(c)}
        return _joinable(scene, every)


def _joinable(scene: Scene, ladders: Mapping[str, Sequence[str]]) -> dict[str, Sequence[str]]:
    """Return the ladders without as few of their last levels as may be; `StructureError` where none may be joined."""
    depths = sorted(itertools.product(*(range(len(levels)) for levels in ladders.values())), key=sum)
    refused: StructureError | None = None
    for depth in depths:
        found = {name: levels[: len(levels) - d] for (name, levels), d in zip(ladders.items(), depth, strict=True)}
        try:
            check_levels(_with(scene, {name: levels[-1] for name, levels in found.items()}).system)
        except StructureError as error:
            refused = refused or error
            continue
        return found
    assert refused is not None
    raise refused


def _with(scene: Scene, levels: Mapping[str, str]) -> Scene:
    """Return the scene with components at levels, start values as they are."""
    components = [
        dataclasses.replace(c, level=levels[c.name]) if c.name in levels else c for c in scene.system.components
    ]
    return dataclasses.replace(scene, system=System(components, scene.system.connections))


def choose(scene: Scene, library: Path | None) -> dict[str, LevelChoice]:
    """Return the choice for each automatic component by name; `library` is the stepping loop in C, `None` for Python's.

    Choices are cached by a hash of all that they depend on. Raises `StructureError` where the scene at its highest
    levels cannot be built or has no response or motion.
    """
    if not automatic(scene):
        return {}
    file = cache_folder() / "levels" / f"{_key(scene)}.json"
    choices = _kept(file)
    if choices is None:
        choices = choose_among(scene, _ladders(scene), library, REST)
        keep(json.dumps({name: dataclasses.asdict(choice) for name, choice in choices.items()}).encode(), file)
    return choices


def _kept(file: Path) -> dict[str, LevelChoice] | None:
    """Return the choices in a file of the cache; `None` where there is none, or a damaged one."""
    try:
        return {name: LevelChoice(**kept) for name, kept in json.loads(file.read_text(encoding="utf-8")).items()}
    except (OSError, ValueError, TypeError, AttributeError):
        return None


def choose_among(
    scene: Scene, ladders: Mapping[str, Sequence[str]], library: Path | None, start: str
) -> dict[str, LevelChoice]:
    """Return the choice for each component of `ladders`, its levels to choose from with the reference last.

    `start` is the state in which co-simulated sines begin, one of `STARTS`. Raises as `choose`.
    """
    return _LevelChoices(scene, ladders, library, start).choices()


def ladders_below(scene: Scene) -> dict[str, Sequence[str]]:
    """Return the levels of each component up to that of the scene, or up to the last for `auto`, of two or more."""
    found = {}
    for component in scene.system.components:
        levels = _levels(component) if component.level == AUTO else _known_levels(component)
        own = level_of(component)
        ladder = levels if own in (None, AUTO) else levels[: levels.index(own) + 1] if own in levels else ()
        if len(ladder) > 1:
            found[component.name] = ladder
    return found


def with_levels_at(scene: Scene, levels: Mapping[str, str]) -> Scene:
    """Return the scene with components at levels, without start values that only another level has."""
    return _at(scene, levels)


def with_chosen(scene: Scene, choices: Mapping[str, LevelChoice]) -> Scene:
    """Return the scene with the chosen levels."""
    return _at(scene, {name: choice.level for name, choice in choices.items()})


def with_choices(record: SystemRecord, choices: Mapping[str, LevelChoice]) -> SystemRecord:
    """Return the record of a system for the results file, with the choices of levels."""
    instances = [dataclasses.replace(i, choice=choices.get(i.instance)) for i in record.instances]
    return dataclasses.replace(record, instances=instances)


def _key(scene: Scene) -> str:
    """Return a hash of all that a choice depends on: the scene, FMUs and parts of others, the sources of both wings."""
    digest = hashlib.sha256(f"{scene_text(scene)}\0{sources()}\0{own_parts(scene)}\0".encode())
    foreign = [Path(c.part) for c in scene.system.components if c.is_foreign]
    for component in scene.system.components:
        digest.update(repr(_absent(component)).encode())
    for file in [*foreign, *sorted(Path(__file__).parents[1].rglob("*.py"))]:
        digest.update(file.read_bytes() + b"\0")
    return digest.hexdigest()[:32]


class _LevelChoices:
    """Choice of levels: the reference of a scene, and the errors of the levels of its automatic components."""

    def __init__(self, scene: Scene, ladders: Mapping[str, Sequence[str]], library: Path | None, start: str):
        self._scene = scene
        self._levels = ladders
        self._reference = self._opened_reference(_at(scene, self._highest), library, start)
        self._errors: dict[str, dict[str, float]] = {}
        self._refusals: dict[str, dict[str, str]] = {}

    def choices(self) -> dict[str, LevelChoice]:
        """Evaluate every component alone, then together; return the choices by component."""
        tolerance = self._scene.tolerance
        for name, levels in self._levels.items():
            evaluated = {level: self._evaluated(name, level) for level in levels[:-1]}
            absent = _absent(self._scene.system[name])
            self._errors[name] = {level: error for level, (error, _) in evaluated.items()}
            self._errors[name] |= {**dict.fromkeys(absent, math.nan), levels[-1]: 0.0}
            refusals = {level: refusal for level, (_, refusal) in evaluated.items() if refusal}
            self._refusals[name] = {**refusals, **absent}
        chosen = {name: self._cheapest(name, tolerance) for name in self._levels}
        together = self._together(chosen)
        while not together <= tolerance:
            lower = [name for name in chosen if chosen[name] != self._levels[name][-1]]
            worst = max(lower, key=lambda name: self._errors[name][chosen[name]])
            chosen[worst] = self._better(worst, chosen[worst])
            together = self._together(chosen)
        return {
            name: LevelChoice(level, tolerance, self._errors[name], self._refusals[name], together)
            for name, level in chosen.items()
        }

    def _opened_reference(self, reference: Scene, library: Path | None, start: str) -> Reference:
        """Return the reference of a scene; `StructureError` names the levels to choose from where there is none."""
        try:
            return reference_of(reference, library, start)
        except (StructureError, StepError) as error:
            words = "; ".join(f"{name}: {', '.join(levels)}" for name, levels in self._levels.items())
            raise StructureError(
                f"level auto compares with the highest level, at which the scene has no response: {error}; "
                f"name the levels ({words})"
            ) from error

    def _evaluated(self, name: str, level: str) -> tuple[float, str]:
        """Return the error of a level, and the reason where it is no candidate, else an empty text."""
        try:
            scene = _at(self._scene, {**self._highest, name: level})
            if missing := _missing_outputs(scene, name):
                return 1.0, f"it has no {', '.join(missing)}"
            return self._reference.error(scene.system), ""
        except (StructureError, StepError, ModelError) as error:
            return math.nan, str(error)

    @property
    def _highest(self) -> dict[str, str]:
        """Highest level of each automatic component."""
        return {name: levels[-1] for name, levels in self._levels.items()}

    def _together(self, chosen: Mapping[str, str]) -> float:
        """Return the error of all choices together; NaN where the system cannot be built or run."""
        lower = [name for name, level in chosen.items() if level != self._levels[name][-1]]
        if not lower:
            return 0.0
        if len(lower) == 1:
            return self._errors[lower[0]][chosen[lower[0]]]
        try:
            return self._reference.error(_at(self._scene, chosen).system)
        except (StructureError, StepError):
            return math.nan

    def _cheapest(self, name: str, tolerance: float) -> str:
        """Return the cheapest candidate within a tolerance."""
        return next(level for level in self._candidates(name) if self._errors[name][level] <= tolerance)

    def _better(self, name: str, than: str) -> str:
        """Return the next level above another with a smaller error."""
        candidates = self._candidates(name)
        above = candidates[candidates.index(than) + 1 :]
        return next((level for level in above if self._errors[name][level] < self._errors[name][than]), candidates[-1])

    def _candidates(self, name: str) -> list[str]:
        """Return the candidates, cheapest first."""
        return [level for level in self._levels[name] if level not in self._refusals[name]]


def _known_levels(component: Component) -> Sequence[str]:
    """Return the ladder of a component's part, cheapest first; none where it has none."""
    return () if component.is_foreign else part_named(component.part, available_parts()).ladder


def _absent(component: Component) -> Mapping[str, str]:
    """Return the levels of a component's part that this machine cannot build, with the reason."""
    return {} if component.is_foreign else part_named(component.part, available_parts()).unavailable


def _levels(component: Component) -> Sequence[str]:
    """Return the ladder of a component's part, cheapest first; `StructureError` where it has none."""
    levels = _known_levels(component)
    if not levels:
        raise StructureError(f"{component.name}: {component.part} has no levels to choose from; leave the level out")
    return levels


def _at(scene: Scene, levels: Mapping[str, str]) -> Scene:
    """Return the scene with components at levels, without start values that only another level has."""
    components = [
        _component_at(component, levels[component.name]) if component.name in levels else component
        for component in scene.system.components
    ]
    return dataclasses.replace(scene, system=System(components, scene.system.connections))


def _component_at(component: Component, level: str) -> Component:
    """Return an automatic component at a level, without start values that only another level has."""
    at = dataclasses.replace(component, level=level)
    known = _variables(at)
    strange = [name for name in component.start if name not in known]
    if not strange:
        return at
    others = [dataclasses.replace(component, level=other) for other in _levels(component) if other != level]
    elsewhere = set().union(*(_variables(other) for other in others))
    start = {name: value for name, value in component.start.items() if name in known or name not in elsewhere}
    return dataclasses.replace(at, start=start)


def _variables(component: Component) -> set[str]:
    """Return the names of a component's variables; none where it cannot be built."""
    try:
        return set(describe(fmu_file(component)).variables)
    except ModelError:
        return set()


def _missing_outputs(scene: Scene, name: str) -> list[str]:
    """Return the recorded outputs that a component lacks."""
    known = describe(fmu_file(scene.system[name])).variables
    recorded = [scene.system.split(output) for output in scene.outputs]
    return [variable for component, variable in recorded if component == name and variable not in known]
