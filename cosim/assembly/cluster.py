"""A cluster that works for `measurement/pool.py`: a scheduler of dask.distributed, whose workers have hfsa installed.

    with on("tcp://host:8786") as executor:          # None without an address: results come from this machine
        for task, result in pool.results(measure, tasks, executor=executor): ...

Workers need no shared disk. A task names the FMUs that it needs by the hashes of their content
(`assembly/portable.py`); a worker that does not hold one answers so instead of running the task, receives its bytes
once, and keeps them in its cache. Points of a worker that is lost run on another. A task that was running on several
lost workers is set aside and runs once more when no other task is left, alone, because another may have been the cause;
if workers are lost again, its result is `None`, as of a crash in `pool.py`.

A worker of another version of hfsa is refused, when it joins later as well.
"""

import contextlib
import itertools
import sysconfig
import threading
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, InvalidStateError
from dataclasses import dataclass
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

from hfsa.cosim.assembly.portable import FileName, Packed, content, missing, pack, store, unpack
from hfsa.cosim.assembly.sources import all_sources
from hfsa.cosim.measurement import pool
from hfsa.cosim.measurement.rig import close_oldest
from hfsa.cosim.systems.errors import StructureError

_PATIENCE = 10.0
"""Time [s] to wait for an answer of the scheduler, and for its first worker."""

_ALONE = 60.0
"""Time [s] without any worker after which the points that are left are given up."""

_MOST_REQUESTS = 20
"""Largest number of times that a task is sent again because its worker does not hold a file."""


class ClusterError(RuntimeError):
    """A cluster that was there at the beginning and no longer answers."""

    exit_code = 4


@contextlib.contextmanager
def on(scheduler: str | None) -> Iterator[Executor | None]:
    """Context of an executor on the workers of a scheduler, `tcp://host:8786`; `None` without one.

    At its end, tasks that are running are asked to stop. Raises `StructureError` where `distributed` is not installed,
    no scheduler or worker answers, or a worker has another version of hfsa.
    """
    if scheduler is None:
        yield None
        return
    client = _connected(scheduler)
    try:
        _check_workers(client, scheduler)
        with _Cluster(client, scheduler) as executor:
            yield executor
    finally:
        client.close(timeout=_PATIENCE)


def _connected(scheduler: str) -> Any:
    """Return a client of a scheduler; errors as of `on`."""
    try:
        from distributed import Client
    except ImportError as error:
        raise StructureError(
            f"a cluster takes the package distributed ({error}); install it with: pip install 'hfsa[cluster]'"
        ) from error
    if not scheduler.strip():
        raise StructureError("the scheduler is an empty text, expected an address such as tcp://host:8786")
    try:
        return Client(scheduler, timeout=_PATIENCE, set_as_default=False, name="hfsa")
    except (OSError, ValueError, TypeError) as error:  # TimeoutError is an OSError
        raise StructureError(
            f"no scheduler answers at {scheduler} ({_words(error)}); expected the address of a running one, such as "
            "tcp://host:8786, which `dask scheduler` prints"
        ) from error


def _check_workers(client: Any, scheduler: str) -> None:
    """Raise `StructureError` unless there is a worker, and each has the hfsa of this process."""
    from distributed import TimeoutError as NoAnswer

    try:
        client.wait_for_workers(1, timeout=_PATIENCE)
    except (NoAnswer, TimeoutError) as error:
        raise StructureError(
            f"the scheduler at {scheduler} has no worker; start one with: dask worker {scheduler}"
        ) from error
    for worker, found in client.run(installation, on_error="return").items():
        if isinstance(found, BaseException):
            raise StructureError(
                f"the worker {worker} has no hfsa {version('hfsa')} ({_words(found)}); install it there"
            )
        if found != installation():
            raise StructureError(_difference(worker, found, installation()))


# On this side ---------------------------------------------------------------------------------------------------------


@dataclass(eq=False)
class _Job:
    """A task on its way: what its submitter waits for, what is sent, and how often it was in vain."""

    outer: Future
    packed: Packed
    priority: int
    requests: int = 0
    is_suspect: bool = False


