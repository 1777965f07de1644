"""From a scene to its assemblies: parts fused, instruments joined, FMUs built and read.

    variants = Variants(scene)
    variants.plain  # parts fused
    variants.instrumented("reference.command.position[3]")  # a sine source there, a lock-in amplifier at the outputs

    variants = Variants(scene, keep="needed", observed=["robot.platform.position[3]"], excited=scene.inputs)
    variants.left_out.sentence                              # "robot: 10 of 12 states and 18 outputs reach nothing ..."

No FMU is built or read twice. With `keep="needed"` the FMUs are pruned (`prune.py`), once for all that is excited and
observed, so that all variants of a sweep have the same ones.
"""

import dataclasses
from collections.abc import Sequence
from functools import cached_property
from typing import Literal

from hfsa.cosim.assembly.build import build, instrument
from hfsa.cosim.assembly.fuse import fused
from hfsa.cosim.assembly.multisine import with_multisine
from hfsa.cosim.assembly.outline import outlined
from hfsa.cosim.assembly.prune import LeftOut, prune
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.systems.scene import LOCK_IN, Scene
from hfsa.cosim.systems.system import System

Keep = Literal["needed", "all"]
"""What is built of a system: what its observed variables need, or all of it."""


class Variants:
    """The assemblies of one scene, in which each FMU is built and read once.

    Args:
        scene: the scene, with its levels chosen.
        known: assembly of some of its parts, whose FMUs are taken from there.
        keep: `needed` prunes the system to what the observed variables need; `all` keeps it whole.
        observed: full names of the variables to observe, outputs, inputs or locals (default: the scene's outputs).
        excited: full names of the inputs that stay, for a source (default: the scene's inputs).

    Attributes:
        scene: whose they are.
        parts: its system before parts are fused, pruned.
        left_out: what pruning left out.

    Errors are those of `build.build`, `build.instrument` and `fuse.fused`; with `needed` also `StructureError` for
    connections and start values of the whole system that do not fit.
    """

    def __init__(
        self,
        scene: Scene,
        known: Assembly | None = None,
        *,
        keep: Keep = "all",
        observed: Sequence[str] | None = None,
        excited: Sequence[str] | None = None,
    ):
        self.scene, self.left_out = scene, LeftOut()
        self._outputs = [name for name in scene.outputs if keep == "all" or observed is None or name in observed]
        system = scene.system
        if keep == "needed":
            outlined(system).check()
            observed = scene.outputs if observed is None else observed
            system, self.left_out = prune(system, observed, scene.inputs if excited is None else excited)
        self.parts = build(system, known=known)

    @cached_property
    def plain(self) -> Assembly:
        """The scene's system, pruned, parts fused."""
        return self._built(self.parts.system)

    def instrumented(self, excited: str, outputs: Sequence[str] | None = None) -> Assembly:
        """Return the assembly with a sine source at one input and a lock-in amplifier at outputs (full names).

        The default outputs are those of the scene, as far as they are observed.
        """
        outputs = self._outputs if outputs is None else outputs
        return self._built(instrument(self.scene, excited, outputs, parts=self.parts))

    def multisine(self, excited: Sequence[str], outputs: Sequence[str], lines: int) -> Assembly:
        """Return the assembly with a multisine source at each of the inputs and a sampler at outputs (full names)."""
        return self._built(with_multisine(self.scene, excited, outputs, lines, self.parts))

    def driven(self, excited: str, frequency: float | None) -> Assembly:
        """Return the assembly with a sine source at one input, at a frequency [Hz] other than the source's own."""
        scene = self.scene
        system = instrument(scene, excited, (), parts=self.parts)
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
