"""Atomic placement of a complete file under its final name.

    with temporary_file(path) as part:              # a name beside `path` that no other process uses
        ...                                         # write `part`, completely
        put_in_place(part, path, lambda: check_new(path, force))

Where several processes write the same path at once, exactly one of them succeeds.
"""

import contextlib
import errno
import os
import secrets
from collections.abc import Callable, Iterator
from pathlib import Path

from hfsa.cosim.results.file_kind import FileKind
from hfsa.cosim.results.locks import Identity, lock
from hfsa.cosim.results.target import Target, check_picture, os_refusal

_NO_HARD_LINKS = (errno.EPERM, errno.EMLINK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)
"""Error codes of a file system without hard links."""


@contextlib.contextmanager
def temporary_file(path: Path) -> Iterator[Path]:
    """Yield an unused file name beside `path`, making its folder; remove the file afterwards if it still exists."""
    real = Path(os.path.realpath(path))
    part = real.with_name(f".{real.name[:40]}.{os.getpid()}-{secrets.token_hex(4)}.part")
    try:
        real.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise os_refusal(path, error) from error
    try:
        yield part
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


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
