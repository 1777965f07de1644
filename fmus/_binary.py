"""The binaries of an FMU: paths, the functions that FMI requires, from the headers, and what is inside of them."""

import re
from functools import cache
from pathlib import Path, PurePosixPath

import fmpy
import lief

from hfsa.fmus._platforms import HERE

INTERFACES = ("ModelExchange", "CoSimulation")
"""XML elements of the interfaces that are checked."""

HEADERS = Path(fmpy.__file__).parent / "c-code"
"""Folder of the headers of the FMI standard, part of fmpy."""

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
"""Platforms that `platform_of` can tell apart, by their names in FMI 3."""

_SYSTEM = re.compile(
    r"lib[cm]\.so\.6|libc\.musl-.*|ld-linux.*\.so\.\d"
    r"|/usr/lib/libsystem\.b\.dylib"
    r"|(kernel32|ntdll|ucrtbase|msvcrt|api-ms-win-crt-[a-z0-9-]+)\.dll"
)
"""Names of the C libraries of Linux, macOS and Windows, in small letters."""

_SECTION = re.compile(
    r"^(?:Common Functions|Functions for .*?(Model Exchange|Co-Simulation|Scheduled Execution))", re.MULTILINE
)
_DEFINE = re.compile(r"^#define (fmi\d\w+)\s+fmi\dFullName\(", re.MULTILINE)


def binary_path(folder: Path, version: int, identifier: str) -> Path:
    """Return the path of this platform's binary with a model identifier, by FMI version."""
    path = HERE.path(version, identifier)
    assert path is not None  # fmpy gives every platform a name of FMI 2
    return folder / path


@cache
def functions(version: int) -> dict[str, frozenset[str]]:
    """Return the FMI functions of a major version by interface, each with the common functions."""
    text = (HEADERS / f"fmi{version}Functions.h").read_text(encoding="utf-8")
    common: set[str] = set()
    special: dict[str, set[str]] = {"ModelExchange": set(), "CoSimulation": set(), "ScheduledExecution": set()}
    sections = list(_SECTION.finditer(text))
    for section, end in zip(sections, [s.start() for s in sections[1:]] + [len(text)], strict=True):
        interface = (section[1] or "").replace("-", "").replace(" ", "")
        for name in _DEFINE.findall(text[section.end() : end]):
            of = re.fullmatch(r"fmi3Instantiate(\w+)", name)
            special.get(of[1] if of else interface, common).add(name)
    return {interface: frozenset(common | names) for interface, names in special.items()}


def all_functions() -> frozenset[str]:
    """Return all functions of FMI 2 and FMI 3, Scheduled Execution included: the exports of our own binaries."""
    return frozenset().union(*functions(2).values(), *functions(3).values())


def exported(library: Path) -> set[str] | None:
    """Return the symbols that a shared library exports; `None` if it is of no format of `_read`."""
    binary = _read(library)
    if binary is None:
        return None
    if isinstance(binary, lief.MachO.Binary):  # the linker itself exports the last two
        names = {str(function.name).removeprefix("_") for function in binary.exported_functions}
        return names - {"_mh_dylib_header", "__dso_handle"}
    symbols = binary.exported_symbols if isinstance(binary, lief.ELF.Binary) else binary.exported_functions
    return {str(symbol.name) for symbol in symbols}


def needed(library: Path) -> set[str] | None:
    """Return the shared libraries that one needs, itself left out; `None` if it is of no format of `_read`."""
    binary = _read(library)
    if binary is None:
        return None
    names = {str(getattr(found, "name", found)) for found in binary.libraries}
    return {name for name in names if PurePosixPath(name).name != library.name}


def platform_of(library: Path) -> str | None:
    """Return the platform that a shared library is made for, its name in FMI 3; `None` if that cannot be told."""
    binary = _read(library)
    if isinstance(binary, lief.MachO.Binary):
        return _MACHINES.get(("darwin", binary.header.cpu_type.name))
    if isinstance(binary, lief.PE.Binary):
        return _MACHINES.get(("windows", binary.header.machine.name))
    if isinstance(binary, lief.ELF.Binary):
        return _MACHINES.get(("linux", binary.header.machine_type.name))
    return None


def is_of_the_system(name: str) -> bool:
    """Whether a library is a C library, or one of mathematics, of its system."""
    return bool(_SYSTEM.fullmatch(name.lower()))


def _read(library: Path) -> "lief.ELF.Binary | lief.PE.Binary | lief.MachO.Binary | None":
    """Return an ELF, PE or Mach-O library; `None` if it is none of these, or holds several of them."""
    lief.logging.disable()
    data = library.read_bytes()
    known = data[:4] in _MAGIC or data[:2] == b"MZ"
    found = lief.parse(data) if known else None
    return found if isinstance(found, lief.ELF.Binary | lief.PE.Binary | lief.MachO.Binary) else None
