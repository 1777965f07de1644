"""Packages (SSP) as scenes; their FMUs are kept in the cache, named by their content."""

import hashlib
import os
import tempfile
from functools import lru_cache
from pathlib import Path

from hfsa.components._modelling.cache import cache_folder, cache_subfolder
from hfsa.cosim.ssp.read import Package, read
from hfsa.cosim.ssp.schema import schema_problems
from hfsa.cosim.systems.errors import StructureError
from hfsa.fmus.check import Report, examine

PACKAGE = ".ssp"
"""Ending of a package."""


def package_of(name: str | Path) -> Package:
    """Return the scene of a package and remarks, read once for each state of its file; errors of `ssp.read.read`."""
    file = Path(name)
    try:
        stat = file.stat()
    except OSError:
        raise StructureError(f"there is no file {file}") from None
    return _read(file, (stat.st_ino, stat.st_mtime_ns, stat.st_size))


def examine_package(file: Path) -> Report:
    """Return what is wrong with a package: its documents by their schemas, what cannot be simulated, and its FMUs."""
    try:
        problems = schema_problems(file)
        found = package_of(file)
    except StructureError as error:
        return Report([str(error)], [])
    warnings = list(found.remarks)
    for component in found.scene.system.components:
        report = examine(Path(component.part))
        problems += [f"{component.name}: {problem}" for problem in report.problems]
        warnings += [f"{component.name}: {warning}" for warning in report.warnings]
    return Report(problems, warnings)


@lru_cache(maxsize=16)
def _read(file: Path, _version: tuple[int, ...]) -> Package:
    """Return the scene of a package; a changed file has another `_version`."""
    return read(file, _kept)


def _kept(name: str, content: bytes) -> Path:
    """Return the file of an FMU in the cache, written there if it is not."""
    inside = f"packages/{hashlib.sha256(content).hexdigest()[:32]}"
    file = cache_folder() / inside / name
    if not (file.is_file() and file.stat().st_size == len(content)):
        folder = cache_subfolder(inside)
        with tempfile.NamedTemporaryFile(dir=folder, prefix=".unfinished-", delete=False) as unfinished:
            unfinished.write(content)
        os.replace(unfinished.name, file)
    return file.resolve()
