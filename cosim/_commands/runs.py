"""From a scene to runs in time: what drives it, what is recorded, which FMUs; everything refused before a file is made.

    ready = prepare(load("mass_on_spring", {}), Drive(frequency=15.9), library)
    run(ready, Path("results/run.h5"))

A scene without inputs has a motion of its own and runs as it is. Like `measure.py` it stands on the roof: it asks
`build.py` for files.
"""

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from hfsa.cosim import build, levels
from hfsa.cosim._commands.measure import Loaded, find_signals, warn_of_step, with_amplitude, with_levels
from hfsa.cosim._commands.orders import with_computed_order
from hfsa.cosim._compiled import LOOPS, chosen_loop
from hfsa.cosim._fmi.description import describe
from hfsa.cosim._fuse import fused
from hfsa.cosim._scene_text import scene_text
from hfsa.cosim.actions.wiring import check_sample_times
from hfsa.cosim.run import Ready, run
from hfsa.cosim.sweep import system_record
from hfsa.cosim.system import Connector, Scene, StructureError, System, check


@dataclass(frozen=True)
class Drive:
    """A sine at one input: its name, full or not, `frequency` [Hz], `amplitude` in the input's unit, 0 for none.

    `None` takes what the scene says: its first input, if it has one, the lowest frequency of its band, its amplitude.
    """

    input: str | None = None
    frequency: float | None = None
    amplitude: float | None = None


def prepare(loaded: Loaded, drive: Drive, library: Path | None) -> Ready:
    """Return what is to run, FMUs built and the wiring checked; `StructureError` names what does not fit.

    The scene's outputs and further signals are recorded, and the input that a sine drives. `library` is the stepping
    loop in C, `None` for Python's.
    """
    scene = loaded.scene
    if drive.input or scene.inputs:
        variables = _variables(build.build(levels.at_highest(scene).system))
        excited = find_signals([drive.input] if drive.input else scene.inputs[:1], scene.inputs, variables, "input")[0]
        # at rest there is nothing to judge levels and orders by, so that the scene's own amplitude is
        scene = with_amplitude(scene, drive.amplitude or None, [excited], variables)
        band = _band_with(scene.band, drive.frequency)
        scene, choices = with_levels(scene, library, inputs=[excited], band=band)
        scene, order = with_computed_order(scene, loaded.order, inputs=[excited], band=band)
        scene = with_amplitude(scene, drive.amplitude, [excited], variables)
        system, names = _driven(scene, excited, drive.frequency), (excited, *scene.outputs, *loaded.signals)
    elif drive.frequency is not None or drive.amplitude is not None:
        raise StructureError(
            "the scene has a motion of its own; a sine takes --input beside --frequency and --amplitude"
        )
    else:
        scene, choices = with_levels(scene, library)
        scene, order = with_computed_order(scene, loaded.order)
        system, names = scene.system, (*scene.outputs, *loaded.signals)
    system = fused(system, scene.fuse)
    files = build.files_for(system, scene.algorithm)
    variables = _variables(files)
    check(system, variables)
    check_sample_times(system, variables, {}, scene.step_size)
    record = system_record(loaded.title, scene_text(scene), (system, files), order=order)
    return Ready(
        system,
        files,
        names,
        scene.stop_time,
        scene.step_size,
        levels.with_choices(record, choices),
        scene.algorithm,
        library,
        scene.tolerance,
    )


def run_scene(
    loaded: Loaded,
    path: Path,
    drive: Drive,
    *,
    loop: str = LOOPS[0],
    warn: Callable[[str], None] = print,
    report: Callable[[float], None] | None = None,
) -> None:
    """Run a scene in time into the file `path`; `loop` is one of `LOOPS`."""
    ready = prepare(loaded, drive, chosen_loop(loop, warn))
    for sentence in choices_made(ready):
        warn(sentence)
    warn_of_step(ready.system, ready.files, ready.algorithm, ready.step_size, warn)
    ended = run(ready, path, report)
    for message in (*ended.warnings.values(), *(found.message for found in ended.limits)):
        warn(message)


def choices_made(ready: Ready) -> list[str]:
    """Return a sentence for each level that was chosen, and one for an order that was computed."""
    chosen = [i.choice.sentence(i.instance) for i in ready.record.instances if i.choice is not None]
    return [*chosen, ready.record.order.sentence] if ready.record.order else chosen


def _band_with(band: tuple[float, float], frequency: float | None) -> tuple[float, float]:
    """Return a scene's band [Hz], with a sine's frequency in it."""
    return band if frequency is None else (min(band[0], frequency), max(band[1], frequency))


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


def _variables(files: Mapping[str, Path]) -> dict[str, dict[str, Connector]]:
    """Return the variables of each component's FMU by name."""
    return {name: describe(file).variables for name, file in files.items()}
