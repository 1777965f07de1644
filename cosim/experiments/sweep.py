"""A frequency sweep of a scene, from its name to its results file.

    bode = sweep("sdelta_shaker", inputs=["command.position[3]"], low=1.0, high=50.0)
    bode.entry("robot.platform.position[3]", "reference.command.position[3]")

The order of work: select signals and frequencies, build FMUs and instruments, choose levels and algorithm, measure.
"""

import dataclasses
import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

from hfsa.cosim.assembly import cluster
from hfsa.cosim.assembly.assemble import Variants
from hfsa.cosim.assembly.build import LOCK_IN, with_ports
from hfsa.cosim.assembly.native_loop import chosen_loop
from hfsa.cosim.experiments.arguments import checked
from hfsa.cosim.experiments.expectations import Theory, expectations, with_expectations
from hfsa.cosim.experiments.multisine import INPUTS, Design, designed, runs_of
from hfsa.cosim.experiments.orders import candidates, with_computed_order
from hfsa.cosim.experiments.selection import find_signals, free_inputs, with_amplitude, with_nominal_amplitudes
from hfsa.cosim.experiments.setup import (
    Setup,
    Warn,
    default_path,
    refuse_order,
    set_up,
    with_levels,
)
from hfsa.cosim.experiments.sweep_plan import draft_plan, frequencies, theoretical, theory_of, usage_errors
from hfsa.cosim.experiments.sweep_request import SweepRequest
from hfsa.cosim.fidelity import levels
from hfsa.cosim.fidelity.step_judge import Judge, judge
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.measurement.multisine import MultisineSettings, multisine
from hfsa.cosim.measurement.sweep import LinearSweep, Progress, points_of, stepped, system_record
from hfsa.cosim.measurement.task import PREVIOUS, REST, Bench
from hfsa.cosim.results.files import (
    AlgorithmChoice,
    Bode,
    Identity,
    LevelChoice,
    OrderChoice,
    Plan,
    SweepFile,
    SystemRecord,
    read_sweep,
)
from hfsa.cosim.results.target import REPLACING, check_continued, check_new
from hfsa.cosim.signals import excitation
from hfsa.cosim.signals.multisine import PHASES
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import nearest
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.scene_file import scene_text

_WITHOUT_AMPLITUDE = 1e-6
"""Factor of the amplitude at which levels are judged for the linear method."""

_AT_REST = "points start at rest, which takes longer: their steady state is not known, as {}"


