"""Machines of a run: which parts of its scene moved, by the signals that its file has."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from hfsa.components._modelling.catalogue import part_named
from hfsa.components._modelling.errors import ModelError
from hfsa.components._modelling.parts import Part
from hfsa.cosim.assembly.models import available_parts
from hfsa.cosim.pages.bodies import Body
from hfsa.cosim.results.recorded import Recorded
from hfsa.cosim.systems.system import Component, System


def moving_bodies(recorded: Recorded, system: System) -> tuple[list[Body], list[str]]:
    """Return the bodies of a system that moved in a run, and sentences on those whose signals are not recorded."""
    bodies, sentences = [], []
    for component in system.components:
        part = _drawn(component)
        if part is None:
            continue
        moving = part.in_motion(component.level, **component.arguments)
        signals = {name: _recorded(recorded.values, system, component.name, name) for name in moving.signals}
        lacking = [name for name, values in signals.items() if values is None]
        if lacking:
            words = ", ".join(f"{component.name}.{name}" for name in lacking)
            sentences.append(f"{component.name} is not drawn: {words} not recorded; record with --signal of `hfsa run`")
            continue
        known = {name: values for name, values in signals.items() if values is not None}
        bodies.append(Body(component.name, moving.panel, moving.displacements(known), list(known.values())))
    return bodies, sentences


def _drawn(component: Component) -> Part | None:
    """Return the part of a component where it can be drawn as it moves."""
    if component.is_foreign or component.members:
        return None
    try:
        part = part_named(component.part, available_parts())
    except ModelError:
        return None
    return part if part.moving is not None else None


def _recorded(
    values: Mapping[str, NDArray[np.float64]], system: System, instance: str, name: str
) -> NDArray[np.float64] | None:
    """Return a signal of an instance, or the output that feeds it; `None` where neither is recorded."""
    full = f"{instance}.{name}"
    fed = [connection.start for connection in system.connections if connection.end == full]
    return next((values[found] for found in (full, *fed) if found in values), None)
