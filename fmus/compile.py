"""Compilation of the C sources into one shared library for FMI 2 and FMI 3, Model Exchange and Co-Simulation."""

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
"""No -ffast-math: it would disable the checks for NaN, and gradual underflow in the whole host process."""

CVODE = "cvode.c"
"""File of the runtime that requires SUNDIALS; part of FMUs with the solver CVODE only."""

SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
"""File extension of shared libraries."""


def source_files(sources: Sources) -> dict[str, str]:
    """Return all source files, text by name, without folders: generated code, runtime and FMI headers."""
    runtime = [path for path in RUNTIME.glob("*.[ch]") if path.name != CVODE or sources.needs_cvode]
    paths = [*runtime, *HEADERS.glob("fmi2*.h"), *HEADERS.glob("fmi3*.h")]
    files = {path.name: path.read_text(encoding="utf-8", errors="surrogateescape") for path in paths}
    return dict(sorted({**files, **sources.files}.items()))


def compile_library(sources: Sources, folder: Path) -> Path:
    """Compile the sources into `folder` and return the path of the shared library, `<name>.so` on Linux.

    The compiler is the first of `$CC`, cc, gcc, clang and the one of PyPI's ziglang.

    Raises:
        ExportError: a failed compilation, with the messages of the compiler; no compiler, with the commands tried; a
            missing installation of SUNDIALS.
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
    """Compile C files, text by name, into a shared library; errors as in `compile_library`."""
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
    """Return the command of the first available C compiler; `ExportError` with the commands tried if there is none."""
    candidates = [shlex.split(os.environ.get("CC", "")), ["cc"], ["gcc"], ["clang"]]
    for command in candidates:
        if command and shutil.which(command[0]):
            return command
    zig = [sys.executable, "-m", "ziglang", "cc"]
    if importlib.util.find_spec("ziglang") is not None:
        return zig
    tried = ", ".join(shlex.join(command) for command in [*candidates, zig] if command)
    raise ExportError(f"no C compiler: tried {tried}; set $CC, or pip install hfsa[zig]")
