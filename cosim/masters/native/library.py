"""The compiled loop in C: its functions by name, once it has been seen to lay structures out as its headers say.

The library is compiled at install (`setup.py`) or at first use (`assembly/native_loop.py`); its name has a hash of its
sources, so that a library of others is never taken. `Library.load` compares every size and place all the same: a
compiler that lays structures out in a way of its own would be found here, not by memory that it overwrites.
"""

from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import Any

import numpy as np

from hfsa.cosim.masters.native import headers

_ITEMS = {"double": np.dtype(float), "size_t": np.dtype(np.uintp)}


class LibraryError(RuntimeError):
    """A library that is not what the headers say; the message names the structure or function."""


class Library:
    """The loaded library.

    Attributes:
        ffi: makes structures, as the headers state them.
        c: functions and words of the headers, by their names there.
        arrays: type of an array and what numpy calls its numbers, by the type of pointers to them.
    """

    def __init__(self, file: Path):
        self.ffi = _headers()
        self.c: Any = self.ffi.dlopen(str(file))
        self._check(file)
        self._fields: dict[str, dict[str, Any]] = {}
        kinds = {item: self.ffi.typeof(f"{item}[]") for item in _ITEMS}
        self.arrays = {self.ffi.typeof(f"{item} *"): (kinds[item], dtype) for item, dtype in _ITEMS.items()}

    @staticmethod
    @cache
    def load(file: Path) -> "Library":
        """Load a library once per process; `LibraryError` where it is not what the headers say."""
        return Library(file)

    def fields(self, structure: str) -> dict[str, Any]:
        """Return the types of a structure's fields, by name."""
        if structure not in self._fields:
            self._fields[structure] = {name: field.type for name, field in self.ffi.typeof(structure).fields}
        return self._fields[structure]

    def _check(self, file: Path) -> None:
        """Raise `LibraryError` for the first difference from the headers."""
        for name in dir(self.c):
            try:
                getattr(self.c, name)
            except AttributeError:
                raise LibraryError(f"{file.name} has no {name}, which its headers declare") from None
        expected, found = headers.sizes(self.ffi), self._sizes()
        for name in dict.fromkeys([*expected, *found]):
            if expected.get(name) != found.get(name):
                structure = name.partition(".")[0]
                raise LibraryError(
                    f"{file.name} was compiled with another {structure} than its headers state: {name} is "
                    f"{found.get(name)}, expected {expected.get(name)}"
                )

    def _sizes(self) -> dict[str, int]:
        """Return `headers.sizes` by the compiler's account."""
        found, i = {}, 0
        while name := self.c.hfsa_sizes[i].name:
            found[self.ffi.string(name).decode()] = self.c.hfsa_sizes[i].value
            i += 1
        return found


def installed_library() -> Path | None:
    """Return the library that was compiled when the package was installed, if there is one of these sources."""
    name = headers.library_name()
    candidates = (headers.FOLDER / f"{name}{suffix}" for suffix in EXTENSION_SUFFIXES)
    return next((file for file in candidates if file.is_file()), None)


@cache
def _headers() -> Any:
    """Return what the headers declare, read once."""
    return headers.read()
