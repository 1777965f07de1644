"""Verb `check`: all rules on FMUs and packages (SSP), exported by hfsa or foreign."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json


def check(files: Annotated[list[Path], Parameter(negative=())], /, *, json: Json = False) -> int:
    """Check FMUs and SSPs, exported by hfsa or foreign, against all known rules; exit code 1 if there are problems.

    Parameters
    ----------
    files
        FMU files, or packages (.ssp), which are checked by the schemas of the standard, with all their FMUs.
    """
    from hfsa.cosim.assembly.packages import PACKAGE, examine_package
    from hfsa.cosim.systems.errors import StructureError
    from hfsa.fmus.check import examine

    if folders := [str(file) for file in files if file.is_dir()]:
        raise StructureError(f"{', '.join(folders)}: a folder, expected the files of FMUs")
    if missing := [str(file) for file in files if not file.is_file()]:
        raise StructureError(f"there is no file {', '.join(missing)}")
    reports = {file: (examine_package if file.suffix == PACKAGE else examine)(file) for file in files}
    lines = []
    for file, report in reports.items():
        holds = f", holds {', '.join(report.platforms)}" if report.platforms else ""
        lines += [f"{file}: {problem}" for problem in report.problems] or [f"{file}: no problem found{holds}"]
        for warning in report.warnings:
            _shell.warn(f"{file}: {warning}")
    data = [{"file": file, **asdict(report)} for file, report in reports.items()]
    _shell.answer(data, "\n".join(lines), json)
    return _shell.PROBLEMS if any(report.problems for report in reports.values()) else _shell.DONE
