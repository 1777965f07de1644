"""Where the stepping loop in C comes from: compiled at install, else at first use, by the compiler that FMUs get.

It stands on the roof, as `assembly/fmu_cache.py` does: only there is the exporter's compiler in
sight.
"""

from collections.abc import Callable
from pathlib import Path

from hfsa.cosim.assembly.compiled import compiled
from hfsa.cosim.masters.native.headers import library_name, sources
from hfsa.cosim.masters.native.library import installed_library
from hfsa.fmus.errors import ExportError

BACKENDS = ("c", "python")
"""The stepping loops; both do the same, bit for bit."""


def stepping_library() -> Path:
    """Return the library of the loop in C, compiled now where there is none; `ExportError` as `compile_files`."""
    installed = installed_library()
    if installed is not None:
        return installed
    return compiled("loop", library_name(), sources())


def chosen_loop(backend: str, warn: Callable[[str], None]) -> Path | None:
    """Return the library of the loop in C; `None` for the one in Python, after a warning where it was not chosen."""
    if backend == "python":
        return None
    try:
        return stepping_library()
    except ExportError as error:
        warn(f"the stepping loop runs in Python, several times slower than in C: {error}")
        return None