@checked(zero=("seed", "amplitude", "settling_periods", "settling_time_min"))
def sweep(
    scene: str | Path | Scene,
    parameters: Mapping[str, Any] | None = None,
    *,
    method: Literal["stepped", "multisine", "linear"] = "stepped",
    low: float | None = None,
    high: float | None = None,
    points: int | None = None,
    grid: Literal["response", "log", "linear"] = "response",
    inputs: Sequence[str] = (),
    outputs: Sequence[str] = (),
    amplitude: float | None = None,
    step_size: float | None = None,
    algorithm: str | None = None,
    tolerance: float | None = None,
    fuse: Sequence[str] = (),
    order: str | None = None,
    algebraic_loops: Literal["solve", "refuse"] = "solve",
    settling_tolerance: float = 1e-3,
    settling_time: float = 60.0,
    settling_periods: int = 0,
    settling_time_min: float = 0.0,
    measurement_periods: int | None = None,
    start: Literal["steady", "rest", "previous"] = "steady",
    phases: Literal["schroeder", "random"] | None = None,
    seed: int | None = None,
    together: bool = False,
    backend: Literal["c", "python"] = "c",
    jobs: int | None = None,
    time_limit: float | None = None,
    tuned: str | Path | None = None,
    keep: Literal["needed", "all"] = "needed",
    scheduler: str | None = None,
    path: str | Path | None = None,
    resume: bool = False,
    force: bool = False,
    warn: Warn = warnings.warn,
    report: Callable[[float, str], None] | None = None,
) -> Bode:
    """Measure the frequency responses of a scene, one input and one frequency at a time, and write a results file.

    Args:
        scene: name, path of a `.py`, `.toml` or `.ssp` file, or a `Scene`.
        parameters: arguments of the scene or of its components, by name: `{"law": "ctc", "robot.damping": 0.02}`.
        method: `stepped` co-simulates one sine at a time until it has settled; `multisine` many at once; `linear` uses
            directional derivatives.
        low, high: ends of the band [Hz] (default: the scene's).
        points: number of frequencies (default: 40, for `linear` 1000).
        grid: spacing of frequencies: `response`, along the curve of the linear response, `log`, or `linear`.
        inputs, outputs: names, full or short, also with ranges (default: the scene's).
        amplitude: amplitude in the unit of each input (default: the scene's); the method `linear` needs none, and
            takes 0 for vanishing sines.
        step_size: communication step size [s] (default: the scene's).
        algorithm, tolerance: as in a scene (default: the scene's).
        fuse: groups of components, each compiled into one FMU, names separated by commas.
        order: order of steps, names separated by commas, or `computed` (default: the scene's).
        algebraic_loops: `solve` or `refuse`.
        settling_tolerance: largest remaining transient, relative to each response.
        settling_time: simulated time [s] after which an unsettled point is given up.
        settling_periods: least number of periods after which a point may settle: those of the longest dead time.
        settling_time_min: least simulated time [s] after which a point may settle: the longest dead time.
        measurement_periods: periods in a measurement window (default: 1); in that of a multisine, of the lowest
            frequency (default: as many as give each frequency its own line, if affordable).
        start: `steady` starts each point on its predicted steady state, where that is known; `rest` waits for it;
            `previous` goes on from the point before, upwards and then downwards, to follow the branches of a nonlinear
            response.
        phases: of a multisine, `schroeder` (the default) or `random`.
        seed: whole number from which a multisine draws random phases and the lines that it leaves out (default: 0).
        together: whether a multisine excites all inputs in one run, on interleaved lines.
        backend: stepping loop, in C or in Python.
        jobs: threads or processes (default: one per processor).
        time_limit: longest time [s] of a point, or of a run of a multisine, which has failed beyond it (default: none).
        tuned: results file of `trade`, whose answer determines levels, groups, algorithm and step.
        keep: `needed` leaves out states and outputs that reach no measured output and no limit flag; `all` keeps them.
        scheduler: address of a scheduler of dask.distributed, whose workers measure the points instead.
        path: results file (default: `results/SCENE.h5`, for other methods `results/SCENE_METHOD.h5`).
        resume, force: continue an existing results file, or replace it.
        warn: function that receives warnings.
        report: function of the finished part, 0 to 1, and a word.

    Raises:
        StructureError: for a wrong scene, name or option; ModelError: for a wrong argument of a part;
        ResultsError: for a file that cannot be written; ExportError: where an FMU cannot be built.
    """
    ending = "" if method == "stepped" else f"_{method}"
    file = Path(path) if path is not None else default_path(scene, ending)
    check_file(file, resume=resume, force=force)
    setup = set_up(
        scene,
        parameters,
        fuse,
        algebraic_loops,
        order,
        file=None if path is None else file,
        step_size=step_size,
        algorithm=algorithm,
        tolerance=tolerance,
        tuned=tuned,
    )
    request = SweepRequest(
        method,
        inputs,
        outputs,
        low,
        high,
        points,
        grid,
        amplitude,
        settling_tolerance,
        settling_time,
        settling_periods,
        settling_time_min,
        measurement_periods,
        jobs,
        backend,
        start,
        keep,
        phases,
        seed,
        together,
        time_limit,
    )
    if scheduler is not None and (method != "stepped" or start == PREVIOUS):
        raise StructureError("--scheduler takes --method stepped, and no --start previous: its points are independent")
    show = None if report is None else partial(_report_points, report)
    with cluster.on(scheduler) as executor:
        written = sweep_scene(
            setup, request, file, resume=resume, force=force, warn=warn, report=show, executor=executor
        )
    found = read_sweep(file)
    written.check(file)
    return found


