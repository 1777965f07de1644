"""Fixtures of results files: a finished sweep, files of other kinds, and a guard against builds."""

import os
import shutil
import socket
import stat
from collections.abc import Callable
from pathlib import Path

import h5py
import pytest
from output_files import write_sweep


@pytest.fixture
def results(tmp_path) -> Path:
    """A finished results file of hfsa."""
    path = tmp_path / "old.h5"
    write_sweep(path)
    return path


@pytest.fixture
def make(tmp_path, mass_on_spring_files) -> Callable[[str, Path], str]:
    """Make a file of some kind at a path; return its description."""

    def put(what: str, path: Path) -> str:
        path.parent.mkdir(exist_ok=True)
        if what.startswith("link to"):
            aim = tmp_path / "aim"
            word = put(what.removeprefix("link to "), aim) if what != "link to nothing" else "which leads to nothing"
            path.symlink_to(aim)
            return f"a symbolic link to {aim}, {word}"
        match what:
            case "text":
                path.write_text("years of work: äöü\n")
            case "empty":
                path.touch()
            case "folder":
                path.mkdir()
            case "fifo":
                os.mkfifo(path)
            case "device":
                if os.geteuid():
                    pytest.skip("only root makes devices")
                os.mknod(path, 0o666 | stat.S_IFCHR, os.makedev(1, 3))
            case "socket":
                with socket.socket(socket.AF_UNIX) as it:
                    it.bind(str(path))
            case "hdf5":
                h5py.File(path, "w").close()
            case "broken":
                write_sweep(tmp_path / "whole.h5")
                path.write_bytes((tmp_path / "whole.h5").read_bytes()[:300])
            case "fmu":
                shutil.copy(mass_on_spring_files[2], path)
            case "picture":
                path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
            case "archive":
                path.write_bytes(b"PK\x03\x04" + bytes(100))
        words = {"hdf5": "an HDF5 file of another program", "broken": "an HDF5 file that cannot be read",
                 "fmu": "an FMU", "picture": "a picture (PNG)", "archive": "a ZIP archive"}  # fmt: skip
        return (
            words.get(what) or f"a{'n' if what == 'empty' else ''} {what}{' file' if what in ('text', 'empty') else ''}"
        )

    return put


@pytest.fixture
def no_builds(monkeypatch):
    """Fail where an FMU is built: targets are checked before."""

    def build(*_, **__):
        raise AssertionError("an FMU is built")

    monkeypatch.setattr("hfsa.cosim.assembly.build.fmu_file", build)
