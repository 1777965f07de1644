"""Time-domain run of a scene, from its name to its results file.

found = run("sdelta_hfsa", frequency=20.0, stop_time=2.0)
found["robot.platform.position[3]"], found.time
"""

import dataclasses
import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from hfsa.cosim.actions.divergence import recorded_scales
from hfsa.cosim.actions.wiring import check_sample_times
from hfsa.cosim.analysis.aliasing import check_resolved
from hfsa.cosim.assembly.assemble import Keep, Variants
from hfsa.cosim.assembly.build import with_ports
from hfsa.cosim.assembly.native_loop import BACKENDS, chosen_loop
from hfsa.cosim.assembly.outline import outlined
from hfsa.cosim.experiments.arguments import checked
from hfsa.cosim.experiments.drive import driven_sentences, with_amplitudes, with_companions
from hfsa.cosim.experiments.orders import candidates, with_computed_order
from hfsa.cosim.experiments.selection import find_signals, with_amplitude
from hfsa.cosim.experiments.setup import Setup, Warn, default_path, set_up, with_levels
from hfsa.cosim.fidelity import levels
from hfsa.cosim.fidelity.step_judge import judge
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.fmi.isolation.waiting import limited
from hfsa.cosim.measurement import run as measured
from hfsa.cosim.measurement.run import RunPlan
from hfsa.cosim.measurement.sweep import system_record
from hfsa.cosim.measurement.verification import check_verifiable, shares, verify
from hfsa.cosim.results.files import DrivenInput, Identity
from hfsa.cosim.results.run import Run
from hfsa.cosim.results.target import check_new
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.scene_file import scene_text

_MULTIPLE = 1e-6
"""Relative deviation of an interval from a multiple of the step that is rounding."""


@dataclass(frozen=True)
class SineInput:
    """Sine at one input: full or short name, `frequency` [Hz], and `amplitude` in the unit of the input, 0 for none.

    Defaults are the first input of the scene, if it has one, the lowest frequency of its band, and its amplitude.
    """

    input: str | None = None
    frequency: float | None = None
    amplitude: float | None = None


@dataclass(frozen=True)
class Thinning:
    """What is left of the points of a run in its file: every so many, or those an interval [s] apart; all by default.

    `StructureError` for both.
    """

    every: int | None = None
    interval: float | None = None

    def __post_init__(self):
        if self.every is not None and self.interval is not None:
            raise StructureError(
                f"--every {self.every} and --interval {self.interval:g} both thin the file; expected one of them"
            )

    def steps(self, step_size: float) -> int:
        """Return the number of communication steps [s] from one row to the next.

        `StructureError` for an interval that is no multiple of the step.
        """
        if self.interval is None:
            return self.every or 1
        found = round(self.interval / step_size)
        if found < 1 or abs(found * step_size - self.interval) > _MULTIPLE * self.interval:
            below = max(math.floor(self.interval / step_size), 1)
            raise StructureError(
                f"--interval {self.interval:g} s is no multiple of the communication step of {step_size:g} s; expected "
                f"{below * step_size:g} s or {(below + 1) * step_size:g} s"
            )
        return found


ALL = Thinning()
"""Every communication point is a row of the file."""


