"""C sources to one shared library that is FMI 2 and FMI 3, Model Exchange and Co-Simulation at once."""

import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from hfsa.fmus._binary import HEADERS
from hfsa.fmus._sundials import sundials
from hfsa.fmus.c_code import RUNTIME, Sources
from hfsa.fmus.errors import ExportError

FLAGS = ("-O2", "-std=c99", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off")
"""Never -ffast-math: it would switch off the checks for NaN, and gradual underflow in the whole host process."""

CVODE = "cvode.c"
"""The file of the runtime that needs SUNDIALS, which only FMUs with that solver have."""

SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
"""Ending of a shared library."""


def source_files(sources: Sources) -> dict[str, str]:
    """Return every file that any C99 compiler needs: generated, runtime and FMI headers, text by name; no folders."""
    runtime = [path for path in RUNTIME.glob("*.[ch]") if path.name != CVODE or sources.needs_cvode]
    paths = [*runtime, *HEADERS.glob("fmi2*.h"), *HEADERS.glob("fmi3*.h")]
    files = {path.name: path.read_text(encoding="utf-8", errors="surrogateescape") for path in paths}
    return dict(sorted({**files, **sources.files}.items()))


def compile_library(sources: Sources, folder: Path) -> Path:
    """Compile the sources into `folder` and return the path of the shared library, `<name>.so` on Linux.

    Tries `$CC`, cc, gcc, clang and the compiler of PyPI's ziglang, in this order. Raises `ExportError` with the
    compiler's messages where it fails, with the commands tried where none is found, and where SUNDIALS is needed and
    is not there.
    """
    library = folder / f"{sources.name}{SUFFIX}"
    files = source_files(sources)
    if sources.needs_cvode:
        found = sundials()
        compile_files(files, library, found.compile_flags, found.link_flags)
    else:
        compile_files(files, library)
    return library


def compile_files(
    files: Mapping[str, str], library: Path, flags: Sequence[str] = (), link_flags: Sequence[str] = ()
) -> None:
    """Compile C files, text by name, into a shared library, with more flags; `ExportError` as `compile_library`."""
    library.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="hfsa-") as scratch:
        for name, text in files.items():
            (Path(scratch) / name).write_text(text, encoding="utf-8", errors="surrogateescape")
        units = sorted(name for name in files if name.endswith(".c"))
        command = [*compiler(), *FLAGS, *flags, "-shared", *units, "-o", str(library.resolve()), *link_flags, "-lm"]
        done = subprocess.run(command, cwd=scratch, capture_output=True, text=True, check=False)
    if done.returncode:
        call = shlex.join(command)
        raise ExportError(f"{library.stem}: {call} failed with code {done.returncode}:\n{done.stderr.strip()}")


def compiler() -> list[str]:
    """Return the command of the first C compiler there is."""
    candidates = [shlex.split(os.environ.get("CC", "")), ["cc"], ["gcc"], ["clang"]]
    for command in candidates:
        if command and shutil.which(command[0]):
            return command
    zig = [sys.executable, "-m", "ziglang", "cc"]
    if importlib.util.find_spec("ziglang") is not None:
        return zig
    tried = ", ".join(shlex.join(command) for command in [*candidates, zig] if command)
    raise ExportError(f"no C compiler: tried {tried}; set $CC, or pip install hfsa[zig]")