class _Cluster(Executor):
    """Executor on the workers of a client.

    `_answered` runs in the client's thread for callbacks, one answer at a time.
    """

    def __init__(self, client: Any, scheduler: str):
        self._client, self._scheduler = client, scheduler
        self._session = uuid.uuid4().hex
        self._files: dict[FileName, Path] = {}
        self._priorities = itertools.count(0, -1)  # the first tasks first
        self._lock = threading.Lock()
        self._jobs: dict[_Job, Any] = {}
        self._suspects: deque[_Job] = deque()
        self._ended = threading.Event()
        threading.Thread(target=self._watch, name="hfsa-cluster", daemon=True).start()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future:
        """Send a task, `fn` of one argument, and return the future of its result."""
        (task,) = args
        assert not kwargs
        packed, files = pack(fn, task)
        self._files |= files
        job = _Job(Future(), packed, next(self._priorities))
        self._send(job)
        return job.outer

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:  # noqa: ARG002
        """Ask running tasks to stop, and forget all."""
        with self._lock:
            if self._ended.is_set():
                return
            self._ended.set()
            is_idle = not self._jobs
        # a worker that does not answer must not hold up the end
        if not is_idle:
            asking = threading.Thread(target=self._ask_to_stop, daemon=True)
            asking.start()
            asking.join(pool.GRACE)

    def _ask_to_stop(self) -> None:
        """Ask the workers to stop the tasks of this executor."""
        with contextlib.suppress(Exception):  # there may be no scheduler any more
            self._client.cancel(list(self._jobs.values()), force=True)
            self._client.run(stop, self._session, on_error="ignore")

    def _send(self, job: _Job) -> None:
        """Send a job to whichever worker is free."""
        inner = self._client.submit(
            perform,
            job.packed,
            installation(),
            self._session,
            key=f"hfsa-{uuid.uuid4().hex}",
            pure=False,
            priority=job.priority,
        )
        with self._lock:
            self._jobs[job] = inner
        inner.add_done_callback(partial(self._answered, job))

    def _answered(self, job: _Job, inner: Any) -> None:
        """Settle a job, or send it again."""
        from distributed import CancelledError, KilledWorker

        if self._ended.is_set():
            return
        try:
            answer = inner.result()
            if isinstance(answer, Lack):
                self._deliver(job, answer)
                self._send(job)
            elif isinstance(answer, Refusal):
                raise StructureError(answer.sentence)
            else:
                self._settle(job, answer.result)
        except KilledWorker:
            self._set_aside(job)
        except CancelledError:
            self._fail(ClusterError(f"the scheduler at {self._scheduler} no longer answers"))
        except Exception as error:
            self._settle(job, error=error)

    def _deliver(self, job: _Job, lack: "Lack") -> None:
        """Send a worker the files that it lacks, unless it has received them for an earlier job."""
        job.requests += 1
        if job.requests > _MOST_REQUESTS:
            raise ClusterError(f"the worker {lack.worker} does not keep the FMUs that it receives: {lack.names}")
        for name in lack.files:
            if self._run(lack.worker, missing, [name]):
                self._run(lack.worker, store, name, content(name, self._files[name]))

    def _run(self, worker: str, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return what a function returns on a worker; `None` where that is lost: another takes its tasks."""
        try:
            found = self._client.run(function, *arguments, workers=[worker], on_error="return").get(worker)
        except Exception:  # dask has many for a worker that is not there
            return None
        if isinstance(found, StructureError):
            raise StructureError(f"the worker {worker}: {found}")
        return None if isinstance(found, BaseException) else found

    def _set_aside(self, job: _Job) -> None:
        """Keep a job whose workers were lost for the end; one that was alone has lost them itself."""
        if job.is_suspect:
            self._settle(job, None)
            return
        job.is_suspect = True
        with self._lock:
            self._jobs.pop(job, None)
            self._suspects.append(job)
        self._send_suspect()

    def _settle(self, job: _Job, result: Any = None, error: Exception | None = None) -> None:
        """Give a job its result or error."""
        with self._lock:
            self._jobs.pop(job, None)
        with contextlib.suppress(InvalidStateError):  # nobody waits any more
            if error is None:
                job.outer.set_result(result)
            else:
                job.outer.set_exception(error)
        self._send_suspect()

    def _send_suspect(self) -> None:
        """Send the next job that was set aside, if no other is on its way."""
        with self._lock:
            job = self._suspects.popleft() if self._suspects and not self._jobs else None
        if job is not None:
            self._send(job)

    def _fail(self, error: Exception) -> None:
        """Give every job that is left an error."""
        with self._lock:
            jobs = [*self._jobs, *self._suspects]
            self._jobs.clear()
            self._suspects.clear()
        for job in jobs:
            self._settle(job, error=error)

    def _watch(self) -> None:
        """Fail all jobs when there has been no worker, or no scheduler, for `_ALONE`."""
        last = time.monotonic()
        while not self._ended.wait(1.0):
            with contextlib.suppress(Exception):
                if self._client.nthreads():
                    last = time.monotonic()
            if time.monotonic() - last > _ALONE:
                self._fail(
                    ClusterError(f"the scheduler at {self._scheduler} has had no worker for {_ALONE:g} s; start one")
                )


# On a worker ----------------------------------------------------------------------------------------------------------

Installation = tuple[str, str, str]
"""Version of hfsa, hash of its sources, and platform."""


@dataclass(frozen=True)
class Done:
    """The result of a task."""

    result: Any


@dataclass(frozen=True)
class Lack:
    """Files that a worker does not hold."""

    worker: str
    files: Sequence[FileName]

    @property
    def names(self) -> str:
        """Names of the files, for a message."""
        return ", ".join(name.name for name in self.files)


@dataclass(frozen=True)
class Refusal:
    """The reason why a worker does not run a task."""

    sentence: str


@cache
def installation() -> Installation:
    """Return what is installed here."""
    return version("hfsa"), all_sources(), sysconfig.get_platform()


def perform(packed: Packed, expected: Installation, session: str) -> Done | Lack | Refusal:
    """Run a task on a worker."""
    from distributed import get_worker

    worker = get_worker().address
    if installation() != expected:
        return Refusal(_difference(worker, installation(), expected))
    lacking = missing(packed.files)
    if lacking:
        return Lack(worker, lacking)
    work, task = unpack(packed)
    close_oldest()
    with pool.stopped_by(_sessions.setdefault(session, threading.Event())):
        try:
            return Done(work(task))
        except KeyboardInterrupt:  # it would end the worker
            return Done(None)


def stop(session: str) -> None:
    """Ask the tasks of a session on this worker to stop."""
    event = _sessions.pop(session, None)
    if event is not None:
        event.set()


_sessions: dict[str, threading.Event] = {}


def _difference(worker: str, found: Installation, expected: Installation) -> str:
    """Return a sentence on a worker whose installation is not the one expected."""
    if found[0] != expected[0]:
        return f"the worker {worker} has hfsa {found[0]}, expected {expected[0]}, as here"
    if found[2] != expected[2]:
        return f"the worker {worker} runs on {found[2]}, and FMUs of here on {expected[2]}; expected the same platform"
    return f"the worker {worker} has hfsa {found[0]} with other sources than here; install the same on both sides"


def _words(error: BaseException) -> str:
    """Return the message of an error in one line, or its type."""
    return " ".join(str(error).split()) or type(error).__name__