@checked(zero=("amplitude",))
def run(
    scene: str | Path | Scene,
    parameters: Mapping[str, Any] | None = None,
    *,
    input: str | None = None,  # noqa: A002 (name of the public argument)
    frequency: float | None = None,
    amplitude: float | None = None,
    record: Sequence[str] = (),
    drive: Mapping[str, Any] | None = None,
    every: int | None = None,
    interval: float | None = None,
    step_size: float | None = None,
    stop_time: float | None = None,
    algorithm: str | None = None,
    tolerance: float | None = None,
    fuse: Sequence[str] = (),
    order: str | None = None,
    algebraic_loops: Literal["solve", "refuse"] = "solve",
    backend: Literal["c", "python"] = "c",
    verify: bool = False,
    time_limit: float | None = None,
    tuned: str | Path | None = None,
    keep: Literal["needed", "all"] = "needed",
    quiet_inputs: bool | None = None,
    path: str | Path | None = None,
    force: bool = False,
    warn: Warn = warnings.warn,
    report: Callable[[float, str], None] | None = None,
) -> Run:
    """Run a scene in the time domain, with a sine at one input, and write the results file.

    A scene without inputs generates its own motion. Arguments that are not listed are those of `sweep`.

    Args:
        input: input of the sine (default: the scene's first).
        frequency: frequency of the sine [Hz] (default: lower end of the scene's band).
        amplitude: amplitude of the sine in the unit of its input, 0 for no excitation (default: the scene's).
        record: variables recorded in addition to the scene's outputs, also with ranges.
        drive: signals that feed inputs, by full or short name of the input, in place of what feeds it in the scene: a
            function of the time [s] that returns the value, or the value and up to three derivatives; a table (rows, 2)
            of times and values; a signal of `hfsa.cosim.signals`; or a text as `--drive` takes it.
        every: communication steps from one row of the file to the next (default: 1); the last point is kept.
        interval: time from one row of the file to the next [s], in place of `every`.
        stop_time: end of the run [s] (default: the scene's).
        verify: whether to estimate the error of each recorded variable by a second run at half the step.
        time_limit: longest time [s] that the steps of the run may take, which fails beyond it (default: none).
        keep: `needed` leaves out states and outputs that reach no recorded variable and no limit flag; `all` keeps
            them.
        quiet_inputs: whether inputs that nothing feeds are not told (default: the scene's).
        path: results file (default: `results/SCENE_run.h5`).

    Raises:
        StepError: where the run cannot continue; the file holds the values recorded until then. DivergenceError: where
        a signal exceeds its scale. Other errors are those of `sweep`.
    """
    thinning = Thinning(every, interval)
    file = Path(path) if path is not None else default_path(scene, "_run")
    check_new(file, force)
    setup = set_up(
        scene,
        parameters,
        fuse,
        algebraic_loops,
        order,
        file=None if path is None else file,
        record=record,
        drive=drive,
        step_size=step_size,
        stop_time=stop_time,
        algorithm=algorithm,
        tolerance=tolerance,
        tuned=tuned,
        quiet_inputs=quiet_inputs,
    )
    sine = SineInput(input, frequency, amplitude)
    show = None if report is None else lambda part: report(part, "")
    options = {"thinning": thinning, "backend": backend, "verified": verify, "keep": keep, "force": force}
    written = run_scene(setup, file, sine, **options, time_limit=time_limit, warn=warn, report=show)
    found = Run.read(file)
    written.check(file)
    return found


def prepare(
    setup: Setup,
    sine: SineInput,
    library: Path | None,
    warn: Warn,
    keep: Keep = "needed",
    thinning: Thinning = ALL,
) -> RunPlan:
    """Return a run that is ready to start, with FMUs built and connections checked; `StructureError` for a misfit.

    Outputs of the scene, further signals and the excited input are recorded. `library` is the stepping loop in C,
    `None` for the loop in Python. `warn` receives the choices of levels, order and algorithm, what is left out, and
    warnings about the result.
    """
    scene, excited = with_sine(setup, sine)
    scene, judged = (
        with_amplitudes(scene, setup.driven, setup.highest),
        [name for name in (excited, *setup.driven) if name],
    )
    frequency, band = None, scene.band
    every = thinning.steps(scene.step_size)
    if excited:
        frequency = sine.frequency or scene.band[0]
    highest = [signal.highest for signal in setup.driven.values() if signal.highest]
    band = min(band[0], *highest, frequency or band[0]), max(band[1], *highest, frequency or band[1])
    override = {"inputs": judged, "band": band} if judged else {}
    scene, choices = with_levels(scene, library, **override)
    scene, order = with_computed_order(scene, setup.order, **override)
    names = tuple(dict.fromkeys((*judged, *scene.outputs, *setup.signals)))
    needed = {"keep": keep, "observed": names, "excited": judged}
    variants = Variants(scene, setup.highest, **needed)
    plain, left_out = variants.plain, variants.left_out.sentence
    continuous = [name for name in judged if plain.connector(name).is_real]
    moved = {name: variants.driven(name, sine.frequency if name == excited else None) for name in continuous}
    checked = ready_to_step(moved.get(excited or "", plain), scene.step_size)
    with judge(scene, plain, moved, scene.outputs, band) as known:
        scene, algorithm, sentences = known.decided(scene, candidates(setup.order), None if setup.driven else frequency)
    # of these the error of the response is in the judgement
    told = [name for name, signal in setup.driven.items() if name in moved and known.analysis and signal.highest]
    sentences = [*sentences, *driven_sentences(setup.driven, plain, scene, told)]
    if excited and sine.amplitude == 0:
        scene = dataclasses.replace(scene, amplitude=dict.fromkeys(scene.amplitude, 0.0))
        checked = Variants(scene, plain, **needed).driven(excited, sine.frequency)
    assembly = with_ports(checked, scene.algorithm)
    chosen = [choice.sentence(name) for name, choice in choices.items()]
    for sentence in filter(None, (*chosen, order and order.sentence, variants.left_out.warning, *sentences)):
        warn(sentence)
    choice = {"order": order, "algorithm": algorithm, "left_out": left_out}
    record = system_record(setup.title, scene_text(scene), assembly, **choice)
    driven = [DrivenInput(name, signal.text, signal.fingerprint) for name, signal in setup.driven.items()]
    record = dataclasses.replace(record, driven=driven)
    whole = outlined(scene.system)
    ready = RunPlan(
        assembly,
        names,
        scene.stop_time,
        scene.step_size,
        levels.with_choices(record, choices),
        scene.algorithm,
        library,
        scene.tolerance,
        recorded_scales(scene, whole.system, whole.connectors, names),
        every,
        setup.driven,
    )
    for sentence in filter(None, (ready.end_sentence, ready.size_sentence)):
        warn(sentence)
    return ready


