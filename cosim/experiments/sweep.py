"""From a scene's name to a sweep's file: choose signals and frequencies, build FMUs and instruments, sweep.

    loaded = load("sdelta_shaker", {"damping": "0.02"}, step_size=20e-6)
    sweep_scene(loaded, Request(Settings(), inputs=["command.position[3]"]), Path("results/sweep.h5"))

Like `cli.py`, for which it works, it stands on the roof: it asks `assembly/build.py` for files.
"""

import contextlib
import dataclasses
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.assembly import build
from hfsa.cosim.assembly.agreement import disagreements
from hfsa.cosim.assembly.fuse import fused, with_fusion
from hfsa.cosim.assembly.load_scene import scenes
from hfsa.cosim.assembly.native_loop import LOOPS, chosen_loop
from hfsa.cosim.experiments.orders import offered, with_computed_order, with_order
from hfsa.cosim.fidelity import levels
from hfsa.cosim.fidelity.step_judge import judge
from hfsa.cosim.fmi.description import describe
from hfsa.cosim.measurement.sweep import (
    Bench,
    LinearSweep,
    Progress,
    Settings,
    finished,
    linear,
    plan_sweep,
    stepped,
    system_record,
)
from hfsa.cosim.results.files import Identity, LevelChoice, Plan, SweepFile, Theory
from hfsa.cosim.results.target import REPLACING, check_continued, check_new
from hfsa.cosim.signals import excitation
from hfsa.cosim.signals.frequency_response import negligible
from hfsa.cosim.systems.connectors import Connector, check, connector
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.feedthrough import refuse_loops
from hfsa.cosim.systems.names import companions, expand, named, nearest, refuse_signal
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.scene_file import scene_text
from hfsa.cosim.systems.system import System

_CAUSALITIES = {"input": ("input",), "output": ("output",), "signal": ("output", "input", "local")}
"""What a variable is in its FMU that is called so here; of several that fit one short name, the first goes before."""

_FORMATS = (".h5", ".hdf5", ".nc", ".png", ".pdf", ".svg", ".jpg", ".jpeg", ".eps", ".tif", ".tiff", ".webp")
"""Endings that no signal is asked after."""

GRIDS = ("response", "log")
"""How frequencies are spaced: along the curve of the linear response, or evenly on a logarithmic axis."""

ALGEBRAIC = ("solve", "refuse")
"""What becomes of algebraic loops between FMUs."""

# Frequencies at which the linear response is followed, and those that draw its line.
_DENSE, _LINE = 5000, 1000

_AROUND = 1e-6
"""Relative width of the band by which levels and orders are judged for a single frequency."""


@dataclass(frozen=True)
class Request:
    """What a user asks of a scene; `None` takes what the scene or the method says.

    `inputs` and `outputs` are names, full or without the component where that is clear; `low` and `high` in Hz;
    `amplitude` in the unit of each input; `jobs` processes, `None` for one per processor; `loop` one of `LOOPS`.
    """

    settings: Settings
    inputs: Sequence[str] = ()
    outputs: Sequence[str] = ()
    low: float | None = None
    high: float | None = None
    points: int | None = None
    grid: str = GRIDS[0]
    amplitude: float | None = None
    jobs: int | None = None
    loop: str = LOOPS[0]


@dataclass(frozen=True)
class Loaded:
    """A scene with the title that its results carry.

    Attributes:
        order: what is typed of it (`orders.py`).
        signals: full names of variables that a run records beside the scene's outputs.
        disagreements: a sentence for each fact on which its parts do not agree.
    """

    scene: Scene
    title: str
    order: str | None = None
    signals: Sequence[str] = ()
    disagreements: Sequence[str] = ()


