"""File locks as HDF5 uses them, and the identity of an open file independent of its name."""

import enum
import errno
import os
import secrets
import time
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from hfsa.cosim.results.records import ResultsError
from hfsa.cosim.results.writers import is_unfinished, writer_of

try:
    import fcntl
except ImportError:  # Windows, where an open file cannot be replaced
    fcntl = None

_PATIENCE = 2.0
"""Time [s] to wait for other processes that read the file."""

_LOCKED_BY_OTHER = (errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES)
"""Error codes of a lock that another process holds."""

_SILENCE = 600.0
"""Time [s] after its last write for which a file without locks counts as open on another machine."""


class _Lock(enum.Enum):
    """Who has locked a file: this process, another one, or nobody on a file system without locks."""

    OURS = enum.auto()
    OTHERS = enum.auto()
    UNKNOWN = enum.auto()


HAS_FLOCK = fcntl is not None
"""Whether the operating system has `flock`; Windows has not, and its open files can be neither renamed nor replaced."""


def lock(descriptor: int, path: Path) -> None:
    """Lock an open file for writing, as HDF5 does; `ResultsError` while another process writes or reads it.

    A process that only tests the lock holds it for an instant, so that readers are waited for. On a file system without
    locks the file itself says who writes it.
    """
    if fcntl is None:
        return
    end = time.monotonic() + _PATIENCE
    while (found := _try_lock(descriptor, fcntl.LOCK_EX)) is _Lock.OTHERS:
        if _try_lock(descriptor, fcntl.LOCK_SH) is _Lock.OTHERS:
            raise _written(descriptor, path)
        fcntl.flock(descriptor, fcntl.LOCK_UN)
        if time.monotonic() > end:
            raise ResultsError(f"cannot write {path}: another process is reading it")
        time.sleep(0.02 * (1 + secrets.randbelow(5)))
    if found is _Lock.UNKNOWN:
        _check_signature(descriptor, path)


def check_not_written(real: Path, path: Path) -> None:
    """Raise `ResultsError` while another process writes a file; `path` is its name in the message."""
    if fcntl is None:
        return
    with open(real, "rb") as file:
        found = _try_lock(file.fileno(), fcntl.LOCK_SH)
        if found is _Lock.OTHERS:
            raise _written(file.fileno(), path)
        if found is _Lock.UNKNOWN:
            _check_signature(file.fileno(), path)


def _written(descriptor: int, path: Path) -> ResultsError:
    """Return the error of a file that another process has locked, which names that process where the file does."""
    writer = writer_of(_reader(descriptor))
    return ResultsError(f"cannot write {path}: {writer.description if writer else 'another process'} is writing it")


def _check_signature(descriptor: int, path: Path) -> None:
    """Raise `ResultsError` where a file on a file system without locks says that another process writes it.

    A process of this machine is looked up; a file of another one counts as open within `_SILENCE` of its last write.
    """
    if not is_unfinished(_reader(descriptor)):
        return
    writer = writer_of(_reader(descriptor))
    if writer is None or writer.is_self or (writer.is_here and not writer.is_alive):
        return
    if writer.is_here:
        raise ResultsError(f"cannot write {path}: {writer.description} is writing it")
    silence = time.time() - os.fstat(descriptor).st_mtime
    if silence < _SILENCE:
        raise ResultsError(
            f"cannot write {path}: its file system has no locks, and {writer.description} wrote it {silence:.0f} s "
            f"ago; if that has ended, try again {_SILENCE - silence:.0f} s later"
        )


def _reader(descriptor: int) -> IO[bytes]:
    """Return a file object of an open file that does not close it."""
    return open(descriptor, "rb", closefd=False)


def has_locks(path: Path) -> bool:
    """Whether the file system of a file supports locks."""
    if fcntl is None:
        return True
    with open(path, "rb") as file:
        return _try_lock(file.fileno(), fcntl.LOCK_SH) is not _Lock.UNKNOWN


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


def _try_lock(descriptor: int, mode: int) -> _Lock:
    """Lock an open file, if no other process has locked it."""
    assert fcntl is not None
    try:
        fcntl.flock(descriptor, mode | fcntl.LOCK_NB)
    except OSError as error:
        return _Lock.OTHERS if error.errno in _LOCKED_BY_OTHER else _Lock.UNKNOWN
    return _Lock.OURS
