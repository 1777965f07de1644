"""Ctrl-C, SIGTERM and SIGHUP end a program alike: by an exception between two calls, never in the middle of a write.

    with handled_signals():                       # once, around all that a program does
        ...
        with deferred_interrupts():                    # what must not be left half done
            ...

A signal raises `Interrupted`, a `KeyboardInterrupt`, so that what is cleaned up after Ctrl-C is cleaned up after the
others too. Where a call into foreign code does not return, no exception can be raised; then SIGTERM and SIGHUP end the
process after a grace period, as they would have without a handler.
"""

import _thread
import contextlib
import os
import signal
import sys
import threading
from collections.abc import Iterator
from typing import Any

GRACE = 10.0
"""Time [s] after which SIGTERM and SIGHUP end a process that does not come back from a call."""

_AGAIN = 0.05
"""Time [s] after which a signal comes again whose exception was swallowed."""

_FINAL = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))
_SIGNALS = (signal.SIGINT, *_FINAL)

_depth = 0
_waiting: int | None = None
_noticed = threading.Event()


class Interrupted(KeyboardInterrupt):
    """A signal asks to end; `code` is the exit code that tells so: 130 for Ctrl-C, 143 for SIGTERM, 129 for SIGHUP."""

    def __init__(self, number: int):
        super().__init__()
        self.number, self.code = number, 128 + number

    @property
    def words(self) -> str:
        """What ended the program."""
        return "interrupted" if self.number == signal.SIGINT else f"ended by {signal.Signals(self.number).name}"


@contextlib.contextmanager
def handled_signals() -> Iterator[None]:
    """Raise `Interrupted` on each of the signals that is not ignored (`nohup`, a shell's `&`), until the block is done.

    Only the main thread can hear signals; in others this does nothing.
    """
    if not _is_main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    try:
        for number, handler in before.items():
            if handler is not signal.SIG_IGN:
                signal.signal(number, _handle)
        with _ending_what_does_not_return(), _raising_again():
            yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        _noticed.clear()


@contextlib.contextmanager
def deferred_interrupts() -> Iterator[None]:
    """Put off `Interrupted` until the block is done.

    HDF5 calls back into Python for every write, and an exception there would leave half of a file written.
    """
    global _depth, _waiting
    if not _is_main_thread():
        yield
        return
    _depth += 1
    try:
        yield
    finally:
        _depth -= 1
        if _depth == 0 and _waiting is not None:
            number, _waiting = _waiting, None
            raise Interrupted(number)


def _handle(number: int, _frame: object) -> None:
    """Take a signal; what follows a SIGTERM or SIGHUP does not interrupt the cleaning up, but Ctrl-C does."""
    global _waiting
    if number in _FINAL:
        if _noticed.is_set():
            return
        _noticed.set()
    if _depth:
        _waiting = number
    else:
        raise Interrupted(number)


@contextlib.contextmanager
def _raising_again() -> Iterator[None]:
    """Raise `Interrupted` again where an FMU's callback, or a finalizer, has swallowed it."""
    before = sys.unraisablehook

    def raise_again(unraisable: Any) -> None:
        """Let the signal come again, or do what is done about other exceptions that nobody can catch."""
        if isinstance(unraisable.exc_value, Interrupted):
            _noticed.clear()
            again = threading.Timer(_AGAIN, _thread.interrupt_main, (unraisable.exc_value.number,))
            again.daemon = True
            again.start()
        else:
            before(unraisable)

    sys.unraisablehook = raise_again
    try:
        yield
    finally:
        sys.unraisablehook = before


@contextlib.contextmanager
def _ending_what_does_not_return() -> Iterator[None]:
    """Watch for signals that the main thread, in a call that does not return, cannot take itself."""
    if os.name != "posix":
        yield
        return
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    before = signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    watch = threading.Thread(target=_end_what_does_not_return, args=(reading,), daemon=True)
    watch.start()
    try:
        yield
    finally:
        signal.set_wakeup_fd(before)
        os.close(writing)
        watch.join()
        os.close(reading)


def _end_what_does_not_return(reading: int) -> None:
    """End the process where a signal is not taken within the grace period; signals come as bytes of their numbers."""
    while numbers := os.read(reading, 64):
        final = [number for number in numbers if number in _FINAL]
        if final and not _noticed.wait(GRACE):
            os._exit(128 + final[0])


def _is_main_thread() -> bool:
    """Whether signals are taken in this thread."""
    return threading.current_thread() is threading.main_thread()
