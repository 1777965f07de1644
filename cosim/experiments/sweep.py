"""A frequency sweep of a scene, from its name to its results file.

    bode = sweep("sdelta_shaker", inputs=["command.position[3]"], low=1.0, high=50.0)
    bode.entry("robot.platform.position[3]", "reference.command.position[3]")

The order of work: select signals and frequencies, build FMUs and instruments, choose levels and algorithm, measure.
"""

import contextlib
import dataclasses
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.assembly import cluster
from hfsa.cosim.assembly.assemble import Keep, Variants
from hfsa.cosim.assembly.build import LOCK_IN, with_ports
from hfsa.cosim.assembly.native_loop import BACKENDS, chosen_loop
from hfsa.cosim.experiments.arguments import checked
from hfsa.cosim.experiments.multisine import INPUTS, Design, designed, runs_of
from hfsa.cosim.experiments.orders import candidates, with_computed_order
from hfsa.cosim.experiments.selection import find_signals, free_inputs, with_amplitude
from hfsa.cosim.experiments.setup import (
    Setup,
    Warn,
    default_path,
    refuse_order,
    set_up,
    with_levels,
)
from hfsa.cosim.fidelity import levels
from hfsa.cosim.fidelity.step_judge import judge
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.measurement.multisine import MultisineSettings, multisine
from hfsa.cosim.measurement.rig import PREVIOUS, REST, STARTS, Bench, Settings
from hfsa.cosim.measurement.sweep import LinearSweep, Progress, linear, plan_sweep, points_of, stepped, system_record
from hfsa.cosim.results.files import Bode, Identity, Plan, SweepFile, SystemRecord, Theory, read_sweep
from hfsa.cosim.results.target import REPLACING, check_continued, check_new
from hfsa.cosim.signals import excitation
from hfsa.cosim.signals.frequency_response import negligible
from hfsa.cosim.signals.multisine import PHASES
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import nearest
from hfsa.cosim.systems.scene import Scene
from hfsa.cosim.systems.scene_file import scene_text

GRIDS = ("response", "log")
"""Spacings of frequencies: even along the curve of the linear response, or even on a logarithmic axis."""

# number of frequencies of the dense grid, and of the theoretical line
_DENSE, _LINE = 5000, 1000

_AROUND = 1e-6
"""Relative width of the band in which levels and orders are judged for a single frequency."""


@dataclass(frozen=True)
class SweepRequest:
    """Options of a sweep; `None` stands for the default of the scene or of the method.

    `inputs` and `outputs` are full or short names; `low` and `high` in Hz; `amplitude` in the unit of each input;
    `jobs` is the number of threads or processes (default: one per processor); `backend` is one of `BACKENDS`. `phases`,
    `seed` and `together` are those of a multisine.
    """

    method: Literal["stepped", "multisine", "linear"] = "stepped"
    inputs: Sequence[str] = ()
    outputs: Sequence[str] = ()
    low: float | None = None
    high: float | None = None
    points: int | None = None
    grid: str = GRIDS[0]
    amplitude: float | None = None
    settling_tolerance: float = 1e-3
    settling_time: float = 60.0
    measurement_periods: int | None = None
    jobs: int | None = None
    backend: str = BACKENDS[0]
    start: str = STARTS[0]
    keep: Keep = "needed"
    phases: str | None = None
    seed: int | None = None
    together: bool = False

    def __post_init__(self):
        given = {"phases": self.phases, "seed": self.seed, "inputs together": self.together or None}
        found = [f"--{name}" for name, value in given.items() if value is not None]
        if found and self.method != "multisine":
            raise StructureError(f"{', '.join(found)} would have no effect: it takes --method multisine")
        if self.start == PREVIOUS and self.method != "stepped":
            raise StructureError(
                f"--start {PREVIOUS} takes --method stepped: {self.method} measures no point after another"
            )

    def settings(self, scene: Scene) -> Settings:
        """Return the settings of the measurement of a scene."""
        return Settings(
            self.method,
            scene.algorithm,
            scene.step_size,
            self.settling_tolerance,
            self.measurement_periods or 1,
            self.settling_time,
            self.start,
        )

    def multisine_settings(self, scene: Scene, design: Design) -> MultisineSettings:
        """Return the settings of a multisine of a scene."""
        return design.settings(
            MultisineSettings(
                scene.algorithm,
                scene.step_size,
                self.settling_tolerance,
                settling_time=self.settling_time,
                start=self.start,
                phases=self.phases or PHASES[0],
                seed=self.seed or 0,
                inputs=INPUTS[self.together],
            )
        )

    def band(self, scene: Scene) -> tuple[float, float]:
        """Return the lowest and the highest frequency [Hz]."""
        low, high = scene.band
        return low if self.low is None else self.low, high if self.high is None else self.high

    def judged_band(self, scene: Scene) -> tuple[float, float]:
        """Return the band [Hz] in which levels and orders are judged; a narrow one about a single frequency."""
        low, high = self.band(scene)
        return (low, high * (1 + _AROUND)) if low == high else (low, high)


