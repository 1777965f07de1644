"""The verb `cache`: what is kept of earlier work, its size, and its removal."""

import re
from collections import Counter
from typing import Annotated

from cyclopts import Parameter

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json

_UNITS = {"": 1, "k": 10**3, "M": 10**6, "G": 10**9, "T": 10**12}


def cache(
    *,
    size: Annotated[bool, Parameter(negative=())] = False,
    clear: Annotated[bool, Parameter(negative=())] = False,
    limit: str | None = None,
    json: Json = False,
) -> int:
    """Tell the folder and the size of the cache of FMUs and other results of work, or make it smaller.

    All of it is made again when it is needed. It is kept below a limit by itself: what was used least recently goes
    first. HFSA_CACHE names another folder.

    Parameters
    ----------
    size
        Tell the size in bytes alone.
    clear
        Remove everything.
    limit
        Largest size, such as 500MB or 20GB: what is beyond it goes now, and from now on.
    """
    from hfsa.components._modelling.cache import cache_folder
    from hfsa.components._modelling.cache_limit import entries, remove, set_limit, trim
    from hfsa.components._modelling.cache_limit import limit as present_limit
    from hfsa.cosim.systems.errors import StructureError

    if size and (clear or limit is not None):
        raise StructureError("--size tells the size and changes nothing; expected it without --clear and --limit")
    removed = []
    if limit is not None:
        set_limit(_bytes(limit))
        removed = trim(present_limit(), spared=0.0)
    if clear:
        removed += [entry for entry in entries() if remove(entry.path)]
    every = entries()
    total = sum(entry.size for entry in every)
    if size:
        _shell.answer({"bytes": total}, str(total), json)
        return _shell.DONE
    counts, sizes = Counter[str](), Counter[str]()
    for entry in every:
        counts[entry.path.parent.name] += 1
        sizes[entry.path.parent.name] += entry.size
    data = {
        "folder": cache_folder(),
        "bytes": total,
        "limit": present_limit(),
        "entries": dict(counts),
        "removed": len(removed),
    }
    lines = [f"{cache_folder()}: {_words(total)} in {len(every)} entries, limit {_words(present_limit())}"]
    lines += [f"  {kind}: {counts[kind]}, {_words(sizes[kind])}" for kind in sorted(counts)]
    if removed:
        lines.append(f"removed: {len(removed)}, {_words(sum(entry.size for entry in removed))}")
    _shell.answer(data, "\n".join(lines), json)
    return _shell.DONE


def _bytes(text: str) -> int:
    """Return a size in bytes; `StructureError` for what is none."""
    from hfsa.cosim.systems.errors import StructureError

    found = re.fullmatch(r"(\d+(?:\.\d+)?)\s*([kMGT]?)B?", text.strip())
    if not found:
        raise StructureError(f"--limit {text!r} is no size, expected one such as 500MB or 20GB")
    return int(float(found[1]) * _UNITS[found[2]])


def _words(size: int) -> str:
    """Return a size in words."""
    unit = next((unit for unit in ("T", "G", "M", "k") if size >= _UNITS[unit]), "")
    return f"{size / _UNITS[unit]:.3g} {unit}B"
