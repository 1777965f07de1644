"""Folders of the cache with a seal: a hash of their files, so that a damaged one is made anew.

if not is_sound(folder):
unfinished = ...            # beside `folder`, filled
finish(unfinished, folder)
"""

import contextlib
import hashlib
import os
from pathlib import Path

from hfsa.components._modelling.cache_limit import remove, trim_once

_SEAL = "seal"
_checked: dict[tuple[Path, int], int] = {}
"""Size of each folder that this process has read through, by its path and the time of its seal."""


def is_sound(folder: Path) -> bool:
    """Whether a folder is there and as it was finished; a damaged one is removed.

    Its files are read once in a process; a file whose size has changed is always found.
    """
    seal = folder / _SEAL
    try:
        key = folder, seal.stat().st_mtime_ns
        size = _total(folder)
        if _checked.get(key) != size:
            if seal.read_text(encoding="ascii") != _hash(folder):
                remove(folder)
                return False
            _checked[key] = size
    except (OSError, ValueError):
        if folder.is_dir():
            remove(folder)
        return False
    with contextlib.suppress(OSError):  # the time of the last use; a cache that cannot be written serves too
        os.utime(folder)
    return True


def finish(unfinished: Path, folder: Path) -> None:
    """Seal a filled folder and give it its name; another process's, if it came first, is as good."""
    (unfinished / _SEAL).write_text(_hash(unfinished), encoding="ascii")
    try:
        unfinished.rename(folder)
    except OSError:
        if not folder.is_dir():
            raise
    trim_once()


def _files(folder: Path) -> list[Path]:
    """Return the files of a folder without its seal, in the order of their names."""
    return sorted(file for file in folder.iterdir() if file.name != _SEAL)


def _total(folder: Path) -> int:
    """Return the size of the files of a folder [bytes]."""
    return sum(file.stat().st_size for file in _files(folder))


def _hash(folder: Path) -> str:
    """Return the hash of the names and contents of the files of a folder."""
    digest = hashlib.sha256()
    for file in _files(folder):
        digest.update(file.name.encode() + b"\0" + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()
