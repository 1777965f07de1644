"""The verb `cache`: what is kept of earlier work, its size, and its removal."""

import re
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from hfsa.cosim.commands import _shell
from hfsa.cosim.commands._json import Json

if TYPE_CHECKING:
    from hfsa.components._modelling.cache_limit import Entry

_UNITS = {"": 1, "k": 10**3, "M": 10**6, "G": 10**9, "T": 10**12}


def cache(
    *,
    size: Annotated[bool, Parameter(negative=(), show_default=False)] = False,
    clear: Annotated[bool, Parameter(negative=(), show_default=False)] = False,
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
    if size:
        total = sum(entry.size for entry in entries())
        _shell.answer({"bytes": total}, str(total), json)
    else:
        data, text = _told(entries(), removed)
        _shell.answer(data, text, json)
    return _shell.DONE


def _told(every: "list[Entry]", removed: "list[Entry]") -> tuple[dict[str, Any], str]:
    """Return what is in the cache and what was removed, as data and as text."""
    from hfsa.components._modelling.cache import cache_folder
    from hfsa.components._modelling.cache_limit import limit

    kinds = sorted({entry.path.parent.name for entry in every})
    grouped = {kind: [entry.size for entry in every if entry.path.parent.name == kind] for kind in kinds}
    total = sum(entry.size for entry in every)
    lines = [f"{cache_folder()}: {_words(total)} in {len(every)} entries, limit {_words(limit())}"]
    lines += [f"  {kind}: {len(sizes)}, {_words(sum(sizes))}" for kind, sizes in grouped.items()]
    if removed:
        lines.append(f"removed: {len(removed)}, {_words(sum(entry.size for entry in removed))}")
    data = {
        "folder": cache_folder(),
        "bytes": total,
        "limit": limit(),
        "entries": {kind: len(sizes) for kind, sizes in grouped.items()},
        "removed": len(removed),
    }
    return data, "\n".join(lines)


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
