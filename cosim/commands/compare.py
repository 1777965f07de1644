"""Verb `compare`: one run for each value of some arguments."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json
from hfsa.cosim.commands._options import (
    Arguments,
    Force,
    Jobs,
    Output,
    Scheduler,
    Signals,
    SineOptions,
    SteppingOptions,
    TimeLimit,
    Verify,
    given,
    refuse,
)


def compare(
    scene: str,
    /,
    *,
    over: Annotated[list[str], Parameter("--over", negative=())],
    parameter: Arguments = None,
    sine: SineOptions = SineOptions(),
    signal: Signals = None,
    stop: Annotated[float | None, Parameter(validator=Number(gt=0))] = None,
    stepping: SteppingOptions = SteppingOptions(),
    verify: Verify = False,
    time_limit: TimeLimit = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    output: Output = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Run a scene once for each value of some of its arguments, on the same motion: one table, one figure.

    The motion is that of `hfsa run`. Each run is written to a file of its own beside the figure.

    Parameters
    ----------
    scene
        Name of a scene, or path of a .py, .toml or .ssp file.
    over
        NAME=VALUES: an argument as in `-p`, with values separated by commas, or by semicolons if there is one.
        Repeatable: all combinations run.
    signal
        Variable to record and compare in addition to the scene's outputs, repeatable.
    stop
        End of the runs [s] (default: the scene's).
    output
        Figure; its ending gives the format (default: `results/SCENE_compare.png`). An existing picture is replaced.
    """
    from hfsa.cosim.commands._comparison_text import comparison_data, comparison_text
    from hfsa.cosim.commands._scenes import refuse_other
    from hfsa.cosim.experiments.compare import compare as compare_experiment
    from hfsa.cosim.experiments.over import parse_over
    from hfsa.cosim.figures.comparison import comparison_figure, save
    from hfsa.cosim.results.target import check_picture

    refuse_other(scene)
    path = output or Path("results", f"{Path(scene).stem}_compare.png")
    check_picture(path)
    if scheduler is not None:
        refuse({"--jobs": jobs}, "the workers of --scheduler compute, each with its own number of threads")
    with _shell.progress("compare") as show:
        compared = compare_experiment(
            scene,
            parse_over(over),
            _shell.named_values(parameter),
            **sine.arguments,
            record=signal or (),
            **given({"stop_time": stop, "jobs": jobs, "scheduler": scheduler}),
            **stepping.arguments,
            verify=verify,
            time_limit=time_limit,
            folder=path.parent,
            file=output,
            force=force,
            warn=_shell.warn,
            report=show,
        )
    outcomes = [run.outcome for run in compared.runs]
    save(comparison_figure(compared.title, [run.label for run in compared.runs], outcomes), path)
    _shell.answer(comparison_data(compared, path), comparison_text(compared, path), json)
    failed = [run for run in compared.runs if run.outcome.failure]
    if len(failed) == len(outcomes):
        first = failed[0]
        _shell.warn(f"no run was finished of {len(outcomes)}; {first.label} failed: {first.outcome.failure}")
        return _shell.SIMULATION_FAILED
    unverified = [outcome for outcome in outcomes if verify and not outcome.errors]
    return _shell.PROBLEMS if failed or unverified else _shell.DONE
