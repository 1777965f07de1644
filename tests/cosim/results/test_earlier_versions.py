"""Results files of version 0.1 open, resume and draw; they were made by that version (`tests/data`)."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from hfsa.cosim import read
from hfsa.cosim.results.files import Status

DATA = Path(__file__).parents[2] / "data"
SWEEP = [
    "sweep",
    "mass_on_spring",
    "-p",
    "damping=5",
    "--from",
    "5",
    "--to",
    "50",
    "--points",
    "6",
    "--grid",
    "log",
    "-j1",
]


@pytest.fixture(autouse=True)
def copies(tmp_path):
    for file in DATA.glob("*_0.1.h5"):
        shutil.copy(file, tmp_path)


def gain(f):
    s = 2j * np.pi * f
    return 1e4 / (s**2 + 5 * s + 1e4)


def test_they_open():
    sweep, linear, run = (read(DATA / f"{name}_0.1.h5") for name in ("sweep", "linear", "run"))
    assert sweep.attributes["tool_version"] == "0.1.0"
    assert [int(np.sum(sweep.status == status)) for status in (Status.DONE, Status.PENDING)] == [3, 3]
    np.testing.assert_allclose(sweep.response[:3, 0, 0], gain(sweep.frequency[:3]), rtol=2e-2)
    assert np.isnan(sweep.step_error).all()
    assert linear.response.shape == (30, 6, 1)
    assert run["mass.position"].shape == run.time.shape


def test_they_resume(hfsa, tmp_path):
    """What is measured stays as it is; the rest is measured now, which the command says."""
    before = read("sweep_0.1.h5")
    code, out, err = hfsa(*SWEEP, "--algorithm", "gauss_seidel", "--resume", "-o", "sweep_0.1.h5")
    assert (code, out.splitlines()[0]) == (0, "sweep_0.1.h5: 6 done")
    assert "the finished points were measured by hfsa 0.1.0" in err
    after = read("sweep_0.1.h5")
    assert np.array_equal(after.response[:3], before.response[:3])
    np.testing.assert_allclose(after.response[:, 0, 0], gain(after.frequency), rtol=2e-2)
    assert after.attributes["status"] == "complete"


def test_another_scene_does_not_resume_them(hfsa):
    other = [word if word != "damping=5" else "damping=4" for word in SWEEP]
    code, _, err = hfsa(*other, "--algorithm", "gauss_seidel", "--resume", "-o", "sweep_0.1.h5")
    assert code == 2
    assert "the scene is another" in err


def test_a_sweep_of_branches_does_not_resume_them(hfsa):
    """They have no room for a downward sweep, and no setting that tells so."""
    ask = [*SWEEP, "--algorithm", "gauss_seidel", "--start", "previous", "--resume", "-o", "sweep_0.1.h5"]
    code, _, err = hfsa(*ask)
    assert code == 2
    assert "it has no downward sweep" in err


def test_they_are_drawn(hfsa):
    for name in ("sweep", "linear"):
        assert hfsa("bode", f"{name}_0.1.h5", "-o", f"{name}.png")[0] == 0
        assert Path(f"{name}.png").stat().st_size > 10_000
