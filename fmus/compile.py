"""Compilation of the C sources into one shared library for FMI 2 and FMI 3, Model Exchange and Co-Simulation."""

import contextlib
import importlib.util
import os
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from multiprocessing.util import Finalize
from pathlib import Path

from hfsa.fmus._interfaces import HEADERS
from hfsa.fmus._platforms import HERE, Platform
from hfsa.fmus._sundials import sundials
from hfsa.fmus.c_code import RUNTIME, Sources
from hfsa.fmus.errors import ExportError

FLAGS = ("-O2", "-std=c99", "-fPIC", "-fvisibility=hidden", "-ffp-contract=off")
"""No -ffast-math: it would disable the checks for NaN, and gradual underflow in the whole host process."""

_ZIG = [sys.executable, "-m", "ziglang", "cc"]

TIME_LIMIT = 900.0
"""Longest time of one call of a compiler [s]; the largest part takes seconds."""

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


def compile_library(sources: Sources, folder: Path, platform: Platform = HERE) -> Path:
    """Compile the sources for a platform into `folder` and return the path of the library, `<name>.so` on Linux.

    The compiler is that of PyPI's ziglang for a platform with a target; otherwise `$CC`, else the first of cc, gcc,
    clang and ziglang.

    Raises:
        ExportError: a failed compilation, with the messages of the compiler; no compiler, with the commands tried; a
            missing installation of SUNDIALS, or SUNDIALS for a target.
    """
    library = folder / f"{sources.name}{platform.suffix}"
    files = source_files(sources)
    if sources.needs_cvode and platform.target:
        raise ExportError(
            f"{sources.name}: solver 'cvode' is compiled with the SUNDIALS of this machine, for platform here alone; "
            f"choose another solver for {platform.name}"
        )
    found = sundials() if sources.needs_cvode else None
    flags, link_flags = (tuple(found.compile_flags), found.link_flags) if found else ((), ())
    if platform.target:
        link_flags = _target_flags(platform, library.name)
    command = tuple(_zig(platform) if platform.target else compiler())
    if command[: len(_ZIG)] == tuple(_ZIG):  # it keeps compiled files itself, and writes no objects of several
        compile_files(files, library, flags, link_flags, command)
        return library
    handwritten = tuple((name, text) for name, text in files.items() if name not in sources.files)
    headers = {name: text for name, text in handwritten if name.endswith(".h")}
    try:
        objects = _objects(command, flags, handwritten)
    except ExportError as error:
        raise ExportError(f"{sources.name}: {error}") from error
    compile_files({**headers, **sources.files}, library, flags, (*objects, *link_flags), command)
    return library


def _zig(platform: Platform) -> list[str]:
    """Return the command of ziglang for a platform; `ExportError` where ziglang is not installed."""
    if importlib.util.find_spec("ziglang") is None:
        raise ExportError(f"platform {platform.name} needs the compiler ziglang: pip install hfsa[zig]")
    return [*_ZIG, "-target", platform.target]


def _target_flags(platform: Platform, name: str) -> tuple[str, ...]:
    """Return linker flags for a platform that is not this one: no symbols but the exported, no path of this machine."""
    install = (f"-Wl,-install_name,@rpath/{name}",) if platform.suffix == ".dylib" else ()
    return ("-s", *install)


@cache
def _objects(command: tuple[str, ...], flags: tuple[str, ...], files: tuple[tuple[str, str], ...]) -> tuple[str, ...]:
    """Return the object files of the runtime, compiled once per process, as no line of it depends on the model."""
    folder = Path(tempfile.mkdtemp(prefix="hfsa-"))
    Finalize(None, shutil.rmtree, (folder, True), exitpriority=0)  # also at the end of a worker process
    _write(folder, dict(files))
    units = sorted(name for name, _ in files if name.endswith(".c"))
    made = [folder / f"{Path(unit).stem}.o" for unit in units]
    _run([*command, *FLAGS, *flags, "-c", *units], folder, "runtime", made)
    return tuple(map(str, made))


def compile_files(
    files: Mapping[str, str],
    library: Path,
    flags: Sequence[str] = (),
    link_flags: Sequence[str] = (),
    command: Sequence[str] = (),
) -> None:
    """Compile C files, text by name, into a shared library; errors as in `compile_library`.

    The compiler is `command`, by default that of `compiler`.
    """
    library.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="hfsa-") as scratch:
        _write(Path(scratch), files)
        units = sorted(name for name in files if name.endswith(".c"))
        output = ["-shared", *units, "-o", str(library.resolve()), *link_flags, "-lm"]
        _run([*(command or compiler()), *FLAGS, *flags, *output], Path(scratch), library.stem, [library])


def _write(folder: Path, files: Mapping[str, str]) -> None:
    """Write source files, text by name."""
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8", errors="surrogateescape")


def _run(command: Sequence[str], folder: Path, name: str, made: Sequence[Path]) -> None:
    """Run a compiler in a folder of sources; `ExportError` with its messages where it fails, hangs or makes nothing."""
    call = f"{name}: {shlex.join(command)}"
    with tempfile.TemporaryFile() as said:
        # a session of its own: what it has started ends with it
        process = subprocess.Popen(
            command, cwd=folder, stdin=subprocess.DEVNULL, stdout=said, stderr=said, start_new_session=True
        )
        try:
            code = process.wait(TIME_LIMIT)
        except BaseException as error:
            _end(process)
            if not isinstance(error, subprocess.TimeoutExpired):
                raise
            raise ExportError(f"{call} has not ended after {TIME_LIMIT:g} s; set $CC to another compiler") from None
        said.seek(0)
        words = said.read().decode(errors="replace").strip()
    if code:
        raise ExportError(f"{call} failed with code {code}:\n{words}")
    missing = [file.name for file in made if not (file.is_file() and file.stat().st_size)]
    if missing:
        made_none = f"{call} ended without an error, but made no file {missing[0]}; expected a C compiler in $CC"
        raise ExportError(f"{made_none}\n{words}".strip())


def _end(process: subprocess.Popen) -> None:
    """Kill a compiler and all that it has started."""
    with contextlib.suppress(OSError):
        os.killpg(process.pid, signal.SIGKILL) if hasattr(os, "killpg") else process.kill()
    process.wait()


def compiler() -> list[str]:
    """Return the command of `$CC`, else of the first available C compiler.

    `ExportError` where the command of `$CC` does not exist, and with the commands tried if there is none.
    """
    if chosen := os.environ.get("CC", "").strip():
        return _command(chosen)
    candidates = [["cc"], ["gcc"], ["clang"]]
    for command in candidates:
        if shutil.which(command[0]):
            return command
    if importlib.util.find_spec("ziglang") is not None:
        return _ZIG
    tried = ", ".join(shlex.join(command) for command in [*candidates, _ZIG])
    raise ExportError(f"no C compiler: tried {tried}; set $CC, or pip install hfsa[zig]")


def _command(chosen: str) -> list[str]:
    """Return the words of `$CC`; `ExportError` where there is no such command."""
    try:
        words = shlex.split(chosen)
    except ValueError as error:
        raise ExportError(f"$CC is {chosen!r}, which is no command: {error}; expected a C compiler") from error
    if not (words and shutil.which(words[0])):
        raise ExportError(
            f"$CC is {chosen!r}, but there is no such command; expected a C compiler, or unset $CC for cc, gcc or clang"
        )
    return words
