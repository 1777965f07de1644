"""Archive of a system structure package, read with care: it comes from somebody else.

A name that leaves the archive, a link, an encrypted or damaged entry, and an archive that is far larger than its file
are refused before anything is unpacked.
"""

import io
import posixpath
import stat
import zipfile
import zlib
from pathlib import Path
from urllib.parse import unquote, urlsplit

from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import nearest

MOST_ENTRIES = 10_000
LARGEST = 2 * 1024**3
"""Largest size [bytes] of all that an archive holds."""
HIGHEST_RATIO, NEVER_TOO_LARGE = 200, 64 * 1024**2
"""Largest size as a multiple of the archive's, and the size [bytes] below which it does not count."""


class Archive:
    """A ZIP archive; `where` names it in messages, `names` are those of its files."""

    def __init__(self, content: bytes, where: str):
        self.where = where
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(content))
        except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError) as error:
            raise StructureError(f"{where} is not a readable SSP: {error}") from None
        entries = self._zip.infolist()
        if len(entries) > MOST_ENTRIES:
            raise StructureError(f"{where} has {len(entries)} entries, expected at most {MOST_ENTRIES}")
        for entry in entries:
            self._check(entry)
        size = sum(entry.file_size for entry in entries)
        if size > LARGEST or size > max(HIGHEST_RATIO * len(content), NEVER_TOO_LARGE):
            raise StructureError(
                f"{where} unpacks to {size:,} bytes from {len(content):,}, expected at most {HIGHEST_RATIO} times as "
                f"many and {LARGEST:,}"
            )
        self.names = [entry.filename for entry in entries if not entry.is_dir()]

    def read(self, name: str, place: str) -> bytes:
        """Return the content of an entry; `place` is where the archive names it."""
        if name not in self.names:
            raise StructureError(f"{place}: there is no {name} in the archive{nearest(name, self.names)}")
        try:
            return self._zip.read(name)
        except (zipfile.BadZipFile, zlib.error, OSError, EOFError, NotImplementedError, RuntimeError) as error:
            raise StructureError(f"{self.where}: {name} is damaged: {error}") from None

    def _check(self, entry: zipfile.ZipInfo) -> None:
        """Raise `StructureError` for an entry that is none of a file or folder within the archive."""
        name = entry.filename
        if _leaves(name):
            raise StructureError(f"{self.where}: the entry {name!r} leaves the archive, expected a path within it")
        if stat.S_ISLNK(entry.external_attr >> 16):
            raise StructureError(f"{self.where}: the entry {name!r} is a link, expected a file")
        if entry.flag_bits & 0x1:
            raise StructureError(f"{self.where}: the entry {name!r} is encrypted, expected a plain one")


def resolved(source: str, base: str, place: str) -> str:
    """Return the name in the archive of a source that is relative to the entry `base`.

    `StructureError`, which begins with `place`, for an address and for a path that leaves the archive.
    """
    parts = urlsplit(source)
    if parts.scheme or parts.netloc:
        raise StructureError(f"{place}: source {source!r} is an address, expected a path in the archive")
    name = posixpath.normpath(posixpath.join(posixpath.dirname(base), unquote(parts.path)))
    if _leaves(name) or not parts.path:
        raise StructureError(f"{place}: source {source!r} leaves the archive, expected a path within it")
    return name


def read_file(file: Path) -> bytes:
    """Return the content of a package's file."""
    if file.is_dir():
        raise StructureError(f"{file} is a folder, expected an SSP, which is a file")
    try:
        return file.read_bytes()
    except FileNotFoundError:
        raise StructureError(f"there is no file {file}") from None
    except OSError as error:
        raise StructureError(f"{file} cannot be read: {error.strerror or error}") from None


def _leaves(name: str) -> bool:
    """Whether a path is absolute, of a drive, or goes above its beginning."""
    return name.startswith(("/", "\\")) or ":" in name or ".." in name.replace("\\", "/").split("/")
