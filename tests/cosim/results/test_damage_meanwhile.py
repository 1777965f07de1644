"""Results files that somebody else damages or leaves behind: one sentence, and what is not ours stays."""

import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from hfsa.cosim.results.placement import _machine, temporary_file
from hfsa.cosim.results.records import ResultsError, SystemRecord
from hfsa.cosim.results.run_file import RunFile, read_run


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run_file(title: str = "a run") -> RunFile:
    """A run of ten rows, open for writing."""
    return RunFile(Path("a.h5"), np.arange(10.0), {"mass.position": "m"}, SystemRecord(title, "scene"))


@pytest.mark.usefixtures("folder")
def test_a_file_that_is_overwritten_while_it_is_written():
    file = run_file()
    Path("a.h5").write_bytes(b"x" * Path("a.h5").stat().st_size)
    with pytest.raises(ResultsError, match=r"cannot write a.h5: it is damaged"):
        file.write(0, {"mass.position": np.ones(3)})
    with pytest.raises(ResultsError, match=r"cannot write a.h5: it is damaged"):
        file.close()


@pytest.mark.parametrize(
    "other",
    [
        pytest.param(lambda group: group.create_group("mass.position"), id="a group"),
        pytest.param(lambda group: group.create_dataset("mass.position", data=np.zeros((2, 2))), id="another shape"),
        pytest.param(lambda group: group.create_dataset("mass.position", data=["x"] * 10), id="texts"),
    ],
)
@pytest.mark.usefixtures("folder")
def test_something_else_in_the_place_of_a_signal(other):
    run_file().close()
    with h5py.File("a.h5", "r+") as file:
        del file["time/mass.position"]
        other(file["time"])
    with pytest.raises(ResultsError, match=r"cannot read a.h5: it is damaged"):
        read_run("a.h5")


@pytest.mark.usefixtures("folder")
def test_a_title_that_is_no_utf_8_is_written_as_its_escape():
    run_file("a\udcff").close()
    with h5py.File("a.h5") as file:
        assert file.attrs["title"] == "a\\udcff"


@pytest.mark.usefixtures("folder")
def test_unfinished_files_of_dead_processes_of_this_machine_go():
    with subprocess.Popen([sys.executable, "-c", ""]) as dead:
        dead.wait()
    gone = Path(f".a.h5.{_machine()}-{dead.pid}-1-00000000.part")
    kept = [
        Path(f".a.h5.{_machine()}-{os.getpid()}-0-00000000.part"),
        Path(f".a.h5.{'0' * 8}-{dead.pid}-1-00000000.part"),
        Path(f".b.h5.{_machine()}-{dead.pid}-1-00000000.part"),
        Path(".a.h5.mine.part"),
    ]
    for file in (gone, *kept):
        file.touch()
    with temporary_file(Path("a.h5")):
        assert not gone.exists()
        assert all(file.exists() for file in kept)
