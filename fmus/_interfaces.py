"""What FMI requires of a binary: its path in an FMU, and its functions, from the headers of the standard."""

import re
from functools import cache
from pathlib import Path

import fmpy

from hfsa.fmus._platforms import HERE

INTERFACES = ("ModelExchange", "CoSimulation")
"""XML elements of the interfaces that are checked."""

HEADERS = Path(fmpy.__file__).parent / "c-code"
"""Folder of the headers of the FMI standard, part of fmpy."""

_SECTION = re.compile(
    r"^(?:Common Functions|Functions for .*?(Model Exchange|Co-Simulation|Scheduled Execution))", re.MULTILINE
)
_DEFINE = re.compile(r"^#define (fmi\d\w+)\s+fmi\dFullName\(", re.MULTILINE)


def binary_path(folder: Path, version: int, identifier: str) -> Path:
    """Return the path of this platform's binary with a model identifier, by FMI version."""
    path = HERE.path(version, identifier)
    assert path is not None  # fmpy gives every platform a name of FMI 2
    return folder / path


@cache
def functions(version: int) -> dict[str, frozenset[str]]:
    """Return the FMI functions of a major version by interface, each with the common functions."""
    text = (HEADERS / f"fmi{version}Functions.h").read_text(encoding="utf-8")
    common: set[str] = set()
    special: dict[str, set[str]] = {"ModelExchange": set(), "CoSimulation": set(), "ScheduledExecution": set()}
    sections = list(_SECTION.finditer(text))
    for section, end in zip(sections, [s.start() for s in sections[1:]] + [len(text)], strict=True):
        interface = (section[1] or "").replace("-", "").replace(" ", "")
        for name in _DEFINE.findall(text[section.end() : end]):
            of = re.fullmatch(r"fmi3Instantiate(\w+)", name)
            special.get(of[1] if of else interface, common).add(name)
    return {interface: frozenset(common | names) for interface, names in special.items()}


def all_functions() -> frozenset[str]:
    """Return all functions of FMI 2 and FMI 3, Scheduled Execution included: the exports of our own binaries."""
    return frozenset().union(*functions(2).values(), *functions(3).values())
