"""Branches of a nonlinear response, followed up and down: the folds of a Duffing oscillator by harmonic balance."""

import h5py
import numpy as np
import pytest
from duffing import balanced_amplitudes, duffing_scene, folds

from hfsa.cosim import read
from hfsa.cosim.analysis.steady_start import SteadyStart
from hfsa.cosim.measurement import branches
from hfsa.cosim.measurement.rig import Bench, Settings, Task
from hfsa.cosim.results.files import Status
from hfsa.cosim.signals.branches import DIFFERENT, JUMP_DOWN, JUMP_UP
from hfsa.cosim.systems.errors import StructureError

FORCE = 25.0
SWEEP = ["--amplitude", FORCE, "--from", 17, "--to", 20.5, "--points", 9, "--grid", "log", "--start", "previous"]


@pytest.fixture
def scene(tmp_path):
    return duffing_scene(tmp_path)


def test_the_jumps_are_at_the_folds(hfsa, scene):
    """Both sweeps are on the branches of harmonic balance, and jump in the intervals of its two folds."""
    code, out, _ = hfsa("sweep", scene, *SWEEP, "-o", "it.h5")
    assert code == 0
    bode = read("it.h5")
    f, down = bode.frequency, bode.downward
    low, high = folds(FORCE, f[0], f[-1])
    flags = down.branches[:, 0]
    assert np.array_equal(np.flatnonzero(flags & JUMP_UP), [np.searchsorted(f, high)])
    assert np.array_equal(np.flatnonzero(flags & JUMP_DOWN), [np.searchsorted(f, low) - 1])
    assert np.array_equal((flags & DIFFERENT) > 0, (f > low) & (f < high))
    found = [balanced_amplitudes(frequency, FORCE) for frequency in f]
    up, back = (np.abs(side.response[:, 0, 0]) * FORCE for side in (bode, down))
    np.testing.assert_allclose(up, [sizes[-1] for sizes in found], rtol=1e-2)
    np.testing.assert_allclose(back, [sizes[0] for sizes in found], rtol=1e-2)
    intervals = [
        f"{f[k]:.6g} and {f[k + 1]:.6g} Hz" for k in (np.searchsorted(f, high) - 1, np.searchsorted(f, low) - 1)
    ]
    line = out.splitlines()[1]
    assert f"upwards it jumps between {intervals[0]}" in line
    assert f"downwards it jumps between {intervals[1]}" in line
    assert bode.to_xarray().response_down.dims == ("frequency", "output", "input")
    assert hfsa("bode", "it.h5", "-o", "it.svg")[0] == 0
    with open("it.svg") as picture:
        assert "stepped sine, downwards" in picture.read()


@pytest.mark.slow
def test_without_folds_both_ways_are_equal(hfsa, scene):
    words = ["sweep", scene, *SWEEP, "--amplitude", 3.0]
    words = [word for k, word in enumerate(words) if k not in (2, 3)]
    code, out, _ = hfsa(*words, "-o", "it.h5")
    bode = read("it.h5")
    assert (code, out.splitlines()[1]) == (0, "  mass.force: upwards and downwards the same response")
    np.testing.assert_allclose(bode.downward.response, bode.response, rtol=2e-3)
    assert not bode.downward.branches.any()


def test_an_input_that_is_not_complete_is_measured_again_from_its_first_point(hfsa, tmp_path):
    """The other one stays as it is; inputs in two threads give the numbers that one thread gives."""
    scene = duffing_scene(tmp_path, ("one", "two"))
    words = ["sweep", scene, *SWEEP]
    words[words.index("--points") + 1] = 3
    assert hfsa(*words, "-j", "1", "-o", "it.h5")[0] == 0
    assert hfsa(*words, "-j", "2", "-o", "other.h5")[0] == 0
    whole = read("it.h5")
    for side, same in ((whole, read("other.h5")), (whole.downward, read("other.h5").downward)):
        assert np.array_equal(side.response, same.response, equal_nan=True)
        assert np.array_equal(side.steps, same.steps)
    with h5py.File("it.h5", "r+") as file:
        bode = file["bode"]
        bode["status_down"][1, 1] = Status.PENDING
        bode["response"][:, :, 0] *= 2  # would be noticed if it were measured again
        bode["response"][:, :, 1] = np.nan
    assert hfsa(*words, "-j", "1", "-o", "it.h5", "--resume")[0] == 0
    resumed = read("it.h5")
    assert np.array_equal(resumed.response[:, 0, 0], 2 * whole.response[:, 0, 0])
    assert np.array_equal(resumed.response[:, 1, 1], whole.response[:, 1, 1])
    assert np.array_equal(resumed.downward.response, whole.downward.response)
    assert resumed.attributes["status"] == "complete"


def test_what_cannot_go_on_from_a_state_is_refused(hfsa, scene):
    code, _, err = hfsa("sweep", scene, *SWEEP, "--algorithm", "monolithic", "-o", "it.h5")
    assert code == 2
    assert "a branch cannot be followed from point to point, as monolithic has no one-step matrix" in err
    start = SteadyStart({}, np.zeros((2, 0)), None, -1.0)
    bench = Bench(assembly=None, outputs=())  # pyright: ignore[reportArgumentType] (not reached)
    with pytest.raises(StructureError, match="memory beyond the states"):
        branches.check([Task(0, 0, bench, Settings(), 1.0, 1.0, start)])


def test_a_foreign_fmu_is_refused(hfsa, box, foreign):
    code, _, err = hfsa("sweep", box(foreign[2]), "--points", 2, "--start", "previous", "-o", "it.h5")
    assert code == 2
    assert "a branch cannot be followed" in err
