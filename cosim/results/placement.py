"""Atomic placement of a complete file under its final name.

    with temporary_file(path) as part:              # a name beside `path` that no other process uses
        ...                                         # write `part`, completely
        put_in_place(part, path, lambda: check_new(path, force))

Where several processes write the same path at once, exactly one of them succeeds.
"""

import contextlib
import errno
import glob
import hashlib
import os
import re
import secrets
import socket
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

from hfsa.cosim.results.file_kind import FileKind
from hfsa.cosim.results.locks import Identity, lock
from hfsa.cosim.results.records import ResultsError
from hfsa.cosim.results.target import Target, check_picture, os_refusal
from hfsa.cosim.results.writers import is_alive, started

_LEFT = re.compile(r"\.([0-9a-f]{8})-(\d+)-(\d+)-[0-9a-f]{8}\.part$")
"""End of the name of an unfinished file: machine, number and start of its process."""

_NO_HARD_LINKS = (errno.EPERM, errno.EMLINK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)
"""Error codes of a file system without hard links."""


@contextlib.contextmanager
def temporary_file(path: Path) -> Iterator[Path]:
    """Yield an unused file name beside `path`, making its folder; remove the file afterwards if it still exists."""
    real = Path(os.path.realpath(path))
    _remove_left(real)
    me = f"{_machine()}-{os.getpid()}-{started(os.getpid())}"
    part = real.with_name(f".{real.name[:40]}.{me}-{secrets.token_hex(4)}.part")
    try:
        real.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise os_refusal(path, error) from error
    try:
        yield part
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def _remove_left(real: Path) -> None:
    """Remove unfinished files for a path that processes of this machine left behind, which have died since.

    Their names have machine, number and start of the process; a file of another form, or machine, is not ours to judge.
    """
    if os.name != "posix":
        return
    with contextlib.suppress(OSError):
        for left in real.parent.glob(f".{glob.escape(real.name[:40])}.*.part"):
            found = _LEFT.search(left.name)
            if found and found[1] == _machine() and not is_alive(int(found[2]), int(found[3])):
                left.unlink(missing_ok=True)


@cache
def _machine() -> str:
    """Return a word for this machine, or the container within it that counts processes on its own."""
    try:
        space = os.stat("/proc/self/ns/pid").st_ino
    except OSError:
        space = 0
    return hashlib.sha256(f"{socket.gethostname()} {space}".encode()).hexdigest()[:8]


def put_in_place(part: Path, path: Path, check: Callable[[], Target]) -> None:
    """Rename a complete file to `path`; where several processes do so at once, one of them succeeds.

    `check` inspects the target each time: it returns a target that may be replaced, and raises otherwise.
    `ResultsError` for a results file that another process has open.
    """
    try:
        while not _is_placed(part, path, check()):
            pass
    except OSError as error:
        raise os_refusal(path, error) from error


def write_picture(path: Path, content: bytes) -> None:
    """Write a picture, completely or not at all; `ResultsError` as `check_picture`, or for a full disk."""
    write_file(path, content, lambda: check_picture(path))


def write_file(path: Path, content: bytes, check: Callable[[], Target]) -> None:
    """Write a file, completely or not at all; `check` as in `put_in_place`. `ResultsError` for a full disk."""
    with temporary_file(path) as part:
        try:
            with open(part, "xb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise os_refusal(path, error) from error
        put_in_place(part, path, check)


class Bound(NamedTuple):
    """The largest size of a kind of files [byte], what they are, and what makes one smaller."""

    size: float
    what: str
    remedy: str


def write_bounded(path: Path, content: bytes, bound: Bound, check: Callable[[], Target]) -> None:
    """Write a file as `write_file`; `ResultsError` where it is larger than its bound."""
    if len(content) > bound.size:
        raise ResultsError(
            f"cannot write {path}: the {bound.what} has {len(content) / 1e6:.1f} MB, expected at most "
            f"{bound.size / 1e6:g} MB; {bound.remedy} would do"
        )
    write_file(path, content, check)


def _is_placed(part: Path, path: Path, target: Target) -> bool:
    """Rename a complete file and return whether it succeeded; false where the target changed after its check."""
    if target.kind is FileKind.NOTHING:
        return _is_linked(part, target.real)
    with open(part, "rb") as file:
        os.fsync(file.fileno())  # a power failure must not lose the file that is replaced
    if target.kind is FileKind.RESULTS:
        with contextlib.suppress(FileNotFoundError), open(target.real, "r+b") as old:
            lock(old.fileno(), path)
            if Identity.of(old.fileno()).is_at(target.real):
                os.replace(part, target.real)
                return True
        return False
    os.replace(part, target.real)
    return True


def _is_linked(part: Path, real: Path) -> bool:
    """Give a file a new name and return whether it succeeded; false where the name exists by now."""
    try:
        os.link(part, real)
    except FileExistsError:
        return False
    except OSError as error:
        if error.errno not in _NO_HARD_LINKS:
            raise
        return _is_renamed(part, real)
    return True


def _is_renamed(part: Path, real: Path) -> bool:
    """Do the same without hard links: the first process to create an empty file of that name succeeds."""
    try:
        os.close(os.open(real, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
    except FileExistsError:
        return False
    try:
        os.replace(part, real)
    except OSError:
        real.unlink()
        raise
    return True