def load(
    name: str,
    arguments: Mapping[str, str],
    fuse: Sequence[str] = (),
    loops: str = ALGEBRAIC[0],
    order: str | None = None,
    *,
    file: Path | None = None,
    signals: Sequence[str] = (),
    **changes: Any,
) -> Loaded:
    """Return a scene by name or path, with `arguments` of its own or its components; of `changes` those not `None`.

    `fuse` are groups of components that become one FMU each, `order` is that of their steps, both as typed; `loops` is
    one of `ALGEBRAIC`, and where it is `refuse`, an algebraic loop between the FMUs is a `StructureError`; so is a
    `file` to be written with the name of a signal. `signals`, as typed, are further ones to record.
    """
    scene = with_fusion(build.load_scene(name, arguments), fuse)
    scene = dataclasses.replace(scene, **{key: value for key, value in changes.items() if value is not None})
    if loops == "refuse":
        _refuse_loops(scene)
    if order is not None:
        scene = with_order(scene, order)
    if file is not None and file.suffix not in _FORMATS:
        refuse_signal(file, _signals(_variables(scene)))
    recorded = find_signals(signals, (), _variables(scene), "signal") if signals else ()
    known = scenes().get(name)
    title = known.doc.partition(":")[0].rstrip(".") if known else Path(name).stem
    further = tuple(name for name in recorded if name not in scene.outputs)
    return Loaded(scene, title, order, further, disagreements(name, arguments, scene))


def refuse_order(loaded: Loaded) -> None:
    """Raise `StructureError` where an order is typed for what takes no steps."""
    if loaded.order is not None:
        raise StructureError(f"--order {loaded.order}: the linear method takes no steps, so that there is no order")


def _refuse_loops(scene: Scene) -> None:
    """Raise `StructureError` where the FMUs of a scene, fused and at their highest levels, close an algebraic loop."""
    system = fused(levels.at_highest(scene).system, scene.fuse)
    variables = {name: describe(file).variables for name, file in build.build(system).items()}
    check(system, variables)
    refuse_loops(system, variables)


def check_file(path: Path, *, resume: bool, force: bool) -> None:
    """Raise `ResultsError` where a sweep may not write: a results file of ours is gone on with, or replaced."""
    if resume and force:
        raise StructureError("--resume goes on with a results file, --force replaces it; expected one of them")
    if resume:
        check_continued(path)
    else:
        check_new(path, force, f"--resume goes on with it, {REPLACING}")


def sweep_scene(
    loaded: Loaded,
    request: Request,
    path: Path,
    *,
    resume: bool = False,
    force: bool = False,
    warn: Callable[[str], None] = print,
    report: Callable[[Progress], None] | None = None,
) -> Identity:
    """Sweep a scene into the file `path` and return which file that is.

    Where there is one, `resume` goes on with it and `force` replaces it.
    """
    for sentence in loaded.disagreements:
        warn(sentence)
    settings = request.settings
    if settings.method == "linear":
        refuse_order(loaded)
    is_linear = settings.method == "linear" and not levels.automatic(loaded.scene)
    library = None if is_linear else chosen_loop(request.loop, warn)
    scene, inputs, outputs = _wanted(loaded.scene, request)
    asked = {"inputs": inputs, "outputs": outputs, "band": _judged_band(scene, request)}
    scene, choices = with_levels(scene, library, **asked)
    for name, choice in choices.items():
        warn(choice.sentence(name))
    scene, order = with_computed_order(scene, loaded.order, **asked)
    if order is not None:
        warn(order.sentence)
    system = fused(scene.system, scene.fuse)
    files = build.build(system)
    draft = _draft(system, files, inputs, outputs, scene, request)
    theory = _theory(system, files, draft, request, warn)
    dense = None if theory is None else theory.response(draft.frequency)
    plan = dataclasses.replace(draft, frequency=_frequencies(draft, dense, request))
    text = scene_text(scene)
    opening = SweepFile.resume if resume and path.is_file() else partial(SweepFile.create, force=force)
    if theory is not None and settings.method == "linear":
        point = {system.own_name(name): value for name, value in theory.operating_point.items()}
        record = system_record(loaded.title, text, (system, files), operating_point=point)
        with opening(path, plan, levels.with_choices(record, choices)) as file:
            file.write(finished(theory.response(plan.frequency)))
        return file.identity
    if theory is not None and dense is not None:
        line = _along(draft, dense, _LINE)
        plan = dataclasses.replace(plan, theory=Theory(line, theory.response(line)))
    with usage_errors():
        excitation.window_steps(plan.frequency.max(), settings.step_size)
    excited = {name: fused(build.instrument(scene, name, outputs), scene.fuse) for name in inputs}
    with judge(scene, excited, outputs, _band(scene, request)) as known:
        scene, algorithm, sentences = known.decided(scene, offered(loaded.order))
        for sentence in sentences:
            warn(sentence)
        plan = dataclasses.replace(plan, step_error=known.step_error(scene, plan.frequency))
    settings = dataclasses.replace(settings, algorithm=scene.algorithm)
    plan = dataclasses.replace(plan, settings=dataclasses.asdict(settings))
    benches = {name: _bench(scene, system, outputs, library) for name, system in excited.items()}
    record = system_record(
        loaded.title,
        scene_text(scene),
        *((bench.system, bench.files) for bench in benches.values()),
        order=order,
        algorithm=algorithm,
    )
    jobs = request.jobs or os.cpu_count() or 1
    with opening(path, plan, levels.with_choices(record, choices)) as file:
        try:
            stepped(file, plan, benches, settings, jobs=jobs, report=report)
        except KeyboardInterrupt:
            warn(f"{len(file.unfinished())} points are missing in {path}; sweep with --resume to go on")
            raise
    return file.identity


