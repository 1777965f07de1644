"""Branches of a sweep that followed them, as data and as text: where both sweeps differ, and where each one jumps."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from hfsa.cosim.results.files import Bode
from hfsa.cosim.signals.branches import DIFFERENT, JUMP_DOWN, JUMP_UP


def branches_data(bode: Bode) -> list[dict[str, Any]] | None:
    """Return ranges [Hz] by input, lowest and highest frequency each; `None` where no branches were followed."""
    if bode.downward is None:
        return None
    f, found = bode.frequency, []
    for i, source in enumerate(bode.inputs):
        flags = bode.downward.branches[:, i]
        up, down = np.flatnonzero(flags & JUMP_UP), np.flatnonzero(flags & JUMP_DOWN)
        edges = np.flatnonzero(np.diff([0, *((flags & DIFFERENT) > 0), 0]))
        found.append(
            {
                "input": source.name,
                "different": [[f[first], f[end - 1]] for first, end in edges.reshape(-1, 2)],
                "jumps_upwards": [[f[k - 1], f[k]] for k in up],
                "jumps_downwards": [[f[k], f[k + 1]] for k in down],
            }
        )
    return found


def branches_lines(data: Sequence[Mapping[str, Any]] | None) -> Iterable[str]:
    """Yield the lines of inputs whose branches differ."""
    for entry in data or ():
        if not entry["different"]:
            yield f"  {entry['input']}: upwards and downwards the same response"
            continue
        parts = [f"two branches at {_ranges(entry['different'], 'to')}"]
        for way in ("upwards", "downwards"):
            if jumps := entry[f"jumps_{way}"]:
                parts.append(f"{way} it jumps between {_ranges(jumps, 'and')}")
        yield f"  {entry['input']}: {'; '.join(parts)}"


def _ranges(ranges: Sequence[Sequence[float]], word: str) -> str:
    """Return ranges as text; a range of one frequency is that frequency."""
    return ", ".join(f"{a:.6g} {word} {b:.6g} Hz" if a != b else f"{a:.6g} Hz" for a, b in ranges)
