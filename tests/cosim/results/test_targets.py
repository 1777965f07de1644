"""What is written over, and what is not: results only where that is asked for, everything else never."""

import os
import resource
import shutil
import socket
import stat
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hfsa.cosim.figures.style import save
from hfsa.cosim.results import locks, target
from hfsa.cosim.results.files import (
    Plan,
    Point,
    ResultsError,
    RunFile,
    Signal,
    Status,
    SweepFile,
    SystemRecord,
    read_sweep,
)
from hfsa.cosim.systems.errors import StructureError
from hfsa.fmus.compile import compiler

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


@pytest.fixture
def results(tmp_path) -> Path:
    """A finished results file of ours."""
    path = tmp_path / "old.h5"
    swept(path)
    return path


def swept(path: Path, force: bool = False) -> None:
    """Write a sweep whose response is 1."""
    with SweepFile.create(path, PLAN, SYSTEM, force) as file:
        file.write([Point(0, k, Status.DONE, np.ones(1, complex)) for k in range(2)])


@pytest.fixture
def make(tmp_path, mass_on_spring_files) -> Callable[[str, Path], str]:
    """Put something at a path; returns the words that name it."""

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
                swept(tmp_path / "whole.h5")
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


def seen(path: Path) -> tuple:
    """All that can be seen of a path without following it, but for when it was read."""
    info = os.lstat(path)
    content = path.read_bytes() if stat.S_ISREG(info.st_mode) else None
    return info.st_mode, info.st_ino, info.st_size, info.st_mtime_ns, info.st_rdev, content


@pytest.fixture
def no_builds(monkeypatch):
    """Fail where an FMU is built: a target is looked at before."""

    def build(*_, **__):
        raise AssertionError("an FMU is built")

    monkeypatch.setattr("hfsa.cosim.assembly.build.fmu_file", build)


# What stays -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("force", [False, True])
@pytest.mark.parametrize("what", FORBIDDEN + LINKS)
def test_what_is_no_results_file_of_ours_is_never_replaced(tmp_path, make, what, force):
    path = tmp_path / "target.h5"
    words = make(what, path)
    before, others = seen(path), sorted(tmp_path.iterdir())
    for write in (
        lambda: SweepFile.create(path, PLAN, SYSTEM, force),
        lambda: RunFile(path, np.arange(3.0), {"a.y": "m"}, SYSTEM, force),
        lambda: target.check_continued(path),
    ):
        with pytest.raises(ResultsError) as caught:
            write()
        assert str(caught.value) == f"cannot write {path}: it is {words}, which is not replaced; -o names another file"
    assert seen(path) == before
    assert sorted(tmp_path.iterdir()) == others


@pytest.mark.parametrize("more", [[], ["--force"]], ids=["", "force"])
@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_looks_before_it_builds(hfsa, make, no_builds, verb, more):
    path = Path("mine.txt")
    make("text", path)
    before = seen(path)
    code, out, err = hfsa(*VERBS[verb], "-o", path, *more)
    assert (code, out) == (2, "")
    assert err == "error: cannot write mine.txt: it is a text file, which is not replaced; -o names another file\n"
    assert seen(path) == before


@pytest.mark.parametrize("place", [".", "/", "", ".."])
@pytest.mark.parametrize("verb", [*VERBS, "bode", "compare"])
def test_a_folder_is_no_file(hfsa, no_builds, results, verb, place):
    words = {"bode": ["bode", results], "compare": ["compare", "mass_on_spring", "--over", "damping=1,2"]}
    code, out, err = hfsa(*words.get(verb, VERBS.get(verb)), "-o", place)
    assert (code, out) == (2, "")
    assert err.startswith("error: cannot write ")
    assert "Traceback" not in err


def test_neither_the_scene_nor_its_fmu_is_replaced_by_its_results(hfsa, box, foreign, tmp_path):
    own = shutil.copy(foreign[2], tmp_path / "own.fmu")
    scene = box(own)
    for path, word in ((scene, "a text file"), (own, "an FMU")):
        before = seen(path)
        code, _, err = hfsa("run", scene, "-o", path, "--force")
        assert code == 2
        assert word in err
        assert seen(path) == before


