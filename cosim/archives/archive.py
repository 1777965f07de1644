"""Archive of somebody else, read with care: an FMU or a system structure package.

    with Archive(file, str(file), "FMU") as archive:
        archive.read("modelDescription.xml", str(file))
        archive.unpack(folder)

A name that leaves the archive, a link, an encrypted entry, two entries in one place, and an archive that is far larger
than its file are refused before anything is unpacked. What is read is never larger than what was checked, and matches
its checksum.
"""

import io
import posixpath
import stat
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Self
from urllib.parse import unquote, urlsplit

from hfsa.cosim.archives.directory import directory_size
from hfsa.cosim.archives.limits import LARGEST, MOST_ENTRIES
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import nearest

HIGHEST_RATIO, NEVER_TOO_LARGE = 200, 64 * 1024**2
"""Largest size as a multiple of the archive's, and the size [bytes] below which it does not count."""
DEEPEST, LONGEST_NAME, LONGEST_PATH = 64, 255, 3000
"""Most folders within each other; most bytes of a name and of a path, of which file systems hold no more."""

_LONGEST_ENTRY = 400
"""Most bytes that an average entry takes in the list of an archive."""
_PIECE = 1 << 20
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_DAMAGE = (zipfile.BadZipFile, zlib.error, OSError, EOFError, NotImplementedError, RuntimeError, ValueError)
"""What reading a damaged archive raises."""


class Archive:
    """A ZIP archive, a file or its content; `where` names it in messages, `names` are those of its files.

    `kind` is what it should be. `StructureError` for an archive that is refused.
    """

    def __init__(self, source: bytes | Path, where: str, kind: str = "SSP"):
        self.where = where
        if isinstance(source, Path):
            check_regular(source, where)
        try:
            stream = io.BytesIO(source) if isinstance(source, bytes) else open(source, "rb")  # noqa: SIM115
        except OSError as error:
            raise StructureError(f"{where} cannot be read: {error.strerror or error}") from None
        try:
            self._zip = _opened(stream, where, kind)
            self.names = self._checked(stream.seek(0, io.SEEK_END))
            self._known = set(self.names)
        except BaseException:
            stream.close()
            raise
        self._stream = stream

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._zip.close()
        self._stream.close()

    def read(self, name: str, place: str) -> bytes:
        """Return the content of an entry; `place` is where the archive names it."""
        with self.open(name, place) as stream:
            return stream.read()

    @contextmanager
    def open(self, name: str, place: str) -> Iterator[IO[bytes]]:
        """Open an entry to be read in pieces; `StructureError` for damage, also while it is read."""
        if name not in self._known:
            raise StructureError(f"{place}: there is no {name} in the archive{nearest(name, self.names)}")
        try:
            with self._zip.open(name) as stream:
                yield stream
        except StructureError:
            raise
        except _DAMAGE as error:
            raise StructureError(f"{self.where}: {name} is damaged: {error}") from None

    def unpack(self, folder: Path, is_wanted: Callable[[str], bool] = lambda _: True) -> None:
        """Write the wanted files into a folder, each a new file; `StructureError` for damage and for a full disk."""
        for name in filter(is_wanted, self.names):
            file = folder / name
            with self.open(name, self.where) as stream:
                with _writing(name, self.where):
                    file.parent.mkdir(parents=True, exist_ok=True)
                    target = open(file, "xb")  # noqa: SIM115
                with target:
                    while piece := stream.read(_PIECE):
                        with _writing(name, self.where):
                            target.write(piece)

    def _checked(self, packed: int) -> list[str]:
        """Return the names of the files; `StructureError` for an archive that must not be unpacked."""
        entries = self._zip.infolist()
        most = MOST_ENTRIES.value
        if len(entries) > most:
            raise StructureError(
                f"{self.where} has {len(entries)} entries, expected at most {most}; {MOST_ENTRIES.advice}"
            )
        for entry in entries:
            self._check(entry)
        size = sum(entry.file_size for entry in entries)
        allowed = LARGEST.own or min(LARGEST.default, max(HIGHEST_RATIO * packed, NEVER_TOO_LARGE))
        if size > allowed:
            raise StructureError(
                f"{self.where} unpacks to {size:,} bytes from {packed:,}, expected at most {allowed:,}; "
                f"{LARGEST.advice}"
            )
        files = [entry for entry in entries if not entry.is_dir()]
        self._check_places(files)
        return list(dict.fromkeys(entry.filename for entry in files))

    def _check(self, entry: zipfile.ZipInfo) -> None:
        """Raise `StructureError` for an entry that is none of a file or folder within the archive."""
        name = entry.orig_filename
        fault = _fault(name)
        if stat.S_ISLNK(entry.external_attr >> 16):
            fault = "is a link, expected a file"
        if entry.flag_bits & 0x1:
            fault = "is encrypted, expected a plain one"
        if entry.compress_type not in _METHODS:
            fault = f"is compressed by method {entry.compress_type}, expected stored or deflated"
        if fault:
            shown = repr(name) if len(name) <= LONGEST_NAME else f"{name[:LONGEST_NAME]!r}..."
            raise StructureError(f"{self.where}: the entry {shown} {fault}")

    def _check_places(self, files: list[zipfile.ZipInfo]) -> None:
        """Raise `StructureError` for two contents in one place, and for a file where another has a folder."""
        places: dict[str, tuple[str, int, int]] = {}
        for entry in files:
            place, content = posixpath.normpath(entry.filename), (entry.filename, entry.file_size, entry.CRC)
            if places.setdefault(place, content) != content:
                raise StructureError(f"{self.where} has two different entries {place!r}, expected one")
        for place in places:
            above = posixpath.dirname(place)
            while above:
                if above in places:
                    raise StructureError(f"{self.where}: {above!r} is a file, and the folder of {place!r}")
                above = posixpath.dirname(above)