def with_levels(scene: Scene, library: Path | None, **asked: Any) -> tuple[Scene, dict[str, LevelChoice]]:
    """Return a scene with every level `auto` chosen, and the choices by component.

    `asked` are those fields of the scene that a measurement has otherwise: inputs, outputs, band.
    """
    if not levels.automatic(scene):
        return scene, {}
    choices = levels.choose(dataclasses.replace(scene, **asked), library)
    return levels.settled(scene, choices), choices


def find_signals(
    wanted: Sequence[str], offered: Sequence[str], variables: Mapping[str, Mapping[str, Connector]], kind: str
) -> list[str]:
    """Return full names of inputs, outputs or signals: those offered by the scene, or any others that are wanted.

    `kind` is `input`, `output`, or `signal`, which is whatever may change in a run. A wanted name may have a range, and
    may leave out the component where only one fits. `StructureError` for a name that fits none, with the nearest ones,
    or several.
    """
    if not wanted:
        return list(offered)
    known = _signals(variables, kind)
    found = []
    for name in (member for item in wanted for member in expand(item)):
        groups = (offered, *(_of(variables, causality) for causality in _CAUSALITIES[kind]))
        fitting = [name] if name in known else next(filter(None, (named(name, group) for group in groups)), [])
        if not fitting:
            short = [full.partition(".")[2] for full in known]
            raise StructureError(
                f"no {kind} is called {name!r}{nearest(name, dict.fromkeys([*offered, *known, *short]))}"
            )
        if len(fitting) > 1:
            raise StructureError(f"{name} fits several {kind}s: {', '.join(fitting)}; say which")
        found += fitting
    return list(dict.fromkeys(found))


def _signals(variables: Mapping[str, Mapping[str, Connector]], kind: str = "signal") -> list[str]:
    """Return the full names of all variables of a kind."""
    return [name for causality in _CAUSALITIES[kind] for name in _of(variables, causality)]


def _of(variables: Mapping[str, Mapping[str, Connector]], causality: str) -> list[str]:
    """Return the full names of all real variables of one causality."""
    every = ((component, v) for component, known in variables.items() for v in known.values())
    return [f"{component}.{v.name}" for component, v in every if v.causality == causality and v.is_real]


def _variables(scene: Scene) -> dict[str, dict[str, Connector]]:
    """Return the variables of each component's FMU by name, levels `auto` at their highest."""
    return {name: describe(file).variables for name, file in build.build(levels.at_highest(scene).system).items()}


def with_amplitude(
    scene: Scene, amplitude: float | None, inputs: Sequence[str], variables: Mapping[str, Mapping[str, Connector]]
) -> Scene:
    """Return the scene with one amplitude for all wanted inputs, each in its own unit."""
    if amplitude is None:
        return scene
    units = {connector(scene.system, variables, name).unit or "1" for name in inputs}
    return dataclasses.replace(scene, amplitude={**scene.amplitude, **dict.fromkeys(units, amplitude)})


