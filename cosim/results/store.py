"""HDF5 file of results, created so that a crash at any moment leaves it readable.

Every group and dataset is written once, with fill values, before the file gets its name; afterwards numbers are
overwritten in place. A full disk is therefore noticed before the computation begins. The file is locked for other
processes from its creation until it is closed.
"""

import contextlib
import io
import os
import platform
import subprocess
import sys
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import h5py
import numpy as np

from hfsa.cosim.results.file_kind import TOOL
from hfsa.cosim.results.hdf5 import LONGEST_STATUS, RUNNING, Node, set_warnings
from hfsa.cosim.results.interrupts import deferred_interrupts
from hfsa.cosim.results.locks import HAS_FLOCK, Identity, has_locks, lock
from hfsa.cosim.results.placement import put_in_place, temporary_file
from hfsa.cosim.results.records import ResultsError, SystemRecord
from hfsa.cosim.results.soundness import check_sound, know
from hfsa.cosim.results.system_group import write_system
from hfsa.cosim.results.target import Target, check_new
from hfsa.cosim.results.writers import sign
from hfsa.cosim.systems.names import legible

FORMAT_VERSION = "1"


class Store:
    """Results file open for writing by this process alone.

    Attributes:
        path: name of the file as given.
        file: the h5py file; use `flush` and `close` of the store, which report a full disk.
        identity: identity of the file, independent of its name.
    """

    def __init__(self, path: Path, disk: "LockedFile"):
        self.path = path
        self._disk = disk
        # absolute, as the working folder may change
        self._real = Path(os.path.realpath(path))
        self.identity = Identity.of(disk.fileno())
        with translate_errors(path, "open"):
            self.file: Node = h5py.File(disk, "r+")
            sign(self.file)

    @classmethod
    def create(cls, path: Path, system: SystemRecord, fill: Callable[[Node], None], force: bool = False) -> "Store":
        """Create a results file and open it when all of its datasets are on disk.

        `ResultsError` where a file exists: a results file of hfsa is replaced with `force`, any other file never.
        """
        check_new(path, force)
        with temporary_file(path) as part:
            disk = LockedFile(path, part, "x+")
            try:
                with deferred_interrupts(), translate_errors(path, "write"):
                    with h5py.File(disk, "w") as file:
                        _write_attributes(file, system.title)
                        write_system(file.create_group("system"), system)
                        fill(file)
                    disk.report()
                disk = disk.placed(part, lambda: check_new(path, force))
                return cls(path, disk)
            except BaseException:
                disk.close()
                raise

    @classmethod
    def resume(cls, path: Path, check: Callable[[Node], None]) -> "Store":
        """Open an existing results file for writing; `check` may raise before anything is changed."""
        _check_is_file(path)
        check_sound(path)
        disk = LockedFile(path, path, "r+")
        try:
            if not Identity.of(disk.fileno()).is_at(path):
                raise ResultsError(f"cannot write {path}: another process has just replaced it")
            with translate_errors(path, "open"), h5py.File(disk, "r") as file:
                _check_version(path, file)
                check(file)
            return cls(path, disk)
        except BaseException:
            disk.close()
            raise

    @contextlib.contextmanager
    def writing(self) -> Iterator[None]:
        """Complete a write before an interrupt; `ResultsError` where somebody has damaged the file meanwhile."""
        with deferred_interrupts(), translate_errors(self.path, "write"):
            yield

    def flush(self) -> None:
        """Write all buffers to the file; `ResultsError` where that fails, or where the file is gone by now."""
        with self.writing():
            self.file.flush()
        self._disk.report()
        self.identity.check(self._real)

    def close(self) -> None:
        """Write all buffers and close the file; everything written before stays readable.

        `ResultsError` where the disk refused a write, or where the file was removed or replaced meanwhile.
        """
        with self.writing():
            try:
                self.file.close()
            finally:
                self._disk.close()
        self._disk.report()
        self.identity.check(self._real)
        know(self._real)


