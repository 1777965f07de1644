"""Fused components: several parts become one FMU, so that what passes between them never waits for a step.

    scene = with_fusion(scene, ["robot,drive[1..3]"])       # Scene.fuse, checked and spelt out
    system = fused(scene.system, scene.fuse)                # `fused` in the place of robot and drives

Signals keep their names: in the fused system `robot.platform.position[3]` is the variable of that name of the FMU
`fused` (`System.split`). The members' start values become the FMU's; the clock and the settings of the solver are
common to all, of these the strictest counts.

Sampled parts within a group tick as they would alone. That takes an order: a group with continuous and sampled members
steps before all that is continuous, so that its ticks use the inputs of the communication point, as they must. What
that order would delay by a sample time is refused.
"""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from hfsa.components import Model
from hfsa.components._modelling.catalogue import part_named
from hfsa.components._modelling.model import Kind
from hfsa.components._modelling.variants import hashed
from hfsa.cosim.assembly.load_scene import load_scene
from hfsa.cosim.assembly.models import available_parts, model_of
from hfsa.cosim.fmi.description import describe
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.kinds import texts
from hfsa.cosim.systems.names import reorder, resolve_names
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component, Connection, System

NAME = "fused"
"""Name of the one group of a system; of several it is `fused[1]`, `fused[2]`, ..."""

_ALONE, _AMONG_OTHERS = range(2)
"""Whether all of an FMU is sampled, or some of it; the first go first."""


def with_fusion(scene: Scene, groups: Iterable[str]) -> Scene:
    """Return the scene with groups to fuse, as typed: names separated by commas, `drive[1..3]` or `drives` for three.

    Without groups, those that the scene itself names are spelt out. `StructureError` for a name that does not exist, a
    foreign FMU, a group of one, or a component in two groups.
    """
    typed = [group.split(",") for group in texts("fuse", groups, "a list of groups, such as robot,drive")] or scene.fuse
    resolved = [tuple(_in_order(scene.system, group)) for group in typed]
    for i, group in enumerate(resolved):
        for other in resolved[:i]:
            if both := [name for name in group if name in other]:
                raise StructureError(f"{', '.join(both)} cannot be fused into two groups; name a component once")
    return dataclasses.replace(scene, fuse=resolved)


def fused(system: System, groups: Sequence[Sequence[str]]) -> System:
    """Return the system with one component in the place of each group (component names).

    `StructureError` where the group's order of ticks cannot be that of its members; errors of `build.build`.
    """
    present = {component.name for component in system.components}
    for name, group in _named(groups).items():
        # a pruned system may lack members; one that is left alone is not fused
        members = [member for member in group if member in present]
        if len(members) > 1:
            system = _with_group(system, name, members)
    return system


def stepping_in(scene: Scene, names: Sequence[str]) -> Scene:
    """Return the scene whose components step in this order, in the places that they have (`system.reorder`).

    A group is named as what it becomes; its members then stand together, in their own order. `StructureError` for a
    name that does not exist, is given twice, or is that of a member.
    """
    groups = _named(scene.fuse)
    for name in names:
        for whole, group in groups.items():
            if name in group:
                raise StructureError(f"{name} is part of {whole}, which steps as one; name {whole} in the order")
    inside = {member: whole for whole, group in groups.items() if whole in names for member in group}
    units = list(dict.fromkeys(inside.get(c.name, c.name) for c in scene.system.components))
    order = [name for unit in reorder(units, names) for name in groups.get(unit, (unit,))]
    system = System([scene.system[name] for name in order], scene.system.connections)
    return dataclasses.replace(scene, system=system)


def _named(groups: Sequence[Sequence[str]]) -> dict[str, Sequence[str]]:
    """Return groups by the name of what they become."""
    return {NAME if len(groups) == 1 else f"{NAME}[{i}]": group for i, group in enumerate(groups, 1)}


def models_to_export(
    name: str, level: str | None, arguments: Mapping[str, Any], groups: Sequence[str] = ()
) -> list[Model]:
    """Return the model of a part; with groups, as typed, those of a scene's groups with the scene's start values.

    `StructureError` for a level beside groups, and where a member sets the solver, which an FMU is told when it runs.
    """
    if not groups:
        return [part_named(name, available_parts()).model(level, **arguments)]
    if level is not None:
        raise StructureError(f"a group has no level {level!r}; name that of each component, -p robot.level={level}")
    scene = with_fusion(load_scene(name, arguments), groups)
    return [_with_starts(component) for component in fused(scene.system, scene.fuse).components if component.members]


