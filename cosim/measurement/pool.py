"""Workers: results in order of completion; a crash loses only its own task; Ctrl-C ends all workers.

Threads suit work in C that holds no lock and does not crash: they share what is loaded. All other work runs in
processes.

Only the parent handles signals: its processes ignore signals to the whole process group (Ctrl-C, SIGTERM of a batch
system). A thread in each process ends it when the parent has died, or when a task does not end within a grace period
after a stop request because an FMU does not return. Temporary folders of the processes lie in a folder of the parent,
which is deleted however a process ends.
"""

import contextlib
import multiprocessing
import os
import shutil
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from functools import partial
from multiprocessing.synchronize import Event
from pathlib import Path
from queue import SimpleQueue
from types import ModuleType
from typing import TypeVar

from hfsa.cosim.archives.scratch import enclosing, owned
from hfsa.cosim.fmi.isolation.waiting import interrupted_by

Task = TypeVar("Task")
Result = TypeVar("Result")

GRACE = 5.0
"""Time [s] from a stop request to the forced end of a task."""

_POLLING_PERIOD = 0.2
"""Period [s] of checking the parent."""

_IGNORED = tuple(getattr(signal, name) for name in ("SIGINT", "SIGHUP") if hasattr(signal, name))

_stop: Event | None = None
_is_ending = False
_is_busy = False
_thread = threading.local()
_alone = threading.Lock()


def results(
    work: Callable[[Task], Result],
    tasks: Sequence[Task],
    jobs: int = 1,
    executor: Executor | None = None,
    apart: bool = False,
    again: Callable[[Task], Task] = lambda task: task,
) -> Generator[tuple[Task, Result | None]]:
    """Yield each task with its result, in order of completion.

    Tasks start in the given order, on `executor`, else in `jobs` new processes; a single job runs in this process
    unless `apart` is set. The result is `None` where the process died, as after a crash in an FMU's code. A task whose
    process died runs once more in the form that `again` returns, because another task may have been the cause. Close
    the generator (`contextlib.closing`) to stop early: running tasks then see `is_stopping`.
    """
    if executor is not None:
        for i, result in _submitted(work, tasks, executor):
            yield tasks[i], result
    elif tasks and (apart or min(jobs, len(tasks)) > 1):
        yield from _in_processes(work, tasks, jobs, again)
    else:
        for task in tasks:
            yield task, work(task)


def in_threads(
    work: Callable[[Task], Result], tasks: Sequence[Task], jobs: int
) -> Generator[tuple[Task, Result | None]]:
    """Yield each task with its result as `results`, from threads of this process; a single job runs in this thread."""
    if min(jobs, len(tasks)) <= 1:
        yield from results(work, tasks)
        return
    stop = threading.Event()
    pool = ThreadPoolExecutor(min(jobs, len(tasks)), "hfsa", partial(setattr, _thread, "stop"), (stop,))
    try:
        for i, result in _submitted(work, tasks, pool):
            yield tasks[i], result
    finally:
        stop.set()
        pool.shutdown(cancel_futures=True)


def streamed(
    work: Callable[[Task], Iterable[Result]], tasks: Sequence[Task], jobs: int
) -> Generator[tuple[Task, Result]]:
    """Yield each task with each of its results, as soon as it is there, from threads as `in_threads`."""
    if min(jobs, len(tasks)) <= 1:
        for task in tasks:
            for result in work(task):
                yield task, result
        return
    found: SimpleQueue[tuple[Task, Result] | None] = SimpleQueue()

    def run(task: Task) -> None:
        """Put the results of a task into the queue, then `None`."""
        try:
            with interrupted_by(is_stopping):
                for result in work(task):
                    found.put((task, result))
        finally:
            found.put(None)

    stop = threading.Event()
    pool = ThreadPoolExecutor(min(jobs, len(tasks)), "hfsa", partial(setattr, _thread, "stop"), (stop,))
    try:
        futures = [pool.submit(run, task) for task in tasks]
        running = len(futures)
        while running:
            one = found.get()
            if one is None:
                running -= 1
            else:
                yield one
        for future in futures:
            future.result()
    finally:
        stop.set()
        pool.shutdown(cancel_futures=True)


def is_stopping() -> bool:
    """Whether the result is no longer needed; always false outside the workers of this module."""
    stops = (_stop, getattr(_thread, "stop", None))
    return _is_ending or any(stop is not None and stop.is_set() for stop in stops)


@contextlib.contextmanager
def stopped_by(stop: threading.Event) -> Iterator[None]:
    """Context in which an event asks the task of this thread to stop."""
    _thread.stop = stop
    try:
        yield
    finally:
        del _thread.stop


