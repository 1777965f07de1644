"""The subject of a sweep: a scene whose levels and order are chosen, its signals, and the assemblies of its FMUs."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hfsa.cosim.assembly.assemble import Variants
from hfsa.cosim.assembly.native_loop import chosen_loop
from hfsa.cosim.experiments.orders import with_computed_order
from hfsa.cosim.experiments.selection import find_signals, free_inputs, with_amplitude, with_nominal_amplitudes
from hfsa.cosim.experiments.setup import (
    Setup,
    Warn,
    refuse_order,
    with_levels,
)
from hfsa.cosim.experiments.sweep_request import SweepRequest
from hfsa.cosim.fidelity import levels
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.measurement.sweep import system_record
from hfsa.cosim.results.files import (
    AlgorithmChoice,
    LevelChoice,
    OrderChoice,
    SystemRecord,
)
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import nearest
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.scene_file import scene_text

_WITHOUT_AMPLITUDE = 1e-6
"""Factor of the amplitude at which levels are judged for the linear method."""


@dataclass(frozen=True)
class Subject:
    """What a sweep measures: a scene whose levels and order are chosen, its signals, and its assemblies.

    Attributes:
        title: title of the results.
        scene: the scene, from the judgement of its steps on with an algorithm in place of `auto`.
        inputs, outputs: full names.
        variants: assemblies of the scene.
        library: the stepping loop in C, `None` for the one in Python.
        choices: chosen levels by component.
        order, algorithm: the choices of these, `None` where they are the scene's.
    """

    title: str
    scene: Scene
    inputs: list[str]
    outputs: list[str]
    variants: Variants
    library: Path | None
    choices: Mapping[str, LevelChoice]
    order: OrderChoice | None
    algorithm: AlgorithmChoice | None = None

    def record(self, *assemblies: Assembly, operating_point: Mapping[str, float] = {}) -> SystemRecord:
        """Return the record of the scene and the FMUs of some assemblies for the results file."""
        found = system_record(
            self.title,
            scene_text(self.scene),
            *assemblies,
            operating_point=operating_point,
            order=self.order,
            algorithm=self.algorithm,
            left_out=self.variants.left_out.sentence,
        )
        return levels.with_choices(found, self.choices)


def subject_of(setup: Setup, request: SweepRequest, warn: Warn) -> Subject:
    """Choose signals, levels and order, and build the FMUs, with a warning for each choice."""
    if request.method == "linear":
        refuse_order(setup)
    is_linear = request.method == "linear" and not levels.automatic(setup.scene)
    library = None if is_linear else chosen_loop(request.backend, warn)
    scene, inputs, outputs = _selected(setup, request)
    override: dict[str, Any] = {"inputs": inputs, "outputs": outputs, "band": request.judged_band(scene)}
    if request.method == "linear":  # the response at rest, whose levels no amplitude sets apart
        override["amplitude"] = {unit: _WITHOUT_AMPLITUDE * amplitude for unit, amplitude in scene.amplitude.items()}
    scene, choices = with_levels(scene, library, **override)
    for name, choice in choices.items():
        warn(choice.sentence(name))
    scene, order = with_computed_order(scene, setup.order, **override)
    if order is not None:
        warn(order.sentence)
    variants = Variants(scene, setup.highest, keep=request.keep, observed=outputs, excited=inputs)
    if variants.left_out.warning:
        warn(variants.left_out.sentence)
    return Subject(setup.title, scene, inputs, outputs, variants, library, choices, order)


def _selected(setup: Setup, request: SweepRequest) -> tuple[Scene, list[str], list[str]]:
    """Return the scene with the requested amplitude, and the requested inputs and outputs."""
    scene, assembly = setup.scene, setup.highest.check()
    inputs = find_signals(request.inputs, scene.inputs, assembly.connectors, "input")
    if not inputs:
        free = nearest("", free_inputs(assembly))
        raise StructureError(f"the scene has a motion of its own and no input to excite; name one with --input{free}")
    outputs = find_signals(request.outputs, scene.outputs, assembly.connectors, "output")
    scene = with_amplitude(scene, request.amplitude or None, inputs, assembly)
    return with_nominal_amplitudes(scene, inputs, assembly) if request.method == "linear" else scene, inputs, outputs
