"""What a file name stands for before something is written there, and how a complete file takes that place.

    check_new(path, force)                          # first of all, and again before the file takes its place
    with unfinished(path) as part:                  # a name beside `path` that no other process uses
        ...                                         # write `part`, completely
        put_in_place(part, path, lambda: check_new(path, force))

What stands there is never overwritten without a word: a results file of ours gives way where that is asked for, a
picture to another one, an FMU to another one. Everything else stays: texts, folders, devices, files of other programs.
A symbolic link stays too; the file that it leads to is what is looked at, and replaced.
"""

import contextlib
import enum
import errno
import os
import re
import secrets
import stat
import time
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from hfsa.cosim.results.records import ResultsError

try:
    import fcntl
except ImportError:  # Windows, which lets nobody replace a file that is open
    fcntl = None

REPLACING = "--force replaces it, -o names another file"
"""What to do about a results file that is there."""

TOOL = "hfsa"
"""The attribute `tool` of a results file of ours."""

_HDF5 = b"\x89HDF\r\n\x1a\n"
_ZIP = b"PK\x03\x04"
_PICTURES = {
    "png": rb"\x89PNG\r\n\x1a\n",
    "pdf": rb"%PDF-",
    "svg": rb"(<\?xml.*)?<svg",
    "eps": rb"%!PS",
    "ps": rb"%!PS",
    "jpg": rb"\xff\xd8\xff",
    "jpeg": rb"\xff\xd8\xff",
    "tif": rb"II\*\0|MM\0\*",
    "tiff": rb"II\*\0|MM\0\*",
    "webp": rb"RIFF....WEBP",
}
"""How files begin that figures are written to, by the ending of their names: patterns."""

_PATIENCE = 2.0
"""Time [s] that a program which reads a file is given to come to its end."""

_HEAD = 1024

_HELD = (errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES)
"""What the system says of a file that another process has locked."""

_NO_LINKS = (errno.EPERM, errno.EMLINK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)
"""What the system says where a file cannot have a second name."""


class Kind(enum.Enum):
    """What a file is, as far as it matters to who wants to write there."""

    NOTHING = enum.auto()
    RESULTS = enum.auto()
    FMU = enum.auto()
    OTHER = enum.auto()


@dataclass(frozen=True)
class Found:
    """What a name stands for: in `words` for a message; `real` is the file itself, wherever links lead to it."""

    kind: Kind
    words: str
    real: Path


def look(path: Path) -> Found:
    """Return what a name stands for; `ResultsError` where the system does not say."""
    try:
        info = os.lstat(path)
    except FileNotFoundError:
        return Found(Kind.NOTHING, "nothing", Path(os.path.realpath(path)))
    except OSError as error:
        raise _refused(path, error) from error
    real = Path(os.path.realpath(path))
    if not stat.S_ISLNK(info.st_mode):
        return Found(*_kind(real, info), real)
    try:
        kind, words = _kind(real, os.stat(path))
    except OSError:
        kind, words = Kind.OTHER, "which leads to nothing"
    return Found(kind, f"a symbolic link to {os.readlink(path)}, {words}", real)


def check_new(path: Path, force: bool = False, advice: str = REPLACING) -> Found:
    """Return what stands where a results file is to be made; `ResultsError` where it has to stay.

    With `force`, a results file of ours need not; without, `advice` says what to do about it.
    """
    found = look(path)
    if found.kind is not Kind.NOTHING:
        _check_results(path, found)
        if not force:
            raise ResultsError(f"{path} is {found.words} already: {advice}")
    _check_folder(path, found)
    return found


def check_continued(path: Path) -> None:
    """Raise `ResultsError` unless a results file of ours, or nothing, stands where a sweep is to go on."""
    found = look(path)
    if found.kind is Kind.NOTHING:
        _check_folder(path, found)
    else:
        _check_results(path, found)


def check_picture(path: Path) -> Found:
    """Return what stands where a figure is to be written; `ResultsError` unless it is such a picture, or nothing."""
    ending = picture_format(path)
    found = look(path)
    if found.kind is not Kind.NOTHING:
        if not (found.real.is_file() and _begins_as(_head(found.real), ending)):
            raise _stays(path, found)
        _check_not_read_only(path, found)
    _check_folder(path, found)
    return found


def picture_format(path: Path) -> str:
    """Return the format that the ending of a picture's name says; `ResultsError` where none is written."""
    ending = path.suffix.removeprefix(".").lower()
    if ending not in _PICTURES:
        formats = ", ".join(f".{known}" for known in _PICTURES)
        raise ResultsError(f"cannot write {path}: the ending says the format of a picture, expected one of {formats}")
    return ending


