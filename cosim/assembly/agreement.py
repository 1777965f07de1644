"""Facts on which the parts of a system must agree: where they do not, and which argument of the scene owns the fact.

    for sentence in disagreements("sdelta_hfsa", {"robot.payload.mass": "0"}, scene):
        warn(sentence)

Parts declare what they know of such facts (`hfsa.components._modelling.facts`). A component knows one by an argument or
a variable, and by the start values that an analysis has computed for it: gains for a payload, say. Components that are
wired together share a fact, or those that a terminal of the fact joins. Instances of one part alone may differ: each
has its own.
"""

import difflib
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin

import numpy as np

from hfsa.components import ModelError
from hfsa.components._modelling.catalogue import part_named
from hfsa.components._modelling.facts import Fact, Known
from hfsa.components._modelling.parts import Argument, Part, argument_values
from hfsa.cosim.assembly.load_scene import FILES, analysis_value, scene_part, written
from hfsa.cosim.assembly.models import AUTO, available_parts, is_part, level_of, named_part
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import compact, expand
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Analysis, Component, System

ROUNDING = 1e-9
"""Relative difference of numbers that are the same but for rounding."""

_STEP, _START = 1.01, 1e-3
"""By how much an argument is changed to see what follows it, and what it is changed to from 0."""
_ANY = (1.0, 1e3, 1e-3)
"""What one that is not given is changed to, the first that the scene takes; of a matrix the diagonal."""


@dataclass(frozen=True)
class Holder:
    """What one component knows of a fact.

    Attributes:
        component: its name.
        source: part, and whether its analysis has computed start values.
        label: argument, variables or start values that hold it, `robot.payload`.
        values: by field of a dataclass; of anything else one under no name.
    """

    component: str
    source: tuple[str, bool]
    label: str
    values: Mapping[str, Any]


@dataclass(frozen=True)
class Conflict:
    """Holders of one fact that do not agree on the `fields` of it."""

    fact: Fact
    holders: Sequence[Holder]
    fields: tuple[str, ...]


def disagreements(name: str, arguments: Mapping[str, Any], scene: Scene) -> list[str]:
    """Return a sentence for each fact on which parts of a scene disagree.

    `name` (empty for a scene without) and `arguments` are those that the scene was loaded by: the sentence names the
    arguments of the scene that change the fact in all parts.
    """
    found = conflicts(scene.system)
    if not found:
        return []
    owners = _Owners(name, arguments, found)
    return [_sentence(conflict, owners.of(conflict)) for conflict in found]


def conflicts(system: System) -> list[Conflict]:
    """Return the facts on which parts of a system disagree, also within one FMU."""
    system = system.unfused
    found = []
    for fact, holders in known_facts(system).items():
        for group in _groups(fact, holders, system):
            first = group[0].values
            common = [field for field in first if all(field in holder.values for holder in group)]
            differing = [f for f in common if not all(same(first[f], holder.values[f]) for holder in group)]
            if differing and len({holder.source for holder in group}) > 1:
                found.append(Conflict(fact, group, tuple(differing)))
    return found


def known_facts(system: System) -> dict[Fact, list[Holder]]:
    """Return what the components of a system know, by fact; what cannot be read is refused where it is built."""
    fed = {connection.end for connection in system.connections}
    found: dict[Fact, list[Holder]] = defaultdict(list)
    for component in system.components:
        if not is_part(component.part):
            continue
        for fact, holder in [*_of_part(component, fed), *_of_analyses(component)]:
            found[fact].append(holder)
    return found


def same(one: Any, other: Any) -> bool:
    """Whether two values are the same, numbers but for rounding, sequences relative to their largest number."""
    if one is None or other is None:
        return one is other
    try:
        a, b = np.asarray(one, dtype=float), np.asarray(other, dtype=float)
    except (TypeError, ValueError):
        return one == other
    if a.shape != b.shape:
        return False
    largest = max(np.abs(a).max(initial=0.0), np.abs(b).max(initial=0.0))
    return bool(np.all((a == b) | (np.abs(a - b) <= ROUNDING * largest)))


# Holders --------------------------------------------------------------------------------------------------------------


def _of_part(component: Component, fed: set[str]) -> Iterator[tuple[Fact, Holder]]:
    """Yield what a component knows by its arguments and variables."""
    part = named_part(component)
    level = level_of(component)
    relevant = {
        fact: known
        for fact, known in part.facts.items()
        if not known.of_analysis
        and not (known.unfed and f"{component.name}.{known.unfed}" in fed)
        and (not known.levels or level in (*known.levels, AUTO))
    }
    if not relevant:
        return
    values = _Values(part, component)
    for fact, known in relevant.items():
        argument, wanted = known.when
        if argument and values.get(argument) != wanted:
            continue
        if found := _fact(values, known):
            yield fact, Holder(component.name, (part.name, False), _label(component.name, known), found)


