"""The command `hfsa`: parses, nothing else.

Every verb hands its words on and returns an exit code (`_commands/_shell.py`). What a verb needs is imported inside it,
so that `hfsa --help` is there at once.
"""

import os
import sys
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, CycloptsError, Parameter
from cyclopts.validators import Number

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._options import (
    DESIGN_STUDY,
    Algorithm,
    Arguments,
    Force,
    Fuse,
    Jobs,
    Json,
    Level,
    Loop,
    Loops,
    Names,
    NotNegative,
    Order,
    Output,
    Positive,
    Signals,
    Tolerance,
    Verify,
)
from hfsa.cosim.systems.names import refuse_signal

app = App(
    name="hfsa",
    help="Components, co-simulation and frequency sweeps for high-frequency, small-amplitude machines, made of FMUs.",
    help_epilogue="Exit codes: 0 done, 1 a check found problems or points failed, 2 wrong usage, 3 build failed, "
    "4 simulation failed, 130 interrupted, 143 ended by SIGTERM, 129 by SIGHUP.",
    version_flags=["--version"],
    suppress_keyboard_interrupt=False,
)


@app.command(name="list")
def list_(name: str | None = None, /, *, json: Json = False) -> int:
    """List components with their levels and ports, controllers, and scenes.

    Parameters
    ----------
    name
        A part or scene to show in full, with its arguments and parameters.
    """
    from hfsa.cosim.commands._reports import listing, listing_text

    data = listing(name)
    _shell.answer(data, listing_text(data), json)
    return _shell.DONE