@checked(zero=("seed",))
def sweep(
    scene: str | Path | Scene,
    parameters: Mapping[str, Any] | None = None,
    *,
    method: Literal["stepped", "multisine", "linear"] = "stepped",
    low: float | None = None,
    high: float | None = None,
    points: int | None = None,
    grid: Literal["response", "log"] = "response",
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
    measurement_periods: int | None = None,
    start: Literal["steady", "rest", "previous"] = "steady",
    phases: Literal["schroeder", "random"] | None = None,
    seed: int | None = None,
    together: bool = False,
    backend: Literal["c", "python"] = "c",
    jobs: int | None = None,
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
        scene: name, path of a `.py` or `.toml` file, or a `Scene`.
        parameters: arguments of the scene or of its components, by name: `{"law": "ctc", "robot.damping": 0.02}`.
        method: `stepped` co-simulates one sine at a time until it has settled; `multisine` many at once; `linear` uses
            directional derivatives.
        low, high: ends of the band [Hz] (default: the scene's).
        points: number of frequencies (default: 40, for `linear` 1000).
        grid: spacing of frequencies, one of `GRIDS`.
        inputs, outputs: names, full or short, also with ranges (default: the scene's).
        amplitude: amplitude in the unit of each input (default: the scene's).
        step_size: communication step size [s] (default: the scene's).
        algorithm, tolerance: as in a scene (default: the scene's).
        fuse: groups of components, each compiled into one FMU, names separated by commas.
        order: order of steps, names separated by commas, or `computed` (default: the scene's).
        algebraic_loops: `solve` or `refuse`.
        settling_tolerance: largest remaining transient, relative to each response.
        settling_time: simulated time [s] after which an unsettled point is given up.
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
        measurement_periods,
        jobs,
        backend,
        start,
        keep,
        phases,
        seed,
        together,
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
    if request.method == "linear":
        refuse_order(setup)
    is_linear = request.method == "linear" and not levels.automatic(setup.scene)
    library = None if is_linear else chosen_loop(request.backend, warn)
    scene, inputs, outputs = _selected(setup, request)
    override = {"inputs": inputs, "outputs": outputs, "band": request.judged_band(scene)}
    scene, choices = with_levels(scene, library, **override)
    for name, choice in choices.items():
        warn(choice.sentence(name))
    scene, order = with_computed_order(scene, setup.order, **override)
    if order is not None:
        warn(order.sentence)
    variants = Variants(scene, setup.highest, keep=request.keep, observed=outputs, excited=inputs)
    assembly, left_out = variants.plain, variants.left_out.sentence
    if variants.left_out.warning:
        warn(left_out)
    draft = _draft(assembly, inputs, outputs, scene, request)
    theory = _theory(assembly, draft, request, warn)
    dense = None if theory is None else theory.response(draft.frequency)
    plan = dataclasses.replace(draft, frequency=_frequencies(draft, dense, request))
    opening = SweepFile.resume if resume and path.is_file() else partial(SweepFile.create, force=force)
    if theory is not None and request.method == "linear":
        point = {assembly.system.own_name(name): value for name, value in theory.operating_point.items()}
        record = system_record(setup.title, scene_text(scene), assembly, operating_point=point, left_out=left_out)
        with opening(path, plan, levels.with_choices(record, choices)) as file:
            file.write(points_of(theory.response(plan.frequency)))
        return file.identity
    design = None
    if request.method == "multisine":
        plan, design = _with_lines(plan, assembly, scene, request, warn)
    if theory is not None and dense is not None:
        line = _along(draft, dense, _LINE)
        plan = dataclasses.replace(plan, theory=Theory(line, theory.response(line)))
    with usage_errors():
        excitation.window_steps(plan.frequency.max(), scene.step_size)
    excited = {name: variants.instrumented(name, outputs) for name in inputs}
    with judge(scene, assembly, excited, outputs, request.band(scene)) as known:
        scene, algorithm, sentences = known.decided(scene, candidates(setup.order))
        for sentence in sentences:
            warn(sentence)
        plan = dataclasses.replace(plan, step_error=known.step_error(scene, plan.frequency))
        starts, runs, reason = {}, [], ""
        if design is not None:
            own = request.multisine_settings(scene, design)
            runs, reason = runs_of(design, known, scene, variants, plan, own, library)
            plan = dataclasses.replace(plan, settings=dataclasses.asdict(own))
        elif request.start != REST:
            starts, reason = known.steady_starts(scene, plan.frequency)
        if request.start == PREVIOUS and len(starts) < len(inputs):
            raise StructureError(f"a branch cannot be followed from point to point, as {reason}; take --start rest")
        if reason:
            warn(f"points start at rest, which takes longer: their steady state is not known, as {reason}")
    choice = {"order": order, "algorithm": algorithm, "left_out": left_out}
    jobs = request.jobs or os.cpu_count() or 1
    if design is not None:
        record = system_record(setup.title, scene_text(scene), *(run.assembly for run in runs), **choice)
        measure = partial(multisine, runs=runs, jobs=jobs, report=report)
        return _written(path, opening, plan, levels.with_choices(record, choices), measure, warn)
    settings = request.settings(scene)
    plan = dataclasses.replace(plan, settings=dataclasses.asdict(settings))
    ready = {name: with_ports(whole, scene.algorithm).check() for name, whole in excited.items()}
    benches = {name: Bench(whole, tuple(outputs), scene.source.name, LOCK_IN, library) for name, whole in ready.items()}
    record = system_record(setup.title, scene_text(scene), *ready.values(), **choice)
    workers = {"jobs": jobs, "executor": executor}
    measure = partial(stepped, benches=benches, settings=settings, starts=starts, report=report, **workers)
    return _written(path, opening, plan, levels.with_choices(record, choices), measure, warn)


def _written(
    path: Path,
    opening: Callable[[Path, Plan, SystemRecord], SweepFile],
    plan: Plan,
    record: SystemRecord,
    measure: Callable[..., None],
    warn: Warn,
) -> Identity:
    """Measure into the file that `opening` returns; return its identity."""
    with opening(path, plan, record) as file:
        if file.earlier_version:
            warn(f"{path}: the finished points were measured by hfsa {file.earlier_version}, with FMUs of its own")
        try:
            measure(file, plan)
        except (KeyboardInterrupt, cluster.ClusterError):
            warn(f"{len(file.unfinished())} points are missing in {path}; sweep with --resume to continue")
            raise
    return file.identity


def _with_lines(plan: Plan, assembly: Assembly, scene: Scene, request: SweepRequest, warn: Warn) -> tuple[Plan, Design]:
    """Return the plan at the lines of a multisine next to its frequencies, and their design."""
    with usage_errors():
        design = designed(
            plan,
            assembly,
            scene,
            request.measurement_periods,
            request.phases or PHASES[0],
            request.seed or 0,
            INPUTS[request.together],
        )
    for sentence in design.warnings:
        warn(sentence)
    return design.in_plan(plan, request.multisine_settings(scene, design)), design


def _selected(setup: Setup, request: SweepRequest) -> tuple[Scene, list[str], list[str]]:
    """Return the scene with the requested amplitude, and the requested inputs and outputs."""
    scene, assembly = setup.scene, setup.highest.check()
    inputs = find_signals(request.inputs, scene.inputs, assembly.connectors, "input")
    if not inputs:
        free = nearest("", free_inputs(assembly))
        raise StructureError(f"the scene has a motion of its own and no input to excite; name one with --input{free}")
    outputs = find_signals(request.outputs, scene.outputs, assembly.connectors, "output")
    return with_amplitude(scene, request.amplitude, inputs, assembly), inputs, outputs


def _draft(assembly: Assembly, inputs: list[str], outputs: list[str], scene: Scene, request: SweepRequest) -> Plan:
    """Return the plan with a dense logarithmic grid of frequencies."""
    with usage_errors():
        frequency = excitation.logarithmic(*request.band(scene), _DENSE)
        return plan_sweep(assembly, inputs, outputs, frequency, scene.amplitude, request.settings(scene))


def _theory(assembly: Assembly, draft: Plan, request: SweepRequest, warn: Warn) -> LinearSweep | None:
    """Return the linearised system; `None`, with a warning, for a stepped sweep of a system without derivatives."""
    try:
        found = linear(assembly, draft)
    except StructureError as error:
        if request.method == "linear":
            raise
        warn(f"there is no linear response to compare with: {error}")
        return None
    if found.growth and request.method == "linear":
        warn(f"the system is unstable: a mode grows by {found.growth:.3g} 1/s, so its response cannot be measured")
    return found


def _frequencies(draft: Plan, dense: NDArray[np.complex128] | None, request: SweepRequest) -> NDArray[np.float64]:
    """Return the frequencies in the requested spacing; logarithmic where there is no linear response."""
    points = request.points or (_LINE if request.method == "linear" else 40)
    if len(draft.frequency) == 1 and request.points not in (None, 1):
        raise StructureError(
            f"--points {points}: from {draft.frequency[0]:g} to {draft.frequency[0]:g} Hz there is one"
        )
    with usage_errors():
        if request.grid == "log" or dense is None:
            return excitation.logarithmic(draft.frequency[0], draft.frequency[-1], points)
        return _along(draft, dense, points)


def _along(draft: Plan, dense: NDArray[np.complex128], points: int) -> NDArray[np.float64]:
    """Return frequencies spaced along the entries of the response that are not zero by symmetry."""
    units, amplitudes = [signal.unit for signal in draft.outputs], [signal.amplitude for signal in draft.inputs]
    return excitation.along_response(draft.frequency, dense[:, ~negligible(dense, units, amplitudes)], points)


@contextlib.contextmanager
def usage_errors() -> Iterator[None]:
    """Raise `StructureError` in place of `ValueError`: the request cannot be measured."""
    try:
        yield
    except ValueError as error:
        raise StructureError(str(error)) from error
