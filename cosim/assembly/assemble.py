"""From a scene to its assemblies: parts fused, instruments joined, FMUs built and read.

    variants = Variants(scene)
    variants.plain  # parts fused
    variants.instrumented("reference.command.position[3]")  # a sine source there, a lock-in amplifier at the outputs

No FMU is built or read twice.
"""

import dataclasses
from collections.abc import Sequence
from functools import cached_property

from hfsa.cosim.assembly.build import build, instrument
from hfsa.cosim.assembly.fuse import fused
from hfsa.cosim.assembly.multisine import with_multisine
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.systems.scene import LOCK_IN, Scene
from hfsa.cosim.systems.system import System


class Variants:
    """The assemblies of one scene, in which each FMU is built and read once.

    Attributes:
        scene: whose they are.
        parts: its system before parts are fused.

    Errors are those of `build.build`, `build.instrument` and `fuse.fused`; `known` is an assembly of some of its parts.
    """

    def __init__(self, scene: Scene, known: Assembly | None = None):
        self.scene = scene
        self.parts = build(scene.system, known=known)

    @cached_property
    def plain(self) -> Assembly:
        """The scene's system, parts fused."""
        return self._built(self.scene.system)

    def instrumented(self, excited: str, outputs: Sequence[str] | None = None) -> Assembly:
        """Return the assembly with a sine source at one input and a lock-in amplifier at outputs (full names)."""
        return self._built(instrument(self.scene, excited, outputs, parts=self.parts))

    def multisine(self, excited: Sequence[str], outputs: Sequence[str], lines: int) -> Assembly:
        """Return the assembly with a multisine source at each of the inputs and a sampler at outputs (full names)."""
        return self._built(with_multisine(self.scene, excited, outputs, lines, self.parts))

    def driven(self, excited: str, frequency: float | None) -> Assembly:
        """Return the assembly with a sine source at one input, at a frequency [Hz] other than the source's own."""
        scene = self.scene
        system = instrument(scene, excited, parts=self.parts)
        start = {"frequency": frequency or scene.band[0], **({} if frequency else scene.source.start)}
        components = [
            dataclasses.replace(c, start={**c.start, **start}) if c.name == scene.source.name else c
            for c in system.components
            if c.name != LOCK_IN
        ]
        connections = [c for c in system.connections if not c.end.startswith(f"{LOCK_IN}.")]
        return self._built(System(components, connections))

    def _built(self, system: System) -> Assembly:
        """Return the assembly of a system with the scene's groups fused."""
        if not self.scene.fuse:
            return build(system, known=self.parts)
        return build(fused(system, self.scene.fuse), known=self.parts)


def assemble(scene: Scene) -> Assembly:
    """Return the assembly of a scene, parts fused; errors as of `Variants`."""
    return Variants(scene).plain