@given(st.sampled_from([b"", b"\x89HDF\r\n\x1a\n", b"PK\x03\x04", b"%PDF-", b"<?xml "]), st.binary(max_size=1500))
def test_whatever_a_file_holds_it_is_refused_in_words(tmp_path_factory, beginning, rest):
    path = tmp_path_factory.getbasetemp() / "anything.h5"
    path.write_bytes(beginning + rest)
    with pytest.raises(ResultsError, match=r"it is an? .*, which is not replaced; -o names another file"):
        target.check_new(path, force=True)
    assert path.read_bytes() == beginning + rest


def test_a_read_only_results_file_stays(results):
    """Also root's: it was marked so by somebody."""
    results.chmod(0o444)
    before = seen(results)
    for write in (lambda: swept(results, force=True), lambda: target.check_continued(results)):
        with pytest.raises(ResultsError, match="it is a results file that is read-only; -o names another file"):
            write()
    assert seen(results) == before


@pytest.mark.parametrize("place", ["new.h5", "missing/folder/new.h5"])
def test_a_folder_that_takes_no_files_is_named(place):
    """The system lets root write everywhere, so it is asked as somebody else, who has imported all he needs."""
    script = """
        import os, sys, h5py
        from pathlib import Path
        from hfsa.cosim.results.target import check_new, check_picture
        if os.geteuid() == 0: os.setuid(65534)
        for check, ending in ((check_new, ".h5"), (check_picture, ".png")):
            try: check(Path(sys.argv[1]).with_suffix(ending))
            except RuntimeError as error: print(error)
    """
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o555)
        command = [sys.executable, "-c", textwrap.dedent(script), os.path.join(folder, place)]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        assert done.stdout.count(f": the folder {folder} is not writable\n") == 2
        assert os.listdir(folder) == []


def test_a_folder_is_made_where_there_is_none(tmp_path, make):
    path = tmp_path / "a" / "b" / "new.h5"
    swept(path)
    assert read_sweep(path).attributes["status"] == "complete"
    make("text", tmp_path / "file")
    with pytest.raises(ResultsError, match=r"cannot write .*: Not a directory"):
        swept(tmp_path / "file" / "new.h5")


def test_names_as_long_as_they_may_be(tmp_path):
    path = tmp_path / ("ü" * 125 + ".h5")
    swept(path)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    with pytest.raises(ResultsError, match="File name too long"):
        swept(tmp_path / ("x" * 300))


# Results files of ours ------------------------------------------------------------------------------------------------


def test_results_give_way_only_where_that_is_asked_for(hfsa):
    for words, ways in ((RUN, "--force replaces it, -o names another file"),
                        (LINEAR, "--resume continues it, --force replaces it, -o names another file")):  # fmt: skip
        assert hfsa(*words, "-o", "a.h5")[0] == 0
        before = seen(Path("a.h5"))
        code, out, err = hfsa(*words, "-o", "a.h5")
        assert (code, out, err) == (2, "", f"error: a.h5 is a results file already: {ways}\n")
        assert seen(Path("a.h5")) == before
        assert hfsa(*words, "-o", "a.h5", "--force")[0] == 0
        assert seen(Path("a.h5")) != before
        Path("a.h5").unlink()
    assert [path.name for path in Path().iterdir()] == []


def test_a_sweep_goes_on_or_replaces_but_not_both(hfsa):
    assert hfsa(*LINEAR, "-o", "a.h5")[0] == 0
    first = os.stat("a.h5").st_ino
    code, _, err = hfsa(*LINEAR, "-o", "a.h5", "--resume", "--force")
    assert code == 2
    assert "--resume continues a results file, --force replaces it; expected one of them" in err
    assert hfsa(*LINEAR, "-o", "a.h5", "--resume")[0] == 0
    assert os.stat("a.h5").st_ino == first
    assert hfsa(*RUN, "-o", "run.h5")[0] == 0
    code, _, err = hfsa(*LINEAR, "-o", "run.h5", "--resume")
    assert code == 2
    assert "run.h5 holds no sweep to resume" in err


