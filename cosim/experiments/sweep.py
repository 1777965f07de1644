"""A frequency sweep of a scene, from its name to its results file.

    bode = sweep("sdelta_shaker", inputs=["command.position[3]"], low=1.0, high=50.0)
    bode.entry("robot.platform.position[3]", "reference.command.position[3]")

The order of work: select signals and frequencies, build FMUs and instruments, choose levels and algorithm, measure.
"""

import dataclasses
import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from functools import partial
from pathlib import Path
from typing import Any, Literal

from hfsa.cosim.assembly import cluster
from hfsa.cosim.experiments.arguments import checked
from hfsa.cosim.experiments.expectations import Theory
from hfsa.cosim.experiments.orders import candidates
from hfsa.cosim.experiments.setup import (
    Setup,
    Warn,
    default_path,
    set_up,
)
from hfsa.cosim.experiments.sweep_measurement import Measurement, many_lines, single_sines, with_lines
from hfsa.cosim.experiments.sweep_plan import draft_plan, frequencies, theoretical, theory_of, usage_errors
from hfsa.cosim.experiments.sweep_request import SweepRequest
from hfsa.cosim.experiments.sweep_subject import Subject, subject_of
from hfsa.cosim.fidelity.step_judge import judge
from hfsa.cosim.measurement.sweep import LinearSweep, Progress, points_of
from hfsa.cosim.measurement.task import PREVIOUS
from hfsa.cosim.measurement.told import add, sentences
from hfsa.cosim.results.files import (
    Bode,
    Identity,
    Plan,
    SweepFile,
    SystemRecord,
    read_sweep,
)
from hfsa.cosim.results.target import REPLACING, check_continued, check_new
from hfsa.cosim.signals import excitation
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene


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
        path: results file (default: `results/SCENE.h5`, for other methods `results/SCENE.METHOD.h5`).
        resume, force: continue an existing results file, or replace it.
        warn: function that receives warnings.
        report: function of the finished part, 0 to 1, and a word.

    Raises:
        StructureError: for a wrong scene, name or option; ModelError: for a wrong argument of a part;
        ResultsError: for a file that cannot be written; ExportError: where an FMU cannot be built.
    """
    ending = "" if method == "stepped" else f".{method}"
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
    subject = subject_of(setup, request, warn)
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
        plan, design = with_lines(plan, subject, request, warn)
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
            measurement = many_lines(subject, plan, design, known, exact, request, warn)
        else:
            measurement = single_sines(subject, plan, excited, known, exact, request, executor, warn)
    return _written(path, opening, measurement, report, warn)


def _computed(subject: Subject, plan: Plan, theory: LinearSweep, opening: Callable[..., SweepFile]) -> Identity:
    """Write the linear response into the file that `opening` returns; return its identity."""
    assembly = subject.variants.plain
    point = {assembly.system.own_name(name): value for name, value in theory.operating_point.items()}
    with opening(plan, subject.record(assembly, operating_point=point)) as file:
        file.write(points_of(theory.response(plan.frequency)))
    return file.identity


def _written(
    path: Path,
    opening: Callable[[Path, Plan, SystemRecord], SweepFile],
    measurement: Measurement,
    report: Callable[[Progress], None] | None,
    warn: Warn,
) -> Identity:
    """Measure into the file that `opening` returns; return its identity."""
    with opening(path, measurement.plan, measurement.record) as file:
        if file.earlier_version:
            warn(f"{path}: the finished points were measured by hfsa {file.earlier_version}, with FMUs of its own")
        told: dict[str, tuple[int, str]] = {}

        def progressed(progress: Progress) -> None:
            """Keep the warnings of a finished point, and report it."""
            add(told, progress.point.warnings)
            if report is not None:
                report(progress)

        try:
            measurement.run(file, measurement.plan, report=progressed)
        except (KeyboardInterrupt, cluster.ClusterError):
            warn(f"{len(file.unfinished())} points are missing in {path}; sweep with --resume to continue")
            raise
        finally:
            found = sentences(told).values()
            file.tell(found)
            for sentence in found:
                warn(sentence)
    return file.identity
