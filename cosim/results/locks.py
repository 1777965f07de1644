"""File locks as HDF5 uses them, and the identity of an open file independent of its name."""

import errno
import os
import secrets
import time
from dataclasses import dataclass
from pathlib import Path

from hfsa.cosim.results.records import ResultsError

try:
    import fcntl
except ImportError:  # Windows, where an open file cannot be replaced
    fcntl = None

_PATIENCE = 2.0
"""Time [s] to wait for other processes that read the file."""

_LOCKED_BY_OTHER = (errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES)
"""Error codes of a lock that another process holds."""

HAS_FLOCK = fcntl is not None
"""Whether the operating system has `flock`; Windows has not, and its open files can be neither renamed nor replaced."""


def lock(descriptor: int, path: Path) -> None:
    """Lock an open file for writing, as HDF5 does; `ResultsError` while another process writes or reads it.

    On a file system without locks this does nothing. A process that only tests the lock holds it for an instant, so
    that readers are waited for.
    """
    if fcntl is None:
        return
    end = time.monotonic() + _PATIENCE
    while not _try_lock(descriptor, fcntl.LOCK_EX):
        if not _try_lock(descriptor, fcntl.LOCK_SH):
            raise ResultsError(f"cannot write {path}: another process is writing it")
        fcntl.flock(descriptor, fcntl.LOCK_UN)
        if time.monotonic() > end:
            raise ResultsError(f"cannot write {path}: another process is reading it")
        time.sleep(0.02 * (1 + secrets.randbelow(5)))


def check_not_written(real: Path, path: Path) -> None:
    """Raise `ResultsError` while another process writes a file; `path` is its name in the message."""
    if fcntl is None:
        return
    with open(real, "rb") as file:
        if not _try_lock(file.fileno(), fcntl.LOCK_SH):
            raise ResultsError(f"cannot write {path}: another process is writing it")


def has_locks(path: Path) -> bool:
    """Whether the file system of a file supports locks."""
    if fcntl is None:
        return True
    with open(path, "rb") as file:
        try:
            fcntl.flock(file.fileno(), fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError as error:
            return error.errno in _LOCKED_BY_OTHER
    return True


@dataclass(frozen=True)
class Identity:
    """Identity of a file by device and inode number, the same under all its names."""

    device: int
    number: int

    @classmethod
    def of(cls, file: int | Path) -> "Identity":
        """Return the identity of an open file by its descriptor, or of a file by its path."""
        info = os.stat(file)
        return cls(info.st_dev, info.st_ino)

    def is_at(self, path: Path) -> bool:
        """Whether a path refers to this file."""
        try:
            return self == Identity.of(path)
        except FileNotFoundError:
            return False

    def check(self, path: Path) -> None:
        """Raise `ResultsError` where a path no longer refers to this file."""
        if not self.is_at(path):
            raise ResultsError(f"{path} was removed or replaced by another program; its contents are lost")


def _try_lock(descriptor: int, mode: int) -> bool:
    """Lock an open file and return whether it is locked; true as well on a file system without locks."""
    assert fcntl is not None
    try:
        fcntl.flock(descriptor, mode | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno not in _LOCKED_BY_OTHER
    return True
