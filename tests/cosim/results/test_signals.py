"""Signals: after any end of a run, sweep or comparison the recorded values are in its file, and no process is left."""

import contextlib
import ctypes
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from hfsa.cosim.measurement import run as running
from hfsa.cosim.results import interrupts
from hfsa.cosim.results.files import Status, read_run, read_sweep
from hfsa.cosim.results.interrupts import Interrupted, deferred_interrupts, handled_signals

DAWDLE, HANG = 11, 12
"""Behaviours of the foreign FMU: 20 ms for a step, and for ever."""


class Child:
    """The command as a process with a session and a folder for temporary files of its own."""

    def __init__(self, folder: Path, words, script="from hfsa.cosim.cli import main", **more):
        self.temporary = folder / "temporary"
        self.temporary.mkdir()
        self.folder = folder
        code = f"import sys\n{script}\nif __name__ == '__main__': sys.exit(main({list(map(str, words))}))"
        (folder / "child.py").write_text(code)
        self.process = subprocess.Popen(
            [sys.executable, "child.py"], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            start_new_session=True, env={**os.environ, "TMPDIR": str(self.temporary)}, **more,
        )  # fmt: skip

    def wait_for(self, is_there) -> None:
        """Wait until a condition holds, while the process runs."""
        while not is_there():
            assert self.process.poll() is None, self.process.communicate()
            time.sleep(0.05)

    def end(self, number: int, is_group: bool = False) -> tuple[int, str]:
        """Send a signal, to the process or to all of its session; return exit code and stderr."""
        (os.killpg if is_group else os.kill)(self.process.pid, number)
        _, err = self.process.communicate(timeout=100)
        return self.process.returncode, err

    @property
    def session(self) -> list[int]:
        """The processes of its session that live."""
        found = []
        for folder in Path("/proc").glob("[0-9]*"):
            with contextlib.suppress(OSError):
                state, _, _, session = (folder / "stat").read_text().rpartition(")")[2].split()[:4]
                found += [int(folder.name)] if int(session) == self.process.pid and state != "Z" else []
        return found

    def wait_for_the_others(self) -> None:
        """Wait until no process of the session is left: pytest's timeout is the limit."""
        while self.session:
            time.sleep(0.05)

    def left(self) -> list[str]:
        return os.listdir(self.temporary)


@pytest.fixture
def child(tmp_path):
    """Start the command in a process of its own; all of its session is killed in the end."""
    begun: list[Child] = []

    def begin(*words, **more) -> Child:
        begun.append(Child(tmp_path, words, **more))
        return begun[-1]

    yield begin
    for it in begun:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(it.process.pid, signal.SIGKILL)
        it.process.communicate()


def rows(path: Path) -> int:
    """Count the recorded rows of a run's file, also while another process writes it; 0 where there is none."""
    if not path.exists():
        return 0
    with h5py.File(path, "r", locking=False) as file:
        return int(np.isfinite(file["time/box.y"][:]).sum())


def status(path: Path) -> str:
    with h5py.File(path) as file:
        return bytes(file.attrs["status"]).rstrip(b"\0").decode()


def points(path: Path) -> int:
    """Count the finished points of a sweep's file, also while another process writes it."""
    if not path.exists():
        return 0
    with h5py.File(path, "r", locking=False) as file:
        return int((file["bode/status"][:] != Status.PENDING).sum())


# A run ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("number", "code", "words"),
    [
        (signal.SIGTERM, 143, "ended by SIGTERM"),
        pytest.param(signal.SIGHUP, 129, "ended by SIGHUP", marks=pytest.mark.slow),
        (signal.SIGINT, 130, "interrupted"),
    ],
    ids=["term", "hup", "int"],
)
def test_a_run_keeps_what_it_has_recorded(child, box, foreign, tmp_path, number, code, words):
    """The FMU takes 20 ms for a step: rows are there long before the end, and all of them after the signal."""
    path = tmp_path / "run.h5"
    it = child("run", box(foreign[2], stop_time=60.0, behaviour=DAWDLE, at=0.0), "-o", path)
    it.wait_for(lambda: rows(path) > 20)
    before = rows(path)
    assert it.end(number) == (code, f"hfsa: {words}\n")
    assert status(path) == "interrupted"
    values, _ = read_run(path)
    recorded = np.isfinite(values["box.y"])
    assert before <= recorded.sum() < 60_000
    assert recorded[: recorded.sum()].all()
    assert np.isfinite(values["box.u"][recorded]).all()
    assert (it.session, it.left()) == ([], [])


def test_a_run_that_is_killed_keeps_what_is_older_than_a_second(child, box, foreign, tmp_path):
    path = tmp_path / "run.h5"
    it = child("run", box(foreign[3], stop_time=60.0, behaviour=DAWDLE, at=0.0), "-o", path)
    it.wait_for(lambda: rows(path) > 20)
    it.end(signal.SIGKILL)
    assert 20 < rows(path) < 60_000
    assert status(path) == "running"


