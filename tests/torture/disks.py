"""Disks that are full, shrink, are read-only or lose a file while a verb writes to them."""

import os
import random
import resource
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from hfsa.cosim.results.files import ResultsError, read_run, read_sweep
from torture._commands import HFSA, Ended, begun, ended
from torture.row import Row

RUN = ["run", "mass_on_spring", "--stop", "20", "-o", "f.h5"]
VERBS = {
    "run": RUN,
    "linear": ["sweep", "mass_on_spring", "--method", "linear", "--points", "2000", "-o", "f.h5"],
    "stepped": ["sweep", "mass_on_spring", "-p", "damping=5", "--points", "3", "--jobs", "1", "-o", "f.h5"],
    "stability": ["stability", "mass_on_spring", "--vary", "damping=0.1:1:3", "-o", "f.h5"],
    "compare": ["compare", "mass_on_spring", "--over", "damping=1,2", "--stop", "2", "-o", "f.png"],
    "export": ["export", "mass_on_spring", "-o", "."],
}


def trials(seed: int, count: int) -> Iterator[Row]:
    """Yield a row per kind of fault of a disk."""
    rng = random.Random(seed)
    with tempfile.TemporaryDirectory() as scratch:
        for what, attempt in (
            ("files limited in size (EFBIG) at any length", _limited),
            ("a full disk (a tmpfs of 64 kB to 2 MB)", _full),
            ("the file removed while it is written", _removed),
        ):
            if attempt is _full and os.geteuid():
                continue
            row = Row(what)
            for number in range(count):
                folder = Path(scratch, f"{number}")
                folder.mkdir()
                row.add(*attempt(folder, rng))
                shutil.rmtree(folder)
            yield row


def _limited(folder: Path, rng: random.Random) -> list[str]:
    """Run a verb whose files may have a size of at most so many bytes."""
    words, size = rng.choice(list(VERBS.items())), int(2 ** rng.uniform(8, 20))
    return _judged(words[0], _run(words[1], folder, folder, lambda: _limit(size)), folder)


def _full(folder: Path, rng: random.Random) -> list[str]:
    """Run a verb on a small disk of its own."""
    words, disk = rng.choice(list(VERBS.items())), folder / "disk"
    disk.mkdir()
    size = rng.choice(["64k", "128k", "256k", "1m", "2m"])
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "hfsa", str(disk)], check=False)
    if mounted.returncode:
        return ["no disk could be mounted"]
    try:
        return _judged(words[0], _run(words[1], folder, disk, lambda: None), disk)
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=True)  # a process that ends may still be in it


def _run(words: list[str], folder: Path, where: Path, before: Callable[[], None]) -> Ended:
    """Run a command in a folder on the disk, its streams outside."""
    with open(folder / "out", "w+") as out, open(folder / "err", "w+") as err:
        try:
            done = subprocess.run(
                [*HFSA, *words], stdout=out, stderr=err, cwd=where, preexec_fn=before, timeout=120, check=False
            )
            code = done.returncode
        except subprocess.TimeoutExpired:
            code = None
    return Ended(code, (folder / "out").read_text(), (folder / "err").read_text())


def _removed(folder: Path, rng: random.Random) -> list[str]:
    """Remove, replace or shorten the file of a run while it is written."""
    how = rng.choice(["removed", "replaced by a folder", "folder removed"])
    inner = folder / "inner"
    inner.mkdir()
    process = begun([*RUN[:3], "1000", "--every", "100", "-o", str(inner / "f.h5")], folder)
    begin = time.monotonic()
    while not (inner / "f.h5").exists() and process.poll() is None and time.monotonic() < begin + 60:
        time.sleep(0.01)
    time.sleep(rng.uniform(0, 1))
    if how == "folder removed":
        shutil.rmtree(inner)
    else:
        (inner / "f.h5").unlink(missing_ok=True)
        if how == "replaced by a folder":
            (inner / "f.h5").mkdir()
    end = ended(process, folder, 120)
    faults = end.faults()
    return [f"{how}: {fault}" for fault in faults or ([f"{how}: exit code 0"] if end.code == 0 else [])]


def _judged(verb: str, end: Ended, folder: Path) -> list[str]:
    """Return what is wrong with the end of a verb and with its file, which is whole or not there."""
    faults = end.faults()
    if (folder / "f.h5").exists() and verb in ("run", "linear", "stepped"):
        try:
            (read_run if verb == "run" else read_sweep)(folder / "f.h5")
        except ResultsError as error:
            faults.append(f"unreadable: {error}")
    for picture in folder.glob("*.png"):
        faults += [f"{picture.name} of 0 bytes"] if not picture.stat().st_size else []
    faults += [f"left {left}"] if (left := [entry.name for entry in folder.iterdir() if ".part" in entry.name]) else []
    return [f"{verb}: {fault}" for fault in faults]


def _limit(size: int) -> None:
    """Limit the size of files."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
