"""Checks of an output path before anything is computed or written.

    check_new(path, force)        # a results file
    check_continued(path)         # a results file that a sweep resumes
    check_picture(path)           # a figure
    check_page(path)              # a page
    check_diagram(path)           # a block diagram as text
    check_model(path)             # a 3D model
    check_fmu(path)               # an exported FMU
    check_package(path)           # an exported SSP
    check_parameters(path, force) # a parameter set
    check_table(path, force)      # a converted results file

Nothing is overwritten unasked: a results file of hfsa is replaced with `force` only, a picture by a picture, an FMU or
SSP by its like. Every other file stays: texts, folders, devices, files of other programs. A symbolic link stays too;
the checks apply to the file that it refers to, and that file is replaced.
"""

import os
import stat
import tempfile
from dataclasses import dataclass
from pathlib import Path

from hfsa.cosim.results.file_kind import (
    OTHER_ENDINGS,
    PICTURE_SIGNATURES,
    TABLE_ENDINGS,
    FileKind,
    identify,
    is_picture,
)
from hfsa.cosim.results.locks import check_not_written
from hfsa.cosim.results.records import ResultsError

_ANOTHER = "-o names another file"
_ANOTHER_FOLDER = "-o names another folder"

REPLACING = "--force replaces it, -o names another file"
"""Advice for a results file that exists."""


@dataclass(frozen=True)
class Target:
    """File at an output path: its kind, a description for messages, and its real path behind all symbolic links."""

    kind: FileKind
    description: str
    real: Path


def inspect(path: Path) -> Target:
    """Return the target of a path; `ResultsError` where the operating system refuses access."""
    try:
        info = os.lstat(path)
    except FileNotFoundError:
        return Target(FileKind.NOTHING, "nothing", Path(os.path.realpath(path)))
    except OSError as error:
        raise os_refusal(path, error) from error
    real = Path(os.path.realpath(path))
    if not stat.S_ISLNK(info.st_mode):
        return Target(*identify(real, info), real)
    try:
        kind, description = identify(real, os.stat(path))
    except OSError:
        kind, description = FileKind.OTHER, "which leads to nothing"
    return Target(kind, f"a symbolic link to {os.readlink(path)}, {description}", real)


def check_new(path: Path, force: bool = False, advice: str = REPLACING) -> Target:
    """Return the target of a new results file; `ResultsError` where an existing file must not be replaced.

    With `force`, a results file of hfsa may be replaced; without it, the message ends with `advice`.
    """
    target = inspect(path)
    if target.kind is not FileKind.NOTHING:
        _check_results(path, target)
        if not force:
            raise ResultsError(f"{path} is {target.description} already: {advice}")
    elif (ending := path.suffix.removeprefix(".").lower()) in OTHER_ENDINGS:
        table = "; hfsa convert makes a table of it" if ending in TABLE_ENDINGS else ""
        raise ResultsError(f"cannot write {path}: a results file is HDF5, expected the ending .h5{table}")
    _check_folder(path, target)
    return target


def check_continued(path: Path) -> None:
    """Raise `ResultsError` unless the target of a resumed sweep is a results file of hfsa or does not exist."""
    target = inspect(path)
    if target.kind is FileKind.NOTHING:
        _check_folder(path, target)
    else:
        _check_results(path, target)


def check_picture(path: Path) -> Target:
    """Return the target of a figure; `ResultsError` unless it is a picture of the same format or does not exist."""
    ending = picture_format(path)
    target = inspect(path)
    if target.kind is not FileKind.NOTHING:
        if not is_picture(target.real, ending):
            raise _not_replaced(path, target)
        _check_writable(path, target)
    _check_folder(path, target)
    return target


def picture_format(path: Path) -> str:
    """Return the picture format of a file name ending; `ResultsError` for an ending that is not supported."""
    ending = path.suffix.removeprefix(".").lower()
    if ending not in PICTURE_SIGNATURES:
        formats = ", ".join(f".{known}" for known in PICTURE_SIGNATURES)
        raise ResultsError(f"cannot write {path}: its ending is no picture format, expected one of {formats}")
    return ending


def check_parameters(path: Path, force: bool = False) -> Target:
    """Return the target of a parameter set; `ResultsError` unless it does not exist, or is one and `force` is given."""
    target = inspect(path)
    if target.kind is not FileKind.NOTHING:
        if target.kind is not FileKind.PARAMETERS:
            raise _not_replaced(path, target)
        _check_writable(path, target)
        if not force:
            raise ResultsError(f"{path} is {target.description} already: {REPLACING}")
    _check_folder(path, target)
    return target


