"""Where the library comes from that stands in for foreign FMUs: compiled at install, else at first use."""

import os
import sys
from functools import cache
from pathlib import Path

from hfsa.cosim.assembly.compiled import compiled
from hfsa.cosim.fmi.isolation.sources import LINKED, installed_library, library_name, sources
from hfsa.fmus.errors import ExportError


@cache
def isolation_library() -> Path | None:
    """Return the library by which foreign FMUs run in processes of their own; `None` on Windows, which has no such.

    `ExportError` where it is not there and cannot be compiled.
    """
    if os.name != "posix":
        return None
    linked = [f"-l{name}" for name in LINKED] if sys.platform == "linux" else []
    try:
        return installed_library() or compiled("isolation", library_name(), sources(), linked)
    except ExportError as error:
        message = "foreign FMUs run in processes of their own, whose library is compiled at first use"
        raise ExportError(f"{message}: {error}") from error
