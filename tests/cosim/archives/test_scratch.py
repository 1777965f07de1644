"""Temporary files of commands: in one folder, gone afterwards, and removed by the next command after a kill."""

import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from hfsa.cosim.archives.scratch import OWNER, enclosing, remove_stale, scratch_folder

HOLDER = """
import sys, tempfile
from hfsa.cosim.archives.scratch import scratch_folder
with scratch_folder():
    open(tempfile.mkstemp()[1], "w").close()
    print(tempfile.gettempdir(), flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def root(tmp_path, monkeypatch) -> Path:
    """The folder for temporary files of a test."""
    folder = tmp_path / "root"
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setattr(tempfile, "tempdir", None)
    return folder


@pytest.fixture
def holder(root):
    """A process with a folder of its own, and the folder."""
    child = subprocess.Popen([sys.executable, "-c", HOLDER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    yield child, Path(child.stdout.readline().strip())
    child.kill()
    child.communicate()


def test_temporary_files_lie_in_one_folder_that_goes(root):
    with scratch_folder():
        inner = Path(tempfile.mkdtemp())
        assert inner.parent.parent == root
        assert enclosing(inner) == inner.parent
        assert os.environ["TMPDIR"] == str(inner.parent)
    assert list(root.iterdir()) == []
    assert Path(tempfile.gettempdir()) == root


def test_the_folder_of_a_killed_process_goes_and_that_of_a_living_one_stays(root, holder):
    child, folder = holder
    remove_stale(root)
    assert folder.is_dir()
    child.send_signal(signal.SIGKILL)
    child.wait()
    assert folder.is_dir()
    remove_stale(root)
    assert list(root.iterdir()) == []


def test_what_is_not_ours_stays(root, tmp_path):
    (root / "hfsa-results").mkdir()
    (root / "hfsa-file").write_text("mine")
    (root / "other").mkdir()
    (root / "other" / OWNER).touch()
    aim = tmp_path / "aim"
    aim.mkdir()
    (aim / OWNER).touch()
    (root / "hfsa-link").symlink_to(aim)
    before = sorted(root.rglob("*"))
    remove_stale(root)
    assert sorted(root.rglob("*")) == before
    assert (aim / OWNER).exists()


def test_a_temporary_folder_that_takes_nothing_is_no_error(monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "nowhere"))
    with scratch_folder():
        assert tempfile.gettempdir() == str(tmp_path / "nowhere")


PROGRAM = """
import sys
from hfsa.cosim.archives.scratch import new_folder
folder, keeper = new_folder()
print(folder, flush=True)
sys.stdin.read()
"""


def test_the_folder_of_an_fmu_of_a_killed_program_goes(root):
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as program:
        folder = Path(program.stdout.readline().strip())
        remove_stale(root)
        assert folder.is_dir()
        program.kill()
    remove_stale(root)
    assert not folder.exists()
