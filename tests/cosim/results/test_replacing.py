"""Results files of hfsa: replaced with --force, resumed with --resume, unchanged after a failure."""

import os
import resource
from pathlib import Path

import numpy as np
import pytest
from output_files import LINEAR, PLAN, RUN, SYSTEM, VERBS, path_state, write_sweep

from hfsa.cosim.results.files import (
    Plan,
    ResultsError,
    SweepFile,
)
from hfsa.cosim.systems.errors import StructureError


def test_results_give_way_only_where_that_is_requested(hfsa):
    for words, ways in ((RUN, "--force replaces it, -o names another file"),
                        (LINEAR, "--resume continues it, --force replaces it, -o names another file")):  # fmt: skip
        assert hfsa(*words, "-o", "a.h5")[0] == 0
        before = path_state(Path("a.h5"))
        code, out, err = hfsa(*words, "-o", "a.h5")
        assert (code, out, err) == (2, "", f"error: a.h5 is a results file already: {ways}\n")
        assert path_state(Path("a.h5")) == before
        assert hfsa(*words, "-o", "a.h5", "--force")[0] == 0
        assert path_state(Path("a.h5")) != before
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
    before = path_state(Path("results/mass_on_spring.h5"))
    for words, file in ((LINEAR, "mass_on_spring.linear"), (VERBS["open loop"], "sdelta_hfsa_open_loop")):
        code, out, _ = hfsa(*words)
        assert code == 0
        assert out.startswith(f"results/{file}.h5: ")
    assert path_state(Path("results/mass_on_spring.h5")) == before


@pytest.mark.slow
def test_maps_give_way_like_runs(hfsa):
    for verb in ("stability", "analyze"):
        words = [*VERBS[verb], "-o", "map.h5"]
        assert hfsa(*words)[0] == 0
        before = path_state(Path("map.h5"))
        code, _, err = hfsa(*words)
        assert code == 2
        assert "map.h5 is a results file already: --force replaces it" in err
        assert path_state(Path("map.h5")) == before
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
    before = [path_state(path) for path in files[1:]]
    code, out, err = hfsa(*words)
    assert (code, out) == (2, "")
    assert f"{files[1]} is a results file already: --force replaces it, -o names a figure in another folder" in err
    assert [path_state(path) for path in files[1:]] == before
    assert hfsa(*words, "--force")[0] == 0
    assert sorted(Path("out").iterdir()) == files
    files[2].unlink()
    make("text", files[2])
    code, _, err = hfsa(*words, "--force")
    assert code == 2
    assert f"cannot write {files[2]}: it is a text file" in err


@pytest.mark.slow
def test_a_refused_run_or_sweep_has_touched_nothing(hfsa, monkeypatch):
    exact = ["run", "stage_bode", "-p", "stage=exact", "--stop", "1e-4"]
    assert hfsa(*exact, "-o", "a.h5")[0] == 0
    before = path_state(Path("a.h5"))
    code, _, err = hfsa(*exact, "--algorithm", "error_controlled", "--tolerance", "1e-9", "-o", "a.h5", "--force")
    assert code == 2
    assert "solves its own equations to" in err
    assert path_state(Path("a.h5")) == before
    assert hfsa(*VERBS["sweep"], "-o", "b.h5")[0] == 0
    before = path_state(Path("b.h5"))

    def refuse(*_):
        raise StructureError("no such step")

    monkeypatch.setattr("hfsa.cosim.experiments.sweep.judge", refuse)
    assert hfsa(*VERBS["sweep"], "-o", "b.h5", "--force") == (2, "", "error: no such step\n")
    assert path_state(Path("b.h5")) == before


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
    """A disk that is too small for the new file, and a Ctrl-C in the middle of its creation."""
    before = path_state(results)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    large = Plan(np.linspace(1, 50, 20_000), PLAN.outputs, PLAN.inputs)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, hard))
    try:
        with pytest.raises(ResultsError, match="File too large"):
            SweepFile.create(results, large, SYSTEM, force=True)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert path_state(results) == before

    class Interrupting(dict):
        def items(self):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        SweepFile.create(results, Plan(PLAN.frequency, PLAN.outputs, PLAN.inputs, Interrupting()), SYSTEM, force=True)
    assert path_state(results) == before
    assert [path.name for path in results.parent.iterdir()] == [results.name]


def test_unfinished_files_of_others_are_left_alone(tmp_path):
    other = tmp_path / "new.h5.part"
    other.write_text("mine")
    write_sweep(tmp_path / "new.h5")
    assert other.read_text() == "mine"
