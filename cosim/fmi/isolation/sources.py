"""Sources of the library that stands in for FMUs, and what it is called when it is compiled.

`setup.py` runs this file by itself, before anything is installed: nothing of the package may be imported here.
"""

import hashlib
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

FOLDER = Path(__file__).parent
"""The folder of the sources."""

FLAGS = ("-O2", "-std=c99", "-fvisibility=hidden")
"""What an installation compiles them with; at first use it is what FMUs are compiled with."""

LINKED = ("dl", "pthread")
"""System libraries that it is linked with, where they are not part of the C library."""


def sources() -> dict[str, str]:
    """Return all files that the library is made of, text by name."""
    return {file.name: file.read_text(encoding="utf-8") for file in sorted(FOLDER.glob("*.[ch]"))}


def library_name() -> str:
    """Return the name of the library of these sources, without an ending."""
    return f"_stand_in_{hashlib.sha256(''.join(sources().values()).encode()).hexdigest()[:12]}"


def installed_library() -> Path | None:
    """Return the library that was compiled when the package was installed, if there is one of these sources."""
    candidates = (FOLDER / f"{library_name()}{suffix}" for suffix in EXTENSION_SUFFIXES)
    return next((file for file in candidates if file.is_file()), None)
