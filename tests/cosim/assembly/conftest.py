"""Clusters of processes on this machine: each worker has a cache and a folder of its own."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

_START = 60.0
"""Time [s] within which a process must have started."""


class Cluster:
    """A scheduler and its workers, in a folder."""

    def __init__(self, folder: Path):
        self.folder = folder
        folder.mkdir()
        self._file = folder / "scheduler.json"
        self._processes: list[subprocess.Popen] = []
        self.workers: list[subprocess.Popen] = []
        self._start("scheduler", "--port", "0", "--no-dashboard", "--scheduler-file", str(self._file), name="scheduler")
        _wait(self._file.is_file)
        self.address = json.loads(self._file.read_text())["address"]

    def add_worker(self, *more: str) -> Path:
        """Start one more worker, of one thread; return its cache."""
        name = f"worker{len(self.workers)}"
        words = ["worker", self.address, "--no-dashboard", "--nthreads", "1", *(more or ["--no-nanny"])]
        self.workers.append(self._start(*words, name=name))
        _wait(lambda: "Registered to" in (self.folder / f"{name}.log").read_text())
        return self.folder / name / "cache"

    def lose(self, worker: int) -> None:
        """Kill a worker."""
        self.workers[worker].kill()
        self.workers[worker].wait()

    def _start(self, *words: str, name: str) -> subprocess.Popen:
        """Start a process in a folder of its own."""
        home = self.folder / name
        home.mkdir()
        variables = {
            **os.environ,
            "HFSA_CACHE": str(home / "cache"),
            "OPENBLAS_NUM_THREADS": "1",
            "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0",
        }
        with open(self.folder / f"{name}.log", "w") as log:
            command = [sys.executable, "-m", "dask", *words]
            process = subprocess.Popen(command, cwd=home, env=variables, stdout=log, stderr=log)
        self._processes.append(process)
        return process

    def close(self) -> None:
        """End all processes."""
        for process in self.workers:
            process.send_signal(signal.SIGTERM)
        for process in [*self.workers, *self._processes]:
            process.send_signal(signal.SIGTERM)
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _wait(is_there: Callable[[], bool]) -> None:
    """Wait until something is there."""
    end = time.monotonic() + _START
    while not is_there():
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.fixture(scope="module")
def clusters(tmp_path_factory) -> Iterator[Callable[[int], Cluster]]:
    """Start clusters with a number of workers; they end with the module."""
    started: list[Cluster] = []

    def start(workers: int) -> Cluster:
        cluster = Cluster(tmp_path_factory.mktemp("cluster") / "it")
        started.append(cluster)
        for _ in range(workers):
            cluster.add_worker()
        return cluster

    yield start
    for cluster in started:
        cluster.close()


@pytest.fixture(scope="module")
def cluster(clusters) -> Cluster:
    """A cluster of two workers, which no test of the module harms."""
    return clusters(2)