def _of_analyses(component: Component) -> Iterator[tuple[Fact, Holder]]:
    """Yield what a component knows by start values that analyses have computed, or are still to compute."""
    computed = {name: analysis for name, analysis in component.computed.items() if name in component.start}
    computed |= {n: v for name, v in component.start.items() if isinstance(v, Analysis) for n in expand(name)}
    used: list[tuple[Analysis, list[str]]] = []
    for variable, analysis in computed.items():
        alike = next((v for a, v in used if (a.part, a.arguments) == (analysis.part, analysis.arguments)), None)
        if alike is None:
            used.append((analysis, alike := []))
        alike.append(variable)
    for analysis, variables in used:
        part = part_named(analysis.part, available_parts())
        values = argument_values(part.name, part.analyze, analysis.arguments)
        for fact, known in part.facts.items():
            following = [v for v in variables if _follows(computed[v], known)]
            if following and (found := _fact(values, known)):
                names = ", ".join(f"{component.name}.{variable}" for variable in compact(following))
                yield fact, Holder(component.name, (part.name, True), f"{names} (by {part.name})", found)


def _follows(analysis: Analysis, known: Known) -> bool:
    """Whether the result that is taken of an analysis follows from the fact."""
    return not known.results or analysis.key.partition("[")[0] in known.results


def _fact(values: Mapping[str, Any], known: Known) -> dict[str, Any] | None:
    """Return a fact by field from the values of names; `None` where a name is not there, or no number."""
    if known.per or known.plus:
        try:
            a, b = (np.asarray(values[name], dtype=float) for name in (known.name, known.per or known.plus))
        except (KeyError, TypeError, ValueError):
            return None
        with np.errstate(divide="ignore", invalid="ignore"):
            return {"": (a / b if known.per else a + b).tolist()}
    if known.name in values:
        return {"": values[known.name]}
    within = f"{known.name}."
    fields = {name.removeprefix(within): value for name, value in values.items() if name.startswith(within)}
    return fields or None


class _Values(Mapping[str, Any]):
    """Values of a component's arguments, and of its variables at the start, its model's where it sets none, by name."""

    def __init__(self, part: Part, component: Component):
        self._part, self._component = part, component
        given = {name: value for name, value in component.arguments.items() if part.has_argument(name)}
        try:
            self._arguments = argument_values(part.name, part.build, given)
        except ModelError:
            self._arguments = {}
        self._set = {name: v for name, v in {**component.arguments, **component.start}.items() if name not in given}

    def __iter__(self) -> Iterator[str]:
        return iter(self._arguments)

    def __len__(self) -> int:
        return len(self._arguments)

    def __getitem__(self, name: str) -> Any:
        for known in (self._set, self._arguments):
            if name in known:
                value = known[name]
                return analysis_value(value) if isinstance(value, Analysis) else value
        if any(argument.startswith(f"{name}.") for argument in self._arguments):
            raise KeyError(name)  # a dataclass, known by its fields
        level = self._part.levels[-1] if self._component.level == AUTO and self._part.levels else self._component.level
        return _starts(self._part, level, _Arguments(self._component.arguments))[name]


class _Arguments(dict[str, Any]):
    """Arguments of a component that a cache can keep."""

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(repr(sorted(self.items(), key=lambda item: item[0])))


@lru_cache(maxsize=64)
def _starts(part: Part, level: str | None, arguments: _Arguments) -> Mapping[str, float]:
    """Return the start values of a part's model; none where it cannot be built."""
    try:
        return {quantity.name: quantity.start for quantity in part.model(level, **arguments)}
    except ModelError:
        return {}


def _label(component: str, known: Known) -> str:
    """Return where a component has a fact."""
    if known.per or known.plus:
        return f"{component} ({known.name} {'/' if known.per else '+'} {known.per or known.plus})"
    return f"{component}.{known.name}"


def _groups(fact: Fact, holders: Sequence[Holder], system: System) -> list[list[Holder]]:
    """Return the holders that share a fact, those that are joined with each other together."""
    knowing = {holder.component for holder in holders}
    joined = {component.name: component.name for component in system.components}

    def root(name: str) -> str:
        while joined[name] != name:
            name = joined[name]
        return name

    for connection in system.connections:
        (one, start), (other, end) = system.split(connection.start), system.split(connection.end)
        at_terminal = all(variable.startswith(f"{fact.terminal}.") for variable in (start, end))
        if not fact.terminal or (at_terminal and {one, other} <= knowing):
            joined[root(one)] = root(other)
    groups: dict[str, list[Holder]] = defaultdict(list)
    for holder in holders:
        groups[root(holder.component)].append(holder)
    return list(groups.values())


# Owners ---------------------------------------------------------------------------------------------------------------