@pytest.mark.slow
def test_what_is_ignored_stays_ignored(child, box, foreign, tmp_path):
    """As under nohup."""
    path = tmp_path / "run.h5"
    scene = box(foreign[2], stop_time=60.0, behaviour=DAWDLE, at=0.0)
    it = child("run", scene, "-o", path, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    it.wait_for(lambda: rows(path) > 0)
    os.kill(it.process.pid, signal.SIGHUP)
    before = rows(path)
    it.wait_for(lambda: rows(path) > before + 20)
    assert it.end(signal.SIGTERM)[0] == 143


def test_a_run_in_a_call_that_never_returns_ends_at_sigterm(child, box, foreign, tmp_path):
    path = tmp_path / "run.h5"
    script = "from hfsa.cosim.results import interrupts; from hfsa.cosim.cli import main; interrupts.GRACE = 0.5"
    it = child("run", box(foreign[2], behaviour=HANG, at=0.1), "-o", path, "--backend", "python", script=script)
    it.wait_for(path.exists)
    found = it.end(signal.SIGTERM)
    assert found[0] == 143, found


class Clock:
    """A master, and a clock that its steps advance by their costs [s]."""

    time = 0.0

    def __init__(self, costs):
        self.now, self.ends = 0.0, np.cumsum(costs)

    def advance(self, steps: int) -> None:
        taken = int(np.searchsorted(self.ends, self.now * (1 + 1e-12), side="right"))
        self.now = float(self.ends[taken + steps - 1])


@pytest.mark.parametrize("cost", [1e-7, 1e-5, 1e-3, 0.02, 0.3, 2.0, 30.0])
def test_steps_are_taken_a_tenth_of_a_second_at_a_stretch(monkeypatch, cost):
    """For any cost of a step, also where it becomes ten times as large; fast steps are rarely interrupted."""
    costs = np.full(min(3_000_000, max(40, int(30 / cost))), cost)
    costs[len(costs) // 2 :] *= 10
    clock = Clock(costs)
    monkeypatch.setattr(running.time, "monotonic", lambda: clock.now)
    times = [clock.now for _ in running._blocks(clock, len(costs))]
    assert clock.now == clock.ends[-1]
    assert max(np.diff(times)) <= max(1.05, 10 * cost * 1.001)
    assert len(times) < 25 + clock.now / 0.05


# Sweeps and comparisons -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("is_group", [False, True], ids=["parent", "group"])
@pytest.mark.slow
def test_a_sweep_keeps_its_points_and_its_processes_end(child, box, foreign, tmp_path, is_group):
    """As batch systems do it: SIGTERM to the parent alone, or to all processes at once. No point counts as failed."""
    path = tmp_path / "sweep.h5"
    scene = box(foreign[2], behaviour=DAWDLE, at=3.0)
    words = ["sweep", scene, "--points", "4", "--grid", "log", "--from", "0.5", "-j", "2", "-o", path]
    it = child(*words)
    it.wait_for(lambda: points(path) >= 2)  # at higher frequencies 3 s are never reached
    assert len(it.session) > 2
    code, err = it.end(signal.SIGTERM, is_group)
    assert code == 143
    assert "sweep with --resume to continue\nhfsa: ended by SIGTERM\n" in err
    assert "Traceback" not in err
    bode = read_sweep(path)
    assert bode.attributes["status"] == "interrupted"
    assert set(bode.status.ravel()) == {Status.PENDING, Status.DONE}
    it.wait_for_the_others()
    assert it.left() == []


@pytest.mark.slow
def test_the_runs_of_a_comparison_keep_what_they_have_recorded(child, box, foreign, tmp_path):
    scene = box(foreign[2], stop_time=60.0, behaviour=DAWDLE)
    it = child("compare", scene, "--over", "box.at=0,0.01", "-j", "2", "-o", "out/it.png")
    paths = [tmp_path / "out" / f"box_box.at={at}.h5" for at in ("0", "0.01")]
    it.wait_for(lambda: min(map(rows, paths)) > 20)
    code, err = it.end(signal.SIGTERM, is_group=True)
    assert code == 143
    assert "0 of 2 runs are finished\nhfsa: ended by SIGTERM\n" in err
    it.wait_for_the_others()
    assert [status(path) for path in paths] == ["interrupted"] * 2
    assert min(map(rows, paths)) > 20
    assert set((tmp_path / "out").iterdir()) == set(paths)
    assert it.left() == []


def test_processes_end_when_their_parent_is_killed(child, box, foreign, tmp_path):
    """They close the files of their runs, and their temporary folders go away with them; the killed one's own stay."""
    scene = box(foreign[2], stop_time=60.0, behaviour=DAWDLE)
    it = child("compare", scene, "--over", "box.at=0,0.01", "-j", "2", "-o", "out/it.png")
    paths = [tmp_path / "out" / f"box_box.at={at}.h5" for at in ("0", "0.01")]
    it.wait_for(lambda: min(map(rows, paths)) > 20)
    before = it.left()
    it.end(signal.SIGKILL)
    it.wait_for_the_others()
    assert [status(path) for path in paths] == ["interrupted"] * 2
    assert len(it.left()) < len(before)


@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGKILL, marks=pytest.mark.slow)], ids=["int", "kill"]
)
def test_processes_end_though_an_fmu_does_not_return(child, box, foreign, tmp_path, number):
    path = tmp_path / "sweep.h5"
    words = ["--points", "2", "--grid", "log", "-j", "2", "-o", path]
    it = child("sweep", box(foreign[2], behaviour=HANG, at=0.1), *words)
    it.wait_for(lambda: path.exists() and len(it.session) > 3)
    code, _ = it.end(number)
    assert code == {signal.SIGINT: 130, signal.SIGKILL: -9}[number]
    it.wait_for_the_others()
    assert set(read_sweep(path).status.ravel()) == {Status.PENDING}