def _report_points(report: Callable[[float, str], None], progress: Progress) -> None:
    """Report the finished points of a sweep."""
    report(progress.work, f"{progress.done} of {progress.points} points")


def check_file(path: Path, *, resume: bool, force: bool) -> None:
    """Raise `ResultsError` for a path where a sweep must not write, `StructureError` for both `resume` and `force`."""
    if resume and force:
        raise StructureError("--resume continues a results file, --force replaces it; expected one of them")
    if resume:
        check_continued(path)
    else:
        check_new(path, force, f"--resume continues it, {REPLACING}")


def sweep_scene(
    setup: Setup,
    request: SweepRequest,
    path: Path,
    *,
    resume: bool = False,
    force: bool = False,
    warn: Warn = warnings.warn,
    report: Callable[[Progress], None] | None = None,
    executor: Executor | None = None,
) -> Identity:
    """Sweep a scene, write the file `path`, and return its identity.

    `resume` continues an existing file, `force` replaces it. Points are measured on `executor`, else on this machine.
    """
    for sentence in setup.disagreements:
        warn(sentence)
    subject = _subject(setup, request, warn)
    draft = draft_plan(subject.variants.plain, subject.inputs, subject.outputs, subject.scene, request)
    theory = theory_of(subject.variants.plain, draft, request, warn)
    dense = None if theory is None else theory.response(draft.frequency)
    plan = dataclasses.replace(draft, frequency=frequencies(draft, dense, request))
    opening = SweepFile.resume if resume and path.is_file() else partial(SweepFile.create, force=force)
    if request.method == "linear":
        assert theory is not None
        return _computed(subject, plan, theory, partial(opening, path))
    design = None
    if request.method == "multisine":
        plan, design = _with_lines(plan, subject, request, warn)
    if theory is not None and dense is not None:
        plan = dataclasses.replace(plan, theory=theoretical(theory, draft, dense))
    with usage_errors():
        excitation.window_steps(plan.frequency.max(), subject.scene.step_size)
    excited = {name: subject.variants.instrumented(name, subject.outputs) for name in subject.inputs}
    with judge(subject.scene, subject.variants.plain, excited, subject.outputs, request.band(subject.scene)) as known:
        scene, algorithm, sentences = known.decided(subject.scene, candidates(setup.order))
        for sentence in sentences:
            warn(sentence)
        subject = dataclasses.replace(subject, scene=scene, algorithm=algorithm)
        plan = dataclasses.replace(plan, step_error=known.step_error(scene, plan.frequency))
        exact = None
        if theory is not None and dense is not None:
            exact = Theory(theory, draft, dense, subject.variants.plain.is_foreign)
        if design is not None:
            measurement = _many_lines(subject, plan, design, known, exact, request, warn)
        else:
            measurement = _single_sines(subject, plan, excited, known, exact, request, executor, warn)
    return _written(path, opening, measurement, report, warn)


@dataclass(frozen=True)
class _Subject:
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


@dataclass(frozen=True)
class _Measurement:
    """A measurement that is ready to run: its plan, the record of its system, and `run(file, plan, report=...)`."""

    plan: Plan
    record: SystemRecord
    run: Callable[..., None]


def _subject(setup: Setup, request: SweepRequest, warn: Warn) -> _Subject:
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
    return _Subject(setup.title, scene, inputs, outputs, variants, library, choices, order)


def _computed(subject: _Subject, plan: Plan, theory: LinearSweep, opening: Callable[..., SweepFile]) -> Identity:
    """Write the linear response into the file that `opening` returns; return its identity."""
    assembly = subject.variants.plain
    point = {assembly.system.own_name(name): value for name, value in theory.operating_point.items()}
    with opening(plan, subject.record(assembly, operating_point=point)) as file:
        file.write(points_of(theory.response(plan.frequency)))
    return file.identity


