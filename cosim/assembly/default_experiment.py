"""Default experiments of foreign FMUs: step and stop of a scene that states none.

proposed(components)             # {"step_size": Proposal(0.01, "Ball.fmu"), "stop_time": ...}
remarks("ball.toml", scene)      # the sentences that say so
"""

import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from hfsa.cosim.fmi.description import Description, describe
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.system import Component


class Proposal(NamedTuple):
    """A value [s] with the name of the FMU that proposes it."""

    value: float
    file: str


def proposed(components: Iterable[Component]) -> dict[str, Proposal]:
    """Return what the default experiments of foreign FMUs propose: the smallest step size, and the latest stop time."""
    found = _descriptions(components)
    steps = [Proposal(d.step_size, d.file.name) for d in found if d.step_size and d.step_size > 0]
    stops = [Proposal(d.stop_time, d.file.name) for d in found if d.stop_time and d.stop_time > 0]
    return ({"step_size": min(steps)} if steps else {}) | ({"stop_time": max(stops)} if stops else {})


def remarks(file: Path, scene: Scene) -> list[str]:
    """Return a sentence for each value of a scene that its file leaves to an FMU, and for a start that is not kept.

    A value that an option has replaced since is not told.
    """
    stated = tomllib.loads(file.read_text(encoding="utf-8-sig"))
    told = [
        f"{label} is {value:.9g} s, of the default experiment of {name}, as the scene states none"
        for label, (value, name) in proposed(scene.system.components).items()
        if label not in stated and getattr(scene, label) == value
    ]
    late = [d for d in _descriptions(scene.system.components) if d.start_time]
    return told + [
        f"the default experiment of {d.file.name} starts at {d.start_time:.9g} s; runs start at 0 s" for d in late
    ]


def _descriptions(components: Iterable[Component]) -> list[Description]:
    """Return the descriptions of the foreign FMUs among components, each file once."""
    files = dict.fromkeys(Path(c.part) for c in components if c.is_foreign)
    return [describe(file) for file in files]
