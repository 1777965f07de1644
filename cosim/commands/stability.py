"""Verb `stability`: longest stable step of every algorithm, or a stability map."""

from typing import Annotated, Literal

from cyclopts import Parameter

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json
from hfsa.cosim.commands._options import (
    AlgorithmName,
    Arguments,
    Force,
    Fuse,
    OrderOfSteps,
    Output,
    Scheduler,
    Step,
    refuse,
)


def stability(
    scene: str,
    /,
    *,
    parameter: Arguments = None,
    fuse: Fuse = None,
    order: OrderOfSteps = None,
    step: Step = None,
    vary: Annotated[list[str] | None, Parameter("--vary", negative=())] = None,
    algorithm: AlgorithmName = None,
    keep: Annotated[Literal["needed", "all"], Parameter("--keep")] = "all",
    scheduler: Scheduler = None,
    output: Output = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Print the longest stable communication step of every algorithm on a scene, or compute a stability map.

    Both follow from the one-step matrix of each algorithm on the FMUs, linearised about the equilibrium.

    Parameters
    ----------
    scene
        Name of a scene, or path of a .py, .toml or .ssp file.
    vary
        NAME=FROM:TO:N, once or twice: axis of a map, a number of `-p`, an element of a vector such as
        `posture.rotation[3]`, or `step_size`. The map has the fastest growth, as HDF5 and as a picture; points next to
        the border and a sample of the others are verified by simulation.
    algorithm
        The only algorithm to examine (default: all; for a map the scene's, or gauss_seidel where that is `auto`).
    keep
        States and outputs that are judged: all of the scene, so that no instability hides, or those that reach an
        output of the scene or a limit flag, which is what the other verbs run by default.
    output
        With `--vary`: file of the map (default: `results/SCENE_stability.h5`).
    """
    from hfsa.cosim.commands._scenes import refuse_other
    from hfsa.cosim.commands._stability import StabilityRequest, stability_answer

    refuse_other(scene)
    if not vary:
        refuse({"--scheduler": scheduler}, "only the points of --vary are computed by workers")
    request = StabilityRequest(fuse or (), step, algorithm, order, vary or (), output, force, keep, scheduler)
    with _shell.progress("stability") as show:
        data, text, is_sound = stability_answer(scene, _shell.named_values(parameter), request, show, _shell.warn)
    _shell.answer(data, text, json)
    return _shell.DONE if is_sound else _shell.PROBLEMS
