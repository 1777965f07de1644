"""Processes that left the session of the FMU that started them: on Linux they are adopted, and end with the command.

    with escaped_processes_ended():
        ...

Where the parent of a process ends, the system gives it to the next ancestor that takes orphans, which this process is
within the block. What it started itself is in its own session, and is left alone.
"""

import contextlib
import ctypes
import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

_TAKE_ORPHANS = 36
"""What Linux calls PR_SET_CHILD_SUBREAPER."""

_ROUNDS = 5
"""How often descendants are looked for, as one can start another before it ends."""


class _Process(NamedTuple):
    """A process: its number, its parent's, and its session."""

    number: int
    parent: int
    session: int


@contextlib.contextmanager
def escaped_processes_ended() -> Iterator[None]:
    """End, after the block, all descendants of this process in other sessions; elsewhere than on Linux do nothing."""
    if sys.platform != "linux" or ctypes.CDLL(None).prctl(_TAKE_ORPHANS, 1, 0, 0, 0):
        yield
        return
    try:
        yield
    finally:
        for _ in range(_ROUNDS):
            if not _end(_escaped()):
                break
        ctypes.CDLL(None).prctl(_TAKE_ORPHANS, 0, 0, 0, 0)


def _escaped() -> list[int]:
    """Return the descendants of this process that live in other sessions."""
    processes = [process for entry in os.scandir("/proc") if entry.name.isdigit() and (process := _process(entry.name))]
    family, found = {os.getpid()}, True
    while found:
        found = {p.number for p in processes if p.parent in family} - family
        family |= found
    own = os.getsid(0)
    return [p.number for p in processes if p.number in family and p.session != own]


def _process(name: str) -> _Process | None:
    """Return a living process by the name of its folder."""
    try:
        state, parent, _, session = Path("/proc", name, "stat").read_text().rpartition(")")[2].split()[:4]
    except (OSError, ValueError):
        return None
    return None if state in "ZX" else _Process(int(name), int(parent), int(session))


def _end(numbers: list[int]) -> bool:
    """End processes; return whether there were any."""
    for number in numbers:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.kill(number, signal.SIGKILL)
    for number in numbers:
        with contextlib.suppress(ChildProcessError):  # a child of another one
            os.waitpid(number, 0)
    return bool(numbers)