def test_a_measurement_is_not_lost_to_the_theory_of_the_same_scene(hfsa):
    assert hfsa(*VERBS["sweep"])[0] == 0
    before = seen(Path("results/mass_on_spring.h5"))
    for words, file in ((LINEAR, "mass_on_spring_linear"), (VERBS["open loop"], "sdelta_hfsa_open_loop")):
        code, out, _ = hfsa(*words)
        assert code == 0
        assert out.startswith(f"results/{file}.h5: ")
    assert seen(Path("results/mass_on_spring.h5")) == before


def test_maps_give_way_like_runs(hfsa):
    for verb in ("stability", "analyze"):
        words = [*VERBS[verb], "-o", "map.h5"]
        assert hfsa(*words)[0] == 0
        before = seen(Path("map.h5"))
        code, _, err = hfsa(*words)
        assert code == 2
        assert "map.h5 is a results file already: --force replaces it" in err
        assert seen(Path("map.h5")) == before
        assert hfsa(*words, "--force")[0] == 0
        for path in ("map.h5", "map.png"):
            os.unlink(path)
    for words in (["stability", "mass_on_spring"], ["analyze", "tba_accelerometer", "--sensitivity"]):
        code, _, err = hfsa(*words, "--force")
        assert code == 2
        assert "--force" in err


def test_a_comparison_looks_at_all_its_files_first(hfsa, make, monkeypatch):
    words = ["compare", "mass_on_spring", "--over", "damping=1,2", "--stop", "0.01", "-j", "1", "-o", "out/it.png"]
    assert hfsa(*words)[0] == 0
    files = sorted(Path("out").iterdir())
    assert len(files) == 3
    files[0].unlink()
    before = [seen(path) for path in files[1:]]
    code, out, err = hfsa(*words)
    assert (code, out) == (2, "")
    assert f"{files[1]} is a results file already: --force replaces it, -o names a figure in another folder" in err
    assert [seen(path) for path in files[1:]] == before
    assert hfsa(*words, "--force")[0] == 0
    assert sorted(Path("out").iterdir()) == files
    files[2].unlink()
    make("text", files[2])
    code, _, err = hfsa(*words, "--force")
    assert code == 2
    assert f"cannot write {files[2]}: it is a text file" in err


def test_a_refused_run_or_sweep_has_touched_nothing(hfsa, monkeypatch):
    exact = ["run", "stage_bode", "-p", "stage=exact", "--stop", "1e-4"]
    assert hfsa(*exact, "-o", "a.h5")[0] == 0
    before = seen(Path("a.h5"))
    code, _, err = hfsa(*exact, "--algorithm", "error_controlled", "--tolerance", "1e-9", "-o", "a.h5", "--force")
    assert code == 2
    assert "solves its own equations to" in err
    assert seen(Path("a.h5")) == before
    assert hfsa(*VERBS["sweep"], "-o", "b.h5")[0] == 0
    before = seen(Path("b.h5"))

    def refuse(*_):
        raise StructureError("no such step")

    monkeypatch.setattr("hfsa.cosim.experiments.sweep.judge", refuse)
    assert hfsa(*VERBS["sweep"], "-o", "b.h5", "--force") == (2, "", "error: no such step\n")
    assert seen(Path("b.h5")) == before


@pytest.mark.parametrize("more", [[], ["--resume"]], ids=["", "resume"])
def test_a_link_to_results_stays_a_link(hfsa, more):
    assert hfsa(*LINEAR, "-o", "real/a.h5")[0] == 0
    Path("link.h5").symlink_to("real/a.h5")
    code, _, err = hfsa(*LINEAR, "-o", "link.h5")
    assert code == 2
    assert "link.h5 is a symbolic link to real/a.h5, a results file already: --resume continues it" in err
    before = os.stat("real/a.h5").st_ino
    assert hfsa(*LINEAR, "-o", "link.h5", *(more or ["--force"]))[0] == 0
    assert Path("link.h5").is_symlink()
    assert (os.stat("real/a.h5").st_ino == before) is bool(more)
    assert [path.name for path in Path("real").iterdir()] == ["a.h5"]


