"""Verb `run`: one time-domain run."""

from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json
from hfsa.cosim.commands._options import (
    Arguments,
    Drives,
    Force,
    Output,
    Positive,
    Signals,
    SineOptions,
    SteppingOptions,
    TimeLimit,
    Tuned,
    Verify,
    given,
)


def run(
    scene: str,
    /,
    *,
    parameter: Arguments = None,
    sine: SineOptions = SineOptions(),
    signal: Signals = None,
    drive: Drives = None,
    every: Annotated[int | None, Parameter(validator=Number(gte=1))] = None,
    interval: Positive = None,
    stop: Annotated[float | None, Parameter(validator=Number(gt=0))] = None,
    stepping: SteppingOptions = SteppingOptions(),
    tuned: Tuned = None,
    verify: Verify = False,
    time_limit: TimeLimit = None,
    quiet_inputs: Annotated[bool, Parameter(negative=(), show_default=False)] = False,
    output: Output = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Run a scene in the time domain with a sine at one input, or signals of your own at any; record these and more.

    A scene without inputs generates its own motion. The scene's outputs are recorded.

    Parameters
    ----------
    scene
        Name of a scene, or path of a .py, .toml or .ssp file.
    signal
        Variable to record in addition to the scene's outputs, repeatable: an output, input or local variable of any
        component. `controller.axis[1..6].command` is a range.
    drive
        INPUT=SIGNAL, repeatable: a signal that feeds an input of any component, in place of what feeds it in the scene.
        SIGNAL is `step`, `ramp`, `sine`, `chirp`, `multisine` or `noise` with options, such as
        `chirp,amplitude=1e-6,from=1,to=200,duration=2`, or a table: `FILE.csv`, `FILE.csv:COLUMN` or
        `FILE.h5:VARIABLE`, joined by `interpolation=held`, `linear` (default) or `smooth`.
    every
        Communication steps from one row of the file to the next (default: 1). The last point is kept, and limits are
        watched at every step.
    interval
        Time from one row of the file to the next [s], a multiple of the step, in place of `--every`.
    stop
        End of the run [s] (default: the scene's).
    quiet_inputs
        Say nothing of inputs that nothing feeds; `quiet_inputs = true` in a scene does so for every command.
    output
        Results file (default: `results/SCENE_run.h5`).
    """
    from hfsa.cosim.commands._reports import run_report
    from hfsa.cosim.commands._scenes import refuse_other
    from hfsa.cosim.experiments.run import run as run_experiment

    refuse_other(scene)
    with _shell.progress("run") as show:
        show(0.0, "building FMUs")
        found = run_experiment(
            scene,
            _shell.named_values(parameter),
            **sine.arguments,
            record=signal or (),
            drive=_shell.named_values(drive, "--drive"),
            **given(
                {"every": every, "interval": interval, "stop_time": stop, "tuned": tuned, "time_limit": time_limit}
            ),
            quiet_inputs=quiet_inputs or None,
            **stepping.arguments,
            verify=verify,
            path=output,
            force=force,
            warn=_shell.warn,
            report=show,
        )
    _shell.answer(*run_report(found.path), json)
    return _shell.DONE
