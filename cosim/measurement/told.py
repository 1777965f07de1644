"""Warnings of FMUs: how often each instance warned, with its first sentence, for the file and for the user.

total = {}
for point in points:
add(total, point.warnings)              # of a master: `told`
sentences(total)                            # {"valve": "valve: fmi2DoStep: warning at ...; 12 times in all"}
"""

from collections.abc import Mapping
from dataclasses import replace

from hfsa.cosim.masters.master import Master
from hfsa.cosim.results.records import Point

Told = Mapping[str, tuple[int, str]]
"""Number and first sentence of warnings by a key, number 0 for what the algorithm says of an instance."""


def add(total: dict[str, tuple[int, str]], told: Told) -> None:
    """Add warnings to a total, whose first sentences stay."""
    for key, (count, sentence) in told.items():
        before, first = total.get(key, (0, sentence))
        total[key] = before + count, first


def sentences(told: Told) -> dict[str, str]:
    """Return a sentence for each key."""
    return {key: f"{text}; {n} times in all" if n > 1 else text for key, (n, text) in told.items()}


def with_warnings(point: Point, master: Master) -> Point:
    """Return a point with the warnings of its run."""
    return replace(point, warnings=dict(master.told))
