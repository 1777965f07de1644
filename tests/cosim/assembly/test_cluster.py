"""A cluster gives the numbers of this machine, and loses none with its workers."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from hfsa.cosim import compare, stability_map, sweep
from hfsa.cosim.assembly import cluster as module
from hfsa.cosim.experiments.stability_map import parse_axis
from hfsa.cosim.measurement import pool
from hfsa.cosim.results.files import Status, read_sweep
from hfsa.cosim.systems.errors import StructureError

VERTICAL = {"inputs": ["command.position[3]"], "points": 8}
SLOW = {"parameters": {"damping": "0.5"}, "points": 12, "start": "rest"}


def same(found, expected):
    """Assert that two sweeps are complete and have the same bits."""
    assert np.all(found.status == Status.DONE)
    for name in ("response", "harmonic_distortion", "remaining_transient"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))


def received(cache: Path) -> dict[str, int]:
    """Return the FMUs in a cache with the time at which each was written."""
    return {file.name: file.stat().st_mtime_ns for file in cache.glob("received/*/*.fmu")}


@pytest.mark.slow
def test_a_cluster_gives_the_bits_of_this_machine(cluster, tmp_path):
    caches = [cluster.folder / f"worker{i}" / "cache" for i in range(2)]
    here = sweep("sdelta_shaker", path=tmp_path / "here.h5", **VERTICAL)
    there = sweep("sdelta_shaker", path=tmp_path / "there.h5", scheduler=cluster.address, **VERTICAL)
    same(there, here)
    first = [received(cache) for cache in caches]
    assert any(len(files) == 4 for files in first)
    assert all(len(files) in (0, 4) for files in first)
    # a second time, nobody who has a file receives it
    same(sweep("sdelta_shaker", path=tmp_path / "again.h5", scheduler=cluster.address, **VERTICAL), here)
    for before, cache in zip(first, caches, strict=True):
        assert before.items() <= received(cache).items()
    assert not list(cluster.folder.glob("worker*/cache/fmus"))  # nothing was exported there


@pytest.mark.slow
def test_progress_is_that_of_this_machine(cluster, tmp_path):
    parts = []
    sweep(
        "mass_on_spring",
        points=5,
        path=tmp_path / "x.h5",
        scheduler=cluster.address,
        report=lambda part, words: parts.append((part, words)),
    )
    assert [words for _, words in parts] == [f"{n} of 5 points" for n in range(1, 6)]
    assert parts[-1][0] == pytest.approx(1)


@pytest.mark.slow
def test_points_of_a_lost_worker_run_elsewhere(clusters, tmp_path):
    few = clusters(2)
    losses = []

    def lose(*_):
        if not losses:
            losses.append(few.lose(0))

    there = sweep("mass_on_spring", path=tmp_path / "there.h5", scheduler=few.address, report=lose, **SLOW)
    assert losses
    same(there, sweep("mass_on_spring", path=tmp_path / "here.h5", **SLOW))


@pytest.mark.slow
def test_a_worker_may_join_late(clusters, tmp_path):
    one = clusters(1)
    joined = []

    def join(*_):
        if not joined:
            one.lose(0)
            joined.append(one.add_worker())

    there = sweep("mass_on_spring", path=tmp_path / "there.h5", scheduler=one.address, report=join, **SLOW)
    same(there, sweep("mass_on_spring", path=tmp_path / "here.h5", **SLOW))
    assert len(received(joined[0])) == 3


@pytest.mark.slow
def test_without_workers_a_sweep_ends_and_can_be_resumed(clusters, tmp_path, monkeypatch):
    one, path, warnings = clusters(1), tmp_path / "there.h5", []
    monkeypatch.setattr(module, "_ALONE", 3.0)
    with pytest.raises(module.ClusterError, match="has had no worker for 3 s"):
        sweep(
            "mass_on_spring",
            path=path,
            scheduler=one.address,
            report=lambda *_: one.lose(0),
            warn=warnings.append,
            **SLOW,
        )
    assert any("sweep with --resume to continue" in sentence for sentence in warnings)
    done = np.sum(read_sweep(path).status == Status.DONE)
    assert 1 <= done < SLOW["points"]
    same(
        sweep("mass_on_spring", path=path, resume=True, **SLOW),
        sweep("mass_on_spring", path=tmp_path / "here.h5", **SLOW),
    )


@pytest.mark.slow
def test_two_sweeps_on_two_schedulers_at_once(cluster, clusters, tmp_path):
    addresses = [cluster.address, clusters(1).address]
    paths = [tmp_path / f"{i}.h5" for i in range(2)]
    running = [command(path, address, "--points", "6") for path, address in zip(paths, addresses, strict=True)]
    for process in running:
        _, err = process.communicate(timeout=300)
        assert (process.returncode, err) == (0, "")
    here = sweep("mass_on_spring", {"damping": "2"}, points=6, start="rest", path=tmp_path / "here.h5")
    for path in paths:
        same(read_sweep(path), here)


@pytest.mark.slow
def test_an_interrupted_sweep_stops_its_workers_and_resumes(cluster, tmp_path):
    path = tmp_path / "x.h5"
    child = command(path, cluster.address, "--points", "16")
    while not (path.is_file() and measured(path)):
        assert child.poll() is None
        time.sleep(0.05)
    child.send_signal(signal.SIGINT)
    _, err = child.communicate(timeout=60)
    assert child.returncode == 130
    assert "sweep with --resume to continue" in err
    assert "Traceback" not in err
    assert 0 < np.sum(read_sweep(path).status == Status.DONE) < 16
    with module.on(cluster.address) as executor:  # the workers are free
        assert [result for _, result in pool.results(eval, ["1 + 1", "2 + 2"], executor=executor)] == [2, 4]
    words = ["--points", "16", "--resume"]
    assert command(path, cluster.address, *words).wait(300) == 0
    same(
        read_sweep(path),
        sweep("mass_on_spring", {"damping": "2"}, points=16, start="rest", path=tmp_path / "here.h5"),
    )


def command(path, address, *more):
    words = ["sweep", "mass_on_spring", "-p", "damping=2", "--start", "rest", "-o", str(path)]
    whole = [sys.executable, "-m", "hfsa.cosim.cli", *words, "--scheduler", address, *more]
    return subprocess.Popen(whole, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=path.parent)


def measured(path):
    """Count the finished points of a file that another process is writing."""
    with h5py.File(path, "r", locking=False) as file:
        return np.sum(file["bode/status"][:] == Status.DONE)


@pytest.mark.slow
def test_a_crash_costs_its_own_result_alone(clusters):
    one = clusters(0)
    one.add_worker("--nanny")
    tasks = ["1 + 1", "__import__('os')._exit(1)", "2 + 2", "3 + 3"]
    with module.on(one.address) as executor:
        found = dict(pool.results(eval, tasks, executor=executor))
    assert found == {"1 + 1": 2, tasks[1]: None, "2 + 2": 4, "3 + 3": 6}


@pytest.mark.slow
def test_an_error_of_a_task_is_raised(cluster):
    with module.on(cluster.address) as executor, pytest.raises(ZeroDivisionError):
        list(pool.results(eval, ["1 / 0"], executor=executor))


def test_without_an_address_there_is_no_executor():
    with module.on(None) as executor:
        assert executor is None


# Bad input ------------------------------------------------------------------------------------------------------------


@pytest.fixture
def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def test_no_scheduler(hfsa, monkeypatch, free_port):
    monkeypatch.setattr(module, "_PATIENCE", 1.0)
    code, _, err = hfsa("sweep", "mass_on_spring", "--scheduler", f"tcp://127.0.0.1:{free_port}")
    assert code == 2
    assert f"no scheduler answers at tcp://127.0.0.1:{free_port}" in err
    assert not os.path.exists("results/mass_on_spring.h5")


@pytest.mark.parametrize("address", ["", "tcp://", "nonsense://host:1", "host"])
def test_no_address(hfsa, monkeypatch, address):
    monkeypatch.setattr(module, "_PATIENCE", 1.0)
    code, _, err = hfsa("sweep", "mass_on_spring", "--scheduler", address)
    assert code == 2
    assert "such as tcp://host:8786" in err


@pytest.mark.slow
def test_no_worker(clusters, monkeypatch):
    monkeypatch.setattr(module, "_PATIENCE", 2.0)
    empty = clusters(0)
    with pytest.raises(StructureError, match=f"{empty.address} has no worker; start one with: dask worker"):
        sweep("mass_on_spring", scheduler=empty.address)


def test_no_distributed(hfsa, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    code, _, err = hfsa("sweep", "mass_on_spring", "--scheduler", "tcp://host:8786")
    assert code == 2
    assert "pip install 'hfsa[cluster]'" in err


@pytest.mark.parametrize(
    ("place", "value", "words"),
    [
        (0, "9.9", r"the worker tcp://\S+ has hfsa \S+, expected 9.9"),
        (1, "changed", r"the worker tcp://\S+ has hfsa \S+ with other sources than here"),
        (2, "another", r"the worker tcp://\S+ runs on \S+, and FMUs of here on another"),
    ],
    ids=["version", "sources", "platform"],
)
@pytest.mark.slow
def test_a_worker_of_another_installation(cluster, monkeypatch, place, value, words):
    here = list(module.installation())
    here[place] = value
    monkeypatch.setattr(module, "installation", Fixed(tuple(here)))
    with pytest.raises(StructureError, match=words):
        sweep("mass_on_spring", scheduler=cluster.address)


class Fixed:
    """The installation of this process changed, that of a worker as it is."""

    def __init__(self, here):
        self.here = here

    def __call__(self):
        return self.here

    def __reduce__(self):
        return getattr, (module, "installation")


@pytest.mark.slow
def test_a_worker_of_another_installation_that_joins_late(cluster, monkeypatch):
    with module.on(cluster.address) as executor:
        monkeypatch.setattr(module, "installation", lambda: ("9.9", "", ""))
        with pytest.raises(StructureError, match=r"expected 9\.9"):
            list(pool.results(eval, ["1 + 1"], executor=executor))


def test_jobs_and_a_scheduler_are_one_too_many(hfsa):
    code, _, err = hfsa("sweep", "mass_on_spring", "--scheduler", "tcp://host:8786", "--jobs", "2")
    assert code == 2
    assert "--jobs would have no effect" in err


def test_the_linear_method_takes_no_cluster(hfsa):
    code, _, err = hfsa("sweep", "mass_on_spring", "--method", "linear", "--scheduler", "tcp://host:8786")
    assert code == 2
    assert "--scheduler would have no effect" in err


# Comparisons ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_comparison_on_a_cluster_writes_its_files_here(cluster, tmp_path):
    over = {"damping": ["0.5", "2"]}
    here = compare("mass_on_spring", over, folder=tmp_path / "here", stop_time=2.0)
    there = compare("mass_on_spring", over, folder=tmp_path / "there", stop_time=2.0, scheduler=cluster.address)
    for one, other in zip(here.runs, there.runs, strict=True):
        assert other.outcome.path.parent == tmp_path / "there"
        assert other.outcome.groups[0].peak == one.outcome.groups[0].peak
        with h5py.File(one.outcome.path) as expected, h5py.File(other.outcome.path) as found:
            assert found.attrs["command"] == expected.attrs["command"]
            assert found.attrs["status"] == expected.attrs["status"] == b"complete"
            assert set(found["time"]) == set(expected["time"])
            for name in expected["time"]:
                np.testing.assert_array_equal(found["time"][name][:], expected["time"][name][:])
    assert len(list((tmp_path / "there").iterdir())) == 2


@pytest.mark.slow
def test_a_comparison_on_a_cluster_replaces_no_file(cluster, tmp_path, monkeypatch):
    """A file that appears while the runs take place stays."""
    path = tmp_path / "mass_on_spring_damping=2.h5"
    monkeypatch.setattr("hfsa.cosim.experiments.compare.check_new", lambda *_: None)
    path.write_text("of somebody else")
    words = {"folder": tmp_path, "stop_time": 1.0, "scheduler": cluster.address}
    first, second = compare("mass_on_spring", {"damping": ["0.5", "2"]}, **words).runs
    assert first.outcome.failure == ""
    assert str(path) in second.outcome.failure
    assert path.read_text() == "of somebody else"


# FMUs of other tools --------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_foreign_fmu_travels_too(cluster, box, foreign, tmp_path):
    scene = box(foreign[2])
    here = sweep(scene, points=4, path=tmp_path / "here.h5", warn=lambda _: None)
    foreign_file = foreign[2].stat().st_ino
    there = sweep(scene, points=4, path=tmp_path / "there.h5", warn=lambda _: None, scheduler=cluster.address)
    same(there, here)
    kept = list(cluster.folder.rglob(f"received/*/{foreign[2].name}"))
    assert kept
    assert all(file.stat().st_ino != foreign_file for file in kept)


# Stability maps -------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_map_on_a_cluster_is_that_of_this_machine(cluster):
    axes = [parse_axis("step_size=6.8e-6:7.2e-6:3")]
    here, there = (
        stability_map("beam_payload", {"suspension": "massless"}, axes, scheduler=scheduler)
        for scheduler in (None, cluster.address)
    )
    assert here.stable.tolist() == [True, True, False]
    np.testing.assert_array_equal(there.growth, here.growth)
    np.testing.assert_array_equal(there.stable, here.stable)
    np.testing.assert_array_equal(there.verified, here.verified)
    assert there.messages == here.messages
    assert here.verified.max() == 1


def test_limits_take_no_cluster(hfsa):
    code, _, err = hfsa("stability", "mass_on_spring", "--scheduler", "tcp://host:8786")
    assert code == 2
    assert "only the points of --vary" in err
