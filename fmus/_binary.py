"""The binary of an FMU: its path, the functions that FMI requires, from the headers, and the symbols it exports."""

import re
import struct
from functools import cache
from pathlib import Path

import fmpy

INTERFACES = ("ModelExchange", "CoSimulation")
"""XML elements of the interfaces that are checked."""

HEADERS = Path(fmpy.__file__).parent / "c-code"
"""Folder of the headers of the FMI standard, part of fmpy."""

_SECTION = re.compile(
    r"^(?:Common Functions|Functions for .*?(Model Exchange|Co-Simulation|Scheduled Execution))", re.MULTILINE
)
_DEFINE = re.compile(r"^#define (fmi\d\w+)\s+fmi\dFullName\(", re.MULTILINE)


def binary_path(folder: Path, version: int, identifier: str) -> Path:
    """Return the path of this platform's binary with a model identifier, by FMI version."""
    platform = fmpy.platform if version == 2 else fmpy.platform_tuple
    return folder / "binaries" / platform / (identifier + fmpy.sharedLibraryExtension)


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
    """Return the symbols that a shared library exports; `None` if it is not a readable 64-bit ELF file."""
    data = library.read_bytes()
    if data[:6] != b"\x7fELF\x02\x01":
        return None
    try:
        return set(_elf_symbols(data))
    except (struct.error, IndexError, ValueError):
        return None


def _elf_symbols(data: bytes):
    """Yield the defined dynamic symbols of a little-endian ELF64 file (System V ABI, chapters 4 and 5)."""
    (table,) = struct.unpack_from("<Q", data, 0x28)
    entry_size, count = struct.unpack_from("<HH", data, 0x3A)
    sections = [struct.unpack_from("<IIQQQQIIQQ", data, table + k * entry_size) for k in range(count)]
    for _, kind, _, _, offset, size, link, _, _, symbol_size in sections:
        if kind != 11:  # SHT_DYNSYM
            continue
        names = sections[link][4]
        for at in range(offset, offset + size, symbol_size):
            name, info, other, section = struct.unpack_from("<IBBH", data, at)
            is_global, is_visible = info >> 4 in (1, 2, 10), other & 3 in (0, 3)
            if section and is_global and is_visible:
                start = names + name
                yield data[start : data.index(b"\0", start)].decode("utf-8", "replace")
