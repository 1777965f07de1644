"""The headers of the loop in C as Python reads them: no structure, word or function of theirs is stated twice.

    ffi = read()
    sizes(ffi)["Loop.bus"]          # where a field is, as cffi lays structures out
    sources()["sizes.c"]            # the same for a C compiler to say, in a file that is written for it

`setup.py` runs this file by itself, before anything is installed: nothing of the package may be imported here.
"""

import hashlib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cffi import FFI

FOLDER = Path(__file__).parent
"""The folder of the sources."""

FLAGS = ("-O2", "-std=c99", "-fvisibility=hidden", "-ffp-contract=off")
"""What an installation compiles them with; at first use it is what FMUs are compiled with."""

_NOT_DECLARED = re.compile(r"/\*.*?\*/|^#.*?$|^static inline .*?^}$|^EXPORT ", re.DOTALL | re.MULTILINE)
"""What says nothing of layouts: comments, the preprocessor's lines, functions that have a body, and a linker's word."""


def sources(folder: Path = FOLDER) -> dict[str, str]:
    """Return all files that the library is made of, text by name, with the one that is written from the headers."""
    files = {file.name: file.read_text(encoding="utf-8") for file in sorted(folder.glob("*.[ch]"))}
    return {**files, "sizes.c": _sizes_file(folder)}


def library_name(folder: Path = FOLDER) -> str:
    """Return the name of the library of these sources, without an ending."""
    files = [*sorted(folder.glob("*.[ch]")), folder / "headers.py"]
    return f"_step_{hashlib.sha256(b''.join(file.read_bytes() for file in files)).hexdigest()[:12]}"


def read(folder: Path = FOLDER) -> FFI:
    """Return what all headers declare."""
    ffi = FFI()
    for text in _in_order(folder):
        ffi.cdef(_NOT_DECLARED.sub("", text))
    return ffi


def sizes(ffi: FFI) -> dict[str, int]:
    """Return the size of each structure, where its fields are, and the number of each word: `Size` of sizes.h."""
    found: dict[str, int] = {}
    for name, kind in _kinds(ffi):
        if kind.kind == "struct":
            found[name] = ffi.sizeof(kind)
            found |= {f"{name}.{field}": place.offset for field, place in kind.fields}
        else:
            found |= kind.relements
    return found


def _kinds(ffi: FFI) -> Iterator[tuple[str, Any]]:
    """Yield (name, type) of each structure and each list of words."""
    for name in ffi.list_types()[0]:
        pointer = ffi.typeof(f"{name} *")
        if pointer.kind == "pointer":  # not a function
            yield name, pointer.item


def _in_order(folder: Path) -> Iterator[str]:
    """Yield the text of each header once, behind those that it includes."""
    done = set()

    def after_others(file: Path) -> Iterator[str]:
        """Yield what a header includes, then the header."""
        if file not in done:
            done.add(file)
            text = file.read_text(encoding="utf-8")
            for included in re.findall(r'^#include "(.+)"$', text, re.MULTILINE):
                yield from after_others(folder / included)
            yield text

    for file in sorted(folder.glob("*.h")):
        yield from after_others(file)


def _sizes_file(folder: Path) -> str:
    """Return the C file in which a compiler gives its own account of `sizes`."""
    rows = []
    for name, kind in _kinds(read(folder)):
        if kind.kind == "struct":
            rows.append((name, f"sizeof({name})"))
            rows += [(f"{name}.{field}", f"offsetof({name}, {field})") for field, _ in kind.fields]
        else:
            rows += [(word, word) for word in kind.relements]
    headers = "".join(f'#include "{file.name}"\n' for file in sorted(folder.glob("*.h")))
    lines = "".join(f'  {{"{name}", {value}}},\n' for name, value in rows)
    return f"{headers}\nconst Size hfsa_sizes[] = {{\n{lines}  {{0, 0}},\n}};\n"
