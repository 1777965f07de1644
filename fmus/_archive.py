"""Archive of an FMU that is checked: problems of its entries, found before anything is unpacked."""

import re
import stat
import zipfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

XML = "modelDescription.xml"

MOST_ENTRIES, LARGEST = 100_000, 2 * 1024**3
"""Most entries of an archive, and most bytes of all of them."""
HIGHEST_RATIO, NEVER_TOO_LARGE = 200, 64 * 1024**2
"""Largest size as a multiple of the archive's, and the size [bytes] below which it does not count."""
DEEPEST, LONGEST_NAME = 64, 255
"""Most folders within each other, and most bytes of a name."""


def archive_problems(file: Path) -> list[str]:
    """Return the problems of the zip file, which may be unpacked only if there are none."""
    if not file.is_file():
        return [f"{file} does not exist" if not file.exists() else f"{file} is not a file"]
    try:
        with zipfile.ZipFile(file) as archive:
            problems = [*_size(archive, file.stat().st_size)] or [*_entries(archive)]
            broken = None if problems else archive.testzip()
    except Exception as error:  # damaged files raise exceptions of zipfile, struct, zlib or lzma
        return [f"archive: cannot be read as a zip file ({error})"]
    if broken is not None:
        problems.append(f"archive: {broken} is damaged, its checksum is wrong")
    return problems


def _size(archive: zipfile.ZipFile, packed: int) -> Iterator[str]:
    """Yield the problems of an archive that costs too much to look at."""
    entries = archive.infolist()
    if len(entries) > MOST_ENTRIES:
        yield f"archive: has {len(entries)} entries, expected at most {MOST_ENTRIES}"
    size, most = sum(info.file_size for info in entries), min(LARGEST, max(HIGHEST_RATIO * packed, NEVER_TOO_LARGE))
    if size > most:
        yield f"archive: unpacks to {size:,} bytes from {packed:,}, expected at most {most:,}"


def _entries(archive: zipfile.ZipFile) -> Iterator[str]:
    """Yield the problems of the entries of the archive."""
    names = [info.orig_filename for info in archive.infolist()]
    for name, count in Counter(names).items():
        if count > 1:
            yield f"archive: contains {name} {count} times"
        yield from _path(name)
    for info in archive.infolist():
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            yield f"archive: {info.filename} is neither stored nor deflated, as FMI requires"
        if info.flag_bits & 1:
            yield f"archive: {info.filename} is encrypted"
        if stat.S_ISLNK(info.external_attr >> 16):
            yield f"archive: {info.filename} is a link, expected a file"
    if XML not in names:
        nested = [name for name in names if name.endswith(f"/{XML}")]
        yield f"archive: has no {XML} at its top level" + (f"; there is {nested[0]}" if nested else "")


def _path(name: str) -> Iterator[str]:
    """Yield the problems of the path of an entry."""
    path = PurePosixPath(name)
    shown = name if len(name) <= LONGEST_NAME else f"{name[:LONGEST_NAME]}..."
    if "\\" in name:
        yield f"archive: {shown} contains a backslash, expected /"
    if path.is_absolute() or ".." in path.parts or re.match("[A-Za-z]:", name):
        yield f"archive: {shown} points outside the archive"
    if not name.isprintable():
        yield f"archive: {name[:LONGEST_NAME]!r} has a character that no path has"
    if len(path.parts) > DEEPEST or any(len(part.encode()) > LONGEST_NAME for part in path.parts):
        yield f"archive: {shown} is deeper than {DEEPEST} folders, or has a name of more than {LONGEST_NAME} bytes"
