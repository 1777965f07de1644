"""Output paths: only results files of hfsa are ever replaced; every other file stays."""

import os
import shutil
import subprocess
import sys
import tempfile
import textwrap
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from output_files import FORBIDDEN, LINKS, PLAN, SYSTEM, VERBS, path_state, write_sweep

from hfsa.cosim.results import target
from hfsa.cosim.results.files import (
    ResultsError,
    RunFile,
    SweepFile,
    read_sweep,
)


@pytest.mark.parametrize("force", [False, True])
@pytest.mark.parametrize("what", FORBIDDEN + LINKS)
def test_what_is_no_results_file_of_ours_is_never_replaced(tmp_path, make, what, force):
    path = tmp_path / "target.h5"
    words = make(what, path)
    before, others = path_state(path), sorted(tmp_path.iterdir())
    for write in (
        lambda: SweepFile.create(path, PLAN, SYSTEM, force),
        lambda: RunFile(path, np.arange(3.0), {"a.y": "m"}, SYSTEM, force),
        lambda: target.check_continued(path),
    ):
        with pytest.raises(ResultsError) as caught:
            write()
        assert str(caught.value) == f"cannot write {path}: it is {words}, which is not replaced; -o names another file"
    assert path_state(path) == before
    assert sorted(tmp_path.iterdir()) == others


@pytest.mark.parametrize("more", [[], ["--force"]], ids=["", "force"])
@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_looks_before_it_builds(hfsa, make, no_builds, verb, more):
    path = Path("mine.txt")
    make("text", path)
    before = path_state(path)
    code, out, err = hfsa(*VERBS[verb], "-o", path, *more)
    assert (code, out) == (2, "")
    assert err == "error: cannot write mine.txt: it is a text file, which is not replaced; -o names another file\n"
    assert path_state(path) == before


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
        before = path_state(path)
        code, _, err = hfsa("run", scene, "-o", path, "--force")
        assert code == 2
        assert word in err
        assert path_state(path) == before


@given(st.sampled_from([b"", b"\x89HDF\r\n\x1a\n", b"PK\x03\x04", b"%PDF-", b"<?xml "]), st.binary(max_size=1500))
def test_whatever_a_file_holds_it_is_refused_in_words(tmp_path_factory, beginning, rest):
    path = tmp_path_factory.getbasetemp() / "anything.h5"
    path.write_bytes(beginning + rest)
    with pytest.raises(ResultsError, match=r"it is an? .*, which is not replaced; -o names another file"):
        target.check_new(path, force=True)
    assert path.read_bytes() == beginning + rest


def test_a_read_only_results_file_stays(results):
    """Also for root: the owner marked it read-only."""
    results.chmod(0o444)
    before = path_state(results)
    for write in (lambda: write_sweep(results, force=True), lambda: target.check_continued(results)):
        with pytest.raises(ResultsError, match="it is a results file that is read-only; -o names another file"):
            write()
    assert path_state(results) == before


@pytest.mark.parametrize("place", ["new.h5", "missing/folder/new.h5"])
def test_a_folder_that_takes_no_files_is_named(place):
    """Root may write everywhere, so the check runs as another user, with all imports done before."""
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
    write_sweep(path)
    assert read_sweep(path).attributes["status"] == "complete"
    make("text", tmp_path / "file")
    with pytest.raises(ResultsError, match=r"cannot write .*: Not a directory"):
        write_sweep(tmp_path / "file" / "new.h5")


def test_names_as_long_as_they_may_be(tmp_path):
    path = tmp_path / ("ü" * 125 + ".h5")
    write_sweep(path)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]
    with pytest.raises(ResultsError, match="File name too long"):
        write_sweep(tmp_path / ("x" * 300))
