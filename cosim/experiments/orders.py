"""The order in which a scene's components step, as a user types it: names, or `computed`.

scene = with_order(scene, "stage,stacks")                          # at once
scene, choice = with_computed_order(scene, "computed")             # when the scene's levels are known
"""

import dataclasses
from contextlib import ExitStack
from typing import Any

from hfsa.cosim.analysis.order import Case, Excitation, Modes, Responses, best_order
from hfsa.cosim.assembly.assemble import assemble, instrumented
from hfsa.cosim.assembly.build import LOCK_IN
from hfsa.cosim.assembly.fuse import stepping_in
from hfsa.cosim.fidelity import levels
from hfsa.cosim.masters.algorithms import CANDIDATES, ORDERED
from hfsa.cosim.results.files import OrderChoice
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import nearest, resolve_names
from hfsa.cosim.systems.scene import AUTO, Scene

COMPUTED = "computed"
"""The word for an order that is to be computed."""


def with_order(scene: Scene, words: str) -> Scene:
    """Return the scene in an order that is typed: names separated by commas, as `names.resolve_names`, or `computed`.

    The components named take, in this order, the places that they have in the scene after fusing. What is to be
    computed stays as it is. `StructureError` where the scene's algorithm knows no order, or for what ticks: when that
    is, and after whom, is what the system is.
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
            f"--order {words}: {ticking[0]} is sampled; when it ticks, and after whom, is what the system is{free}"
        )
    return ordered


def offered(words: str | None) -> list[str]:
    """Return the algorithms that `auto` may take: with an order, as typed, those to which it makes a difference."""
    return [name for name in CANDIDATES if words is None or name in ORDERED]


def with_computed_order(scene: Scene, words: str | None, **asked: Any) -> tuple[Scene, OrderChoice | None]:
    """Return the scene in the order that errs least, and what it was chosen by, where `words` ask for that.

    `asked` are those fields of the scene that a measurement has otherwise: inputs, outputs, band. `StructureError`
    where that cannot be computed.
    """
    if words != COMPUTED:
        return scene, None
    question = dataclasses.replace(scene, **asked)
    with ExitStack() as stack:
        assembly = assemble(scene)
        system, instances = assembly.system, stack.enter_context(assembly.open())
        algorithm = offered(words)[0] if scene.algorithm == AUTO else scene.algorithm
        case = Case(system, instances, algorithm, scene.step_size)
        excitations = [_excitation(question, name, stack) for name in question.inputs]
        try:
            if excitations:
                choice = best_order(case, Responses(case, excitations, question.outputs, question.band))
            else:
                choice = best_order(case, Modes(case, question.outputs, question.band[0]))
        except StructureError as error:
            raise StructureError(f"--order {COMPUTED} takes the FMUs' linear response: {error}") from error
        # a sampled group goes first in any case, and its members tick where the scene has them
        groups = {whole.name for whole in system.components if whole.members}
        staying = {name for name in groups if instances[name].fmu.description.has_sample_time}
    return stepping_in(scene, [name for name in choice.order if name not in staying]), choice


def _excitation(scene: Scene, name: str, stack: ExitStack) -> Excitation:
    """Return the scene's system with its instruments at one input; the stack closes the instances."""
    assembly = instrumented(scene, name)
    system, instances = assembly.system, stack.enter_context(assembly.open())
    amplitude = system[scene.source.name].start["amplitude"]
    return Excitation(system, instances, scene.source.name, LOCK_IN, name, amplitude)
