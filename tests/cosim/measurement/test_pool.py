"""Workers: a crash loses only its own task, and an early stop does not wait."""

import contextlib
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from hfsa.cosim.measurement import pool

SUMS = ["1 + 1", "2 + 2", "3 + 3"]


@pytest.mark.parametrize("results", [pool.results, pool.in_threads])
@pytest.mark.parametrize("jobs", [1, 2])
def test_results_belong_to_their_tasks(results, jobs):
    assert dict(results(eval, SUMS, jobs)) == {"1 + 1": 2, "2 + 2": 4, "3 + 3": 6}
    assert list(results(eval, [], jobs)) == []


def test_any_executor_will_do():
    with ThreadPoolExecutor(1) as executor:
        assert dict(pool.results(eval, SUMS, executor=executor)) == {"1 + 1": 2, "2 + 2": 4, "3 + 3": 6}


def test_a_process_that_dies_takes_only_its_own_task_with_it():
    deadly = ["__import__('os')._exit(1)", "__import__('os').kill(__import__('os').getpid(), 11)"]
    tasks = [SUMS[0], deadly[0], SUMS[1], deadly[1], SUMS[2]]
    expected = {"1 + 1": 2, "2 + 2": 4, "3 + 3": 6, deadly[0]: None, deadly[1]: None}
    assert dict(pool.results(eval, tasks, 2)) == expected


@pytest.mark.parametrize("results", [pool.results, pool.in_threads])
def test_who_stops_waiting_ends_what_runs(tmp_path, results):
    module = "__import__('hfsa.cosim.measurement.pool', fromlist=['is_stopping'])"
    begun, told = tmp_path / "begun", tmp_path / "told"
    sleep = f"all(__import__('time').sleep(0.01) is None for _ in iter({module}.is_stopping, True))"
    wait = f"open({str(begun)!r}, 'w').close() or {sleep} and open({str(told)!r}, 'w').close()"
    begin = time.monotonic()
    with contextlib.closing(results(eval, ["1", wait, wait], 2)) as found:
        next(found)
        while not begun.exists():  # a task that has not begun is never told
            time.sleep(0.01)
    assert told.exists()
    assert time.monotonic() - begin < 60  # it came back at all: the tasks wait for ever
    assert not pool.is_stopping()


def test_processes_do_not_hear_the_keyboard():
    ignored = "__import__('signal').getsignal(2) == __import__('signal').SIG_IGN"
    assert dict(pool.results(eval, [ignored, f"{ignored} "], 2)) == {ignored: True, f"{ignored} ": True}