def test_the_old_file_stays_until_the_new_one_is_complete(results):
    """A disk that is too small for the new frame, and a Ctrl-C in the middle of it."""
    before = seen(results)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    large = Plan(np.linspace(1, 50, 20_000), PLAN.outputs, PLAN.inputs)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, hard))
    try:
        with pytest.raises(ResultsError, match="File too large"):
            SweepFile.create(results, large, SYSTEM, force=True)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert seen(results) == before

    class Interrupting(dict):
        def items(self):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        SweepFile.create(results, Plan(PLAN.frequency, PLAN.outputs, PLAN.inputs, Interrupting()), SYSTEM, force=True)
    assert seen(results) == before
    assert [path.name for path in results.parent.iterdir()] == [results.name]


def test_unfinished_files_of_others_are_left_alone(tmp_path):
    other = tmp_path / "new.h5.part"
    other.write_text("mine")
    swept(tmp_path / "new.h5")
    assert other.read_text() == "mine"


# Other processes ------------------------------------------------------------------------------------------------------

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
    """Two processes that write sweeps at one frequency of their own, 1 Hz and 2 Hz, when they are told to."""
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


def told(child, line: str) -> str:
    child.stdin.write(f"{line}\n")
    return child.stdout.readline().strip()


def raced(children, path: Path, force: str) -> list[str]:
    """Tell both to begin at once; returns what they say."""
    for child in children:
        child.stdin.write(f"{path} {force}\n")
    said = [child.stdout.readline().strip() for child in children]
    ended = [told(child, "go on") for child in children]
    assert ended == ["done" if word == "won" else "gone" for word in said]
    return said


@pytest.mark.parametrize(
    ("kind", "force"), [((), ""), (("no_links",), ""), ((), "force")], ids=["", "no_links", "force"]
)
def test_of_two_that_start_together_exactly_one_wins(writers, tmp_path, kind, force):
    children, losers = writers(*kind), set()
    for number in range(10):
        path = tmp_path / f"{number}.h5"
        if force:
            swept(path)
        said = raced(children, path, force)
        assert said.count("won") == 1, said
        winner = said.index("won")
        losers.add(said[1 - winner].replace(str(path), "it"))
        bode = read_sweep(path)
        assert bode.frequency.tolist() == [1.0 + winner]
        assert bode.attributes["status"] == "complete"
        assert sorted(p.name for p in tmp_path.iterdir()) == sorted(f"{n}.h5" for n in range(number + 1))
    assert losers <= {"cannot write it: another process is writing it",
                      "cannot write it: it is an empty file, which is not replaced; -o names another file"}  # fmt: skip


@pytest.mark.parametrize("force", ["", "force"])
def test_a_file_that_is_being_written_is_refused_to_others(writers, tmp_path, hfsa, force):
    first, second = writers()
    path = tmp_path / "a.h5"
    assert told(first, f"{path}") == "won"
    assert told(second, f"{path} {force}") == f"cannot write {path}: another process is writing it"
    more = ["--force"] if force else []
    for words in (RUN, LINEAR, [*LINEAR, "--resume"] if not force else LINEAR):
        assert hfsa(*words, "-o", path, *more)[::2] == (
            2,
            f"error: cannot write {path}: another process is writing it\n",
        )
    assert (told(second, "go on"), told(first, "go on")) == ("gone", "done")
    assert read_sweep(path).frequency.tolist() == [1.0]
    assert told(second, f"{path} force") == "won"
    assert told(second, "go on") == "done"
    assert read_sweep(path).frequency.tolist() == [2.0]


def test_a_file_that_somebody_reads_is_not_replaced(results, monkeypatch):
    monkeypatch.setattr(locks, "_PATIENCE", 0.1)
    with h5py.File(results) as file:
        with pytest.raises(ResultsError, match="another process is reading it"):
            swept(results, force=True)
        with pytest.raises(ResultsError, match="another process is reading it"):
            SweepFile.resume(results, PLAN, SYSTEM)
        assert file["bode/status"][:].tolist() == [[1], [1]]
    swept(results, force=True)


