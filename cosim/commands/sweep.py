"""Verb `sweep`: frequency responses of a scene, and margins of a loop."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json
from hfsa.cosim.commands._options import (
    Arguments,
    Force,
    Jobs,
    Names,
    Output,
    Scheduler,
    Signals,
    SteppingOptions,
    TimeLimit,
    Tuned,
    given,
    refuse,
)


@Parameter(name="*")
@dataclass(frozen=True)
class SettlingOptions:
    """Options of the measurement of a point in a stepped sweep."""

    settling_tolerance: Annotated[
        float | None,
        Parameter(
            validator=Number(gt=0), help="Largest remaining transient, relative to each response (default: 1e-3)."
        ),
    ] = None
    start: Annotated[
        Literal["steady", "rest", "previous"] | None,
        Parameter(
            help="State in which a point starts: its predicted steady state, where that is known, rest, or that of the "
            "point before, upwards and then downwards in frequency (default: steady). Settling is judged alike."
        ),
    ] = None
    settling_time: Annotated[
        float | None,
        Parameter(
            validator=Number(gt=0), help="Simulated time [s] after which an unsettled point is given up (default: 60)."
        ),
    ] = None
    settling_periods: Annotated[
        int | None,
        Parameter(
            validator=Number(gte=0),
            help="Periods that pass before a point may count as settled, at least (default: 0); in a multisine, those "
            "of the lowest frequency.",
        ),
    ] = None
    settling_time_min: Annotated[
        float | None,
        Parameter(
            validator=Number(gte=0),
            help="Simulated time [s] that passes before a point may count as settled, at least (default: 0): the "
            "longest dead time of FMUs that do not declare it.",
        ),
    ] = None
    measurement_periods: Annotated[
        int | None,
        Parameter(
            validator=Number(gte=1),
            help="Periods in a measurement window (default: 1). In that of a multisine, periods of the lowest "
            "frequency (default: as many as give each frequency a line of its own, if that takes no longer than "
            "`stepped`).",
        ),
    ] = None


@Parameter(name="*")
@dataclass(frozen=True)
class MultisineOptions:
    """Options of a multisine sweep."""

    phases: Annotated[
        Literal["schroeder", "random"] | None,
        Parameter(help="With `--method multisine`: phases of the sines (default: schroeder, of a low peak)."),
    ] = None
    seed: Annotated[
        int | None,
        Parameter(
            validator=Number(gte=0),
            help="With `--method multisine`: whole number from which random phases and the lines that are left out "
            "are drawn (default: 0).",
        ),
    ] = None
    inputs: Annotated[
        Literal["separate", "together"] | None,
        Parameter(
            help="With `--method multisine`: a run for each input, or one run for all, on interleaved lines (default: "
            "separate)."
        ),
    ] = None

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of an experiment for the options that are given."""
        return given({"phases": self.phases, "seed": self.seed, "together": self.inputs == "together" or None})