def _wanted(scene: Scene, request: Request) -> tuple[Scene, list[str], list[str]]:
    """Return the scene with the wanted amplitude, and the wanted inputs and outputs."""
    system, variables = levels.at_highest(scene).system, _variables(scene)
    check(system, variables)
    inputs = find_signals(request.inputs, scene.inputs, variables, "input")
    if not inputs:
        free = nearest("", _free_inputs(system, variables))
        raise StructureError(f"the scene has a motion of its own and no input to excite; say one with --input{free}")
    outputs = find_signals(request.outputs, scene.outputs, variables, "output")
    return with_amplitude(scene, request.amplitude, inputs, variables), inputs, outputs


def _band(scene: Scene, request: Request) -> tuple[float, float]:
    """Return the lowest and the highest wanted frequency [Hz]."""
    low, high = scene.band
    return low if request.low is None else request.low, high if request.high is None else request.high


def _judged_band(scene: Scene, request: Request) -> tuple[float, float]:
    """Return the band [Hz] by which levels and orders are judged: around a single frequency where that is wanted."""
    low, high = _band(scene, request)
    return (low, high * (1 + _AROUND)) if low == high else (low, high)


def _free_inputs(system: System, variables: Mapping[str, Mapping[str, Connector]]) -> list[str]:
    """Return the inputs (full names) that nothing feeds, without rates and accelerations of others."""
    fed = {connection.end for connection in system.connections}
    free = []
    for component, known in variables.items():
        names = [v.name for v in known.values() if v.causality == "input" and f"{component}.{v.name}" not in fed]
        follow = {companion for name in names for companion in companions(name)}
        free += [f"{component}.{name}" for name in names if name not in follow]
    return free


def _draft(
    system: System, files: Mapping[str, Path], inputs: list[str], outputs: list[str], scene: Scene, request: Request
) -> Plan:
    """Return the plan with very many frequencies, evenly spaced on a logarithmic axis."""
    with usage_errors():
        frequency = excitation.logarithmic(*_band(scene, request), _DENSE)
        return plan_sweep(system, files, inputs, outputs, frequency, scene.amplitude, request.settings)


def _theory(
    system: System, files: Mapping[str, Path], draft: Plan, request: Request, warn: Callable[[str], None]
) -> LinearSweep | None:
    """Return the linearised system; `None`, with a warning, where a stepped sweep has none."""
    try:
        found = linear(system, files, draft)
    except StructureError as error:
        if request.settings.method == "linear":
            raise
        warn(f"there is no linear response to compare with: {error}")
        return None
    if found.growth and request.settings.method == "linear":
        warn(f"the system is unstable: a mode grows by {found.growth:.3g} 1/s, so its response cannot be measured")
    return found


def _frequencies(draft: Plan, dense: NDArray[np.complex128] | None, request: Request) -> NDArray[np.float64]:
    """Return the frequencies as the request wants them spaced; evenly where there is no response to follow."""
    points = request.points or (_LINE if request.settings.method == "linear" else 40)
    if len(draft.frequency) == 1 and request.points not in (None, 1):
        raise StructureError(
            f"--points {points}: from {draft.frequency[0]:g} to {draft.frequency[0]:g} Hz there is one"
        )
    with usage_errors():
        if request.grid == "log" or dense is None:
            return excitation.logarithmic(draft.frequency[0], draft.frequency[-1], points)
        return _along(draft, dense, points)


def _along(draft: Plan, dense: NDArray[np.complex128], points: int) -> NDArray[np.float64]:
    """Return frequencies along the response's entries that are not zero by symmetry."""
    units, amplitudes = [signal.unit for signal in draft.outputs], [signal.amplitude for signal in draft.inputs]
    return excitation.along_response(draft.frequency, dense[:, ~negligible(dense, units, amplitudes)], points)


def _bench(scene: Scene, system: System, outputs: Sequence[str], library: Path | None) -> Bench:
    """Return a scene's system with its instruments, ready to be measured, its wiring checked."""
    files = build.files_for(system, scene.algorithm)
    check(system, {name: describe(file).variables for name, file in files.items()})
    return Bench(system, files, tuple(outputs), scene.source.name, build.LOCK_IN, library)


@contextlib.contextmanager
def usage_errors() -> Iterator[None]:
    """What cannot be measured as it was asked for is a wrong word of the user's."""
    try:
        yield
    except ValueError as error:
        raise StructureError(str(error)) from error
