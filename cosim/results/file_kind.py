"""The kind of an existing file, recognised by its first bytes: results file, FMU, SSP, parameter set, picture, another.

identify(path, os.lstat(path))      # -> (FileKind.RESULTS, "a results file")
"""

import enum
import json
import os
import re
import stat
from pathlib import Path

from hfsa.cosim.archives.archive import Archive
from hfsa.cosim.systems.errors import StructureError

TOOL = "hfsa"
"""Attribute `tool` of results files written by hfsa."""

PICTURE_SIGNATURES = {
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
"""Regular expression of the first bytes of each picture format, by file name ending."""

PARAMETER_SET = "# parameter set of hfsa"
"""First line of a file of parameters written by hfsa."""

DIAGRAM = "// block diagram of hfsa"
"""First line of a block diagram as text."""

PAGE_SIGNATURE = "<!doctype html><!-- page of hfsa -->"
"""First line of a page written by hfsa."""

_HDF5 = b"\x89HDF\r\n\x1a\n"
_ZIP = b"PK\x03\x04"
_GLTF = b"glTF"
_LONGEST_HEADER = 1 << 26
"""Number of bytes at most of the description in a glTF file that is read."""
_TABLES = {b"MATLAB 5.0 MAT-file": "a MAT file", b"PAR1": "a Parquet file"}
"""First bytes of tables, and their names."""

TABLE_ENDINGS = ("csv", "mat", "parquet")
"""Endings of tables."""

OTHER_ENDINGS = frozenset(
    (*PICTURE_SIGNATURES, *TABLE_ENDINGS, "dot", "fmu", "glb", "html", "ssp", "toml", "py", "txt", "json", "xml")
)
"""Endings that promise something else than HDF5."""

_HEAD = 1024
"""Number of bytes read to recognise a file."""


class FileKind(enum.Enum):
    """Kinds of files that are treated differently when a file is written over them."""

    NOTHING = enum.auto()
    RESULTS = enum.auto()
    FMU = enum.auto()
    PACKAGE = enum.auto()
    PARAMETERS = enum.auto()
    TABLE = enum.auto()
    PAGE = enum.auto()
    DIAGRAM = enum.auto()
    MODEL = enum.auto()
    OTHER = enum.auto()


def identify(real: Path, info: os.stat_result) -> tuple[FileKind, str]:
    """Return the kind and a description of an existing file that is not a symbolic link."""
    special = {
        stat.S_IFDIR: "a folder",
        stat.S_IFIFO: "a fifo",
        stat.S_IFSOCK: "a socket",
        stat.S_IFCHR: "a device",
        stat.S_IFBLK: "a device",
    }
    if description := special.get(stat.S_IFMT(info.st_mode)):
        return FileKind.OTHER, description
    try:
        head = _head(real)
    except OSError:
        return FileKind.OTHER, "a file that cannot be read"
    if head.startswith(_HDF5):
        return _hdf5_kind(real)
    if head.startswith(_ZIP):
        return _archive_kind(real)
    if head.startswith(_GLTF):
        return _gltf_kind(real)
    if head.startswith(PARAMETER_SET.encode()):
        return FileKind.PARAMETERS, "a parameter set"
    if table := next((words for signature, words in _TABLES.items() if head.startswith(signature)), ""):
        return FileKind.TABLE, table
    if real.suffix.lower() == ".csv" and _text_or_binary(head) == "a text file":
        return FileKind.TABLE, "a CSV file"
    if head.startswith(PAGE_SIGNATURE.encode()):
        return FileKind.PAGE, "a page"
    if head.startswith(DIAGRAM.encode()):
        return FileKind.DIAGRAM, "a block diagram"
    for ending in PICTURE_SIGNATURES:
        if _has_signature(head, ending):
            return FileKind.OTHER, f"a picture ({ending.upper()})"
    return FileKind.OTHER, _text_or_binary(head)


def is_picture(real: Path, ending: str) -> bool:
    """Whether a path is a regular file with the signature of a picture format."""
    return real.is_file() and _has_signature(_head(real), ending)


def _hdf5_kind(real: Path) -> tuple[FileKind, str]:
    """Return the kind of an HDF5 file by its attribute `tool`, which results files carry from their first moment."""
    import h5py

    try:
        # HDF5 takes no lock on a file object that Python has opened
        with open(real, "rb") as raw, h5py.File(raw, "r") as file:
            is_ours = file.attrs.get("tool") == TOOL
    except Exception:  # h5py raises many types for a damaged file
        return FileKind.OTHER, "an HDF5 file that cannot be read"
    return (FileKind.RESULTS, "a results file") if is_ours else (FileKind.OTHER, "an HDF5 file of another program")


def _archive_kind(real: Path) -> tuple[FileKind, str]:
    """Return the kind of a ZIP archive: an FMU has a model description, an SSP has a system structure."""
    try:
        with Archive(real, str(real)) as archive:
            names = archive.names
    except StructureError:
        names = []
    if "modelDescription.xml" in names:
        return FileKind.FMU, "an FMU"
    return (FileKind.PACKAGE, "an SSP") if "SystemStructure.ssd" in names else (FileKind.OTHER, "a ZIP archive")


def _gltf_kind(real: Path) -> tuple[FileKind, str]:
    """Return the kind of a binary glTF file by its generator."""
    other = FileKind.OTHER, "a 3D model of another program"
    with open(real, "rb") as file:
        header = file.read(20)
        if len(header) < 20:
            return other
        length = int.from_bytes(header[12:16], "little")
        content = file.read(min(length, _LONGEST_HEADER))
    try:
        asset = json.loads(content)["asset"]
        is_ours = asset["generator"] == TOOL
    except (ValueError, KeyError, TypeError, RecursionError):
        return other
    return (FileKind.MODEL, "a 3D model") if is_ours else other


def _head(real: Path) -> bytes:
    """Return the first bytes of a file."""
    with open(real, "rb") as file:
        return file.read(_HEAD)


def _has_signature(head: bytes, ending: str) -> bool:
    """Whether the first bytes of a file match a picture format."""
    return re.match(PICTURE_SIGNATURES[ending], head, re.DOTALL) is not None


def _text_or_binary(head: bytes) -> str:
    """Return the description of a file without a known signature."""
    if not head:
        return "an empty file"
    try:
        text = head.decode()
    except UnicodeDecodeError as error:
        # a multi-byte character may be cut at the end of the head
        text = head[: error.start].decode() if error.start > len(head) - 4 else "\0"
    return "a binary file of another program" if "\0" in text else "a text file"
