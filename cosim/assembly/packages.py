"""Packages (SSP) as scenes; their FMUs are kept in the cache, named by their content."""

import hashlib
import os
import tempfile
from functools import lru_cache
from pathlib import Path

from hfsa.components._modelling.cache import cache_folder, cache_subfolder
from hfsa.cosim.ssp.read import Package, read
from hfsa.cosim.systems.errors import StructureError

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
