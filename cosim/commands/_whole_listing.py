"""The listing of all parts and scenes, kept in the cache, because making it builds the model of every part.

It is made from the sources of both wings and a few libraries, whose hash is its name. With parts or scenes of other
packages, whose sources nobody knows, it is made anew each time; so is one that has an error in it.
"""

import contextlib
import hashlib
import json
import platform
from importlib.metadata import entry_points, version
from typing import Any

from hfsa.components._modelling.cache import cache_folder, keep
from hfsa.components._modelling.errors import ModelError
from hfsa.cosim.assembly.sources import all_sources
from hfsa.cosim.commands import _shell

_LIBRARIES = ("casadi", "numpy", "scipy")
_GROUPS = ("hfsa.parts", "hfsa.scenes")


def whole_listing() -> tuple[dict[str, Any], str]:
    """Return the listing of all parts and scenes as plain data and as text."""
    if any(entry_points(group=group) for group in _GROUPS):
        return _made()
    words = [all_sources(), platform.python_version(), *map(version, _LIBRARIES)]
    file = cache_folder() / "listings" / f"{hashlib.sha256(' '.join(words).encode()).hexdigest()[:32]}.json"
    try:
        data, text = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        data, text = _made()
        if not any("error" in entry for entries in data.values() for entry in entries):
            with contextlib.suppress(OSError, ModelError):  # a cache that cannot be written costs time alone
                keep(json.dumps([data, text]).encode(), file)
    return data, text


def _made() -> tuple[dict[str, Any], str]:
    """Return the listing, made now."""
    from hfsa.cosim.commands._listing import listing, listing_text

    data = listing()
    return _shell.plain(data), listing_text(data)