def check_fmu(path: Path) -> None:
    """Raise `ResultsError` unless an FMU, or nothing, stands where one is to be exported."""
    found = look(path)
    if found.kind is Kind.OTHER or found.kind is Kind.RESULTS:
        raise _stays(path, found)
    if found.kind is Kind.FMU:
        _check_not_read_only(path, found)
    _check_folder(path, found)


def write_picture(path: Path, content: bytes) -> None:
    """Write a picture, completely or not at all; `ResultsError` as `check_picture`, or where the disk refuses."""
    with unfinished(path) as part:
        try:
            with open(part, "xb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            raise _refused(path, error) from error
        put_in_place(part, path, lambda: check_picture(path))


@contextlib.contextmanager
def unfinished(path: Path) -> Iterator[Path]:
    """Give a name for what is to be `path`, in the same folder, which is made; remove what is left there in the end."""
    real = Path(os.path.realpath(path))
    part = real.with_name(f".{real.name[:40]}.{os.getpid()}-{secrets.token_hex(4)}.part")
    try:
        real.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _refused(path, error) from error
    try:
        yield part
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def put_in_place(part: Path, path: Path, check: Callable[[], Found]) -> None:
    """Give a complete file its name; where others want it too, one of them gets it.

    `check` looks at what is there: it returns what may be replaced, and raises where that has to stay. A results file
    that another process has open is not replaced: `ResultsError`.
    """
    try:
        while not _is_placed(part, path, check()):
            pass
    except OSError as error:
        raise _refused(path, error) from error


def lock(descriptor: int, path: Path) -> None:
    """Lock an open file for writing, as HDF5 does; `ResultsError` where another process writes it, or goes on reading.

    A file system without locks does without. Who only looks whether a file is locked holds it for an instant.
    """
    if fcntl is None:
        return
    end = time.monotonic() + _PATIENCE
    while not _is_locked(descriptor, fcntl.LOCK_EX):
        if not _is_locked(descriptor, fcntl.LOCK_SH):
            raise ResultsError(f"cannot write {path}: another process is writing it")
        fcntl.flock(descriptor, fcntl.LOCK_UN)
        if time.monotonic() > end:
            raise ResultsError(f"cannot write {path}: another process is reading it")
        time.sleep(0.02 * (1 + secrets.randbelow(5)))


def has_locks(path: Path) -> bool:
    """Whether the file system that a file is on knows locks."""
    if fcntl is None:
        return True
    with open(path, "rb") as file:
        try:
            fcntl.flock(file.fileno(), fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError as error:
            return error.errno in _HELD
    return True


@dataclass(frozen=True)
class Identity:
    """A file, whatever names it has."""

    device: int
    number: int

    @classmethod
    def of(cls, file: int | Path) -> "Identity":
        """Return the identity of an open file by its descriptor, or of a file by its name."""
        info = os.stat(file)
        return cls(info.st_dev, info.st_ino)

    def is_at(self, path: Path) -> bool:
        """Whether a name stands for this file."""
        try:
            return self == Identity.of(path)
        except FileNotFoundError:
            return False

    def check(self, path: Path) -> None:
        """Raise `ResultsError` where a name does not stand for this file any more."""
        if not self.is_at(path):
            raise ResultsError(f"{path} was removed or replaced by another program; what it held is lost")


def _is_locked(descriptor: int, kind: int) -> bool:
    """Lock an open file, unless another process holds it; true, too, where the file system knows no locks."""
    assert fcntl is not None
    try:
        fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno not in _HELD
    return True


def _is_placed(part: Path, path: Path, found: Found) -> bool:
    """Give a complete file its name; false where what stands there is not what was found any more."""
    if found.kind is Kind.NOTHING:
        return _is_named(part, found.real)
    with open(part, "rb") as file:
        os.fsync(file.fileno())  # what is replaced must not be lost where the power fails
    if found.kind is Kind.RESULTS:
        with contextlib.suppress(FileNotFoundError), open(found.real, "r+b") as old:
            lock(old.fileno(), path)
            if Identity.of(old.fileno()).is_at(found.real):
                os.replace(part, found.real)
                return True
        return False
    os.replace(part, found.real)
    return True


def _is_named(part: Path, real: Path) -> bool:
    """Give a file a name that nobody has; false where somebody has it now."""
    try:
        os.link(part, real)
    except FileExistsError:
        return False
    except OSError as error:
        if error.errno not in _NO_LINKS:
            raise
        return _is_renamed(part, real)
    return True


def _is_renamed(part: Path, real: Path) -> bool:
    """Do as `_is_named` where there are no hard links: who makes an empty file of that name comes first."""
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


def _check_results(path: Path, found: Found) -> None:
    """Raise `ResultsError` unless what was found is a results file of ours that may be written, and nobody writes."""
    if found.kind is not Kind.RESULTS:
        raise _stays(path, found)
    _check_not_read_only(path, found)
    if fcntl is None:
        return
    with open(found.real, "rb") as file:
        if not _is_locked(file.fileno(), fcntl.LOCK_SH):
            raise ResultsError(f"cannot write {path}: another process is writing it")


def _check_not_read_only(path: Path, found: Found) -> None:
    """Raise `ResultsError` for a file that is marked read-only: a word of its owner's, also to root."""
    if not os.access(found.real, os.W_OK) or not os.stat(found.real).st_mode & 0o222:
        raise ResultsError(f"cannot write {path}: it is {found.words} that is read-only; -o names another file")


def _check_folder(path: Path, found: Found) -> None:
    """Raise `ResultsError` where no file can be made in the folder, or the folder not be made."""
    folder = found.real.parent
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    if not folder.is_dir():
        raise ResultsError(f"cannot write {path}: {folder} is no folder")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise ResultsError(f"cannot write {path}: the folder {folder} is not writable")


def _stays(path: Path, found: Found) -> ResultsError:
    """Return the error for what is never replaced."""
    return ResultsError(f"cannot write {path}: it is {found.words}, which is not replaced; -o names another file")


def _refused(path: Path, error: OSError) -> ResultsError:
    """Return the error for what the system refuses."""
    return ResultsError(f"cannot write {path}: {error.strerror or error}")


def _kind(real: Path, info: os.stat_result) -> tuple[Kind, str]:
    """Return what a file is that no link stands for."""
    special = {
        stat.S_IFDIR: "a folder",
        stat.S_IFIFO: "a fifo",
        stat.S_IFSOCK: "a socket",
        stat.S_IFCHR: "a device",
        stat.S_IFBLK: "a device",
    }
    if word := special.get(stat.S_IFMT(info.st_mode)):
        return Kind.OTHER, word
    try:
        head = _head(real)
    except OSError:
        return Kind.OTHER, "a file that cannot be read"
    if head.startswith(_HDF5):
        return _hdf5_kind(real)
    if head.startswith(_ZIP):
        return _archive_kind(real)
    for ending in _PICTURES:
        if _begins_as(head, ending):
            return Kind.OTHER, f"a picture ({ending.upper()})"
    return Kind.OTHER, _text_or_not(head)


def _hdf5_kind(real: Path) -> tuple[Kind, str]:
    """Return what an HDF5 file is; a file of ours says so from the moment it has its name, also while it is written."""
    import h5py

    try:
        # a file that Python has opened is read without a lock
        with open(real, "rb") as raw, h5py.File(raw, "r") as file:
            is_ours = file.attrs.get("tool") == TOOL
    except Exception:  # whatever a damaged file makes of HDF5
        return Kind.OTHER, "an HDF5 file that cannot be read"
    return (Kind.RESULTS, "a results file") if is_ours else (Kind.OTHER, "an HDF5 file of another program")


def _archive_kind(real: Path) -> tuple[Kind, str]:
    """Return what a ZIP archive is."""
    try:
        with zipfile.ZipFile(real) as archive:
            is_fmu = "modelDescription.xml" in archive.namelist()
    except (OSError, zipfile.BadZipFile, ValueError):
        is_fmu = False
    return (Kind.FMU, "an FMU") if is_fmu else (Kind.OTHER, "a ZIP archive")


def _head(real: Path) -> bytes:
    """Return how a file begins."""
    with open(real, "rb") as file:
        return file.read(_HEAD)


def _begins_as(head: bytes, ending: str) -> bool:
    """Whether a file begins as pictures of a format do."""
    return re.match(_PICTURES[ending], head, re.DOTALL) is not None


def _text_or_not(head: bytes) -> str:
    """Return in words what a file without a known signature is."""
    if not head:
        return "an empty file"
    try:
        text = head.decode()
    except UnicodeDecodeError as error:
        # a character that is cut off at the end makes no binary file
        text = head[: error.start].decode() if error.start > len(head) - 4 else "\0"
    return "a file that is no results file of ours" if "\0" in text else "a text file"
