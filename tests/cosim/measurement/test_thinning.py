"""Thinned files of runs: the rows that are kept, the limits that no row may miss, and the sizes that are told."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mass_and_law import law, plant

from hfsa.cosim.actions.divergence import DivergenceError, Scale
from hfsa.cosim.actions.recording import Recording
from hfsa.cosim.fmi.assembly import Assembly
from hfsa.cosim.measurement.kept_rows import KeptRows
from hfsa.cosim.measurement.limit_flags import active_limits
from hfsa.cosim.measurement.run import RunPlan, run
from hfsa.cosim.measurement.verification import verify
from hfsa.cosim.results.files import SystemRecord, read_errors, read_run, read_step_size
from hfsa.cosim.systems.system import Component, Connection, System

NAMES = ("mass.position", "mass.velocity")


@pytest.fixture
def plan(exported, library, monkeypatch, tmp_path) -> RunPlan:
    """A mass of 1 kg that a law of 100 N/m and 1 N.s/m holds, in a run of 1 s."""
    monkeypatch.chdir(tmp_path)
    start = {"stiffness": 100.0, "damping": 1.0}
    system = System(
        [Component("mass", "x", start={"q": 1.0}), Component("law", "x", start=start)],
        [*(Connection(n, f"law.{n.partition('.')[2]}") for n in NAMES), Connection("law.force", "mass.force")],
    )
    files = {"mass": exported(plant())[2], "law": exported(law())[2]}
    return RunPlan(Assembly.read(system, files), NAMES, 1.0, 1e-3, SystemRecord("held", ""), "gauss_seidel", library)


@pytest.mark.parametrize("every", [1, 7, 250, 999, 5000])
def test_a_thinned_file_has_every_so_many_rows_and_the_last(plan, every):
    """Bit by bit those of the whole file, in a file that is smaller by the rows that are missing."""
    run(plan, Path("whole.h5"))
    run(replace(plan, every=every), Path("thin.h5"))
    whole, thin = read_run("whole.h5")[0], read_run("thin.h5")[0]
    kept = sorted({*range(0, 1001, every), 1000})
    for name, values in whole.items():
        assert np.array_equal(values[kept], thin[name])
    sizes = [Path(name).stat().st_size for name in ("whole.h5", "thin.h5")]
    assert sizes[0] - sizes[1] == 8 * len(whole) * (1001 - len(kept))
    assert read_step_size("thin.h5") == 1e-3


@pytest.mark.parametrize("every", [1, 64])
def test_a_run_that_ends_early_keeps_its_last_point(plan, every):
    """The point at which it diverges is a row, whether or not it was to be one, and time rises up to it."""
    limit = {"mass.velocity": Scale(9.0e-3, "m/s", "a scale")}
    with pytest.raises(DivergenceError) as caught:
        run(replace(plan, scales=limit, every=every), Path("it.h5"))
    values = read_run("it.h5")[0]
    reached = np.isfinite(values["mass.velocity"])
    time = values["time"][reached]
    assert time[-1] == caught.value.time
    assert abs(values["mass.velocity"][reached][-1]) > 9.0
    assert np.all(np.diff(time) > 0)
    assert reached.sum() == sum(reached[: reached.sum()])  # no gap


@pytest.mark.parametrize("every", [1, 100])
def test_errors_of_a_thinned_run_are_those_at_its_rows(plan, every):
    """Held forces err by a first-order amount: the estimate is as large as the deviation from a far finer run."""
    thin = replace(plan, every=every)
    run(thin, Path("thin.h5"))
    verify(thin, Path("thin.h5"))
    run(replace(plan, step_size=1e-3 / 64, every=64 * every), Path("fine.h5"))
    found, fine = read_run("thin.h5")[0], read_run("fine.h5")[0]
    for name, error in read_errors("thin.h5").items():
        assert error.absolute == pytest.approx(np.abs(found[name] - fine[name]).max(), rel=0.05)


@pytest.mark.parametrize("every", [1, 30])
@pytest.mark.parametrize("is_compiled", [True, False], ids=["c", "python"])
def test_a_run_in_little_memory_is_the_same(plan, monkeypatch, every, is_compiled):
    """A recording of 16 points, which grows and forgets: its file is that of a recording of all points."""
    plan = replace(plan, every=every, library=plan.library if is_compiled else None)
    run(plan, Path("whole.h5"))
    monkeypatch.setattr("hfsa.cosim.measurement.run._CAPACITY", 16)
    run(plan, Path("little.h5"))
    whole = read_run("whole.h5")[0]
    for name, values in read_run("little.h5")[0].items():
        assert np.array_equal(values, whole[name])


@given(st.integers(1, 60), st.integers(1, 20), st.lists(st.integers(1, 60), max_size=6), st.integers(0, 2**60))
def test_no_limit_is_missed_between_two_rows(steps, every, calls, bits):
    """However the blocks fall, a flag is the fraction of active points since the row before; others are as recorded."""
    flags = np.array([bits >> k & 1 for k in range(steps + 1)], dtype=float)
    recording = Recording(("a.value", "a.saturation"), steps + 1)
    kept = np.unique(np.append(np.arange(0, steps + 1, every), steps))
    rows, blocks, done = KeptRows(recording, kept, ["a.saturation"]), [], 0
    for reached in [*sorted(min(call, steps + 1) for call in calls), steps + 1]:
        time, room = recording.room
        fresh = slice(recording.rows, recording.rows + reached - done)
        time[fresh], room[fresh] = (
            np.arange(done, reached),
            np.transpose([np.arange(done, reached), flags[done:reached]]),
        )
        recording.rows, done = fresh.stop, reached
        blocks.append(rows.take())
    value, flag = (np.concatenate([block[name] for block in blocks]) for name in recording.names)
    assert np.array_equal(value, kept)
    begins = [0, *(kept[:-1] + 1)]
    assert flag == pytest.approx([flags[b : e + 1].mean() for b, e in zip(begins, kept, strict=True)], rel=1e-15)
    assert not rows.is_behind
    if not flags.any():
        assert rows.limits.active == []
        return
    (found,) = rows.limits.active
    active = np.flatnonzero(flags)
    rests = np.flatnonzero(flags == 0)
    lasting = (rests[-1] + 1 if len(rests) else 0) if flags[-1] else None
    assert (found.first_time, found.lasting_since) == (active[0], lasting)
    assert found.share == pytest.approx(flags.mean(), rel=1e-15)
    assert active_limits(np.arange(steps + 1), {"a.saturation": flags, "a.value": flags}) == [found]
    of_rows = active_limits(kept, {"a.saturation": flag})
    assert kept[np.argmax(flag > 0)] == of_rows[0].first_time >= found.first_time


def test_a_large_file_is_announced_with_what_makes_it_small(plan):
    """4 s at 10 us of 25 variables are 83 MB; forty times that is too much, and the advice holds."""
    small = replace(plan, names=tuple(f"mass.x[{i}]" for i in range(25)), stop_time=4.0, step_size=1e-5)
    assert small.size_sentence == ""
    large = replace(small, stop_time=160.0)
    found = re.fullmatch(
        r"the file will have (\d+) MB, 25 variables at 16000001 points; --every (\d+) makes it (\d+) MB",
        large.size_sentence,
    )
    assert found is not None
    assert int(found[1]) == 3328
    thinned = replace(large, every=int(found[2]))
    assert thinned.size_sentence == ""
    assert int(found[3]) == round(8 * 26 * len(thinned.kept) / 1e6) <= 100


def test_the_answer_says_what_is_kept_and_its_size(hfsa):
    """An interval is a number of steps; the size is that of the file."""
    code, out, err = hfsa("run", "mass_on_spring", "--stop", "0.1", "--interval", "2e-3", "-o", "a.h5")
    assert (code, err) == (0, "")
    size = Path("a.h5").stat().st_size
    assert out.startswith(f"a.h5: 0.1 s in 1000 steps, of which 51 points are kept, {size / 1e3:.3g} kB\n")
    assert hfsa("run", "mass_on_spring", "--stop", "0.1", "--every", "20", "-o", "b.h5")[0] == 0
    for name, values in read_run("a.h5")[0].items():
        assert np.array_equal(values, read_run("b.h5")[0][name])
