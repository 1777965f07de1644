"""The size of the cache: its entries, and the removal of those that were used least recently.

An entry is a file or folder in a folder of the cache; the time of its last use is that of its last modification. It
disappears by being renamed, so that another process finds it whole or not at all.
"""

import contextlib
import os
import shutil
import tempfile
import time
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from hfsa.components._modelling.cache import cache_folder
from hfsa.components._modelling.errors import ModelError

LIMIT = 5 * 10**9
"""Size [bytes] beyond which entries are removed, unless `set_limit` has set another one."""

_UNFINISHED = ".unfinished-"
_IN_USE = 86400.0
"""Age [s] below which an entry stays whatever the size, because a process may be about to read it."""


@dataclass(frozen=True)
class Entry:
    """An entry: its path, its size [bytes], and when it was last used [s since 1970]."""

    path: Path
    size: int
    used: float


def entries() -> list[Entry]:
    """Return all entries, the least recently used first; those that vanish meanwhile are left out."""
    found = []
    with contextlib.suppress(OSError):
        for folder in (folder for folder in cache_folder().iterdir() if folder.is_dir()):
            for path in folder.iterdir():
                with contextlib.suppress(OSError):
                    found.append(Entry(path, _size(path), path.stat().st_mtime))
    return sorted(found, key=lambda entry: entry.used)


def _size(path: Path) -> int:
    """Return the size of a file, or of all files in a folder [bytes]."""
    if not path.is_dir():
        return path.stat().st_size
    return sum(Path(folder, file).stat().st_size for folder, _, files in os.walk(path) for file in files)


def limit() -> int:
    """Return the largest size of the cache [bytes]."""
    try:
        return int(_limit_file().read_text(encoding="ascii"))
    except (OSError, ValueError):
        return LIMIT


def set_limit(size: int) -> None:
    """Set the largest size of the cache [bytes]; `ModelError` where that cannot be written."""
    try:
        _limit_file().parent.mkdir(parents=True, exist_ok=True)
        _limit_file().write_text(str(size), encoding="ascii")
    except OSError as error:
        raise ModelError(f"{_limit_file()} cannot be written ({error.strerror or error})") from error


def _limit_file() -> Path:
    """Return the file with the limit."""
    return cache_folder() / "limit"


def trim(size: int, spared: float = _IN_USE) -> list[Entry]:
    """Remove the least recently used entries until the rest fits into `size` [bytes], and return those.

    Entries used in the last `spared` seconds stay.
    """
    every = entries()
    total, removed, now = sum(entry.size for entry in every), [], time.time()
    for entry in every:
        if total <= size:
            break
        if now - entry.used > spared and remove(entry.path):
            total -= entry.size
            removed.append(entry)
    return removed


@cache
def trim_once() -> None:
    """Keep the cache below its limit, once in this process."""
    trim(limit())


def remove(path: Path) -> bool:
    """Remove an entry, and return whether it was this process that did."""
    try:
        aside = Path(tempfile.mkdtemp(prefix=_UNFINISHED, dir=path.parent))
    except OSError:
        return False
    try:
        path.rename(aside / path.name)
    except OSError:  # another process was first
        return False
    finally:
        shutil.rmtree(aside, ignore_errors=True)
    return True
