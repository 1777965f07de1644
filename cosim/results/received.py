"""A results file that another machine has written, as bytes."""

from pathlib import Path

import h5py

from hfsa.cosim.results.placement import put_in_place, temporary_file
from hfsa.cosim.results.store import command_line, translate_errors
from hfsa.cosim.results.target import check_new


def write_received(path: Path, content: bytes, force: bool = False) -> None:
    """Write the bytes of a results file, completely or not at all, with the command of this process.

    `ResultsError` as for a new file of `files.py`.
    """
    check_new(path, force)
    with temporary_file(path) as part:
        with translate_errors(path, "write"):
            part.write_bytes(content)
            with h5py.File(part, "r+") as file:
                file.attrs["command"] = command_line()
        put_in_place(part, path, lambda: check_new(path, force))
