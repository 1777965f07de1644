"""Concurrent access to results files: one of several writers succeeds, readers and writers are respected."""

import os
import re
import subprocess
import sys
import textwrap
from pathlib import Path

import h5py
import pytest
from output_files import LINEAR, PLAN, RUN, SYSTEM, write_sweep

from hfsa.cosim.results import locks
from hfsa.cosim.results.files import (
    ResultsError,
    SweepFile,
    read_sweep,
)
from hfsa.fmus.compile import compiler

WRITER = """
    import errno, os, sys
    from pathlib import Path
    import numpy as np
    from hfsa.cosim.results.files import Plan, Point, ResultsError, Signal, Status, SweepFile, SystemRecord

    def no_links(*_):
        raise OSError(errno.EPERM, "no")

    if "no_links" in sys.argv: os.link = no_links
    name = float(sys.argv[1])
    plan = Plan(np.array([name]), (Signal("a.y", "m"),), (Signal("a.u", "m", 1.0),))
    print("ready", flush=True)
    for line in sys.stdin:
        path, *force = line.split()
        try:
            with SweepFile.create(Path(path), plan, SystemRecord("A", ""), bool(force)) as file:
                print("won", flush=True)
                sys.stdin.readline()
                file.write([Point(0, 0, Status.DONE, np.ones(1, complex))])
            print("done", flush=True)
        except ResultsError as error:
            print(error, flush=True)
            sys.stdin.readline()
            print("gone", flush=True)
"""


@pytest.fixture
def writers():
    """Two processes that write a sweep at 1 Hz and at 2 Hz, each on command."""
    children = []

    def begin(*more: str, env=None):
        for name in ("1", "2"):
            command = [sys.executable, "-c", textwrap.dedent(WRITER), name, *more]
            pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True, "bufsize": 1}
            children.append(subprocess.Popen(command, **pipes, env=env))
        assert [child.stdout.readline() for child in children] == ["ready\n"] * 2
        return children

    yield begin
    for child in children:
        child.stdin.close()
        child.wait()
        child.stdout.close()


def command(child, line: str) -> str:
    child.stdin.write(f"{line}\n")
    return child.stdout.readline().strip()


def race(children, path: Path, force: str) -> list[str]:
    """Start both writers at once; return their messages."""
    for child in children:
        child.stdin.write(f"{path} {force}\n")
    messages = [child.stdout.readline().strip() for child in children]
    ended = [command(child, "go on") for child in children]
    assert ended == ["done" if word == "won" else "gone" for word in messages]
    return messages


@pytest.mark.parametrize(
    ("kind", "force"),
    [((), ""), pytest.param(("no_links",), "", marks=pytest.mark.slow), ((), "force")],
    ids=["", "no_links", "force"],
)
def test_of_two_that_start_together_exactly_one_wins(writers, tmp_path, kind, force):
    children, losers = writers(*kind), set()
    for number in range(10):
        path = tmp_path / f"{number}.h5"
        if force:
            write_sweep(path)
        messages = race(children, path, force)
        assert messages.count("won") == 1, messages
        winner = messages.index("won")
        losers.add(re.sub(r'".*" \(process \d+ on .*\)', "its writer", messages[1 - winner].replace(str(path), "it")))
        bode = read_sweep(path)
        assert bode.frequency.tolist() == [1.0 + winner]
        assert bode.attributes["status"] == "complete"
        assert sorted(p.name for p in tmp_path.iterdir()) == sorted(f"{n}.h5" for n in range(number + 1))
    assert losers <= {"cannot write it: its writer is writing it", "cannot write it: another process is writing it",
                      "cannot write it: it is an empty file, which is not replaced; -o names another file"}  # fmt: skip