def _many_lines(
    subject: _Subject,
    plan: Plan,
    design: Design,
    known: Judge,
    exact: Theory | None,
    request: SweepRequest,
    warn: Warn,
) -> _Measurement:
    """Return the measurement of a multisine."""
    settings = _multisine_settings(request, subject.scene, design)
    runs, reason = runs_of(design, known, subject.scene, subject.variants, plan, settings, subject.library)
    if reason:
        warn(_AT_REST.format(reason))
    if exact is not None:
        runs = with_expectations(runs, plan, expectations(plan, exact, {}, subject.scene, request.settling_tolerance))
    plan = dataclasses.replace(plan, settings=dataclasses.asdict(settings))
    runs = [dataclasses.replace(run, time_limit=request.time_limit) for run in runs]
    return _Measurement(
        plan, subject.record(*(run.assembly for run in runs)), partial(multisine, runs=runs, jobs=_jobs(request))
    )


def _single_sines(
    subject: _Subject,
    plan: Plan,
    excited: Mapping[str, Assembly],
    known: Judge,
    exact: Theory | None,
    request: SweepRequest,
    executor: Executor | None,
    warn: Warn,
) -> _Measurement:
    """Return the measurement of one sine at a time."""
    starts, reason = ({}, "") if request.start == REST else known.steady_starts(subject.scene, plan.frequency)
    if request.start == PREVIOUS and len(starts) < len(subject.inputs):
        raise StructureError(f"a branch cannot be followed from point to point, as {reason}; take --start rest")
    if reason:
        warn(_AT_REST.format(reason))
    settings = request.settings(subject.scene)
    plan = dataclasses.replace(plan, settings=dataclasses.asdict(settings))
    ready = {name: with_ports(whole, subject.scene.algorithm).check() for name, whole in excited.items()}
    benches = {
        name: Bench(whole, tuple(subject.outputs), subject.scene.source.name, LOCK_IN, subject.library)
        for name, whole in ready.items()
    }
    expected = {}
    if exact is not None and request.start != PREVIOUS:  # which follows what is not linear
        expected = expectations(plan, exact, starts, subject.scene, settings.settling_tolerance)
    run = partial(
        stepped,
        benches=benches,
        settings=settings,
        starts=starts,
        expected=expected,
        jobs=_jobs(request),
        executor=executor,
        time_limit=request.time_limit,
    )
    return _Measurement(plan, subject.record(*ready.values()), run)


def _jobs(request: SweepRequest) -> int:
    """Return the number of threads or processes."""
    return request.jobs or os.cpu_count() or 1


def _written(
    path: Path,
    opening: Callable[[Path, Plan, SystemRecord], SweepFile],
    measurement: _Measurement,
    report: Callable[[Progress], None] | None,
    warn: Warn,
) -> Identity:
    """Measure into the file that `opening` returns; return its identity."""
    with opening(path, measurement.plan, measurement.record) as file:
        if file.earlier_version:
            warn(f"{path}: the finished points were measured by hfsa {file.earlier_version}, with FMUs of its own")
        try:
            measurement.run(file, measurement.plan, report=report)
        except (KeyboardInterrupt, cluster.ClusterError):
            warn(f"{len(file.unfinished())} points are missing in {path}; sweep with --resume to continue")
            raise
    return file.identity


def _with_lines(plan: Plan, subject: _Subject, request: SweepRequest, warn: Warn) -> tuple[Plan, Design]:
    """Return the plan at the lines of a multisine next to its frequencies, and their design."""
    with usage_errors():
        design = designed(
            plan,
            subject.variants.plain,
            subject.scene,
            request.measurement_periods,
            request.phases or PHASES[0],
            request.seed or 0,
            INPUTS[request.together],
        )
    for sentence in design.warnings:
        warn(sentence)
    return design.in_plan(plan, _multisine_settings(request, subject.scene, design)), design


def _multisine_settings(request: SweepRequest, scene: Scene, design: Design) -> MultisineSettings:
    """Return the settings of a multisine of a scene."""
    return design.settings(
        MultisineSettings(
            scene.algorithm,
            scene.step_size,
            request.settling_tolerance,
            settling_time=request.settling_time,
            settling_periods=request.settling_periods,
            settling_time_min=request.settling_time_min,
            start=request.start,
            phases=request.phases or PHASES[0],
            seed=request.seed or 0,
            inputs=INPUTS[request.together],
        )
    )


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
