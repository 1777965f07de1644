"""The folder for temporary files of a command, which is removed however the command ends, if need be by the next one.

    with scratch_folder():
        tempfile.mkdtemp()          # within, and so are the files of compilers and other children
    folder, keeper = new_folder()   # of a program that calls hfsa, whose temporary files are its own

A folder has a file that its process keeps locked. The system frees the lock when the process dies, so that a folder
without a lock is stale. It never removes a folder that has no such file.
"""

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

try:
    import fcntl
except ImportError:  # Windows removes no file that is open
    fcntl = None

OWNER = ".owner"
"""Locked file in the folder, which holds the number of the process."""

_PREFIX = "hfsa-"
_VARIABLE = "TMPDIR"


@contextlib.contextmanager
def scratch_folder() -> Iterator[None]:
    """Keep all temporary files of this process and its children in one folder, and remove it afterwards.

    First it removes the folders of processes that died. Where the folder for temporary files takes none, it does
    nothing.
    """
    try:
        root = Path(tempfile.gettempdir())
        remove_stale(root)
        folder = Path(tempfile.mkdtemp(prefix=_PREFIX))
    except OSError:
        yield
        return
    before, outside = tempfile.tempdir, os.environ.get(_VARIABLE)
    try:
        with owned(folder):
            tempfile.tempdir = os.environ[_VARIABLE] = str(folder)
            yield
    finally:
        tempfile.tempdir = before
        if outside is None:
            os.environ.pop(_VARIABLE, None)
        else:
            os.environ[_VARIABLE] = outside
        shutil.rmtree(folder, ignore_errors=True)


def remove_stale(root: Path) -> None:
    """Remove the folders of processes that died; several processes may do so at once."""
    if fcntl is None:
        return
    with contextlib.suppress(OSError), os.scandir(root) as entries:
        for entry in entries:
            if entry.name.startswith(_PREFIX) and entry.is_dir(follow_symlinks=False):
                with contextlib.suppress(OSError):
                    _remove_if_stale(Path(entry.path))


def enclosing(folder: Path) -> Path:
    """Return the folder of a command that a folder lies in, else the folder itself."""
    return folder.parent if (folder.parent / OWNER).exists() else folder


def _remove_if_stale(folder: Path) -> None:
    """Remove a folder of this user whose file no process has locked."""
    assert fcntl is not None
    if folder.stat().st_uid != os.getuid():
        return
    with open(folder / OWNER, "rb") as owner:
        fcntl.flock(owner, fcntl.LOCK_EX | fcntl.LOCK_NB)  # an error where it is locked, or where there are no locks
        shutil.rmtree(folder, ignore_errors=True)


def new_folder() -> tuple[Path, contextlib.ExitStack]:
    """Return a new folder for files of this process, and what keeps it owned until it is closed.

    Within the folder of a command it needs no owner of its own. The first one of a process has those removed whose
    processes died.
    """
    keeper, root = contextlib.ExitStack(), Path(tempfile.gettempdir())
    if (root / OWNER).exists():
        return Path(tempfile.mkdtemp(prefix=_PREFIX)), keeper
    _remove_stale_once(root)
    folder = Path(tempfile.mkdtemp(prefix=_PREFIX))
    keeper.enter_context(owned(folder))
    return folder, keeper


@cache
def _remove_stale_once(root: Path) -> None:
    """Remove the folders of processes that died, once in a process."""
    remove_stale(root)


@contextlib.contextmanager
def owned(folder: Path) -> Iterator[None]:
    """Lock the file of a folder, which appears locked."""
    unfinished = folder / f"{OWNER}.new"
    with contextlib.ExitStack() as stack:
        with contextlib.suppress(OSError):
            owner = stack.enter_context(open(unfinished, "w"))
            owner.write(f"{os.getpid()}\n")
            owner.flush()
            if fcntl is not None:
                fcntl.flock(owner, fcntl.LOCK_EX | fcntl.LOCK_NB)
                os.rename(unfinished, folder / OWNER)
        yield
