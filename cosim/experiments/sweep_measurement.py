"""A measurement that is ready to run: of one sine at a time, or of many lines of a multisine."""

import dataclasses
import os
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial

from hfsa.cosim.assembly.build import LOCK_IN, with_ports
from hfsa.cosim.experiments.expectations import Theory, expectations, with_expectations
from hfsa.cosim.experiments.multisine import INPUTS, Design, designed, runs_of
from hfsa.cosim.experiments.setup import (
    Warn,
)
from hfsa.cosim.experiments.sweep_plan import usage_errors
from hfsa.cosim.experiments.sweep_request import SweepRequest
from hfsa.cosim.experiments.sweep_subject import Subject
from hfsa.cosim.fidelity.step_judge import Judge
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.measurement.multisine import MultisineSettings, multisine
from hfsa.cosim.measurement.sweep import stepped
from hfsa.cosim.measurement.task import PREVIOUS, REST, Bench
from hfsa.cosim.results.files import (
    Plan,
    SystemRecord,
)
from hfsa.cosim.signals.multisine import PHASES
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.scene import Scene

_AT_REST = "points start at rest, which takes longer: their steady state is not known, as {}"


@dataclass(frozen=True)
class Measurement:
    """A measurement that is ready to run: its plan, the record of its system, and `run(file, plan, report=...)`."""

    plan: Plan
    record: SystemRecord
    run: Callable[..., None]


def many_lines(
    subject: Subject,
    plan: Plan,
    design: Design,
    known: Judge,
    exact: Theory | None,
    request: SweepRequest,
    warn: Warn,
) -> Measurement:
    """Return the measurement of a multisine."""
    settings = _multisine_settings(request, subject.scene, design)
    runs, reason = runs_of(design, known, subject.scene, subject.variants, plan, settings, subject.library)
    if reason:
        warn(_AT_REST.format(reason))
    if exact is not None:
        runs = with_expectations(runs, plan, expectations(plan, exact, {}, subject.scene, request.settling_tolerance))
    plan = dataclasses.replace(plan, settings=dataclasses.asdict(settings))
    runs = [dataclasses.replace(run, time_limit=request.time_limit) for run in runs]
    return Measurement(
        plan, subject.record(*(run.assembly for run in runs)), partial(multisine, runs=runs, jobs=_jobs(request))
    )


def single_sines(
    subject: Subject,
    plan: Plan,
    excited: Mapping[str, Assembly],
    known: Judge,
    exact: Theory | None,
    request: SweepRequest,
    executor: Executor | None,
    warn: Warn,
) -> Measurement:
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
    return Measurement(plan, subject.record(*ready.values()), run)


def _jobs(request: SweepRequest) -> int:
    """Return the number of threads or processes."""
    return request.jobs or os.cpu_count() or 1


def with_lines(plan: Plan, subject: Subject, request: SweepRequest, warn: Warn) -> tuple[Plan, Design]:
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
