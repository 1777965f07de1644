"""A run in an environment that lacks something: it works, or one sentence says what to set."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from torture.row import Row

TIME_LIMIT = 300.0
"""Longest time of one run [s]."""
MAIN = "import sys; from hfsa.cosim.cli import main; sys.exit(main())"
NOBODY = "import pwd\ndef gone(*_): raise KeyError\npwd.getpwuid = gone\n"
NO_FLOCK = "import sys; sys.modules['fcntl'] = None\n"
RUN = ("run", "mass_on_spring", "--stop", "0.01", "--force", "-o", "r.h5")


class Case(NamedTuple):
    """An environment: variables (`None` unsets one), what Python does first, redirections, and how it may end."""

    what: str
    variables: Mapping[str, str | None]
    codes: tuple[int, ...]
    words: str = ""
    first: str = ""
    redirection: str = ""
    command: tuple[str, ...] = RUN


def cases(folder: Path) -> Iterator[Case]:
    """Yield the cases; `folder` is empty, and `here` in it is a cache of its own."""
    fresh = {"HFSA_CACHE": str(folder / "fresh")}
    hang = folder / "hang"
    hang.write_text("#!/bin/sh\necho out of order >&2\nexit 7\n")
    hang.chmod(0o700)
    nowhere = {"HOME": None, "HFSA_CACHE": None, "XDG_CACHE_HOME": None}
    yield Case("no HOME", {**nowhere}, (0,))
    yield Case("no HOME and no entry of the user", nowhere, (2,), "set HFSA_CACHE", NOBODY)
    yield Case("HOME is a file", {**nowhere, "HOME": os.devnull}, (2,), "HFSA_CACHE")
    yield Case("TMPDIR is not there", {"TMPDIR": str(folder / "nowhere")}, (0,))
    yield Case("the compiler is not there", {**fresh, "CC": "nonexistent"}, (3,), "no such command")
    yield Case("the compiler fails", {**fresh, "CC": str(hang)}, (3,), "out of order")
    yield Case("the compiler makes nothing", {**fresh, "CC": "true"}, (3,), "made no file")
    yield Case("the compiler is half a quotation", {**fresh, "CC": "'gcc"}, (3,), "no command")
    yield Case("no compiler", {**fresh, "CC": None, "PATH": str(folder)}, (0, 3), "")
    yield Case("locale C", {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}, (0,))
    yield Case("output in ASCII", {"PYTHONIOENCODING": "ascii"}, (0,), command=("list", "--json"))
    yield Case("no display, a back end of windows", {"DISPLAY": None, "MPLBACKEND": "TkAgg"}, (0,))
    yield Case("stdout closed", {}, (0,), redirection=">&-")
    yield Case("all streams closed", {}, (0,), redirection="<&- >&- 2>&-")
    if Path("/dev/full").exists():
        yield Case("stdout full", {}, (4,), "standard output", redirection=">/dev/full")
    yield Case("no flock", {}, (0,), first=NO_FLOCK)


def trials(seed: int, count: int) -> Iterator[Row]:
    """Yield a row for each environment; nothing is drawn, so that `seed` and `count` have no effect."""
    with tempfile.TemporaryDirectory(prefix="torture-") as folder:
        for case in cases(Path(folder)):
            row = Row(f"a run where: {case.what}")
            row.add(*faults(case, Path(folder)))
            yield row
        for options, what, variable, words in (
            ("size=64k", "the temporary folder is full", "TMPDIR", "TMPDIR"),
            ("noexec", "nothing may be executed in the temporary folder", "TMPDIR", "TMPDIR"),
            ("ro", "the temporary folder cannot be written", "TMPDIR", ""),
            ("ro", "the cache cannot be written", "HFSA_CACHE", "HFSA_CACHE"),
            ("size=64k", "the cache is full", "HFSA_CACHE", "No space left"),
        ):
            yield from on_a_disk(Path(folder), options, what, variable, words)


def on_a_disk(folder: Path, options: str, what: str, variable: str, words: str) -> Iterator[Row]:
    """Yield the row of a run with a small disk in memory as one of its folders, where this user can mount one."""
    place = folder / "disk"
    place.mkdir(exist_ok=True)
    mount = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(place)]
    try:
        if subprocess.run(mount, capture_output=True, check=False).returncode:
            return
    except OSError:
        return
    try:
        row = Row(f"a run where: {what}")
        row.add(*faults(Case(what, {variable: str(place)}, (0, 2, 4), words), folder))
        yield row
    finally:
        subprocess.run(["umount", str(place)], check=False)


def faults(case: Case, folder: Path) -> list[str]:
    """Return what is wrong with the end of a run in an environment."""
    changed = {**os.environ, **case.variables}
    env = {name: value for name, value in changed.items() if value is not None}
    words = [sys.executable, "-c", case.first + MAIN, *case.command]
    if case.redirection:
        words = ["sh", "-c", f'exec "$@" {case.redirection}', "sh", *words]
    try:
        done = subprocess.run(words, cwd=folder, env=env, capture_output=True, timeout=TIME_LIMIT, check=False)
    except subprocess.TimeoutExpired:
        return [f"no end after {TIME_LIMIT:g} s"]
    said = (done.stdout + done.stderr).decode(errors="replace")
    found = []
    if done.returncode not in case.codes:
        found.append(f"exit code {done.returncode}, expected {' or '.join(map(str, case.codes))}: {said[-300:]}")
    if "Traceback" in said:
        found.append(f"a traceback: {said[-300:]}")
    if done.returncode and case.words not in said:
        found.append(f"{case.words!r} is not said: {said[-300:]}")
    return found
