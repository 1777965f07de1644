"""Verbs ended by every signal at random moments, alone and with their group; what is left, and whether it can go on."""

import os
import random
import shutil
import signal
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

from hfsa.cosim.results.files import Status, read_run, read_sweep
from torture._commands import begun, ended, living, run
from torture.row import Row

SIGNALS = {"SIGTERM": 143, "SIGHUP": 129, "SIGINT": 130, "SIGKILL": -9}
SWEEP = ["sweep", "sdelta_shaker", "--input", "command.position[3]", "--points", "16", "--jobs", "2", "--start", "rest"]
RUN = ["run", "sdelta_shaker", "--stop", "1000", "--every", "50"]
OTHERS = {
    "compare": ["compare", "mass_on_spring", "--over", "damping=1,2", "--stop", "1000", "--jobs", "2"],
    "stability": ["stability", "sdelta_hfsa", "--vary", "step_size=1e-4:1e-3:400"],
    "export": ["export", "sdelta", "-o", "."],
    "trade": ["trade", "sdelta_hfsa"],
}
PATIENCE = 15.0
"""Time [s] after which everything must be gone."""


def trials(seed: int, count: int) -> Iterator[Row]:
    """Yield a row for sweeps, one for runs, and one for every other verb that takes long."""
    rng = random.Random(seed)
    with tempfile.TemporaryDirectory() as scratch:
        whole = Path(scratch, "whole.h5")
        assert run([*SWEEP, "-o", str(whole)], Path(scratch), 600).code == 0
        row = Row("stepped sweep ended by a signal at any moment, then `--resume`")
        for number in range(count):
            row.add(*_sweep(Path(scratch, f"s{number}"), whole, rng))
        yield row
        row = Row("`run` ended by a signal at any moment")
        kept = [_run(Path(scratch, f"r{number}"), rng, row) for number in range(count)]
        row.note = f"{min(kept, default=0)} to {max(kept, default=0)} rows kept"
        yield row
        for verb, words in OTHERS.items():
            row = Row(f"`{verb}` ended by a signal at any moment")
            for number in range(max(count // 4, 1)):
                folder = Path(scratch, f"{verb}{number}")
                row.add(*_killed(words, folder, rng, None))
                shutil.rmtree(folder)
            yield row


def _killed(words: list[str], folder: Path, rng: random.Random, file: Path | None) -> list[str]:
    """Begin a command, end it by a signal, and return what is wrong: how it ended, and what it left behind."""
    folder.mkdir()
    name, to_group = rng.choice(list(SIGNALS)), rng.random() < 0.4
    process = begun(words, folder)
    early = file is None or rng.random() < 0.2
    begin = time.monotonic()
    while not early and file and not file.exists() and process.poll() is None and time.monotonic() < begin + 60:
        time.sleep(0.01)
    time.sleep(rng.uniform(0, 6))
    number = signal.Signals[name]
    is_over = process.poll() is not None
    if not is_over:
        (os.killpg if to_group else os.kill)(process.pid, number)
    end = ended(process, folder, 60)
    codes = (0, 1) if is_over else (SIGNALS[name], -number, 0)
    faults = [] if name == "SIGKILL" and end.code == -9 else end.faults(codes)
    begin = time.monotonic()
    while (left := living(process.pid)) and time.monotonic() < begin + PATIENCE:
        time.sleep(0.1)
    if left:
        faults.append(f"{len(left)} processes left")
        os.killpg(process.pid, signal.SIGKILL)
    if list((folder / "tmp").iterdir()):
        run(["list"], folder)  # the next command removes what a killed one left
        if found := [entry.name for entry in (folder / "tmp").iterdir()]:
            faults.append(f"left {found}")
    hidden = [entry.name for entry in folder.iterdir() if entry.name.endswith(".part")]
    faults += [f"left {hidden}"] if hidden and name != "SIGKILL" else []
    return [f"{name}{' to the group' if to_group else ''}: {fault}" for fault in faults]


def _sweep(folder: Path, whole: Path, rng: random.Random) -> list[str]:
    """End a sweep, look at its points, and resume it."""
    file = folder / "s.h5"
    faults = _killed([*SWEEP, "-o", "s.h5"], folder, rng, file)
    expected = read_sweep(whole)
    if file.exists():
        found = read_sweep(file)
        done = np.nonzero(found.status[:, 0] == Status.DONE)[0]
        faults += [] if np.array_equal(found.response[done], expected.response[done]) else ["a finished point differs"]
    faults += run([*SWEEP, "-o", "s.h5", "--resume"], folder, 300).faults((0,))
    if not file.exists() or not np.array_equal(read_sweep(file).response, expected.response):
        faults.append("the resumed sweep differs from an undisturbed one")
    shutil.rmtree(folder)
    return faults


def _run(folder: Path, rng: random.Random, row: Row) -> int:
    """End a run, add it to a row, and return the number of rows that its file has kept."""
    file, rows = folder / "r.h5", 0
    faults = _killed([*RUN, "-o", "r.h5"], folder, rng, file)
    if file.exists():
        values, _ = read_run(file)
        finite = [np.isfinite(values[name]) for name in values if name != "time"]
        rows = int(finite[0].sum())
        faults += [] if all(f[:rows].all() and not f[rows:].any() for f in finite) else ["rows with gaps"]
        with h5py.File(file) as raw:
            status = bytes(raw.attrs["status"]).rstrip(b"\0").decode()
        faults += [] if status in ("interrupted", "running", "complete") else [f"status {status}"]
        faults += [f"status {status} after {faults}"] if status == "running" and faults else []
    row.add(*faults)
    shutil.rmtree(folder)
    return rows
