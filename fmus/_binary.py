"""What is inside of a shared library: exported symbols, libraries that it needs, platform."""

import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path, PurePosixPath
from typing import Any

_MAGIC = (b"\x7fELF", b"\xcf\xfa\xed\xfe", b"\xce\xfa\xed\xfe")

_MACHINES = {
    ("linux", "X86_64"): "x86_64-linux",
    ("linux", "AARCH64"): "aarch64-linux",
    ("linux", "I386"): "x86-linux",
    ("windows", "AMD64"): "x86_64-windows",
    ("windows", "I386"): "x86-windows",
    ("windows", "ARM64"): "aarch64-windows",
    ("darwin", "X86_64"): "x86_64-darwin",
    ("darwin", "ARM64"): "aarch64-darwin",
}
"""Platforms by system and processor as lief names it."""

KNOWN = frozenset(_MACHINES.values())
"""Platforms that `read_binary` can tell apart, by their names in FMI 3."""

_SYSTEM = re.compile(
    r"lib[cm]\.so\.6|libc\.musl-.*|ld-linux.*\.so\.\d"
    r"|/usr/lib/libsystem\.b\.dylib"
    r"|(kernel32|ntdll|ucrtbase|msvcrt|api-ms-win-crt-[a-z0-9-]+)\.dll"
)
"""Names of the C libraries of Linux, macOS and Windows, in small letters."""


@dataclass(frozen=True)
class Binary:
    """A shared library for Linux, Windows or macOS.

    Attributes:
        exported: symbols that it exports.
        needed: shared libraries that it needs, itself left out.
        platform: what it is made for, by its name in FMI 3; `None` for a processor that is not in `KNOWN`.
    """

    exported: frozenset[str]
    needed: frozenset[str]
    platform: str | None


def is_of_the_system(name: str) -> bool:
    """Whether a library is a C library, or one of mathematics, of its system."""
    return bool(_SYSTEM.fullmatch(name.lower()))


def read_binary(library: Path) -> Binary | None:
    """Read an ELF, PE or Mach-O library; `None` if it is none of these, or holds several of them."""
    state = library.stat()
    return _read(library, state.st_size, state.st_mtime_ns)


@lru_cache(maxsize=64)
def _read(library: Path, *_: int) -> Binary | None:
    """Read a library once; the further numbers change with its content."""
    import lief  # takes longer than to open an FMU that is built

    lief.logging.disable()
    data = library.read_bytes()
    if data[:4] not in _MAGIC and data[:2] != b"MZ":
        return None
    binary: Any = lief.parse(data)  # its own types lack what a file's kind has
    if isinstance(binary, lief.ELF.Binary):
        symbols = {str(symbol.name) for symbol in binary.exported_symbols}
        machine = ("linux", binary.header.machine_type.name)
    elif isinstance(binary, lief.PE.Binary):
        symbols = {str(symbol.name) for symbol in binary.exported_functions}
        machine = ("windows", binary.header.machine.name)
    elif isinstance(binary, lief.MachO.Binary):
        symbols = {str(symbol.name).removeprefix("_") for symbol in binary.exported_functions}
        symbols -= {"_mh_dylib_header", "__dso_handle"}  # which the linker itself exports
        machine = ("darwin", binary.header.cpu_type.name)
    else:
        return None
    needed = {str(getattr(found, "name", found)) for found in binary.libraries}
    others = frozenset(name for name in needed if PurePosixPath(name).name != library.name)
    return Binary(frozenset(symbols), others, _MACHINES.get(machine))