def one_at_a_time(work: Callable[[Task], Result], task: Task) -> Result:
    """Run a task while no other of this function runs in the same process, for work that suits no threads."""
    with _alone:
        return work(task)


def _in_processes(
    work: Callable[[Task], Result], tasks: Sequence[Task], jobs: int, again: Callable[[Task], Task]
) -> Generator[tuple[Task, Result | None]]:
    """Yield tasks with results from worker processes; `None` for a task that crashes its process."""
    left, work = list(range(len(tasks))), partial(_run_busy, work)
    with _pool(min(jobs, len(tasks))) as pool, contextlib.suppress(BrokenExecutor):
        for i, result in _submitted(work, tasks, pool):
            left.remove(i)
            yield tasks[i], result
    # a process died, and the pool with it: run one task at a time to find the cause
    while left:
        with _pool(1) as pool:
            while left:
                i = left.pop(0)
                try:
                    ((_, result),) = _submitted(work, [again(tasks[i])], pool)
                except BrokenExecutor:
                    result = None
                yield tasks[i], result
                if result is None:
                    break


def _submitted(
    work: Callable[[Task], Result], tasks: Sequence[Task], executor: Executor
) -> Iterator[tuple[int, Result]]:
    """Yield the indices of tasks with results in order of completion; cancel the remaining tasks at the end."""
    with _signals_blocked(), _without_main():
        futures = {executor.submit(work, task): i for i, task in enumerate(tasks)}
    try:
        for future in as_completed(futures):
            yield futures[future], future.result()
    finally:
        for future in futures:
            future.cancel()


@contextlib.contextmanager
def _pool(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """Context of a pool of new processes, which are stopped at its end."""
    context = multiprocessing.get_context("spawn")
    with _signals_blocked():  # the resource tracker starts here too
        stop = context.Event()
    with tempfile.TemporaryDirectory(prefix="hfsa-", ignore_cleanup_errors=True) as folder, owned(Path(folder)):
        pool = ProcessPoolExecutor(jobs, context, _initialize, (stop, folder))
        try:
            yield pool
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)


@contextlib.contextmanager
def _without_main() -> Iterator[None]:
    """Context in which new processes do not import the script that is running, which would run again in each."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


@contextlib.contextmanager
def _signals_blocked() -> Iterator[None]:
    """Context in which new processes start with signals blocked; the parent receives them afterwards."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, (*_IGNORED, signal.SIGTERM))
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


# In a process of the pool ---------------------------------------------------------------------------------------------


def _initialize(stop: Event, folder: str) -> None:
    """Initialise a worker process with its stop event and its folder for temporary files.

    SIGTERM stays blocked, as at the start of the process; `_watch` polls it.
    """
    global _stop
    _stop, tempfile.tempdir = stop, folder
    for number in _IGNORED:
        signal.signal(number, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _IGNORED)
    threading.Thread(target=_watch, args=(stop, Path(folder)), daemon=True).start()


def _run_busy(work: Callable[[Task], Result], task: Task) -> Result:
    """Run a task and mark this process as busy for `_watch`; a task that arrives after a stop is not started."""
    global _is_busy
    if is_stopping():
        raise KeyboardInterrupt
    _is_busy = True
    try:
        with interrupted_by(is_stopping):
            return work(task)
    finally:
        _is_busy = False


def _watch(stop: Event, folder: Path) -> None:
    """End this process when its parent has died or SIGTERM has arrived, at the latest `GRACE` later.

    A task that does not end within `GRACE` after a stop request is ended too; an idle process is ended by the parent.
    """
    global _is_ending
    parent = multiprocessing.parent_process()
    assert parent is not None
    stop_time = float("inf")
    while True:
        parent.join(_POLLING_PERIOD)
        is_orphan = not parent.is_alive()
        _is_ending = _is_ending or is_orphan or _is_terminated()
        if _is_ending or (stop.is_set() and _is_busy):
            stop_time = min(stop_time, time.monotonic())
        if (_is_ending and not _is_busy) or time.monotonic() > stop_time + GRACE:
            break
        if is_orphan:
            time.sleep(_POLLING_PERIOD)
    end = time.monotonic() + GRACE
    left = enclosing(folder)
    while is_orphan and left.exists() and time.monotonic() < end:  # other workers may still write there
        shutil.rmtree(left, ignore_errors=True)
    os._exit(1)


def _is_terminated() -> bool:
    """Whether SIGTERM is pending, from the pool itself or from outside."""
    return hasattr(signal, "sigpending") and signal.SIGTERM in signal.sigpending()
