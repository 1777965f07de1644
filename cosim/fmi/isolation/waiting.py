"""Waiting for a call of an FMU in another process: until when, and what may end it before.

    with limited(10.0), interrupted_by(is_stopping):
        ...                                            # a call that hangs ends with a status

A thread that waits for longer than a tenth of a second asks `patience` from time to time. Python handles a signal when
that is asked, because no other code of the thread runs meanwhile.
"""

import contextlib
import ctypes
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

LOST, INTERRUPTED, OVERDUE, NOT_LOADED = 110, 111, 112, 113
"""Statuses of a call beside those of FMI, as `channel.h` has them."""

_GO_ON = 1


class _Waiting(threading.local):
    """What ends the waiting of one thread."""

    deadline = float("inf")
    interruption: KeyboardInterrupt | None = None

    def __init__(self):
        self.checks: list[Callable[[], bool]] = []


_waiting = _Waiting()


@contextlib.contextmanager
def limited(seconds: float | None) -> Iterator[None]:
    """Context in which calls of FMUs in other processes end after a time [s] from here; `None` for no limit."""
    before = _waiting.deadline
    if seconds is not None:
        _waiting.deadline = min(before, time.monotonic() + seconds)
    try:
        yield
    finally:
        _waiting.deadline = before


@contextlib.contextmanager
def interrupted_by(check: Callable[[], bool]) -> Iterator[None]:
    """Context in which a call ends as by Ctrl-C where a function returns true."""
    _waiting.checks.append(check)
    try:
        yield
    finally:
        _waiting.checks.remove(check)


def is_overdue() -> bool:
    """Whether the time limit of this thread is over."""
    return time.monotonic() > _waiting.deadline


def interruption() -> KeyboardInterrupt:
    """Return what has ended a call with the status `INTERRUPTED`."""
    found, _waiting.interruption = _waiting.interruption, None
    return found or KeyboardInterrupt()


def _patience() -> int:
    """Return 1 to go on waiting, else the status that the call ends with."""
    if _waiting.interruption is not None:
        return INTERRUPTED
    try:
        if any(check() for check in _waiting.checks):
            return INTERRUPTED
        return OVERDUE if is_overdue() else _GO_ON
    except KeyboardInterrupt as found:
        _waiting.interruption = found
        return INTERRUPTED


patience = ctypes.CFUNCTYPE(ctypes.c_int)(_patience)
"""`_patience` for C; its answer is undefined where an exception is raised before its first line, as a signal does."""


def catch_interruptions() -> None:
    """Keep the exception of a signal that arrives as `patience` is asked, which ctypes cannot raise."""
    before = sys.unraisablehook
    if getattr(before, "keeps", None) is patience:
        return

    def keep(unraisable: Any) -> None:
        """Keep an interruption of `patience`; others go to the hook before."""
        if unraisable.object is _patience and isinstance(unraisable.exc_value, KeyboardInterrupt):
            _waiting.interruption = unraisable.exc_value
        else:
            before(unraisable)

    keep.keeps = patience  # type: ignore[attr-defined]
    sys.unraisablehook = keep
