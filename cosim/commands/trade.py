"""Verb `trade`: the cheapest way to run a scene within an error."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json
from hfsa.cosim.commands._options import Arguments, Force, Names, Output, Positive, Signals, given


def trade(
    scene: str,
    /,
    *,
    parameter: Arguments = None,
    tolerance: Annotated[float | None, Parameter(validator=Number(gt=0))] = None,
    budget: Annotated[float | None, Parameter(validator=Number(gt=0))] = None,
    purpose: Annotated[Literal["response", "motion"] | None, Parameter("--for")] = None,
    input: Names = None,  # noqa: A002 (name of the option)
    signal: Signals = None,
    low: Annotated[float | None, Parameter("--from", validator=Number(gt=0))] = None,
    high: Annotated[float | None, Parameter("--to", validator=Number(gt=0))] = None,
    amplitude: Positive = None,
    stop: Annotated[float | None, Parameter(validator=Number(gt=0))] = None,
    output: Output = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Find the cheapest way to run a scene within an error: levels, fused groups, algorithm and communication step.

    Errors are predicted from the FMUs' directional derivatives and costs from a short probe; the best configurations
    and some others are then run, and their errors measured from a reference that a second one confirms. The answer is
    used by `hfsa sweep SCENE --tuned FILE` and `hfsa run SCENE --tuned FILE`.

    Parameters
    ----------
    scene
        Name of a scene, or path of a .py, .toml or .ssp file.
    tolerance
        Largest relative error (default: the scene's).
    budget
        Time [s] for the runs of the verification (default: no limit).
    purpose
        `response` to sines, as of `hfsa sweep`, or `motion` over time, as of `hfsa run` (default: `response` for a
        scene with inputs).
    input
        Input to excite, repeatable (default: all of the scene). A motion takes one, at the lowest frequency.
    signal
        Output whose error counts, repeatable (default: all of the scene).
    low
        Lowest frequency [Hz] (default: the scene's).
    high
        Highest frequency [Hz] (default: the scene's).
    amplitude
        Amplitude in the unit of each input (default: the scene's).
    stop
        End of a motion [s] (default: the scene's).
    output
        Results file (default: `results/SCENE_trade.h5`); the figure is beside it, with the ending .png.
    """
    from hfsa.cosim.commands._scenes import refuse_other
    from hfsa.cosim.commands._trade_text import trade_data, trade_text
    from hfsa.cosim.experiments.trade import trade as trade_experiment
    from hfsa.cosim.figures.trade import save, trade_figure
    from hfsa.cosim.results.target import check_picture

    refuse_other(scene)
    path = output or Path("results", f"{Path(scene).stem}_trade.h5")
    figure = path.with_suffix(".png")
    check_picture(figure)
    with _shell.progress("trade") as show:
        found = trade_experiment(
            scene,
            _shell.named_values(parameter),
            **given({"tolerance": tolerance, "budget": budget, "purpose": purpose}),
            **given({"low": low, "high": high, "amplitude": amplitude, "stop_time": stop}),
            inputs=input or (),
            outputs=signal or (),
            path=path,
            force=force,
            warn=_shell.warn,
            report=show,
        )
    save(trade_figure(found), figure)
    _shell.answer(trade_data(found, figure), trade_text(found, figure), json)
    return _shell.DONE if found.best is not None else _shell.PROBLEMS
