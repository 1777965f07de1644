"""Who writes a results file: a text of fixed length in the file, which messages and file systems without locks need.

    sign(file)                          # a file of h5py, open for writing
    writer = writer_of(raw)             # of a file that another process may have open; None where it does not say
    writer.description                  # "hfsa sweep stage -o c.h5" (process 4711 on node7 since ...)

No lock is taken to read it.
"""

import contextlib
import json
import os
import socket
import sys
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, Any

WRITER = "writer"
"""Attribute of the file."""

_LENGTH = 400
"""Length of the attribute [byte]; a longer command is cut."""


@dataclass(frozen=True)
class Writer:
    """Process that has a file open for writing, or had: its number, machine, start and command.

    `started` is the start of the process in units of its system, 0 where that is unknown; two processes of one number
    differ in it.
    """

    process: int
    machine: str
    started: int
    since: str
    command: str

    @property
    def description(self) -> str:
        """Description for a message."""
        return f'"{self.command}" (process {self.process} on {self.machine} since {self.since})'

    @property
    def is_here(self) -> bool:
        """Whether the process runs, or ran, on this machine."""
        return self.machine == socket.gethostname()

    @property
    def is_alive(self) -> bool:
        """Whether the process lives, if it is one of this machine."""
        return is_alive(self.process, self.started)

    @property
    def is_self(self) -> bool:
        """Whether it is this process."""
        return self.is_here and self.process == os.getpid() and self.started == started(os.getpid())


def signature() -> bytes:
    """Return the text of this process, of fixed length so that it can be overwritten in place."""
    words = " ".join([Path(sys.argv[0]).name, *sys.argv[1:]])[:_LENGTH].encode(errors="replace").decode()
    since = datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
    facts = [os.getpid(), socket.gethostname()[:64], started(os.getpid()), since]
    text = json.dumps([*facts, words])
    while len(text) > _LENGTH:
        words = words.removesuffix("...")[:-8] + "..."
        text = json.dumps([*facts, words])
    return text.ljust(_LENGTH).encode()


def sign(file: Any) -> None:
    """Write who this process is into a file of h5py, in place where it has the text already."""
    import numpy as np

    text = np.bytes_(signature())
    if WRITER in file.attrs:
        file.attrs.modify(WRITER, text)
    else:
        file.attrs.create(WRITER, text, dtype=f"S{_LENGTH}")


def writer_of(raw: IO[bytes]) -> Writer | None:
    """Return the writer of a file by an open file object, which takes no lock; `None` where the file does not say."""
    import h5py

    with contextlib.suppress(Exception), h5py.File(raw, "r") as opened:
        file: Any = opened  # anything is raised where a file is being made
        return Writer(*json.loads(bytes(file.attrs[WRITER])))
    return None


def is_unfinished(raw: IO[bytes]) -> bool:
    """Whether the file says that its writer has not closed it."""
    import h5py

    with contextlib.suppress(Exception), h5py.File(raw, "r") as opened:
        file: Any = opened
        return bytes(file.attrs["status"]).rstrip(b"\0") == b"running"
    return False


def is_alive(process: int, start: int) -> bool:
    """Whether a process of this machine lives, by its number and its start, 0 where that is unknown."""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return start in (0, started(process))


def started(process: int) -> int:
    """Return the start of a process, 0 where the system does not tell."""
    try:
        return int(Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[19])
    except (OSError, ValueError, IndexError):
        return 0