@pytest.mark.parametrize("how", ["removed", "replaced"])
def test_a_file_that_loses_its_name_is_told(tmp_path, how):
    path = tmp_path / "a.h5"
    file = SweepFile.create(path, PLAN, SYSTEM)
    if how == "removed":
        path.unlink()
    else:
        swept(tmp_path / "b.h5")
        os.replace(tmp_path / "b.h5", path)
    with pytest.raises(ResultsError, match=r"a.h5 was removed or replaced by another program; its contents are lost"):
        file.close()
    with pytest.raises(ResultsError, match="was removed or replaced"):
        file.identity.check(path)


@pytest.mark.parametrize("code", ["ENOLCK", "ENOTSUP", "ENOSYS"])
def test_a_file_system_without_locks_will_do(tmp_path, code):
    """As some network file systems: everything works, a file that is there is not replaced unasked."""
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
        said = raced(children, path, "")
        assert said.count("won") == 1, said
        assert read_sweep(path).frequency.tolist() == [1.0 + said.index("won")]


# Pictures and FMUs ----------------------------------------------------------------------------------------------------


@pytest.fixture
def figure():
    from matplotlib.figure import Figure

    return Figure()


@pytest.mark.parametrize("ending", ["png", "pdf", "svg", "jpg", "eps", "tif", "webp"])
def test_a_picture_gives_way_to_one_of_its_kind_alone(tmp_path, make, figure, ending):
    path = tmp_path / f"it.{ending}"
    for _ in range(2):
        save(figure, path)
    for what in FORBIDDEN:
        if what == "picture" and ending == "png":
            continue
        other = tmp_path / f"{what}.{ending}"
        words = make(what, other)
        before = seen(other)
        with pytest.raises(ResultsError) as caught:
            save(figure, other)
        assert f"it is {words}, which is not replaced" in str(caught.value)
        assert seen(other) == before


def test_pictures_of_verbs_are_looked_at_first(hfsa, make, no_builds, results):
    make("text", Path("map.png"))
    for verb in ("stability", "analyze"):
        code, _, err = hfsa(*VERBS[verb], "-o", "map.h5")
        assert code == 2
        assert "cannot write map.png: it is a text file" in err
    for path, words in (("map.png", "it is a text file"), ("x", "its ending is no picture format"),
                        (results, "its ending is no picture format")):  # fmt: skip
        for verb in (["bode", results], ["compare", "mass_on_spring", "--over", "damping=1,2"]):
            code, _, err = hfsa(*verb, "-o", path)
            assert code == 2
            assert f"cannot write {path}: {words}" in err
    assert not list(Path().glob("map.h5"))


@pytest.mark.parametrize("old", [False, True], ids=["new", "old"])
def test_a_full_disk_leaves_no_half_a_picture(hfsa, results, old):
    if old:
        assert hfsa("bode", results)[0] == 0
    before = sorted((path.name, seen(path)) for path in Path().iterdir())
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        code, out, err = hfsa("bode", results)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert (code, out) == (4, "")
    assert "old.png: File too large" in err
    assert sorted((path.name, seen(path)) for path in Path().iterdir()) == before


def test_an_fmu_gives_way_to_an_fmu_alone(hfsa, make, mass_on_spring_files):
    words = ["export", "mass_on_spring", "--fmi", "2", "-o"]
    assert hfsa(*words, "a")[0] == 0
    assert hfsa(*words, "a")[0] == 0
    for what in ("text", "folder", "fifo", "hdf5", "link to text"):
        path = Path(what.replace(" ", "_")) / "MassOnSpring.fmi2.fmu"
        word = make(what, path)
        before = seen(path)
        code, _, err = hfsa(*words, path.parent)
        assert code == 2
        assert f"cannot write {path}: it is {word}" in err
        assert seen(path) == before
    code, _, err = hfsa(*words, "a/MassOnSpring.fmi2.fmu")
    assert code == 2
    assert "Not a directory" in err
    Path("b").mkdir()
    shutil.copy(mass_on_spring_files[2], "real.fmu")
    Path("b/MassOnSpring.fmi2.fmu").symlink_to("../real.fmu")
    before = seen(Path("real.fmu"))
    assert hfsa(*words, "b")[0] == 0
    assert Path("b/MassOnSpring.fmi2.fmu").is_symlink()
    assert seen(Path("real.fmu")) != before
