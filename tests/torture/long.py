"""Long runs and many of them: time exact, energy bound, memory, file descriptors and folders flat."""

import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import hfsa.cosim
from hfsa.cosim import load_scene
from hfsa.cosim.assembly.build import build
from hfsa.cosim.assembly.native_loop import stepping_library
from hfsa.cosim.fmi.co_simulation import Fmu, Instance
from hfsa.cosim.masters.algorithms import open_master
from torture.row import Row

GROWTH = 4.0
"""Most growth of the memory of this process [MB] by what must not grow: libraries take some once."""

MOVED = 1e-6
"""Where all inputs stand from the start [SI units]."""

STEPS = {"mass_on_spring": 100_000, "sdelta_hfsa": 10_000}
"""Steps for each of `count`."""


def trials(seed: int, count: int) -> Iterator[Row]:
    """Yield the rows; nothing is drawn, so that `seed` has no effect."""
    for scene, steps in STEPS.items():
        yield long_run(scene, steps * count)
    before = tempfile.tempdir
    with tempfile.TemporaryDirectory() as results, tempfile.TemporaryDirectory() as own:
        tempfile.tempdir = own
        try:
            yield instances(50 * count)
            yield repeated("runs", 2 * count, lambda k: a_run(Path(results) / f"{k % 3}.h5"))
            yield repeated("sweeps", 2 * count, lambda k: a_sweep(Path(results) / f"s{k % 3}.h5"))
        finally:
            tempfile.tempdir = before


def long_run(name: str, steps: int) -> Row:
    """The times of all instances and of the master at the end, all states bounded, and memory over nine tenths."""
    row = Row(f"`{name}`, {steps:.0e} steps: time exact, motion bounded, memory flat")
    scene = load_scene(name)
    assembly, step = build(scene.system), scene.step_size
    recorded, moved = scene.outputs, dict.fromkeys(scene.inputs, MOVED)
    master = open_master(assembly, "gauss_seidel", step, stepping_library())
    try:
        master.initialize(starts=moved)
        master.advance(steps // 10)
        first, before = np.abs(master.read(recorded)).max(), resident()
        master.advance(steps - steps // 10)
        growth, last, time = resident() - before, np.abs(master.read(recorded)).max(), master.time
    finally:
        master.close()
    faults = []
    if time != steps * step:
        faults.append(f"time {time!r}, expected {steps * step!r}")
    if growth > GROWTH:
        faults.append(f"memory grew by {growth:.1f} MB")
    if not 0 < last <= 10 * max(first, MOVED):
        faults.append(f"outputs grew from {first:.3g} to {last:.3g}")
    row.add(*faults)
    row.note = f"{growth:+.2f} MB"
    return row


def instances(count: int) -> Row:
    """Instances of one FMU made, stepped and freed."""
    row = Row(f"{count} instances made, stepped and freed: memory, descriptors and folders flat")
    file = next(iter(build(load_scene("mass_on_spring").system).files.values()))
    fmu = Fmu.load(file)

    def one(k: int) -> None:
        with Instance(fmu, f"it{k}") as it:
            it.start(0.0)
            it.step(0.0, 1e-3)

    row.add(*flat(count, one))
    return row


def repeated(what: str, count: int, one: Callable[[int], None]) -> Row:
    """The same work many times in this process."""
    row = Row(f"{count} {what} in one process: memory, descriptors and folders flat")
    row.add(*flat(count, one))
    return row


def flat(count: int, one: Callable[[int], None]) -> list[str]:
    """Return sentences on what grew between the first tenth of `count` calls and their end."""
    for k in range(max(3, count // 10)):
        one(k)
    before = resident(), descriptors(), temporary()
    for k in range(count - max(3, count // 10)):
        one(k)
    after = resident(), descriptors(), temporary()
    faults = []
    if after[0] - before[0] > GROWTH:
        faults.append(f"memory grew by {after[0] - before[0]:.1f} MB")
    faults += [
        f"{words}: {then} before, {now} after"
        for words, then, now in zip(("descriptors", "temporary entries"), before[1:], after[1:], strict=True)
        if now > then
    ]
    return faults


def a_run(file: Path) -> None:
    """One run of 100 steps, and its file."""
    scene = load_scene("mass_on_spring")
    hfsa.cosim.run(scene, stop_time=0.1, path=file, force=True)


def a_sweep(file: Path) -> None:
    """One sweep of two points, and its file."""
    hfsa.cosim.sweep(load_scene("mass_on_spring"), low=5.0, high=20.0, points=2, path=file, force=True, jobs=1)


def resident() -> float:
    """Return the present memory of the process [MB]; 0 where the system does not tell."""
    place = Path("/proc/self/statm")
    return int(place.read_text().split()[1]) * os.sysconf("SC_PAGESIZE") / 1e6 if place.exists() else 0.0


def descriptors() -> int:
    """Return the number of open file descriptors; 0 where the system does not tell."""
    return len(os.listdir("/proc/self/fd")) if Path("/proc/self/fd").exists() else 0


def temporary() -> int:
    """Return the number of entries of the temporary folder, which `trials` makes one of their own."""
    return len(os.listdir(tempfile.gettempdir()))
