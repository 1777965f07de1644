"""Order of steps of the components of a scene, as typed: names, or `computed`.

scene = with_order(scene, "stage,stacks")                          # a given order
scene, choice = with_computed_order(scene, "computed")             # once the levels are chosen
"""

import dataclasses
from contextlib import ExitStack
from typing import Any

from hfsa.cosim.analysis.order import ExcitedSystem, ModeCriterion, OrderProblem, ResponseCriterion, best_order
from hfsa.cosim.assembly.assemble import Variants, assemble
from hfsa.cosim.assembly.build import LOCK_IN
from hfsa.cosim.assembly.fuse import stepping_in
from hfsa.cosim.fidelity import levels
from hfsa.cosim.masters.algorithms import CANDIDATES, ORDERED
from hfsa.cosim.results.files import OrderChoice
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import nearest, resolve_names
from hfsa.cosim.systems.scene import AUTO, Scene

COMPUTED = "computed"
"""Value of the option `--order` for a computed order."""


def with_order(scene: Scene, words: str) -> Scene:
    """Return the scene in a typed order: names separated by commas, as of `names.resolve_names`.

    The named components are permuted among their places in the scene after fusing; `computed` leaves the order
    unchanged. `StructureError` for an algorithm without an order of steps, and for a sampled component, whose order is
    part of the system.
    """
    if scene.algorithm not in (AUTO, *ORDERED):
        raise StructureError(
            f"--order {words}: with {scene.algorithm} the order of steps makes no difference; it does with "
            f"{', '.join(ORDERED[:-1])} and {ORDERED[-1]}"
        )
    if words == COMPUTED:
        return scene
    assembly = assemble(levels.at_highest(scene))
    system, descriptions = assembly.system, assembly.descriptions
    everyone = [*descriptions, *(member.name for whole in system.components for member in whole.members)]
    names = [name for word in words.split(",") for name in resolve_names(word.strip(), everyone)]
    ordered = stepping_in(scene, names)
    if ticking := [name for name in names if descriptions[name].has_sample_time]:
        free = nearest("", [name for name, description in descriptions.items() if not description.has_sample_time])
        raise StructureError(
            f"--order {words}: {ticking[0]} is sampled, and the order of its ticks is part of the system{free}"
        )
    return ordered


def candidates(words: str | None) -> list[str]:
    """Return the candidates of `auto`; with a typed order, those whose result depends on the order of steps."""
    return [name for name in CANDIDATES if words is None or name in ORDERED]


def with_computed_order(scene: Scene, words: str | None, **measured: Any) -> tuple[Scene, OrderChoice | None]:
    """Return the scene in the order of least error, and the choice, where `words` is `computed`; else the same scene.

    `measured` overrides fields of the scene for the measurement: inputs, outputs, band. `StructureError` where the
    order cannot be computed.
    """
    if words != COMPUTED:
        return scene, None
    target = dataclasses.replace(scene, **measured)
    with ExitStack() as stack:
        variants = Variants(scene)
        system, instances = variants.plain.system, stack.enter_context(variants.plain.open())
        algorithm = candidates(words)[0] if scene.algorithm == AUTO else scene.algorithm
        case = OrderProblem(system, instances, algorithm, scene.step_size, target.outputs)
        excitations = [_excitation(Variants(target, variants.parts), name, stack) for name in target.inputs]
        try:
            if excitations:
                choice = best_order(case, ResponseCriterion(case, excitations, target.outputs, target.band))
            else:
                choice = best_order(case, ModeCriterion(case, target.outputs, target.band[0]))
        except StructureError as error:
            raise StructureError(f"--order {COMPUTED} takes the FMUs' linear response: {error}") from error
        # a sampled group steps first in any case, and its members tick in the order of the scene
        groups = {whole.name for whole in system.components if whole.members}
        staying = {name for name in groups if instances[name].fmu.description.has_sample_time}
    return stepping_in(scene, [name for name in choice.order if name not in staying]), choice


def _excitation(variants: Variants, name: str, stack: ExitStack) -> ExcitedSystem:
    """Return the scene's system with its instruments at one input; the stack closes the instances."""
    assembly, scene = variants.instrumented(name), variants.scene
    system, instances = assembly.system, stack.enter_context(assembly.open())
    amplitude = system[scene.source.name].start["amplitude"]
    return ExcitedSystem(system, instances, scene.source.name, LOCK_IN, name, amplitude)
