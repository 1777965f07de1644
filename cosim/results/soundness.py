"""Look at a results file in another process first: a damaged one can keep the HDF5 library busy for ever, or crash it.

    check_sound(path)       # `ResultsError` where the file cannot be read to its end

What this process has written or looked at is not looked at again. Where no process can be started, nothing is checked.
"""

import os
import subprocess
import sys
from pathlib import Path

from hfsa.cosim.results.records import ResultsError

LIMIT = 20.0
"""Time [s] within which a sound file of any size is looked through: arrays of numbers are not read."""

_known: set[tuple[int, int, int, int]] = set()

_LOOK = """
import sys
import h5py

def look(_, node):
    for name in node.attrs:
        node.attrs[name]
    if isinstance(node, h5py.Dataset):
        if node.dtype.hasobject:
            node[()]
        else:
            node.id.get_offset(), node.id.get_storage_size(), node.shape

try:
    # file objects take no lock, and whoever writes the file goes on
    with open(sys.argv[1], "rb") as raw, h5py.File(raw, "r") as file:
        look("", file)
        file.visititems(look)
except Exception as error:
    print(error)
"""
"""Program that reads all attributes and texts of a file; an exception is for the reader of the file to tell."""


def know(path: Path) -> None:
    """Take a file as sound, which this process has written."""
    _known.add(_state(path))


def check_sound(path: Path) -> None:
    """Raise `ResultsError` where looking through a file of HDF5 does not end, or crashes."""
    state = _state(path)
    if state in _known:
        return
    try:
        done = subprocess.run(
            [sys.executable, "-I", "-c", _LOOK, str(path)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=LIMIT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise ResultsError(
            f"cannot open {path}: it is damaged; looking through it did not end in {LIMIT:g} s"
        ) from None
    except OSError:
        return
    if done.returncode < 0:
        raise ResultsError(f"cannot open {path}: it is damaged; looking through it crashes the HDF5 library")
    _known.add(state)


def _state(path: Path) -> tuple[int, int, int, int]:
    """Return what changes with the content of a file."""
    info = os.stat(path)
    return info.st_dev, info.st_ino, info.st_size, info.st_mtime_ns