def sweep(
    scene: str,
    /,
    *,
    parameter: Arguments = None,
    method: Literal["stepped", "multisine", "linear"] = "stepped",
    low: Annotated[float | None, Parameter("--from", validator=Number(gt=0))] = None,
    high: Annotated[float | None, Parameter("--to", validator=Number(gt=0))] = None,
    points: Annotated[int | None, Parameter(validator=Number(gte=1))] = None,
    grid: Literal["response", "log", "linear"] = "response",
    open_loop: Annotated[str | None, Parameter("--open-loop")] = None,
    input: Names = None,  # noqa: A002 (name of the option)
    signal: Signals = None,
    amplitude: Annotated[float | None, Parameter(validator=Number(gte=0))] = None,
    stepping: SteppingOptions = SteppingOptions(),
    settling: SettlingOptions = SettlingOptions(),
    tuned: Tuned = None,
    multisine: MultisineOptions = MultisineOptions(),
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    time_limit: TimeLimit = None,
    resume: Annotated[bool, Parameter(negative=(), show_default=False)] = False,
    output: Output = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Measure the frequency responses of a scene, outputs over inputs, one input and one frequency at a time.

    Parameters
    ----------
    scene
        Name of a scene, or path of a .py, .toml or .ssp file.
    method
        `stepped` co-simulates one sine at a time until it has settled; `multisine` many sines at once, on lines next to
        the frequencies asked for; `linear` uses the directional derivatives of the FMUs.
    low
        Lowest frequency [Hz] (default: the scene's).
    high
        Highest frequency [Hz] (default: the scene's).
    points
        Number of frequencies (default: 40, for `linear` 1000). A single one is the lowest.
    grid
        Spacing: along the curve of the linear response, resonances included, or evenly on a logarithmic or a linear
        axis.
    open_loop
        With `--method linear`: connection at which a loop is opened, given by either end or as `start -> end`.
        Writes loop gain and sensitivity instead of the responses of the scene, and prints gain, phase and delay
        margins.
    input
        Input to excite, repeatable (default: all of the scene, one at a time). `command.position[1..3]` is a range.
    signal
        Output to measure, repeatable (default: all of the scene).
    amplitude
        Amplitude in the unit of each input (default: the scene's). `--method linear` needs none.
    resume
        Continue the file of an interrupted sweep; failed points are measured again.
    output
        Results file (default: `results/SCENE.h5`, for `multisine` and `linear` `results/SCENE.METHOD.h5`, with
        `--open-loop` `results/SCENE_open_loop.h5`).
    """
    from hfsa.cosim.commands._reports import sweep_report
    from hfsa.cosim.commands._scenes import refuse_other
    from hfsa.cosim.experiments.sweep import sweep as sweep_experiment

    refuse_other(scene)
    parameters = _shell.named_values(parameter)
    band = given({"low": low, "high": high, "points": points}) | {"grid": grid}
    measured: dict[str, Any] = {
        "--step": stepping.step,
        "--algorithm": stepping.algorithm,
        "--backend": stepping.backend,
        "--tuned": tuned,
        "--jobs": jobs,
        "--scheduler": scheduler,
        "--time-limit": time_limit,
        **{f"--{name.replace('_', '-')}": value for name, value in asdict(settling).items()},
    }
    lines = {f"--{name}": value for name, value in asdict(multisine).items()}
    if method != "multisine":
        refuse(lines, "they are those of --method multisine")
    if method == "linear":
        stepped = {**({} if open_loop is not None else measured), "--tolerance": stepping.tolerance}
        if given(stepped) and not _chooses_levels(scene, parameters):
            refuse(stepped, "the linear method takes no steps, and no level is auto")
    if open_loop is not None:
        others = {"--input": input, "--signal": signal, "--amplitude": amplitude, "--resume": resume}
        others |= {"--fuse": stepping.fuse, "--order": stepping.order}
        return _open_loop(scene, open_loop, parameters, method, measured | others, stepping, band, output, force, json)
    if scheduler is not None:
        refuse({"--jobs": jobs}, "the workers of --scheduler compute, each with its own number of threads")
    with _shell.progress("sweep") as show:
        show(0.0, "building FMUs")
        found = sweep_experiment(
            scene,
            parameters,
            method=method,
            **band,
            inputs=input or (),
            outputs=signal or (),
            **given(
                {"amplitude": amplitude, "jobs": jobs, "scheduler": scheduler, "tuned": tuned, "time_limit": time_limit}
            ),
            **stepping.arguments,
            **given(asdict(settling)),
            **multisine.arguments,
            path=output,
            resume=resume,
            force=force,
            warn=_shell.warn,
            report=show,
        )
    data, text, is_complete = sweep_report(found.path)
    _shell.answer(data, text, json)
    return _shell.DONE if is_complete else _shell.PROBLEMS


def _open_loop(
    scene: str,
    connection: str,
    parameters: dict[str, str],
    method: str,
    ignored: dict[str, Any],
    stepping: SteppingOptions,
    band: dict[str, Any],
    output: Path | None,
    force: bool,
    json: bool,
) -> int:
    """Run the open-loop analysis and print the margins."""
    from hfsa.cosim.commands._open_loop import open_loop_data, open_loop_text
    from hfsa.cosim.experiments.open_loop import open_loop
    from hfsa.cosim.systems.errors import StructureError

    if method != "linear":
        raise StructureError("--open-loop takes --method linear")
    refuse(ignored, "--open-loop uses the linearised scene, without inputs, outputs, steps or a file to continue")
    found = open_loop(
        scene,
        connection,
        parameters,
        **band,
        **given({name: getattr(stepping, name) for name in ("tolerance", "algebraic_loops", "keep")}),
        path=output,
        force=force,
        warn=_shell.warn,
    )
    _shell.answer(open_loop_data(found), open_loop_text(found), json)
    return _shell.DONE


def _chooses_levels(scene: str, parameters: dict[str, str]) -> bool:
    """Whether a level is chosen by the tolerance, which may need a co-simulation."""
    from hfsa.cosim.assembly.load_scene import load_scene
    from hfsa.cosim.fidelity.levels import automatic

    return bool(automatic(load_scene(scene, parameters)))
