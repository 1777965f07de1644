"""Handlers of Ctrl-C, SIGTERM and SIGHUP: each raises an exception between two calls, never in the middle of a write.

    with handled_signals():                 # once, around the whole program
        ...
        with deferred_interrupts():         # around a write that must be complete
            ...

Each signal raises `Interrupted`, a subclass of `KeyboardInterrupt`, so that the cleanup after Ctrl-C also runs after
the others. Where a call into foreign code does not return, no exception can be raised; SIGTERM and SIGHUP then end the
process after a grace period.
"""

import _thread
import contextlib
import math
import os
import select
import signal
import sys
import threading
import time
from collections.abc import Iterator
from typing import Any

GRACE = 10.0
"""Time [s] after which SIGTERM and SIGHUP end a process whose main thread does not return from a call."""

TWICE = 2.0
"""Time [s] after the second signal at which the process is ended, whatever it is doing."""

_AGAIN = 0.05
"""Time [s] after which a signal is raised again if its exception was swallowed."""

_FINAL = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))
_SIGNALS = (signal.SIGINT, *_FINAL)

_depth = 0
_pending: int | None = None
_repeated = 0
_handled = threading.Event()


class Interrupted(KeyboardInterrupt):
    """Request to end the program; `code` is its exit code: 130 for Ctrl-C, 143 for SIGTERM, 129 for SIGHUP."""

    def __init__(self, number: int):
        super().__init__()
        self.number, self.code = number, 128 + number

    @property
    def description(self) -> str:
        """Description of the signal for a message."""
        return "interrupted" if self.number == signal.SIGINT else f"ended by {signal.Signals(self.number).name}"


@contextlib.contextmanager
def handled_signals() -> Iterator[None]:
    """Raise `Interrupted` on each signal within the block, unless it is ignored (`nohup`, `&` of a shell).

    Only the main thread receives signals; in other threads this does nothing.
    """
    if not _is_main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    try:
        for number, handler in before.items():
            if handler is not signal.SIG_IGN:
                signal.signal(number, _handle)
        with _watchdog(), _raising_again():
            yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        _handled.clear()


def is_pending() -> bool:
    """Whether a signal waits for the end of a block of `deferred_interrupts`."""
    return _pending is not None


@contextlib.contextmanager
def deferred_interrupts() -> Iterator[None]:
    """Raise `Interrupted` at the end of the block instead of within it.

    HDF5 calls Python for every write; an exception there would leave a file half written.
    """
    global _depth, _pending
    if not _is_main_thread():
        yield
        return
    _depth += 1
    try:
        yield
    finally:
        _depth -= 1
        if _depth == 0 and _pending is not None:
            number, _pending = _pending, None
            raise Interrupted(number)


def _handle(number: int, _frame: object) -> None:
    """Handle a signal; a second SIGTERM or SIGHUP does not interrupt the cleanup after the first, Ctrl-C does."""
    global _pending
    if number in _FINAL:
        if _handled.is_set():
            return
        _handled.set()
    if _depth:
        _pending = number
    else:
        raise Interrupted(number)


@contextlib.contextmanager
def _raising_again() -> Iterator[None]:
    """Raise `Interrupted` again where a callback of an FMU, or a finalizer, swallowed it."""
    before = sys.unraisablehook

    def raise_again(unraisable: Any) -> None:
        """Send the signal again; other exceptions that cannot be caught go to the hook before."""
        if isinstance(unraisable.exc_value, Interrupted):
            _handled.clear()
            again = threading.Timer(_AGAIN, _repeat, (unraisable.exc_value.number,))
            again.daemon = True
            again.start()
        else:
            before(unraisable)

    sys.unraisablehook = raise_again
    try:
        yield
    finally:
        sys.unraisablehook = before


def _repeat(number: int) -> None:
    """Send a signal to this process again, which is not a second one."""
    global _repeated
    _repeated += 1
    _thread.interrupt_main(signal.Signals(number))


@contextlib.contextmanager
def _watchdog() -> Iterator[None]:
    """Watch for signals that the main thread cannot handle, being in a call that does not return."""
    if os.name != "posix":
        yield
        return
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    before = signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    watch = threading.Thread(target=_watch, args=(reading,), daemon=True)
    watch.start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(before)
        os.close(writing)
        watch.join()
        os.close(reading)


def _watch(reading: int) -> None:
    """End the process `GRACE` after a signal that is not handled, and `TWICE` after a second one.

    Each signal arrives as a byte, its number.
    """
    first, count, end, last = 0, _repeated, math.inf, math.inf
    while True:
        left = min(end, last) - time.monotonic()
        if not select.select([reading], [], [], None if left == math.inf else max(left, 0))[0]:
            if time.monotonic() >= last or not _handled.is_set():
                os._exit(128 + first)
            end = math.inf
            continue
        if not (numbers := os.read(reading, 64)):
            return
        arrived = [number for number in numbers if number in _SIGNALS]
        first, count = first or next(iter(arrived), 0), count + len(arrived)
        if not _handled.is_set() and any(number in _FINAL for number in arrived):
            end = min(end, time.monotonic() + GRACE)
        if count - _repeated > 1:
            last = min(last, time.monotonic() + TWICE)


def _is_main_thread() -> bool:
    """Whether this is the main thread, which receives signals."""
    return threading.current_thread() is threading.main_thread()