@app.command
def analyze(
    name: str,
    /,
    *,
    level: Level = None,
    parameter: Arguments = None,
    sensitivity: Annotated[bool, Parameter(group=DESIGN_STUDY, negative=(), show_default=False)] = False,
    map: Annotated[str | None, Parameter(group=DESIGN_STUDY)] = None,  # noqa: A002 (the user's word)
    optimize: Annotated[bool, Parameter(group=DESIGN_STUDY, negative=(), show_default=False)] = False,
    bounds: Annotated[str | None, Parameter(group=DESIGN_STUDY)] = None,
    output: Annotated[Path | None, Parameter(("-o", "--output"), group=DESIGN_STUDY)] = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Print a part's own engineering numbers: stiffness, modes, compliance, mobility, whatever it knows.

    Parameters
    ----------
    name
        A component, controller or analysis, as in `hfsa list`.
    sensitivity
        How much each response follows each dimension: d ln(response) / d ln(dimension), largest first.
    map
        DIMENSION,DIMENSION: the responses over two dimensions, as HDF5 and as a picture beside it. From half to twice
        the present value, or as said: `tm=10e-6:40e-6,l`.
    optimize
        The dimensions within bounds for which the first response is largest.
    bounds
        With `--optimize`: PERCENT to either side of the present dimensions, 20 without; and for single ones
        DIMENSION=LOW:HIGH, or one value to hold it: `30,tm=10e-6:40e-6,w=3e-4`.
    output
        With `--map`: its file; `results/NAME_map.h5` without.
    """
    from hfsa.components._modelling.parts import part_named, studied
    from hfsa.cosim.assembly.models import parts
    from hfsa.cosim.commands._numbers import numbers_text
    from hfsa.cosim.commands._studies import Request, study_answer

    values = _shell.part_arguments(level, parameter)
    request = Request(sensitivity, map, optimize, bounds, output, force)
    if request.is_study():
        study = studied(name, parts()).design_study(**values)
        data, text, is_found = study_answer(study, request, name, values)
        _shell.answer(data, text, json)
        return _shell.DONE if is_found else _shell.PROBLEMS
    part = part_named(name, parts())
    numbers = part.analysis(**values)
    units = {key: part.units[key] for key in numbers if key in part.units}
    _shell.answer({**numbers, "units": units}, numbers_text(numbers, units), json)
    return _shell.DONE


@app.command
def export(
    name: str,
    /,
    *,
    level: Level = None,
    parameter: Arguments = None,
    fuse: Fuse = None,
    fmi: Literal[2, 3] | None = None,
    output: Output = None,
    json: Json = False,
) -> int:
    """Write a part's FMU, checked and with sources, and print its path.

    Parameters
    ----------
    name
        A component or controller, as in `hfsa list`; with `--fuse` a scene, of whose groups the FMUs are written, with
        the scene's start values.
    fmi
        Version of FMI; both without.
    output
        Folder; `fmus/built` in a checkout, else the working folder. An FMU of the same name there is replaced.
    """
    from hfsa.cosim.assembly.fuse import models_to_export
    from hfsa.cosim.results.target import check_fmu
    from hfsa.fmus.export import export as export_model
    from hfsa.fmus.export import file_of

    values = _shell.part_arguments(level, parameter)
    models = models_to_export(name, values.pop("level", None), values, fuse or ())
    folder = output or _export_folder()
    versions: tuple[Literal[2, 3], ...] = (fmi,) if fmi else (2, 3)
    for model in models:
        for version in versions:
            check_fmu(file_of(model, folder, version))
    files = [file for model in models for file in export_model(model, folder, versions)]
    _shell.answer({"files": files}, "\n".join(map(str, files)), json)
    return _shell.DONE


@app.command
def check(files: Annotated[list[Path], Parameter(negative=())], /, *, json: Json = False) -> int:
    """Check FMUs, ours or not, against every rule we know; problems are exit code 1.

    Parameters
    ----------
    files
        FMU files.
    """
    from hfsa.cosim.systems.errors import StructureError
    from hfsa.fmus.check import examine

    if missing := [str(file) for file in files if not file.is_file()]:
        raise StructureError(f"there is no file {', '.join(missing)}")
    reports = {file: examine(file) for file in files}
    lines = []
    for file, report in reports.items():
        lines += [f"{file}: {problem}" for problem in report.problems] or [f"{file}: no problem found"]
        for warning in report.warnings:
            _shell.warn(f"{file}: {warning}")
    data = [{"file": f, "problems": r.problems, "warnings": r.warnings} for f, r in reports.items()]
    _shell.answer(data, "\n".join(lines), json)
    return _shell.PROBLEMS if any(report.problems for report in reports.values()) else _shell.DONE


@app.command
def run(
    scene: str,
    /,
    *,
    parameter: Arguments = None,
    input: str | None = None,  # noqa: A002 (the user's word)
    signal: Signals = None,
    frequency: Positive = None,
    amplitude: NotNegative = None,
    step: Positive = None,
    stop: Positive = None,
    algorithm: Algorithm | None = None,
    fuse: Fuse = None,
    order: Order = None,
    tolerance: Tolerance = None,
    loops: Loops = "solve",
    loop: Loop = "c",
    verify: Verify = False,
    output: Output = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Run a scene in time, one input following a sine; record that input, the scene's outputs, and more.

    A scene without inputs has a motion of its own and runs as it is.

    Parameters
    ----------
    scene
        A scene's name, or the path of a .py or .toml file.
    input
        Input that follows the sine; the scene's first, if it has one, without.
    signal
        Variables that are recorded beside the scene's outputs, as often as wanted: outputs, inputs and local ones of
        any component. `controller.axis[1..6].command` is a range.
    frequency
        Frequency of the sine [Hz]; the lowest of the scene's band without.
    amplitude
        Amplitude of the sine in the unit of its input, 0 to hold still; the scene's without.
    step
        Communication step size [s]; the scene's without.
    stop
        End of the run [s]; the scene's without.
    algorithm
        Co-simulation algorithm; the scene's without.
    output
        Results file; `results/SCENE_run.h5` without.
    """
    from hfsa.cosim.commands._reports import run_report
    from hfsa.cosim.experiments.run import Drive, run_scene
    from hfsa.cosim.experiments.sweep import load
    from hfsa.cosim.results.target import check_new

    path = output or _results_file(scene, "_run")
    check_new(path, force)
    changes = {"step_size": step, "stop_time": stop, "algorithm": algorithm, "tolerance": tolerance}
    values, signals = _shell.named_values(parameter), signal or ()
    loaded = load(scene, values, fuse or (), loops, order, file=output, signals=signals, **changes)
    with _shell.progress("run") as show:
        show(0.0, "building FMUs")
        written = run_scene(
            loaded,
            path,
            Drive(input, frequency, amplitude),
            loop=loop,
            verified=verify,
            force=force,
            warn=_shell.warn,
            report=lambda part: show(part, ""),
        )
    found = run_report(path)
    written.check(path)
    _shell.answer(*found, json)
    return _shell.DONE


@app.command
def compare(
    scene: str,
    /,
    *,
    over: Annotated[list[str], Parameter("--over", negative=())],
    parameter: Arguments = None,
    input: str | None = None,  # noqa: A002 (the user's word)
    signal: Signals = None,
    frequency: Positive = None,
    amplitude: NotNegative = None,
    step: Positive = None,
    stop: Positive = None,
    algorithm: Algorithm | None = None,
    fuse: Fuse = None,
    order: Order = None,
    tolerance: Tolerance = None,
    loops: Loops = "solve",
    loop: Loop = "c",
    verify: Verify = False,
    jobs: Jobs = None,
    output: Output = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Run a scene once for each value of some of its arguments, on the same motion: one table, one figure.

    The motion is that of `hfsa run`. Each run is written to a file of its own beside the figure.

    Parameters
    ----------
    scene
        A scene's name, or the path of a .py or .toml file.
    over
        NAME=VALUES: whatever `-p` takes, with its values separated by commas, or by semicolons where there is one.
        Several: all combinations.
    input
        Input that follows a sine; the scene's first, if it has one, without.
    signal
        Variables that are recorded and compared beside the scene's outputs, as often as wanted.
    frequency
        Frequency of the sine [Hz]; the lowest of the scene's band without.
    amplitude
        Amplitude of the sine in the unit of its input, 0 to hold still; the scene's without.
    step
        Communication step size [s]; the scene's without.
    stop
        End of the runs [s]; the scene's without.
    algorithm
        Co-simulation algorithm; the scene's without.
    jobs
        Processes; one per processor without.
    output
        Figure; its ending says the format. `results/SCENE_compare.png` without. A picture that is there is replaced.
    """
    from hfsa.cosim.commands._comparison_text import comparison_data, comparison_text
    from hfsa.cosim.experiments.compare import compare as compare_runs
    from hfsa.cosim.experiments.compare import parse_over
    from hfsa.cosim.experiments.run import Drive
    from hfsa.cosim.figures.comparison import comparison_figure, save
    from hfsa.cosim.results.target import check_picture

    path = output or Path("results", f"{Path(scene).stem}_compare.png")
    check_picture(path)
    with _shell.progress("compare") as show:
        compared = compare_runs(
            scene,
            _shell.named_values(parameter),
            parse_over(over),
            path.parent,
            drive=Drive(input, frequency, amplitude),
            loop=loop,
            jobs=jobs,
            verified=verify,
            force=force,
            warn=_shell.warn,
            report=show,
            file=output,
            signals=signal or (),
            fuse=fuse or (),
            loops=loops,
            order=order,
            step_size=step,
            stop_time=stop,
            algorithm=algorithm,
            tolerance=tolerance,
        )
    outcomes = [run.outcome for run in compared.runs]
    save(comparison_figure(compared.title, [run.words for run in compared.runs], outcomes), path)
    _shell.answer(comparison_data(compared, path), comparison_text(compared, path), json)
    failed = [outcome for outcome in outcomes if outcome.failure]
    if len(failed) == len(outcomes):
        return _shell.SIMULATION_FAILED
    unverified = [outcome for outcome in outcomes if verify and not outcome.errors]
    return _shell.PROBLEMS if failed or unverified else _shell.DONE


@app.command
def sweep(
    scene: str,
    /,
    *,
    parameter: Arguments = None,
    method: Literal["stepped", "linear"] = "stepped",
    low: Annotated[float | None, Parameter("--from", validator=Number(gt=0))] = None,
    high: Annotated[float | None, Parameter("--to", validator=Number(gt=0))] = None,
    points: Annotated[int | None, Parameter(validator=Number(gte=1))] = None,
    grid: Literal["response", "log"] = "response",
    open_loop: Annotated[str | None, Parameter("--open-loop")] = None,
    input: Names = None,  # noqa: A002 (the user's word)
    signal: Signals = None,
    amplitude: Positive = None,
    step: Positive = None,
    algorithm: Algorithm | None = None,
    fuse: Fuse = None,
    order: Order = None,
    tolerance: Tolerance = None,
    loops: Loops = "solve",
    settling_tolerance: Annotated[float, Parameter(validator=Number(gt=0))] = 1e-3,
    settling_time: Annotated[float, Parameter(validator=Number(gt=0))] = 60.0,
    measurement_periods: Annotated[int, Parameter(validator=Number(gte=1))] = 1,
    loop: Loop = "c",
    jobs: Jobs = None,
    resume: Annotated[bool, Parameter(negative=(), show_default=False)] = False,
    output: Output = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Measure a scene's frequency responses: its outputs over its inputs, one input and one frequency at a time.

    Parameters
    ----------
    scene
        A scene's name, or the path of a .py or .toml file.
    method
        `stepped` co-simulates one sine at a time until it has settled; `linear` takes the FMUs' own derivatives.
    low
        Lowest frequency [Hz]; the scene's without.
    high
        Highest frequency [Hz]; the scene's without.
    points
        Number of frequencies; 40, and 1000 for `linear`, without. One is the lowest.
    grid
        Spacing: along the curve of the linear response, resonances included, or evenly on a logarithmic axis.
    open_loop
        With `linear`: a connection, by either of its ends or as `start -> end`, at which a loop is cut. Loop gain and
        sensitivity are written in place of the scene's responses, and gain, phase and delay margins answered.
    input
        Inputs, one at a time, as often as wanted; all of the scene without. `command.position[1..3]` is a range.
    signal
        Outputs that are measured, as inputs; all of the scene without.
    amplitude
        Amplitude in the unit of each input; the scene's without.
    step
        Communication step size [s]; the scene's without.
    algorithm
        Co-simulation algorithm; the scene's without.
    settling_tolerance
        Largest transient that may remain, relative to each response.
    settling_time
        Simulated time [s] after which a point that has not settled is given up.
    measurement_periods
        Periods in a measurement window.
    jobs
        Processes; one per processor without.
    resume
        Go on with the file where a sweep was interrupted; points that failed are tried again.
    output
        Results file; without, `results/SCENE.h5`, for `linear` `results/SCENE_linear.h5`, with `--open-loop`
        `results/SCENE_open_loop.h5`.
    """
    from hfsa.cosim.commands._reports import sweep_report
    from hfsa.cosim.experiments.sweep import Request, Settings, check_file, load, sweep_scene

    changes = {"step_size": step, "algorithm": algorithm, "tolerance": tolerance}
    if open_loop is not None:
        from hfsa.cosim.experiments.open_loop import sweep_loop
        from hfsa.cosim.results.target import check_new
        from hfsa.cosim.systems.errors import StructureError

        if method != "linear" or input or signal or resume:
            raise StructureError("--open-loop takes --method linear, and no --input, --signal and --resume")
        path = output or _results_file(scene, "_open_loop")
        check_new(path, force)
        loaded = load(scene, _shell.named_values(parameter), fuse or (), loops, order, file=output, **changes)
        band = {"low": low, "high": high, "points": points, "grid": grid}
        _shell.answer(*sweep_loop(loaded, open_loop, path, force=force, warn=_shell.warn, **band), json)
        return _shell.DONE
    path = output or _results_file(scene, "" if method == "stepped" else f"_{method}")
    check_file(path, resume=resume, force=force)
    loaded = load(scene, _shell.named_values(parameter), fuse or (), loops, order, file=output, **changes)
    settings = Settings(
        method=method,
        algorithm=loaded.scene.algorithm,
        step_size=loaded.scene.step_size,
        settling_tolerance=settling_tolerance,
        measurement_periods=measurement_periods,
        settling_time=settling_time,
    )
    request = Request(settings, input or (), signal or (), low, high, points, grid, amplitude, jobs, loop)
    with _shell.progress("sweep") as show:
        show(0.0, "building FMUs")
        written = sweep_scene(
            loaded,
            request,
            path,
            resume=resume,
            force=force,
            warn=_shell.warn,
            report=lambda p: show(p.work, f"{p.done} of {p.points} points"),
        )
    data, text, is_complete = sweep_report(path)
    written.check(path)
    _shell.answer(data, text, json)
    return _shell.DONE if is_complete else _shell.PROBLEMS


@app.command
def stability(
    scene: str,
    /,
    *,
    parameter: Arguments = None,
    fuse: Fuse = None,
    order: Order = None,
    step: Positive = None,
    vary: Annotated[list[str] | None, Parameter("--vary", negative=())] = None,
    algorithm: Algorithm | None = None,
    output: Output = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Print the longest stable communication step of every algorithm on a scene, or map where it is stable.

    From the one-step matrix of each algorithm on the scene's FMUs, linearised about its equilibrium.

    Parameters
    ----------
    scene
        A scene's name, or the path of a .py or .toml file.
    step
        Communication step size [s] that is looked at; the scene's without.
    vary
        NAME=FROM:TO:N, once or twice: a number that `-p` takes, an element of a vector as `posture.rotation[3]`, or
        `step_size`. Maps the fastest growth over it, as HDF5 and as a picture, points next to the border and a sample
        of the others checked by simulation.
    algorithm
        The only one to look at; all without, and for a map the scene's, or gauss_seidel where that is `auto`.
    output
        With `--vary`: the map's file; `results/SCENE_stability.h5` without.
    """
    from hfsa.cosim.commands._stability import Request, stability_answer

    request = Request(fuse or (), step, algorithm, order, vary or (), output, force)
    with _shell.progress("stability") as show:
        data, text, is_sound = stability_answer(scene, _shell.named_values(parameter), request, show, _shell.warn)
    _shell.answer(data, text, json)
    return _shell.DONE if is_sound else _shell.PROBLEMS


@app.command
def bode(
    files: Annotated[list[Path], Parameter(negative=())],
    /,
    *,
    input: Names = None,  # noqa: A002 (the user's word)
    signal: Signals = None,
    output: Output = None,
    json: Json = False,
) -> int:
    """Draw the Bode plot of one or more sweeps, one upon the other: `linear` as a line, measured points as points.

    Parameters
    ----------
    files
        Results files of `hfsa sweep`.
    input
        Inputs to draw, as often as wanted; all without. `command.position[1..3]` is a range.
    signal
        Outputs to draw, as inputs; all that are not zero by symmetry without.
    output
        Picture file; its ending says the format. The first results file with the ending `.png` without. A picture that
        is there is replaced.
    """
    from hfsa.cosim.figures.bode import bode_figure, save
    from hfsa.cosim.results.files import read
    from hfsa.cosim.results.target import check_picture

    sweeps = [read(path) for path in files]
    if output is not None:
        refuse_signal(output, [s.name for bode in sweeps for s in (*bode.outputs, *bode.inputs)])
    path = output or files[0].with_suffix(".png")
    check_picture(path)
    save(bode_figure(sweeps, signal or (), input or ()), path)
    _shell.answer({"file": path}, str(path), json)
    return _shell.DONE


def main(tokens: list[str] | None = None) -> int:
    """Run the command line and return its exit code."""
    # matrices are small here, and jobs are processes: threads of linear algebra would only wait for each other
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

    def verb() -> int:
        """Parse and run; a wrong word has been told by then."""
        try:
            return app(tokens, exit_on_error=False, print_error=True, result_action="return_value") or _shell.DONE
        except CycloptsError:
            return _shell.USAGE

    return _shell.run(verb)


def _results_file(scene: str, ending: str) -> Path:
    """Return the results file of a scene, by name or path, where none is named."""
    return Path("results", f"{Path(scene).stem}{ending}.h5")


def _export_folder() -> Path:
    """Return `fmus/built` of the checkout this runs from, else the working folder: a package is not written into."""
    checkout = Path(__file__).resolve().parents[1]
    return checkout / "fmus" / "built" if (checkout / "pyproject.toml").is_file() else Path()


if __name__ == "__main__":
    sys.exit(main())
