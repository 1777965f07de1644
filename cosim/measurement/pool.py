"""Tasks in processes: results as they come; a process that dies takes only its own task with it; Ctrl-C ends all.

Only the parent decides how to end: signals to a whole group of processes (Ctrl-C, a batch system's SIGTERM) pass its
children by. A thread in each watches over it: it ends the process when the parent has died, and where a task does not
come to its end within a grace period after it was told to, because an FMU does not return. Temporary folders of the
children lie in one of the parent's, so that they go away however a child ends.
"""

import contextlib
import multiprocessing
import os
import shutil
import signal
import tempfile
import threading
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor, as_completed
from functools import partial
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import TypeVar

Task = TypeVar("Task")
Result = TypeVar("Result")

GRACE = 5.0
"""Time [s] that a task which was told to end is given."""

_GLANCE = 0.2
"""Time [s] between two looks at the parent."""

_IGNORED = tuple(getattr(signal, name) for name in ("SIGINT", "SIGHUP") if hasattr(signal, name))

_stop: Event | None = None
_is_ending = False
_is_at_work = False


def results(
    work: Callable[[Task], Result],
    tasks: Sequence[Task],
    jobs: int = 1,
    executor: Executor | None = None,
    apart: bool = False,
    again: Callable[[Task], Task] = lambda task: task,
) -> Generator[tuple[Task, Result | None]]:
    """Yield each task with its result, in the order they finish.

    Tasks run on `executor`, else in as many new processes as `jobs`, which begin in the given order; a single job runs
    in this process unless it is to stay `apart`.
    The result is `None` where the process died, as after a crash in an FMU's code; `again` makes of a task what is
    tried a second time, as its process may have died of another's. Whoever stops asking must close the generator
    (`contextlib.closing`): what runs then is told so (`is_stopping`).
    """
    if executor is not None:
        for i, result in _submitted(work, tasks, executor):
            yield tasks[i], result
    elif tasks and (apart or min(jobs, len(tasks)) > 1):
        yield from _in_processes(work, tasks, jobs, again)
    else:
        for task in tasks:
            yield task, work(task)


def is_stopping() -> bool:
    """Whether nobody waits for the result any more; only a process made here ever hears of it."""
    return _is_ending or (_stop is not None and _stop.is_set())


def _in_processes(
    work: Callable[[Task], Result], tasks: Sequence[Task], jobs: int, again: Callable[[Task], Task]
) -> Generator[tuple[Task, Result | None]]:
    """Yield tasks with results from processes; `None` for the task that kills its own."""
    left, work = list(range(len(tasks))), partial(_at_work, work)
    with _pool(min(jobs, len(tasks))) as pool, contextlib.suppress(BrokenExecutor):
        for i, result in _submitted(work, tasks, pool):
            left.remove(i)
            yield tasks[i], result
    # a process died, and with it the pool; one task at a time tells whose fault it was
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
    """Yield the places of tasks with results as they finish; what is left is cancelled in the end."""
    with _signals_passing_by():
        futures = {executor.submit(work, task): i for i, task in enumerate(tasks)}
    try:
        for future in as_completed(futures):
            yield futures[future], future.result()
    finally:
        for future in futures:
            future.cancel()


@contextlib.contextmanager
def _pool(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """A pool of new processes, which are told to stop in the end."""
    context = multiprocessing.get_context("spawn")
    with _signals_passing_by():  # also by the process that counts what the others share
        stop = context.Event()
    with tempfile.TemporaryDirectory(prefix="hfsa-", ignore_cleanup_errors=True) as folder:
        pool = ProcessPoolExecutor(jobs, context, _begin, (stop, folder))
        try:
            yield pool
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)


@contextlib.contextmanager
def _signals_passing_by() -> Iterator[None]:
    """Start processes with signals blocked, which the parent hears afterwards."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, (*_IGNORED, signal.SIGTERM))
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


# In a process of the pool ---------------------------------------------------------------------------------------------


def _begin(stop: Event, folder: str) -> None:
    """Take what tells a process of the pool to stop, and where its temporary folders go.

    SIGTERM stays blocked, as it was when the process began: `_watch` sees it.
    """
    global _stop
    _stop, tempfile.tempdir = stop, folder
    for number in _IGNORED:
        signal.signal(number, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _IGNORED)
    threading.Thread(target=_watch, args=(stop, Path(folder)), daemon=True).start()


def _at_work(work: Callable[[Task], Result], task: Task) -> Result:
    """Do a task, visibly to `_watch`; one that was already on its way when nobody waits any more is not begun."""
    global _is_at_work
    if is_stopping():
        raise KeyboardInterrupt
    _is_at_work = True
    try:
        return work(task)
    finally:
        _is_at_work = False


def _watch(stop: Event, folder: Path) -> None:
    """End this process when it has no parent any more or gets SIGTERM, a task at work within `GRACE` after that.

    So, too, where a task does not come to its end after a stop; without one the parent ends the process in good order.
    """
    global _is_ending
    parent = multiprocessing.parent_process()
    assert parent is not None
    told = float("inf")
    while True:
        parent.join(_GLANCE)
        is_orphan = not parent.is_alive()
        _is_ending = _is_ending or is_orphan or _is_terminated()
        if _is_ending or (stop.is_set() and _is_at_work):
            told = min(told, time.monotonic())
        if (_is_ending and not _is_at_work) or time.monotonic() > told + GRACE:
            break
        if is_orphan:
            time.sleep(_GLANCE)
    end = time.monotonic() + GRACE
    while is_orphan and folder.exists() and time.monotonic() < end:  # brothers may still write there
        shutil.rmtree(folder, ignore_errors=True)
    os._exit(1)


def _is_terminated() -> bool:
    """Whether SIGTERM has come, of the pool itself or of somebody else."""
    return hasattr(signal, "sigpending") and signal.SIGTERM in signal.sigpending()
