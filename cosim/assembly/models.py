"""From a component of a system to its model: that of its part, found by name, or those of its members as one."""

from functools import cache

import hfsa.components
import hfsa.controllers
from hfsa.components import Model, ModelError
from hfsa.components._modelling.catalogue import Catalogue, find, part_named
from hfsa.components._modelling.compose import compose
from hfsa.components._modelling.loading import is_path
from hfsa.components._modelling.parts import Part
from hfsa.components._modelling.prune import pruned
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component

AUTO = "auto"
"""The level of a component that is to be chosen by the scene's tolerance (`fidelity/levels.py`)."""


@cache
def available_parts() -> Catalogue:
    """Return all components and controllers, and the parts of installed packages (`hfsa.parts`), by name."""
    return find([hfsa.components, hfsa.controllers], "hfsa.parts")


def is_part(name: str) -> bool:
    """Whether a component's `part` is a name or path of a part, which may still be broken, and no foreign FMU."""
    return not name.endswith(".fmu") and (is_path(name) or name in available_parts())


def named_part(component: Component) -> Part:
    """Return a component's part, whatever its level; where there is none, `ModelError` names the component."""
    try:
        return part_named(component.part, available_parts())
    except ModelError as error:
        if getattr(error, "is_located", False):
            raise
        raise ModelError(f"{component.name}: {error}") from error.__cause__


def part_of(component: Component) -> Part:
    """Return a component's part; `StructureError` where its level is still to be chosen, or it has no model."""
    part = named_part(component)
    if part.build is None:
        raise StructureError(f"{component.name}: {part.name} is an analysis and has no model, expected a part with one")
    if component.level == AUTO:
        raise StructureError(
            f"{component.name}: level auto is a scene's question, and there is no FMU of it; name one of "
            f"{', '.join(part.levels) or 'none'}"
        )
    return part


def level_of(component: Component) -> str | None:
    """Return the component's level, its part's default where it names none, `None` where the part has no levels."""
    if component.is_foreign:
        return None
    default = named_part(component).arguments.get("level")
    return component.level or component.arguments.get("level") or (default.default if default else None)


def model_of(component: Component) -> Model:
    """Return the model of a component: its part's, pruned where it is, or those of its members as one."""
    if component.members:
        members = {member.name: model_of(member) for member in component.members}
        for member in component.members:
            if "sample_time" in member.start and "sample_time" in members[member.name]:
                members[member.name].set_start("sample_time", member.start["sample_time"])
        name = "".join(dict.fromkeys(model.name for model in members.values()))
        for connection in component.connections:
            if connection.is_transformed:
                raise ModelError(
                    f"connection {connection} inside {component.name} has factor {connection.factor:g} and offset "
                    f"{connection.offset:g}; expected none inside a fused group"
                )
        return compose(name, members, [(c.start, c.end) for c in component.connections])
    model = part_of(component).model(component.level, **component.arguments)
    return model if component.kept is None else pruned(model, component.kept)
