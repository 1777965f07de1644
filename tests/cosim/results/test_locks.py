"""Who writes a file, and what protects it on a file system without locks."""

import errno
import json
import os
import subprocess
import sys

import h5py
import numpy as np
import pytest
from output_files import PLAN, SYSTEM, write_sweep

from hfsa.cosim.results import locks, writers
from hfsa.cosim.results.files import ResultsError, SweepFile, read_sweep


@pytest.fixture
def no_locks(monkeypatch):
    """A file system without locks."""

    def refuse(*_):
        raise OSError(errno.ENOSYS, "Function not implemented")

    monkeypatch.setattr(locks.fcntl, "flock", refuse)


@pytest.fixture
def other():
    """A living process."""
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    yield child.pid
    child.communicate()


def unfinished(path, process, machine, started=0):
    """Let a file say that a process writes it."""
    facts = [process, machine, started, "2026-01-01 10:00:00 UTC", "hfsa sweep a"]
    with h5py.File(path, "r+", locking=False) as file:
        file.attrs.modify("status", np.bytes_(b"running".ljust(16, b"\0")))
        file.attrs.modify("writer", np.bytes_(json.dumps(facts).ljust(400)))


def test_a_file_says_who_wrote_it(results):
    with open(results, "rb") as raw:
        writer = writers.writer_of(raw)
    assert (writer.process, writer.is_self, writer.is_alive) == (os.getpid(), True, True)
    assert f"(process {os.getpid()} on {writer.machine} since " in writer.description


@pytest.mark.parametrize("length", [1, 300, 100_000], ids=["short", "long", "very long"])
@pytest.mark.parametrize("letter", ["a", "ö", "\udcff", '"', "\n"], ids=["a", "umlaut", "no text", "quote", "line"])
def test_any_command_fits(monkeypatch, length, letter):
    monkeypatch.setattr(sys, "argv", ["hfsa", letter * length])
    text = writers.signature()
    assert len(text) == 400
    assert writers.Writer(*json.loads(text)).is_self


@pytest.mark.usefixtures("no_locks")
def test_without_locks_a_living_writer_of_this_machine_is_respected(results, other):
    unfinished(results, other, writers.socket.gethostname())
    sentence = rf'"hfsa sweep a" \(process {other} on .* since 2026-01-01 10:00:00 UTC\) is writing it'
    for attempt in (lambda: write_sweep(results, force=True), lambda: SweepFile.resume(results, PLAN, SYSTEM)):
        with pytest.raises(ResultsError, match=sentence):
            attempt()


@pytest.mark.usefixtures("no_locks")
def test_without_locks_a_dead_writer_blocks_nothing(results, other):
    unfinished(results, other, writers.socket.gethostname(), started=1)  # its number has another process by now
    SweepFile.resume(results, PLAN, SYSTEM).close()
    assert read_sweep(results).attributes["status"] == "complete"


@pytest.mark.usefixtures("no_locks")
def test_without_locks_a_writer_of_another_machine_blocks_until_it_is_silent(results):
    unfinished(results, 1, "elsewhere")
    with pytest.raises(ResultsError, match=r"has no locks, and .* on elsewhere .* try again \d+ s later"):
        write_sweep(results, force=True)
    old = os.stat(results).st_mtime - 700
    os.utime(results, (old, old))
    write_sweep(results, force=True)


@pytest.mark.parametrize(
    ("ending", "hint"),
    [("csv", "hfsa convert"), ("png", ""), ("html", ""), ("fmu", "")],
    ids=lambda word: word or "none",
)
def test_an_ending_that_promises_another_format_is_refused(tmp_path, ending, hint):
    with pytest.raises(ResultsError, match=rf"a results file is HDF5, expected the ending \.h5.*{hint}"):
        write_sweep(tmp_path / f"t.{ending}")
    assert list(tmp_path.iterdir()) == []
