"""Output files for tests: a small sweep, the verbs that write results files, and the state of a path."""

import os
import stat
from pathlib import Path

import numpy as np

from hfsa.cosim.results.files import Plan, Point, Signal, Status, SweepFile, SystemRecord

PLAN = Plan(np.array([1.0, 10.0]), (Signal("a.y", "m"),), (Signal("a.u", "m", 1e-5),), {"method": "stepped"})
SYSTEM = SystemRecord("A", "scene")

RUN = ["run", "mass_on_spring", "--stop", "0.01"]
LINEAR = ["sweep", "mass_on_spring", "--method", "linear", "--points", "5"]
VERBS = {
    "run": RUN,
    "sweep": ["sweep", "mass_on_spring", "--points", "2", "--jobs", "1"],
    "linear": LINEAR,
    "open loop": ["sweep", "sdelta_hfsa", "--method", "linear", "--open-loop", "controller.axis[1].command"],
    "stability": ["stability", "mass_on_spring", "--vary", "damping=1:2:2"],
    "analyze": ["analyze", "tba_accelerometer", "--map", "tm,l"],
}
"""Verbs that write the HDF5 file that `-o` names."""

FORBIDDEN = ["text", "empty", "folder", "fifo", "device", "socket", "hdf5", "broken", "fmu", "picture", "archive"]
LINKS = ["link to text", "link to folder", "link to nothing"]


def write_sweep(path: Path, force: bool = False) -> None:
    """Write a sweep whose response is 1."""
    with SweepFile.create(path, PLAN, SYSTEM, force) as file:
        file.write([Point(0, k, Status.DONE, np.ones(1, complex)) for k in range(2)])


def path_state(path: Path) -> tuple:
    """Return the observable state of a path, without following links and without the time of access."""
    info = os.lstat(path)
    content = path.read_bytes() if stat.S_ISREG(info.st_mode) else None
    return info.st_mode, info.st_ino, info.st_size, info.st_mtime_ns, info.st_rdev, content
