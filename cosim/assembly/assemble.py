"""From a scene to its assembly: parts fused, instruments joined, FMUs built and read."""

import dataclasses
from collections.abc import Sequence

from hfsa.cosim.assembly.build import build, instrument
from hfsa.cosim.assembly.fuse import fused
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.systems.scene import LOCK_IN, Scene
from hfsa.cosim.systems.system import System


def assemble(scene: Scene) -> Assembly:
    """Return a scene's assembly; errors as of `build.build` and `fuse.fused`."""
    return build(fused(scene.system, scene.fuse))


def instrumented(scene: Scene, excited: str, outputs: Sequence[str] | None = None) -> Assembly:
    """Return the assembly with a sine source at one input and a lock-in amplifier at outputs, as `build.instrument`."""
    return build(fused(instrument(scene, excited, outputs), scene.fuse))


def driven(scene: Scene, excited: str, frequency: float | None) -> Assembly:
    """Return the assembly with a sine source at one input (full name), at a frequency [Hz] other than its own."""
    system = instrument(scene, excited, scene.outputs)
    start = {"frequency": frequency or scene.band[0], **({} if frequency else scene.source.start)}
    components = [
        dataclasses.replace(c, start={**c.start, **start}) if c.name == scene.source.name else c
        for c in system.components
        if c.name != LOCK_IN
    ]
    connections = [c for c in system.connections if not c.end.startswith(f"{LOCK_IN}.")]
    return build(fused(System(components, connections), scene.fuse))
