"""Verb `identify`: inertia parameters of a platform from a manoeuvre."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json
from hfsa.cosim.commands._options import Force, Output, Positive, given


def identify(
    file: Path,
    /,
    *,
    of: Literal["body", "payload"] = "body",
    alone: Path | None = None,
    motion: Literal["measured", "pose", "commanded"] = "measured",
    regressor: Literal["full", "linear"] | None = None,
    body: str | None = None,
    torque_noise: Positive = None,
    force_noise: Positive = None,
    gravity: Annotated[float | None, Parameter(validator=Number(gte=0))] = None,
    low: Annotated[float | None, Parameter("--from", validator=Number(gte=0))] = None,
    high: Annotated[float | None, Parameter("--to", validator=Number(gt=0))] = None,
    output: Output = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Identify the inertia of a platform with its payload from one manoeuvre: ten parameters, standard deviations.

    The parameters are mass, first moments and inertia tensor about the reference point of the signals, in body axes.
    Exit code 1 where the manoeuvre does not determine them all.

    Parameters
    ----------
    file
        Results file of a run, such as of `sdelta_manoeuvre`, or of a sweep. It has to hold the motion of the platform
        and the wrench of the limbs on it.
    of
        `body` for the platform with its payload, `payload` for the difference to the platform alone.
    alone
        With `--of payload`: results file of a manoeuvre of the platform alone (default: the platform of the model).
    motion
        `measured` acceleration and twist; `pose` differentiates the recorded pose over five points; `commanded` assumes
        that the platform follows its command, as a rigid robot does.
    regressor
        `full` equations of a rigid body, or `linear` ones without the products of the angular velocity (default: those
        that leave the smaller residuals; of a sweep `linear`).
    body
        Component whose platform it is (default: the only one).
    torque_noise
        Standard deviation of each equation of moments [N.m] (default: that of the residuals).
    force_noise
        Standard deviation of each equation of forces [N] (default: that of the residuals).
    gravity
        Gravitational acceleration along -Z [m/s2] (default: that of the component in the file).
    low
        First time of the rows of a run [s], or lowest frequency of a sweep [Hz] (default: all).
    high
        Last time of a run [s], or highest frequency of a sweep [Hz] (default: all).
    output
        Results file (default: beside FILE, with the ending `_inertia.h5`).
    """
    from hfsa.cosim.commands._identification_text import identification_data, identification_text
    from hfsa.cosim.experiments.identify import identify as identify_experiment

    found = identify_experiment(
        file,
        of=of,
        motion=motion,
        **given({"alone": alone, "regressor": regressor, "body": body, "gravity": gravity}),
        **given({"torque_noise": torque_noise, "force_noise": force_noise, "low": low, "high": high}),
        path=output,
        force=force,
        warn=_shell.warn,
    )
    _shell.answer(identification_data(found), identification_text(found), json)
    return _shell.DONE if found.is_complete else _shell.PROBLEMS
