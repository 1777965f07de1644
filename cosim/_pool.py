"""Tasks in processes: results as they come; a process that dies takes only its own task with it; Ctrl-C ends all."""

import contextlib
import multiprocessing
import signal
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor, as_completed
from multiprocessing.synchronize import Event
from typing import TypeVar

Task = TypeVar("Task")
Result = TypeVar("Result")

_stop: Event | None = None


def results(
    work: Callable[[Task], Result],
    tasks: Sequence[Task],
    jobs: int = 1,
    executor: Executor | None = None,
    apart: bool = False,
) -> Generator[tuple[Task, Result | None]]:
    """Yield each task with its result, in the order they finish.

    Tasks run on `executor`, else in as many new processes as `jobs`, which begin in the given order; a single job runs
    in this process unless it is to stay `apart`.
    The result is `None` where the process died, as after a crash in an FMU's code. Whoever stops asking must close the
    generator (`contextlib.closing`): what runs then is told so (`is_stopping`).
    """
    if executor is not None:
        for i, result in _submitted(work, tasks, executor):
            yield tasks[i], result
    elif tasks and (apart or min(jobs, len(tasks)) > 1):
        yield from _in_processes(work, tasks, jobs)
    else:
        for task in tasks:
            yield task, work(task)


def is_stopping() -> bool:
    """Whether nobody waits for the result any more; only a process made here ever hears of it."""
    return _stop is not None and _stop.is_set()


def _in_processes(
    work: Callable[[Task], Result], tasks: Sequence[Task], jobs: int
) -> Generator[tuple[Task, Result | None]]:
    """Yield tasks with results from processes; `None` for the task that kills its own."""
    left = list(range(len(tasks)))
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
                    ((_, result),) = _submitted(work, [tasks[i]], pool)
                except BrokenExecutor:
                    result = None
                yield tasks[i], result
                if result is None:
                    break


def _submitted(
    work: Callable[[Task], Result], tasks: Sequence[Task], executor: Executor
) -> Iterator[tuple[int, Result]]:
    """Yield the places of tasks with results as they finish; what is left is cancelled in the end."""
    with _interrupts_ignored():
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
    stop = context.Event()
    pool = ProcessPoolExecutor(jobs, context, _begin, (stop,))
    try:
        yield pool
    finally:
        stop.set()
        pool.shutdown(cancel_futures=True)


def _begin(stop: Event) -> None:
    """Take what tells a process of the pool to stop."""
    global _stop
    _stop = stop


@contextlib.contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """Start processes that a Ctrl-C at the keyboard passes by: only the parent decides how to end."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