def _with_starts(component: Component) -> Model:
    """Return the model of a fused component with its start values in it; errors as `models_to_export`."""
    model = model_of(component)
    for name, value in component.start.items():
        if name.startswith("solver."):
            raise StructureError(f"{name} = {value:g} is set in the FMU when it is run; leave it out of the scene")
        model.set_start(name, value)
    variant = hashed([model.origin.variant, sorted(component.start.items())])
    model.origin = dataclasses.replace(model.origin, variant=variant)
    return model


def _in_order(system: System, words: Iterable[str]) -> list[str]:
    """Return the names of a group's components in the system's order; errors as `with_fusion`."""
    known = [component.name for component in system.components]
    wanted = {name for word in words for name in resolve_names(word.strip(), known)}
    if len(wanted) < 2:
        raise StructureError(f"a group to fuse has two components or more; found {', '.join(wanted) or 'none'}")
    for name in known:
        if name in wanted and system[name].is_foreign:
            raise StructureError(
                f"{name} is the finished FMU {system[name].part} and cannot be fused: only parts have equations to join"
            )
    return [name for name in known if name in wanted]


def _with_group(system: System, name: str, group: Sequence[str]) -> System:
    """Return the system with one group fused."""
    members = [component for component in system.components if component.name in group]
    of_group = {c: [system.split(end)[0] in group for end in (c.start, c.end)] for c in system.connections}
    whole = Component(
        name,
        " + ".join(Path(member.part).stem for member in members),
        start={},
        members=tuple(members),
        connections=tuple(connection for connection, ends in of_group.items() if all(ends)),
    )
    whole = dataclasses.replace(whole, start=_start(whole))

    def renamed(connection: Connection) -> Connection:
        """The connection between the components as they are now."""
        ends = zip((connection.start, connection.end), of_group[connection], strict=True)
        start, end = (f"{name}.{end}" if is_inside else end for end, is_inside in ends)
        return dataclasses.replace(connection, start=start, end=end)

    outer = [renamed(connection) for connection, ends in of_group.items() if not all(ends)]
    order = [c for c in system.components if c is members[0] or c not in members]
    order = [whole if c is members[0] else c for c in order]
    clock = _clock(whole)
    if clock is not None:
        if clock == _AMONG_OTHERS:
            order = [whole, *(c for c in order if c is not whole)]
        _check_ticks(system, System(order, outer), whole, [c for c, ends in of_group.items() if any(ends)])
    return System(order, outer)


def _start(whole: Component) -> dict[str, Any]:
    """Return the members' start values under the FMU's names; of what is common the least."""
    start: dict[str, Any] = {}
    for member in whole.members:
        for variable, value in member.start.items():
            name = whole.variable(member.name, variable)
            start[name] = min(value, start.get(name, value)) if name == variable else value
    return start


def _check_ticks(before: System, after: System, whole: Component, connections: Sequence[Connection]) -> None:
    """Raise `StructureError` where a member would tick on the other side of a part that it is joined to."""
    was, now = _tick_order(before), _tick_order(after)
    for connection in connections:
        ends = [before.split(end)[0] for end in (connection.start, connection.end)]
        inside = [any(member.name == end for member in whole.members) for end in ends]
        if all(inside) or any(end not in was for end in ends):
            continue
        earlier = [was[end] for end in ends]
        later = [now[after.split(end)[0]] for end in (connection.start, connection.end)]
        if (earlier[0] < earlier[1]) != (later[0] < later[1]):
            member, other = ends if inside[0] else ends[::-1]
            raise StructureError(
                f"{connection}: {member} and {other} tick one after the other, and {member} would change sides if it "
                f"were fused with {_others(whole, member)}; fuse {other} as well, or leave {member} out"
            )


def _tick_order(system: System) -> Mapping[str, int]:
    """Return the place of each component that ticks: those that are sampled alone go first."""
    clocks = {component.name: _clock(component) for component in system.components}
    ticking = {name: clock for name, clock in clocks.items() if clock is not None}
    return {name: i for i, name in enumerate(sorted(ticking, key=ticking.__getitem__))}


def _clock(component: Component) -> int | None:
    """Return whether a component is sampled, and if so, whether alone or among others."""
    if component.is_foreign:
        description = describe(Path(component.part))
        return (_ALONE if description.is_sampled else _AMONG_OTHERS) if description.has_sample_time else None
    models = [model_of(member) for member in component.members or (component,)]
    if not any(model.is_sampled for model in models):
        return None
    return _AMONG_OTHERS if any(model.of(Kind.STATE, Kind.OUTPUT) for model in models) else _ALONE


def _others(whole: Component, name: str) -> str:
    """Return the names of the other members."""
    return ", ".join(member.name for member in whole.members if member.name != name)
