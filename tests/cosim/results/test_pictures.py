"""Pictures and FMUs: replaced by files of the same kind only, completely or not at all."""

import resource
import shutil
from pathlib import Path

import pytest
from output_files import FORBIDDEN, VERBS, path_state

from hfsa.cosim.figures.style import save
from hfsa.cosim.results.files import (
    ResultsError,
)


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
        before = path_state(other)
        with pytest.raises(ResultsError) as caught:
            save(figure, other)
        assert f"it is {words}, which is not replaced" in str(caught.value)
        assert path_state(other) == before


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
    before = sorted((path.name, path_state(path)) for path in Path().iterdir())
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        code, out, err = hfsa("bode", results)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert (code, out) == (4, "")
    assert "old.png: File too large" in err
    assert sorted((path.name, path_state(path)) for path in Path().iterdir()) == before


def test_an_fmu_gives_way_to_an_fmu_alone(hfsa, make, mass_on_spring_files):
    words = ["export", "mass_on_spring", "--fmi", "2", "-o"]
    assert hfsa(*words, "a")[0] == 0
    assert hfsa(*words, "a")[0] == 0
    for what in ("text", "folder", "fifo", "hdf5", "link to text"):
        path = Path(what.replace(" ", "_")) / "MassOnSpring.fmi2.fmu"
        word = make(what, path)
        before = path_state(path)
        code, _, err = hfsa(*words, path.parent)
        assert code == 2
        assert f"cannot write {path}: it is {word}" in err
        assert path_state(path) == before
    code, _, err = hfsa(*words, "a/MassOnSpring.fmi2.fmu")
    assert code == 2
    assert "is a file, expected a folder" in err
    Path("b").mkdir()
    shutil.copy(mass_on_spring_files[2], "real.fmu")
    Path("b/MassOnSpring.fmi2.fmu").symlink_to("../real.fmu")
    before = path_state(Path("real.fmu"))
    assert hfsa(*words, "b")[0] == 0
    assert Path("b/MassOnSpring.fmi2.fmu").is_symlink()
    assert path_state(Path("real.fmu")) != before