def run_scene(
    setup: Setup,
    path: Path,
    sine: SineInput,
    *,
    thinning: Thinning = ALL,
    backend: str = BACKENDS[0],
    verified: bool = False,
    keep: Keep = "needed",
    force: bool = False,
    time_limit: float | None = None,
    warn: Warn = warnings.warn,
    report: Callable[[float], None] | None = None,
) -> Identity:
    """Run a scene in the time domain, write the file `path`, and return its identity.

    `thinning` says which points are rows of the file; `backend` is one of `BACKENDS`; `verified` adds error estimates;
    `keep` is that of `run`; `force` replaces a results file; `time_limit` [s] is that of all steps, without the
    preparation.
    """
    for sentence in setup.disagreements:
        warn(sentence)
    ready = prepare(setup, sine, chosen_loop(backend, warn), warn, keep, thinning)
    if verified:
        check_verifiable(ready)
    first, second = shares(report) if verified else (report, None)
    with limited(time_limit):
        ended = measured.run(ready, path, first, force)
        for message in (*ended.warnings.values(), *(found.message for found in ended.limits)):
            warn(message)
        if verified and (sentence := verify(ready, path, second).excess(ready.tolerance)):
            warn(sentence)
    return ended.file


def with_sine(setup: Setup, sine: SineInput) -> tuple[Scene, str | None]:
    """Return the scene with the amplitude of a sine, and the input that it excites; `None` for a motion of its own.

    `StructureError` for a sine where there is no input. Without excitation the scene keeps its amplitude, at which
    levels, orders and algorithms are judged.
    """
    scene = setup.scene
    if setup.driven and sine == SineInput():
        return scene, None
    if sine.input or scene.inputs:
        wanted = [sine.input] if sine.input else scene.inputs[:1]
        excited = find_signals(wanted, scene.inputs, setup.highest.connectors, "input")[0]
        if excited in with_companions(setup.driven, setup.highest):
            raise StructureError(f"{excited} is driven, and has no sine as well; expected another --input")

        return with_amplitude(scene, sine.amplitude or None, [excited], setup.highest), excited
    if sine.frequency is not None or sine.amplitude is not None:
        raise StructureError(
            "the scene has a motion of its own; a sine takes --input beside --frequency and --amplitude"
        )
    return scene, None


def ready_to_step(assembly: Assembly, step_size: float) -> Assembly:
    """Return the assembly; `StructureError` for misfits of connections, sample times or source frequencies."""
    assembly.check()
    check_sample_times(assembly.system, assembly.connectors, {}, step_size)
    check_resolved(assembly.system, assembly.connectors, step_size)
    return assembly
