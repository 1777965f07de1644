"""Calibration of a part from a table of measurements.

    found = calibrate("rrr_stage", "poses.csv", {"turn": 53.961}, path="mine.toml")
    found.values, found.deviations, found.directions

The file of the result is a parameter set that the part takes: `-p kinematics=mine.toml`.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hfsa.components._modelling.calibration import Calibration, Fit, Objective
from hfsa.components._modelling.catalogue import calibrated
from hfsa.components._modelling.fit import fit
from hfsa.cosim.assembly.models import available_parts
from hfsa.cosim.experiments.arguments import checked
from hfsa.cosim.experiments.measured_table import read_measured
from hfsa.cosim.results.parameter_set import write_parameter_set
from hfsa.cosim.results.target import check_parameters
from hfsa.cosim.systems.errors import StructureError

_ENDING = ".toml"


@checked()
def calibrate(
    part: str,
    measured: str | Path,
    arguments: Mapping[str, Any] | None = None,
    *,
    free: Sequence[str] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    sizes: Mapping[str, Any] | None = None,
    objective: Objective = "least_squares",
    path: str | Path | None = None,
    force: bool = False,
) -> Fit:
    """Calibrate a part and return what was found; write it to `path`, if one is given.

    Args:
        part: name of a part, or the path of its file.
        measured: CSV or HDF5 file: a table with a header, or the numbers of a Jacobian.
        arguments: arguments of the part's calibration, where it starts from.
        free: names of the dimensions to fit, by default those that the part proposes.
        bounds: bounds by dimension, in place of those of the part.
        sizes: errors that weigh alike by response, in SI units.
        objective: `least_squares`, or `largest`, the least of the largest weighted error of a row.
        path: file of the parameter set.
        force: whether to replace an existing parameter set.

    Raises:
        ModelError: as `fit` and the part; a table that cannot be read.
        StructureError: a file for a part that takes none.
        ResultsError: a path that is not to be written.
    """
    owner = calibrated(part, available_parts())
    task = owner.calibration_task(**dict(arguments or {}))
    file = None if path is None else _file(owner.name, task, Path(path), force)
    table = read_measured(Path(measured), task.units)
    if isinstance(table, np.ndarray):
        table = task.corners(table)
    found = fit(task, table, free, bounds, sizes, objective)
    if file is not None:
        write_parameter_set(file, parameters(found), _remarks(owner.name, Path(measured), found), force)
    return found


def parameters(found: Fit) -> dict[str, float]:
    """Return the parameter set of a result: the dimensions of the part's document, fitted and others, by key."""
    study = found.task.study
    prefix = f"{next(iter(found.free)).split('.')[0]}."
    all_values = {name: variable.value for name, variable in study.variables.items()} | dict(found.values)
    return {name.removeprefix(prefix): value for name, value in all_values.items() if name.startswith(prefix)}


def _file(part: str, task: Calibration, path: Path, force: bool) -> Path:
    """Return the file of a parameter set; raises before anything is computed."""
    if not task.document:
        raise StructureError(f"{part} takes no parameter set as a file; without -o its values are printed for -p")
    if path.suffix != _ENDING:
        raise StructureError(f"{path} is to be a parameter set; expected a name that ends in {_ENDING}")
    check_parameters(path, force)
    return path


def _remarks(part: str, measured: Path, found: Fit) -> list[str]:
    """Return what the file of a parameter set tells of it."""
    lines = [f"{part}, calibrated by {found.objective} from {found.rows} rows of {measured.name}"]
    for name in found.free:
        deviation = found.deviations[name]
        known = "not determined" if np.isinf(deviation) else f"standard deviation {deviation:.3g}"
        lines.append(f"{name}: {known}")
    return lines
