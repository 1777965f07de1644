"""The command as a process with a time limit, in a folder and with a temporary folder of its own."""

import os
import resource
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

HFSA = [sys.executable, "-m", "hfsa.cosim.cli"]
CODES = range(5)
"""Documented exit codes of a verb that no signal ends."""

MEMORY = 6 << 30
"""Address space [byte] that a command may take."""


@dataclass
class Ended:
    """How a command ended: its exit code, `None` where it took too long, and the words on both streams."""

    code: int | None
    out: str
    err: str

    def faults(self, codes: object = CODES) -> list[str]:
        """Return what is wrong: a traceback, an exit code that is not one of `codes`, a refusal without a sentence."""
        if self.code is None:
            return ["no end within the time limit"]
        last = self.err.strip().splitlines()[-1][:160] if self.err.strip() else "no word"
        if "Traceback (most recent call last)" in self.err:
            return [f"traceback: {last}"]
        if self.code not in codes:  # type: ignore[operator]
            return [f"exit code {self.code}: {last}"]
        # a signal that comes before hfsa has begun ends the process without a word
        return [] if self.code <= 1 or self.err.strip() else [f"exit code {self.code} without a word"]


def begun(words: list[str], folder: Path, **environment: str) -> subprocess.Popen:
    """Begin a command in a folder; its temporary files go to `folder/tmp`, its words to `folder/tmp.out`, `.err`."""
    temporary = folder / "tmp"
    temporary.mkdir(exist_ok=True)
    streams = [open(folder / f"tmp.{name}", "w+b") for name in ("out", "err")]  # noqa: SIM115
    surroundings = {**os.environ, "TMPDIR": str(temporary), **environment}
    call = [*HFSA, *words]
    try:
        return subprocess.Popen(
            call, stdout=streams[0], stderr=streams[1], cwd=folder, env=surroundings, start_new_session=True,
            stdin=subprocess.DEVNULL, preexec_fn=_limited,
        )  # fmt: skip
    finally:
        for stream in streams:
            stream.close()


def ended(process: subprocess.Popen, folder: Path, limit: float = 60.0) -> Ended:
    """Wait for a command, at most `limit` [s], and end all that is left of its session."""
    try:
        code = process.wait(limit)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        code = None
    return Ended(code, *((folder / f"tmp.{name}").read_text(errors="replace") for name in ("out", "err")))


def run(words: list[str], folder: Path, limit: float = 60.0) -> Ended:
    """Run a command to its end."""
    return ended(begun(words, folder), folder, limit)


def living(session: int) -> list[int]:
    """Return the processes of a session that live."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                state, _, _, its = (entry / "stat").read_text().rpartition(")")[2].split()[:4]
            except OSError:
                continue
            if int(its) == session and state not in "ZX":
                found.append(int(entry.name))
    return found


def _limited() -> None:
    """Bound the memory and the size of files of a command, and let it hear Ctrl-C in the background of a shell."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 30, 1 << 30))
