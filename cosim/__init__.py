"""From FMUs to measurements: systems, co-simulation, sweeps, results.

    from hfsa.cosim import sweep

    bode = sweep("sdelta_shaker", inputs=["command.position[3]"], low=1.0, high=50.0)
    bode.entry("robot.platform.position[3]", "reference.command.position[3]")      # complex, (frequencies,)

This is the public face; it has the defaults of the command line, which calls the same functions. Each folder below is a
room with one noun of the field: `scenes` and `systems`, then `assembly`, `masters`, `measurement`, `experiments`. A
room imports only from below (CONTRIBUTING). Read `experiments/sweep.py` first.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hfsa.cosim.assembly.load_scene import available_scenes, load_scene
    from hfsa.cosim.assembly.models import available_parts
    from hfsa.cosim.experiments.calibrate import calibrate
    from hfsa.cosim.experiments.compare import compare
    from hfsa.cosim.experiments.identify import identify
    from hfsa.cosim.experiments.open_loop import open_loop
    from hfsa.cosim.experiments.package import package
    from hfsa.cosim.experiments.run import run
    from hfsa.cosim.experiments.stability import stability
    from hfsa.cosim.experiments.stability_map import stability_map
    from hfsa.cosim.experiments.sweep import sweep
    from hfsa.cosim.experiments.trade import trade
    from hfsa.cosim.figures.drawing import draw
    from hfsa.cosim.figures.signals import plot
    from hfsa.cosim.results.read import read
    from hfsa.cosim.results.stability_map import Axis
    from hfsa.cosim.systems.scene import Scene
    from hfsa.cosim.systems.system import Component, Connection, System

__all__ = [
    "Axis",
    "Component",
    "Connection",
    "Scene",
    "System",
    "available_parts",
    "available_scenes",
    "calibrate",
    "compare",
    "draw",
    "identify",
    "load_scene",
    "open_loop",
    "package",
    "plot",
    "read",
    "run",
    "stability",
    "stability_map",
    "sweep",
    "trade",
]

_HOMES = {
    "Axis": "results.stability_map",
    "Component": "systems.system",
    "Connection": "systems.system",
    "Scene": "systems.scene",
    "System": "systems.system",
    "available_parts": "assembly.models",
    "available_scenes": "assembly.load_scene",
    "calibrate": "experiments.calibrate",
    "compare": "experiments.compare",
    "draw": "figures.drawing",
    "identify": "experiments.identify",
    "load_scene": "assembly.load_scene",
    "open_loop": "experiments.open_loop",
    "package": "experiments.package",
    "plot": "figures.signals",
    "read": "results.read",
    "run": "experiments.run",
    "stability": "experiments.stability",
    "stability_map": "experiments.stability_map",
    "sweep": "experiments.sweep",
    "trade": "experiments.trade",
}
"""Module of each public name: it is imported when the name is first used, as some take a second."""


def __getattr__(name: str) -> Any:
    """Return a public name."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOMES])