class _Owners:
    """The arguments of a scene that change facts in all who know them, found by changing each a little."""

    def __init__(self, name: str, arguments: Mapping[str, Any], found: Sequence[Conflict]):
        self._wrong = {(conflict.fact, field) for conflict in found for field in conflict.fields}
        self._changes: dict[str, Mapping[tuple[Fact, str], set[str]]] = {}
        self._known: dict[Fact, set[str]] = {}
        self._typed: list[str] = []
        if not name or name.endswith(FILES):
            return
        part = scene_part(name)
        own = {key: value for key, value in arguments.items() if part.has_argument(key)}
        self._typed = [key for key in arguments if key not in own]
        self._part = part
        self._before = known_facts(written(part, own).system)
        self._known = {fact: {holder.label for holder in holders} for fact, holders in self._before.items()}
        values = argument_values(part.name, part.build, own)
        for argument in part.arguments.values():
            for other in _others(argument, values[argument.name]):
                changes = self._changed({**own, argument.name: other})
                if changes:
                    self._changes[argument.name] = changes
                    break

    def of(self, conflict: Conflict) -> list[str]:
        """Return the fewest arguments that change all fields of a conflict in all its holders; empty without any."""
        labels = {holder.label for holder in conflict.holders} & self._known.get(conflict.fact, set())
        able = {}
        for argument, changes in self._changes.items():
            fields = {f for f in conflict.fields if labels <= changes.get((conflict.fact, f), set())}
            if labels and fields:
                able[argument] = fields
        chosen, missing = [], set(conflict.fields)
        while missing and able:
            best = max(able, key=lambda argument: self._rank(argument, able[argument] & missing))
            if not able[best] & missing:
                return []
            chosen.append(best)
            missing -= able.pop(best)
        return [] if missing else chosen

    def _rank(self, argument: str, fields: set[str]) -> tuple[int, int, float]:
        """Return how well an argument serves: what it puts right, what it leaves alone, and how it is called."""
        beside = sum(change not in self._wrong for change in self._changes[argument])
        matcher = difflib.SequenceMatcher
        alike = max((matcher(None, argument, typed).ratio() for typed in self._typed), default=0.0)
        return len(fields), -beside, alike

    def _changed(self, arguments: Mapping[str, Any]) -> Mapping[tuple[Fact, str], set[str]]:
        """Return by fact and field the holders in whom it is another one, and one for all, with these arguments."""
        try:
            after = known_facts(written(self._part, arguments).system)
        except (ModelError, StructureError):
            return {}
        changes: dict[tuple[Fact, str], set[str]] = defaultdict(set)
        for fact, holders in after.items():
            before = {holder.label: holder.values for holder in self._before.get(fact, ())}
            for holder in holders:
                old = before.get(holder.label, holder.values)
                for field, value in holder.values.items():
                    if field in old and not same(value, old[field]):
                        changes[fact, field].add(holder.label)
        return changes


def _others(argument: Argument, value: Any) -> Iterator[Any]:
    """Yield other values of an argument than this one."""
    if argument.values:
        yield from (other for other in argument.values if other != value)
        return
    kinds = get_args(argument.annotation) if get_origin(argument.annotation) in (Union, UnionType) else ()
    if value is None and kinds:
        kind = next(kind for kind in kinds if kind is not NoneType)
        size = len(get_args(kind)) if get_origin(kind) is tuple else 0
        if size and math.isqrt(size) ** 2 == size:
            yield from (tuple((number * np.eye(math.isqrt(size))).ravel().tolist()) for number in _ANY)
        if kind is float or size:
            yield from ((number,) * size if size else number for number in _ANY)
        return
    if isinstance(value, tuple) and all(isinstance(item, int | float) for item in value):
        yield tuple(_STEP * item or _START for item in value)
    elif isinstance(value, float):
        yield _STEP * value or _START


# Words ----------------------------------------------------------------------------------------------------------------


def _sentence(conflict: Conflict, owners: Sequence[str]) -> str:
    """Return who has which value, the fewest first, and what would change all of them."""
    clusters: list[tuple[Mapping[str, Any], list[str]]] = []
    for holder in conflict.holders:
        values = {field: holder.values[field] for field in conflict.fields}
        for known, labels in clusters:
            if all(same(known[field], value) for field, value in values.items()):
                labels.append(holder.label)
                break
        else:
            clusters.append((values, [holder.label]))
    clusters.sort(key=lambda cluster: len(cluster[1]))
    digits = next((d for d in (6, 10) if len({_shown(v, conflict.fact, d) for v, _ in clusters}) == len(clusters)), 17)
    said = [f"{_shown(values, conflict.fact, digits)} in {', '.join(compact(names))}" for values, names in clusters]
    if owners:
        advice = f"{' and '.join(f'-p {owner}=VALUE' for owner in owners)} changes all of them"
    else:
        advice = "the scene has no argument that changes all of them"
    return f"{conflict.fact.name} differs: {'; '.join(said)}; {advice}"


def _shown(values: Mapping[str, Any], fact: Fact, digits: int) -> str:
    """Return the values of a fact as words."""
    unit = f" {fact.unit}" if fact.unit not in ("", "1") else ""
    return ", ".join(
        f"{field} {_number(v, digits)}".lstrip() + ("" if v is None else unit) for field, v in values.items()
    )


def _number(value: Any, digits: int) -> str:
    """Return a value as it would be typed."""
    if isinstance(value, list | tuple):
        return ",".join(_number(item, digits) for item in value)
    if value is None:
        return "none"
    return f"{value:.{digits}g}" if isinstance(value, int | float) else str(value)
