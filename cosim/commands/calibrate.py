"""Verb `calibrate`: dimensions of a part from measurements."""

from pathlib import Path
from typing import Literal

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json
from hfsa.cosim.commands._options import Arguments, Force, Output


def calibrate(
    name: str,
    /,
    *,
    measured: Path,
    parameter: Arguments = None,
    free: str | None = None,
    bounds: str | None = None,
    sizes: str | None = None,
    objective: Literal["least_squares", "largest"] = "least_squares",
    output: Output = None,
    force: Force = False,
    json: Json = False,
) -> int:
    """Calibrate a part: the dimensions that fit a table of measurements best, and what the table does not determine.

    A column of the table is a response of the part, or a dimension that is known in every row. Exit code 1 where the
    solver does not converge.

    Parameters
    ----------
    name
        A part with a calibration or a design study, as in `hfsa list`, or the path of a .py file.
    measured
        CSV file whose header names the columns, `x` or `x [m]`, or HDF5 file with a dataset per column, in SI units. A
        CSV file without a header is a Jacobian, for parts that have one: elongations to poses of `rrr_stage`.
    free
        NAME,NAME: dimensions to fit (default: those that the part proposes).
    bounds
        NAME=LOW:HIGH,...: bounds of dimensions (default: the part's).
    sizes
        NAME=SIZE,...: errors that weigh alike, by response, in SI units (default: the part's, or the root mean square
        of the column).
    objective
        `least_squares`, or `largest`: the largest weighted error of a row (eq 2.23 of the stage's source).
    output
        FILE.toml: parameter set of the result, for parts that take one, `-p kinematics=FILE.toml` of `rrr_stage`.
    """
    from hfsa.cosim.commands._calibration_text import arguments_text, calibration_data, calibration_text
    from hfsa.cosim.commands._studies import named_numbers, named_ranges
    from hfsa.cosim.experiments.calibrate import calibrate as calibrate_experiment

    found = calibrate_experiment(
        name,
        measured,
        _shell.part_arguments(None, parameter),
        free=() if free is None else [word.strip() for word in free.split(",")],
        bounds=named_ranges(bounds, "--bounds"),
        sizes=named_numbers(sizes, "--sizes"),
        objective=objective,
        path=output,
        force=force,
    )
    last = f"{output}: -p {found.task.document}={output}" if output else arguments_text(found)
    _shell.answer(calibration_data(found, output), f"{calibration_text(found)}\n{last}", json)
    return _shell.DONE if found.is_converged else _shell.PROBLEMS