# Between two calls ----------------------------------------------------------------------------------------------------


def test_a_signal_waits_for_what_must_not_be_left_half_done():
    done = []

    def work():
        with handled_signals():
            with deferred_interrupts():
                with deferred_interrupts():
                    signal.raise_signal(signal.SIGTERM)
                    done.append("inner")
                done.append("outer")
            done.append("behind")

    with pytest.raises(Interrupted) as caught:
        work()
    assert done == ["inner", "outer"]
    assert caught.value.code == 143


def test_what_was_set_before_is_set_again():
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = [signal.getsignal(number) for number in numbers]
    with pytest.raises(Interrupted), handled_signals():
        signal.raise_signal(signal.SIGHUP)
    assert [signal.getsignal(number) for number in numbers] == before
    assert not interrupts._handled.is_set()


def test_a_second_sigterm_does_not_disturb_the_cleaning_up_but_ctrl_c_does():
    cleaned = []

    def work():
        with handled_signals():
            try:
                signal.raise_signal(signal.SIGHUP)
            finally:
                signal.raise_signal(signal.SIGTERM)
                cleaned.append("once")
                signal.raise_signal(signal.SIGINT)
                cleaned.append("twice")

    with pytest.raises(Interrupted) as caught:
        work()
    assert cleaned == ["once"]
    assert caught.value.code == 130


def test_a_signal_that_a_callback_swallows_comes_again():
    """Exceptions cannot pass through C, from which the logger is called."""
    kind = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(ctypes.c_int), ctypes.POINTER(ctypes.c_int))
    calls = []

    def compare(one, other):
        calls.append(one[0])
        if len(calls) == 3:
            signal.raise_signal(signal.SIGTERM)
        return one[0] - other[0]

    def work():
        numbers = (ctypes.c_int * 10)(*range(10))
        with handled_signals():
            ctypes.CDLL(None).qsort(numbers, 10, 4, kind(compare))
            calls.append("behind")
            while True:
                time.sleep(0.01)

    with pytest.raises(Interrupted) as caught:
        work()
    assert calls[-1] == "behind"
    assert caught.value.code == 143


STORM = """
import sys
from pathlib import Path
import numpy as np
from hfsa.cosim.results.interrupts import handled_signals
from hfsa.cosim.results.files import RunFile, SystemRecord

def main(words):
    names = {f"box.y{i}": "m" for i in range(10)} | {"box.y": "m"}
    file = RunFile(Path(words[0]), np.arange(200_000.0), names, SystemRecord("A", ""))
    try:
        with handled_signals():
            print("ready", flush=True)
            for row in range(199_000):
                file.write(row, dict.fromkeys(names, np.full(3, float(row))))
    except KeyboardInterrupt:
        file.interrupt()
"""


@pytest.mark.slow
def test_a_signal_in_the_middle_of_writing_spoils_nothing(child, tmp_path):
    """At five different moments; the file is complete, its columns have equal lengths, and it is closed in order."""
    path = tmp_path / "run.h5"
    for number in range(5):
        it = child(path, script=STORM)
        it.process.stdout.readline()
        time.sleep(0.005 * number)
        assert it.end(signal.SIGTERM if number % 2 else signal.SIGINT) == (0, "")
        assert status(path) == "interrupted"
        values, _ = read_run(path)
        (written,) = {int(np.isfinite(v).sum()) for name, v in values.items() if name != "time"}
        whole = max(0, written - 2)  # the last write is of three rows, of which each next one replaces two
        assert np.array_equal(values["box.y"][:whole], np.arange(float(whole)))
        path.unlink()
        it.temporary.rmdir()