@pytest.mark.parametrize("force", ["", "force"])
def test_a_file_that_is_being_written_is_refused_to_others(writers, tmp_path, hfsa, force):
    first, second = writers()
    path = tmp_path / "a.h5"
    assert command(first, f"{path}") == "won"
    refusal = re.compile(rf'cannot write {path}: "-c 1" \(process {first.pid} on .+ since .+ UTC\) is writing it\n?')
    assert refusal.fullmatch(command(second, f"{path} {force}"))
    more = ["--force"] if force else []
    for words in (RUN, LINEAR, [*LINEAR, "--resume"] if not force else LINEAR):
        code, _, err = hfsa(*words, "-o", path, *more)
        assert code == 2
        assert refusal.fullmatch(err.removeprefix("error: "))
    assert (command(second, "go on"), command(first, "go on")) == ("gone", "done")
    assert read_sweep(path).frequency.tolist() == [1.0]
    assert command(second, f"{path} force") == "won"
    assert command(second, "go on") == "done"
    assert read_sweep(path).frequency.tolist() == [2.0]


def test_a_file_that_somebody_reads_is_not_replaced(results, monkeypatch):
    monkeypatch.setattr(locks, "_PATIENCE", 0.1)
    with h5py.File(results) as file:
        with pytest.raises(ResultsError, match="another process is reading it"):
            write_sweep(results, force=True)
        with pytest.raises(ResultsError, match="another process is reading it"):
            SweepFile.resume(results, PLAN, SYSTEM)
        assert file["bode/status"][:].tolist() == [[1], [1]]
    write_sweep(results, force=True)


@pytest.mark.parametrize("how", ["removed", "replaced"])
def test_a_file_that_loses_its_name_is_reported(tmp_path, how):
    path = tmp_path / "a.h5"
    file = SweepFile.create(path, PLAN, SYSTEM)
    if how == "removed":
        path.unlink()
    else:
        write_sweep(tmp_path / "b.h5")
        os.replace(tmp_path / "b.h5", path)
    with pytest.raises(ResultsError, match=r"a.h5 was removed or replaced by another program; its contents are lost"):
        file.close()
    with pytest.raises(ResultsError, match="was removed or replaced"):
        file.identity.check(path)


@pytest.mark.parametrize(
    "code",
    ["ENOLCK", pytest.param("ENOTSUP", marks=pytest.mark.slow), pytest.param("ENOSYS", marks=pytest.mark.slow)],
)
def test_a_file_system_without_locks_will_do(tmp_path, code):
    """As on some network file systems: all verbs work, and an existing file is not replaced without --force."""
    (tmp_path / "flock.c").write_text(f"#include <errno.h>\nint flock(int f, int o) {{ errno = {code}; return -1; }}\n")
    shim = tmp_path / "flock.so"
    subprocess.run([*compiler(), "-shared", "-fPIC", "flock.c", "-o", shim], cwd=tmp_path, check=True)
    environment = {**os.environ, "LD_PRELOAD": str(shim)}

    def hfsa(*words: str):
        command = [sys.executable, "-m", "hfsa.cosim.cli", *words]
        return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)

    assert hfsa(*LINEAR, "-o", "a.h5").returncode == 0
    assert "--force replaces it" in hfsa(*LINEAR, "-o", "a.h5").stderr
    assert hfsa(*LINEAR, "-o", "a.h5", "--resume").returncode == 0
    done = hfsa("bode", "a.h5")
    assert (done.returncode, done.stdout, done.stderr) == (0, "a.png\n", "")


def test_without_locks_one_still_wins(writers, tmp_path):
    (tmp_path / "flock.c").write_text("#include <errno.h>\nint flock(int f, int o) { errno = ENOLCK; return -1; }\n")
    shim = tmp_path / "flock.so"
    subprocess.run([*compiler(), "-shared", "-fPIC", "flock.c", "-o", shim], cwd=tmp_path, check=True)
    children = writers(env={**os.environ, "LD_PRELOAD": str(shim)})
    for number in range(10):
        path = tmp_path / f"{number}.h5"
        messages = race(children, path, "")
        assert messages.count("won") == 1, messages
        assert read_sweep(path).frequency.tolist() == [1.0 + messages.index("won")]
