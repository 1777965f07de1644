"""Libraries of ours in C, compiled at first use and kept in the cache.

A library appears in the cache complete or not at all, so that several processes may compile at once and any may be
killed.
"""

import os
import sysconfig
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from hfsa.components._modelling.cache import cache_folder, cache_subfolder
from hfsa.fmus.compile import SUFFIX, compile_files


def compiled(folder: str, name: str, sources: Mapping[str, str], link_flags: Sequence[str] = ()) -> Path:
    """Return a library of a folder of the cache, compiled now where it is not there; errors as of `compile_files`.

    `name` tells sources apart; they are texts by file name.
    """
    library = cache_folder() / folder / f"{name}-{sysconfig.get_platform()}{SUFFIX}"
    if not library.is_file():
        with tempfile.TemporaryDirectory(prefix=".unfinished-", dir=cache_subfolder(folder)) as scratch:
            unfinished = Path(scratch, library.name)
            compile_files(sources, unfinished, link_flags=link_flags)
            os.replace(unfinished, library)
    return library