def check_table(path: Path, force: bool = False) -> Target:
    """Return the target of a table; `ResultsError` unless it does not exist, or is one of that ending and `force`."""
    target = inspect(path)
    if target.kind is not FileKind.NOTHING:
        if target.kind is not FileKind.TABLE or target.real.suffix.lower() != path.suffix.lower():
            raise _not_replaced(path, target)
        _check_writable(path, target)
        if not force:
            raise ResultsError(f"{path} is {target.description} already: {REPLACING}")
    _check_folder(path, target)
    return target


def check_page(path: Path) -> Target:
    """Return the target of a page; `ResultsError` unless it is a page of hfsa or does not exist."""
    if path.suffix != ".html":
        raise ResultsError(f"cannot write {path}: a page is an HTML file, expected the ending .html")
    return _check_own(path, FileKind.PAGE)


def check_diagram(path: Path) -> Target:
    """Return the target of a diagram as text; `ResultsError` unless it is one of hfsa or does not exist."""
    return _check_own(path, FileKind.DIAGRAM)


def check_model(path: Path) -> Target:
    """Return the target of a 3D model; `ResultsError` unless it is one of hfsa or does not exist."""
    return _check_own(path, FileKind.MODEL)


def _check_own(path: Path, kind: FileKind) -> Target:
    """Return a target of a kind that hfsa alone writes; `ResultsError` unless it is of the kind or does not exist."""
    target = inspect(path)
    if target.kind is not FileKind.NOTHING:
        if target.kind is not kind:
            raise _not_replaced(path, target)
        _check_writable(path, target)
    _check_folder(path, target)
    return target


def check_fmu(path: Path) -> None:
    """Raise `ResultsError` unless the target of an export is an FMU or does not exist."""
    _check_export(path, FileKind.FMU, _ANOTHER_FOLDER)


def check_package(path: Path) -> None:
    """Raise `ResultsError` unless the target of an exported scene is an SSP or does not exist."""
    _check_export(path, FileKind.PACKAGE, _ANOTHER)


def _check_export(path: Path, kind: FileKind, advice: str) -> None:
    """Raise `ResultsError` unless the target is of a kind or does not exist, and its folder takes files."""
    target = inspect(path)
    if target.kind not in (FileKind.NOTHING, kind):
        raise _not_replaced(path, target, advice)
    if target.kind is kind:
        _check_writable(path, target, advice)
    folder = _check_folder(path, target)
    try:
        os.rmdir(tempfile.mkdtemp(prefix=".hfsa-", dir=folder))  # some file systems, such as /proc, take no files
    except OSError as error:
        raise ResultsError(f"cannot write {path}: {folder} takes no files ({error.strerror or error})") from error


def os_refusal(path: Path, error: OSError) -> ResultsError:
    """Return the error for a path that the operating system refuses to write."""
    return ResultsError(f"cannot write {path}: {error.strerror or error}")


def _check_results(path: Path, target: Target) -> None:
    """Raise `ResultsError` unless a target is a writable results file that no other process writes."""
    if target.kind is not FileKind.RESULTS:
        raise _not_replaced(path, target)
    _check_writable(path, target)
    check_not_written(target.real, path)


def _check_writable(path: Path, target: Target, advice: str = _ANOTHER) -> None:
    """Raise `ResultsError` for a file that is marked read-only, for root as well."""
    if not os.access(target.real, os.W_OK) or not os.stat(target.real).st_mode & 0o222:
        raise ResultsError(f"cannot write {path}: it is {target.description} that is read-only; {advice}")


def _check_folder(path: Path, target: Target) -> Path:
    """Return the folder of a target, or the one to make it in; `ResultsError` where neither is possible."""
    folder = target.real.parent
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    if not folder.is_dir():
        raise ResultsError(f"cannot write {path}: {folder} is no folder")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise ResultsError(f"cannot write {path}: the folder {folder} is not writable")
    return folder


def _not_replaced(path: Path, target: Target, advice: str = _ANOTHER) -> ResultsError:
    """Return the error for a file that is never replaced."""
    return ResultsError(f"cannot write {path}: it is {target.description}, which is not replaced; {advice}")
