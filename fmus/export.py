"""Export of a model as FMU files: generate, compile, describe, pack, check.

    files = export(mass_on_spring(), Path("built"))      # built/MassOnSpring.fmi2.fmu, built/MassOnSpring.fmi3.fmu

Files are written atomically, after the check. The same model, compiler and package version give the same bytes.
"""

import contextlib
import os
import tempfile
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from hfsa.components import Model
from hfsa.fmus._documentation import documentation
from hfsa.fmus._icons import ICON, icons
from hfsa.fmus._platforms import Platform, platforms_for
from hfsa.fmus._sundials import sundials
from hfsa.fmus._terminals import FOLDER, terminals, terminals_and_icons
from hfsa.fmus.c_code import Sources, generate
from hfsa.fmus.check import check
from hfsa.fmus.compile import compile_library, source_files
from hfsa.fmus.errors import ExportError
from hfsa.fmus.model_description import Version, build_description, model_description

_LICENSE = Path(__file__).parent / "runtime" / "LICENSE"


def export(
    model: Model, folder: Path, versions: Sequence[Version] = (2, 3), platforms: Sequence[str] = ("here",)
) -> list[Path]:
    """Write `Name.fmi2.fmu` and `Name.fmi3.fmu` of the model into `folder` and return their paths.

    `platforms` are names of `_platforms.PLATFORMS`, `here` or `all`. A version of FMI that has no name for a platform
    leaves it out.

    Raises:
        ModelError: an incomplete model.
        ExportError: code that cannot be generated or compiled; a file that cannot be written; an FMU that violates a
            rule of FMI; an unknown platform; no platform that a version has a name for.
    """
    chosen = platforms_for(platforms, versions)
    sources = generate(model)
    files = []
    libraries = _libraries(sources, chosen)
    for version in versions:
        file = file_of(model, folder, version)
        with appearing(file) as unfinished:
            pack(unfinished, members(model, sources, libraries, version))
            problems = check(unfinished)
            if problems:
                raise ExportError("\n  ".join([f"{file.name} breaks {len(problems)} rules:", *problems]))
        files.append(file)
    return files


def file_of(model: Model, folder: Path, version: Version) -> Path:
    """Return the path of a model's FMU in a folder."""
    return Path(folder) / f"{model.identifier}.fmi{version}.fmu"


def _libraries(sources: Sources, platforms: Sequence[Platform]) -> dict[Platform, bytes]:
    """Return the shared library for each platform."""
    with tempfile.TemporaryDirectory(prefix="hfsa-") as scratch:
        return {p: compile_library(sources, Path(scratch, p.name), p).read_bytes() for p in platforms}


def members(model: Model, sources: Sources, libraries: Mapping[Platform, bytes], version: Version) -> dict[str, bytes]:
    """Return the files of the FMU by their path in the archive."""
    paths = {platform: platform.path(version, sources.name) for platform in libraries}
    files = {
        "modelDescription.xml": model_description(model, sources, version),
        **{path.as_posix(): libraries[platform] for platform, path in paths.items() if path},
        "documentation/index.html": documentation(model, sources, version),
        f"{FOLDER}/terminalsAndIcons.xml": terminals_and_icons(sources.variables),
        **icons(sources.name, terminals(sources.variables)),
        "documentation/licenses/license.txt": _LICENSE.read_bytes(),
        **{f"sources/{name}": text.encode(errors="surrogateescape") for name, text in source_files(sources).items()},
    }
    if sources.needs_cvode:
        files["documentation/licenses/sundials.txt"] = sundials().license.encode()
    if version == 2:
        files["model.png"] = files[ICON]
    else:
        files["sources/buildDescription.xml"] = build_description(sources)
    return files


def pack(file: Path, files: Mapping[str, bytes]) -> None:
    """Write a reproducible zip archive: fixed dates, owner and order."""
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files, key=lambda name: (name != "modelDescription.xml", name.count("/"), name)):
            entry = zipfile.ZipInfo(name)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3
            entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            archive.writestr(entry, files[name])


@contextlib.contextmanager
def appearing(file: Path) -> Iterator[Path]:
    """Yield a temporary path beside `file`, which replaces `file` at the end; an exception deletes it.

    A symbolic link is kept, and its target is replaced. Raises `ExportError` if the file cannot be written.
    """
    real = Path(os.path.realpath(file))
    unfinished = real.with_name(f".{real.name}.{os.getpid()}")
    try:
        real.parent.mkdir(parents=True, exist_ok=True)
        try:
            yield unfinished
            os.replace(unfinished, real)
        finally:
            unfinished.unlink(missing_ok=True)
    except OSError as error:
        raise ExportError(f"{file} cannot be written: {error.strerror or error}") from error