def resolved(source: str, base: str, place: str) -> str:
    """Return the name in the archive of a source that is relative to the entry `base`.

    `StructureError`, which begins with `place`, for an address and for a path that leaves the archive.
    """
    try:
        parts = urlsplit(source)
    except ValueError as error:
        raise StructureError(f"{place}: source {source!r} is no path: {error}") from None
    if parts.scheme or parts.netloc:
        raise StructureError(f"{place}: source {source!r} is an address, expected a path in the archive")
    name = posixpath.normpath(posixpath.join(posixpath.dirname(base), unquote(parts.path)))
    if _leaves(name) or not parts.path:
        raise StructureError(f"{place}: source {source!r} leaves the archive, expected a path within it")
    return name


def check_regular(file: Path, where: str) -> None:
    """Raise `StructureError` for a device or a pipe, which may have no end."""
    if file.exists() and not (file.is_file() or file.is_dir()):
        raise StructureError(f"{where} is a device or a pipe, expected a file")


def read_file(file: Path) -> bytes:
    """Return the content of a package's file."""
    check_regular(file, str(file))
    if file.is_dir():
        raise StructureError(f"{file} is a folder, expected an SSP, which is a file")
    try:
        return file.read_bytes()
    except FileNotFoundError:
        raise StructureError(f"there is no file {file}") from None
    except OSError as error:
        raise StructureError(f"{file} cannot be read: {error.strerror or error}") from None


def _opened(stream: IO[bytes], where: str, kind: str) -> zipfile.ZipFile:
    """Return an archive whose list of entries has a size that can be read; `StructureError` for no archive."""
    size, most = directory_size(stream), _LONGEST_ENTRY * MOST_ENTRIES.value
    if size > most:
        raise StructureError(
            f"{where} is not a readable {kind}: the list of its entries takes {size:,} bytes, expected at most "
            f"{most:,}; {MOST_ENTRIES.advice}"
        )
    try:
        return zipfile.ZipFile(stream)
    except _DAMAGE as error:
        raise StructureError(f"{where} is not a readable {kind}: {error}") from None


@contextmanager
def _writing(name: str, where: str) -> Iterator[None]:
    """Raise `StructureError` where a file cannot be written."""
    try:
        yield
    except (OSError, ValueError) as error:  # a name that the file system cannot hold is a ValueError
        reason = getattr(error, "strerror", None) or error
        raise StructureError(f"{where}: {name} cannot be unpacked: {reason}; TMPDIR names the folder for it") from None


def _fault(name: str) -> str:
    """Return why an entry must not have a name, empty where it may."""
    if _leaves(name):
        return "leaves the archive, expected a path within it"
    if not name.isprintable() or "\\" in name:
        return "has a character that no path in an archive has, expected a path with / between its folders"
    folders = name.split("/")
    if len(folders) > DEEPEST:
        return f"lies {len(folders)} folders deep, expected at most {DEEPEST}"
    sizes = [len(folder.encode(errors="replace")) for folder in folders]
    if max(sizes) > LONGEST_NAME or sum(sizes) + len(sizes) > LONGEST_PATH:
        return f"has a name of more than {LONGEST_NAME} bytes, or a path of more than {LONGEST_PATH}"
    return ""


def _leaves(name: str) -> bool:
    """Whether a path is absolute, of a drive, or goes above its beginning."""
    return name.startswith(("/", "\\")) or ":" in name or ".." in name.replace("\\", "/").split("/")
