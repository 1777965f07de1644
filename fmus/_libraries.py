"""The shared libraries in an unpacked FMU: for which platforms they are, and what is wrong with them."""

from collections.abc import Iterator
from pathlib import Path

from hfsa.fmus._binary import KNOWN, is_of_the_system, read_binary
from hfsa.fmus._interfaces import all_functions

_FOLDERS = {
    2: {
        "linux64": "x86_64-linux",
        "linux32": "x86-linux",
        "win64": "x86_64-windows",
        "win32": "x86-windows",
        "darwin64": "x86_64-darwin",
    },
    3: {},
}
"""Platforms by the names of their folders in FMI 2; in FMI 3 they are the same."""

_SUFFIXES = (".so", ".dll", ".dylib")


def libraries(folder: Path) -> list[Path]:
    """Return the shared libraries of an FMU."""
    return sorted(path for path in (folder / "binaries").glob("*/*") if path.suffix in _SUFFIXES)


def platforms(folder: Path) -> list[str]:
    """Return the names of the folders of platforms with a shared library, `sources` for C code."""
    code = ["sources"] if any((folder / "sources").glob("*.c")) else []
    return [*dict.fromkeys(path.parent.name for path in libraries(folder)), *code]


def misplaced(folder: Path, version: int) -> Iterator[str]:
    """Yield a problem for each library in the folder of another platform, which could not be loaded there.

    Folders of other names are not judged.
    """
    for library in libraries(folder):
        place = library.parent.name
        expected, binary = _FOLDERS[version].get(place, place), read_binary(library)
        if binary and binary.platform not in (None, expected) and expected in KNOWN:
            yield f"{place}/{library.name} is a library for {binary.platform}, expected one for {expected}"


def stray(library: Path) -> str:
    """Return in words which exported names are no functions of FMI, empty where there are none."""
    binary = read_binary(library)
    names = sorted(binary.exported - all_functions()) if binary else []
    more = ", ..." if len(names) > 5 else ""
    return f"exports {len(names)} names that are not in FMI: {', '.join(names[:5])}{more}" if names else ""


def own_rules(library: Path) -> Iterator[str]:
    """Yield what is wrong with a library of ours: all functions of FMI and nothing else, on its system's C library."""
    binary = read_binary(library)
    if binary is None:
        yield "is no shared library for Linux, Windows or macOS"
        return
    if text := stray(library):
        yield text
    if missing := sorted(all_functions() - binary.exported):
        yield f"does not export {len(missing)} functions of FMI: {', '.join(missing[:5])}"
    if foreign := sorted(name for name in binary.needed if not is_of_the_system(name)):
        yield f"needs {', '.join(foreign)}, expected the C library alone"