class LockedFile(io.FileIO):
    """Locked file object that HDF5 writes to; `opened` is its present name, `path` its name in messages.

    A failed write is stored and raised later by `report`, because HDF5 crashes at exit after an exception in a write.
    """

    def __init__(self, path: Path, opened: Path, mode: str):
        with translate_errors(path, "write"):
            super().__init__(opened, mode)
        self.path = path
        self.error: OSError | None = None
        try:
            lock(self.fileno(), path)
        except ResultsError:
            self.close()
            raise

    def placed(self, part: Path, check: Callable[[], Target]) -> "LockedFile":
        """Rename the complete file from `part` to `path` and return it, still locked."""
        if not HAS_FLOCK:  # Windows cannot rename an open file
            self.close()
            put_in_place(part, self.path, check)
            return LockedFile(self.path, self.path, "r+")
        put_in_place(part, self.path, check)
        return self

    def report(self) -> None:
        """Raise `ResultsError` for the first failed write."""
        if self.error is not None:
            raise ResultsError(f"cannot write {self.path}: {_reason(self.error)}") from self.error

    def write(self, data, /) -> int:
        """Write all bytes; an error is stored for `report`."""
        rest = memoryview(data)
        size = len(rest)
        try:
            while len(rest):
                rest = rest[super().write(rest) :]
        except OSError as error:
            self.error = self.error or error
        return size

    def truncate(self, size: int | None = None, /) -> int:
        """Change the size; an error is stored for `report`."""
        try:
            return super().truncate(size)
        except OSError as error:
            self.error = self.error or error
            return size or 0


@contextlib.contextmanager
def reading(path: Path) -> Iterator[Node]:
    """Open a results file for reading.

    `ResultsError` where it is missing, open for writing, of another format, damaged, or no results file, at once or
    where it is read within the block.
    """
    _check_is_file(path)
    check_sound(path)
    with translate_errors(path, "open"):
        file: Node = h5py.File(path, "r", locking=None if has_locks(path) else False)
    with translate_errors(path, "read"), file:
        _check_version(path, file)
        yield file


def _check_is_file(path: Path) -> None:
    """Raise `ResultsError` for a folder, and where there is no file."""
    if path.is_dir():
        raise ResultsError(f"{path} is a folder, expected a results file")
    if not path.is_file():
        raise ResultsError(f"there is no file {path}")


def _check_version(path: Path, file: Node) -> None:
    """Raise `ResultsError` for a file of another format version."""
    found = file.attrs.get("format_version")
    if found != FORMAT_VERSION:
        raise ResultsError(f"{path} has format version {found}, expected {FORMAT_VERSION}")


@contextlib.contextmanager
def translate_errors(path: Path, verb: str) -> Iterator[None]:
    """Raise `ResultsError` in place of the errors of h5py and the system for a full disk, a locked or a broken file.

    A damaged file can raise anything where it is read; errors of hfsa pass.
    """
    try:
        yield
    except Exception as error:
        if hasattr(error, "exit_code"):
            raise
        if verb == "write" and not isinstance(error, OSError | RuntimeError | KeyError):
            raise
        what = (
            _reason(error) if isinstance(error, OSError | RuntimeError) else f"it is damaged ({error or 'no memory'})"
        )
        raise ResultsError(f"cannot {verb} {path}: {what}") from error


def _write_attributes(file: Node, title: str) -> None:
    """Write the attributes of the file: its program, version, command and date."""
    file.attrs["title"] = legible(title)
    file.attrs["created"] = datetime.now(UTC).isoformat(timespec="seconds")
    file.attrs["tool"] = TOOL
    file.attrs["tool_version"] = version("hfsa")
    file.attrs["git_commit"] = _git_commit()
    file.attrs["command"] = command_line()
    file.attrs["python"] = platform.python_version()
    file.attrs["platform"] = platform.platform()
    file.attrs["format_version"] = FORMAT_VERSION
    sign(file)
    # of fixed length, so that it can be overwritten in place
    file.attrs.create("status", np.bytes_(RUNNING), dtype=f"S{LONGEST_STATUS}")
    set_warnings(file, [])


def command_line() -> str:
    """Return the command of this process."""
    return legible(" ".join([Path(sys.argv[0]).name, *sys.argv[1:]]))


def _git_commit() -> str:
    """Return the commit of this checkout, with `-dirty` if it has changes; empty outside a checkout."""
    folder = Path(__file__).parent
    try:
        call = ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
        done = subprocess.run(call, cwd=folder, capture_output=True, text=True, timeout=10, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


def _reason(error: Exception) -> str:
    """Return the message of the operating system within an HDF5 error."""
    message = str(error)
    if "unable to lock file" in message:
        return "another process has it open"
    if "file signature not found" in message:
        return "it is no HDF5 file, as results files of hfsa are"
    if "error message = '" in message:
        return message.split("error message = '")[1].split("'")[0]
    return getattr(error, "strerror", None) or message
