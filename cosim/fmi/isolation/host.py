"""Host process of one instance: started, ended, and the words for how it has ended."""

import contextlib
import ctypes
import os
import signal
import subprocess
import sys
import tempfile
from ctypes import byref, c_int, c_size_t, c_void_p
from functools import cache
from pathlib import Path

from hfsa.cosim.fmi.isolation.waiting import OVERDUE, catch_interruptions, patience

_SHARED = 1 << 26
"""Size of the shared memory [byte], of which only what is used costs memory; the largest that one call can move."""

_LOOKS = 3000
"""Number of looks at a counter before sleeping, some 100 microseconds, where another processor can change it."""

_GRACE = 1.0
"""Time [s] for a host to end after its last call."""

_SERVE = (
    "import ctypes, sys; library, binary, *numbers = sys.argv[1:]; n = [int(number) for number in numbers]; "
    "ctypes.CDLL(library).hfsa_serve(binary.encode(), n[0], ctypes.c_size_t(n[1]), *n[2:])"
)
"""The program of a host: nothing but the library and what it serves."""


@cache
def client(library: Path) -> ctypes.CDLL:
    """Return the library that stands in for FMUs, loaded once per process."""
    loaded = ctypes.CDLL(str(library))
    loaded.hfsa_set_patience(patience)
    loaded.hfsa_attach.argtypes = [c_int, c_int, c_size_t, c_int, c_int, c_int]
    loaded.hfsa_words.argtypes, loaded.hfsa_words.restype = [c_void_p, ctypes.POINTER(c_size_t)], c_void_p
    loaded.hfsa_ending.argtypes = loaded.hfsa_is_instance.argtypes = loaded.hfsa_detach.argtypes = [c_void_p]
    return loaded


class Host:
    """Process for one instance of an FMU's binary, in a session of its own; the next instantiation is in it.

    Working folder and environment are those of this process, standard input is empty, and what it prints is kept for a
    message. It ends with this process, however that ends.
    """

    def __init__(self, library: Path, binary: Path):
        self._client = client(library)
        catch_interruptions()
        looks = _LOOKS if _processors() > 1 else 0
        with contextlib.ExitStack() as stack:
            memory = _memory()
            stack.callback(os.close, memory)
            from_client, to_host = os.pipe()
            from_host, to_client = os.pipe()
            self._printed, prints = os.pipe()
            for end in (from_client, to_client, prints):
                stack.callback(os.close, end)
            served = (self._printed, from_client, to_client, memory)
            numbers = (memory, _SHARED, from_client, to_client, self._printed, looks)
            self._process = subprocess.Popen(
                [sys.executable, "-I", "-S", "-c", _SERVE, str(library), str(binary), *map(str, numbers)],
                stdin=subprocess.DEVNULL,
                stdout=prints,
                stderr=prints,
                pass_fds=served,
                start_new_session=True,
            )
            if self._client.hfsa_attach(self._process.pid, memory, _SHARED, to_host, from_host, looks):
                raise MemoryError(f"no memory can be shared with the process of {binary.name}")
        os.set_blocking(self._printed, False)

    def end(self, address: int) -> None:
        """End the process of the instance at an address, which is freed, and all processes that it has started."""
        self._client.hfsa_detach(address)
        os.close(self._printed)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_GRACE)
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()

    def ending(self, address: int) -> str:
        """Return how the process of the instance at an address has ended, and the last of what it printed."""
        if self._client.hfsa_ending(address) == OVERDUE:
            how = "its call did not return within the time limit"
        else:
            code = self._process.wait()
            how = f"its process {_how(code)}"
        printed = self._words(address)
        return f"{how} (it printed: {printed})" if printed else how

    def _words(self, address: int) -> str:
        """Return the last line of what the process printed."""
        n = c_size_t()
        kept = ctypes.string_at(self._client.hfsa_words(address, byref(n)), n.value)
        with contextlib.suppress(BlockingIOError):
            while more := os.read(self._printed, 1 << 16):
                kept += more
        lines = [line.strip() for line in kept.decode(errors="replace").splitlines() if line.strip()]
        return lines[-1][-200:] if lines else ""


def _how(code: int) -> str:
    """Return the words for a return code of a process."""
    if code >= 0:
        return f"ended itself with exit code {code}"
    try:
        return f"was ended by {signal.Signals(-code).name}"
    except ValueError:
        return f"was ended by signal {-code}"


def _memory() -> int:
    """Return a file of shared memory, which has no name."""
    if hasattr(os, "memfd_create"):
        file = os.memfd_create("hfsa")
    else:
        with tempfile.TemporaryFile() as temporary:
            file = os.dup(temporary.fileno())
    os.ftruncate(file, _SHARED)
    return file


def _processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
