"""From a scene to runs in time: what drives it, what is recorded, which FMUs; everything refused before a file is made.

    ready = prepare(load("mass_on_spring", {}), Drive(frequency=15.9), library, print)
    run(ready, Path("results/run.h5"))

A scene without inputs has a motion of its own and runs as it is. Like `measure.py` it stands on the roof: it asks
`assembly/build.py` for files.
"""

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from hfsa.cosim.actions.divergence import recorded_scales
from hfsa.cosim.actions.wiring import check_sample_times
from hfsa.cosim.analysis.aliasing import check_resolved
from hfsa.cosim.assembly import build
from hfsa.cosim.assembly.fuse import fused
from hfsa.cosim.assembly.native_loop import LOOPS, chosen_loop
from hfsa.cosim.experiments.orders import offered, with_computed_order
from hfsa.cosim.experiments.sweep import Loaded, find_signals, with_amplitude, with_levels
from hfsa.cosim.fidelity import levels
from hfsa.cosim.fidelity.step_judge import judge
from hfsa.cosim.fmi.description import describe
from hfsa.cosim.measurement.run import Ready, run
from hfsa.cosim.measurement.sweep import system_record
from hfsa.cosim.measurement.verification import check_verifiable, shares, verify
from hfsa.cosim.results.files import Identity
from hfsa.cosim.systems.connectors import Connector, check
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.scene_file import scene_text
from hfsa.cosim.systems.system import System


@dataclass(frozen=True)
class Drive:
    """A sine at one input: its name, full or not, `frequency` [Hz], `amplitude` in the input's unit, 0 for none.

    `None` takes what the scene says: its first input, if it has one, the lowest frequency of its band, its amplitude.
    """

    input: str | None = None
    frequency: float | None = None
    amplitude: float | None = None


def prepare(loaded: Loaded, drive: Drive, library: Path | None, warn: Callable[[str], None]) -> Ready:
    """Return what is to run, FMUs built and the wiring checked; `StructureError` names what does not fit.

    The scene's outputs and further signals are recorded, and the input that a sine drives. `library` is the stepping
    loop in C, `None` for Python's. `warn` is told which levels, order and algorithm were chosen, and what is known
    against the answer.
    """
    scene, frequency, excited, band = loaded.scene, None, None, loaded.scene.band
    if drive.input or scene.inputs:
        variables = _variables(build.build(levels.at_highest(scene).system))
        excited = find_signals([drive.input] if drive.input else scene.inputs[:1], scene.inputs, variables, "input")[0]
        # at rest there is nothing to judge levels, orders and algorithms by, so that the scene's own amplitude is
        scene = with_amplitude(scene, drive.amplitude or None, [excited], variables)
        frequency = drive.frequency or scene.band[0]
        band = min(scene.band[0], frequency), max(scene.band[1], frequency)
    elif drive.frequency is not None or drive.amplitude is not None:
        raise StructureError(
            "the scene has a motion of its own; a sine takes --input beside --frequency and --amplitude"
        )
    asked = {"inputs": [excited], "band": band} if excited else {}
    scene, choices = with_levels(scene, library, **asked)
    scene, order = with_computed_order(scene, loaded.order, **asked)
    driven = {excited: fused(_driven(scene, excited, drive.frequency), scene.fuse)} if excited else {}
    variables = _checked(driven[excited] if excited else fused(scene.system, scene.fuse), scene.step_size)
    with judge(scene, driven, scene.outputs, band) as known:
        scene, algorithm, sentences = known.decided(scene, offered(loaded.order), frequency)
    if excited and drive.amplitude == 0:
        scene = dataclasses.replace(scene, amplitude=dict.fromkeys(scene.amplitude, 0.0))
        driven = {excited: fused(_driven(scene, excited, drive.frequency), scene.fuse)}
    system = driven[excited] if excited else fused(scene.system, scene.fuse)
    files = build.files_for(system, scene.algorithm)
    chosen = [choice.sentence(name) for name, choice in choices.items()]
    for sentence in (*chosen, *([order.sentence] if order else []), *sentences):
        warn(sentence)
    record = system_record(loaded.title, scene_text(scene), (system, files), order=order, algorithm=algorithm)
    names = (*([excited] if excited else []), *scene.outputs, *loaded.signals)
    ready = Ready(
        system,
        files,
        names,
        scene.stop_time,
        scene.step_size,
        levels.with_choices(record, choices),
        scene.algorithm,
        library,
        scene.tolerance,
        recorded_scales(scene, system, variables, names),
    )
    if ready.end_sentence:
        warn(ready.end_sentence)
    return ready


def run_scene(
    loaded: Loaded,
    path: Path,
    drive: Drive,
    *,
    loop: str = LOOPS[0],
    verified: bool = False,
    force: bool = False,
    warn: Callable[[str], None] = print,
    report: Callable[[float], None] | None = None,
) -> Identity:
    """Run a scene in time into the file `path`, as `run` with `force`, and return which file that is.

    `loop` is one of `LOOPS`, `verified` adds error estimates.
    """
    for sentence in loaded.disagreements:
        warn(sentence)
    ready = prepare(loaded, drive, chosen_loop(loop, warn), warn)
    if verified:
        check_verifiable(ready)
    first, second = shares(report) if verified else (report, None)
    ended = run(ready, path, first, force)
    for message in (*ended.warnings.values(), *(found.message for found in ended.limits)):
        warn(message)
    if verified and (sentence := verify(ready, path, second).excess(ready.tolerance)):
        warn(sentence)
    return ended.file


def _driven(scene: Scene, excited: str, frequency: float | None) -> System:
    """Return the scene's system with a sine source at one input (full name)."""
    system = build.instrument(scene, excited, scene.outputs)
    start = {"frequency": frequency or scene.band[0], **({} if frequency else scene.source.start)}
    components = [
        dataclasses.replace(c, start={**c.start, **start}) if c.name == scene.source.name else c
        for c in system.components
        if c.name != build.LOCK_IN
    ]
    return System(components, [c for c in system.connections if not c.end.startswith(f"{build.LOCK_IN}.")])


def _checked(system: System, step_size: float) -> dict[str, dict[str, Connector]]:
    """Return the variables of a system's FMUs; `StructureError` where wiring, ticks or sources do not fit."""
    variables = _variables(build.build(system))
    check(system, variables)
    check_sample_times(system, variables, {}, step_size)
    check_resolved(system, variables, step_size)
    return variables


def _variables(files: Mapping[str, Path]) -> dict[str, dict[str, Connector]]:
    """Return the variables of each component's FMU by name."""
    return {name: describe(file).variables for name, file in files.items()}
