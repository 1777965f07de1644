"""The cache: a folder of this user for FMUs, compiled loops, solved meshes and computed choices.

It is `$HFSA_CACHE`, else `hfsa` in `$XDG_CACHE_HOME` or `~/.cache`. What lies there is named by a hash of all that it
is made from, and appears complete or not at all.
"""

import os
import tempfile
from pathlib import Path

from hfsa.components._modelling.errors import ModelError


def cache_folder() -> Path:
    """Return the folder of the cache, which may not exist yet; `ModelError` where the user has no home folder."""
    if own := os.environ.get("HFSA_CACHE"):
        return Path(own)
    if chosen := os.environ.get("XDG_CACHE_HOME"):
        return Path(chosen) / "hfsa"
    try:
        return Path.home() / ".cache" / "hfsa"
    except RuntimeError as error:
        raise ModelError("this user has no home folder; set HFSA_CACHE to a folder to keep FMUs in") from error


def cache_subfolder(name: str) -> Path:
    """Return a folder of the cache, made where it is not there; `ModelError` where that cannot be written."""
    folder = cache_folder() / name
    try:
        folder.mkdir(parents=True, exist_ok=True)
        os.rmdir(tempfile.mkdtemp(prefix=".unfinished-", dir=folder))
    except OSError as error:
        variable = next((word for word in ("HFSA_CACHE", "XDG_CACHE_HOME") if os.environ.get(word)), "HOME")
        raise ModelError(
            f"${variable} is {os.environ.get(variable, Path.home())}, but its folder {folder} cannot be written "
            f"({error.strerror or error}); expected a folder to keep FMUs in, which HFSA_CACHE names"
        ) from error
    return folder


def keep(data: bytes, file: Path) -> None:
    """Write a file of the cache, complete or not at all; `ModelError` where its folder cannot be written."""
    folder = cache_subfolder(file.parent.name)
    with tempfile.NamedTemporaryFile(dir=folder, delete=False) as unfinished:
        unfinished.write(data)
    os.replace(unfinished.name, file)
