"""Masters whose stepping loop is in C, `runtime/step.c`: bit for bit what is done without, but no Python in between.

    master = make_master(instances, system, "gauss_seidel", 50e-6, library)     # library: Path; None takes Python's

A master decides which prepared calls are made and in which order, here and there. The loop in C is given their
function pointers, components, value references and arrays, and makes them for some 50 ms at a time, so that Ctrl-C is
heard. Whatever is not plainly well it hands back at once: a status, a value that is not finite or out of bounds, a full
recording, an iteration that needs a new inverse. Then the same methods speak and solve as in Python's loop, and where
it was no failure the one in C goes on behind it.

The library is compiled at install (`setup.py`) or at first use (`assembly/native_loop.py`); its name has a hash of its
sources, so that a library of others is never taken.
"""

import ctypes
import hashlib
from collections.abc import Iterable, Mapping
from ctypes import POINTER, c_double, c_longlong
from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from time import perf_counter

from hfsa.cosim.actions.iterated import IteratedStep
from hfsa.cosim.actions.recording import Recording
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.masters.algorithm import Algorithm
from hfsa.cosim.masters.master import Master
from hfsa.cosim.masters.native.program import Program, watched
from hfsa.cosim.masters.native.structures import Call, Cycle, Run
from hfsa.cosim.systems.system import System

RUNTIME = Path(__file__).parent
"""The folder of the sources."""

_SPELL = 0.05
"""Time [s] after which the loop in C comes back to see whether anybody wants something else."""

_COMPLETE, _CALL_NOT_OK, _BUS_WRONG, _ROW_WRONG, _RECORDING_FULL = range(5)


def sources() -> list[Path]:
    """Return the files that the library is made of, by name."""
    return sorted(RUNTIME.glob("*.[ch]"))


@cache
def library_name() -> str:
    """Return the name of the library of these sources, without an ending; `setup.py` gives the same."""
    return f"_step_{hashlib.sha256(b''.join(file.read_bytes() for file in sources())).hexdigest()[:12]}"


def installed_library() -> Path | None:
    """Return the library that was compiled when the package was installed, if there is one of these sources."""
    candidates = (Path(__file__).with_name(library_name() + suffix) for suffix in EXTENSION_SUFFIXES)
    return next((file for file in candidates if file.is_file()), None)


def step_in_c(action: IteratedStep, library: Path) -> None:
    """Let an iterated step be made in C wherever it is run; it stays what it is, bit for bit."""
    program, make = Program([action]), ctypes.CDLL(str(library)).hfsa_make
    make.argtypes = [POINTER(Call), c_double, c_double]
    wiring = action.wiring

    def attempt() -> int:
        """Make the step in C, and tell which of its calls the status is of."""
        status = make(program.calls, wiring.time, wiring.step_size)
        if status:
            program.failed(0)
        return status

    action.attempt = attempt


class CompiledMaster(Master):
    """Takes steps with the loop in C, of a compiled library."""

    def __init__(
        self, instances: Mapping[str, Instance], system: System, algorithm: Algorithm, step_size: float, library: Path
    ):
        super().__init__(instances, system, algorithm, step_size)
        self._advance = ctypes.CDLL(str(library)).hfsa_advance
        self._advance.argtypes = [POINTER(Cycle), POINTER(Run), c_longlong]
        self._run_in_c = Run()
        self._spell = 1
        self._prepare()

    def record(self, names: Iterable[str], rows: int, every: int = 1) -> Recording:
        """Record as `Master.record`."""
        recording = super().record(names, rows, every)
        self._prepare()
        return recording

    def _prepare(self) -> None:
        """Lay out the cycle for C: to the next point, the exchange at it, what is recorded there."""
        recording = self._recording
        self._program = Program([*(action.call for action in self.cycle), *self._record_calls])
        self._cycle = Cycle(
            calls=self._program.calls,
            exchange=self._scheme.first_of_point,
            record=len(self.cycle),
            end=len(self._program.calls),
            bus=watched(self._watch),
            step_size=self.step_size,
        )
        if recording is not None:
            self._cycle.row, self._cycle.every = watched(recording.watch), recording.every

    def _take(self, steps: int) -> None:
        """Take steps in C, as many at a time as `_SPELL` lets it, and say what it hands back."""
        cycle, run, recording = self._cycle, self._run_in_c, self._recording
        last, outcome = self._count + steps, None
        cycle.start_time = self._start_time
        run.count, run.next, run.phase = self._count, 0, 0
        self._make_room()
        while outcome != _COMPLETE or self._count < last:
            begin, before = perf_counter(), self._count
            try:
                outcome = self._advance(cycle, run, min(last, before + self._spell))
            finally:  # where a Ctrl-C that came meanwhile is raised
                self._count = run.count
                self.wiring.time.value = self.time
                if recording is not None:
                    recording.rows = run.rows
            if outcome == _COMPLETE:
                if self._count > before:
                    fitting = int((self._count - before) * _SPELL / (perf_counter() - begin))
                    self._spell = max(1, min(fitting, 100 * self._spell))
            elif outcome == _CALL_NOT_OK:
                self._exchange.report(self._program.failed(run.next - 1), run.status)
            elif outcome == _BUS_WRONG:
                self._watch.check(self.time)
            elif recording is not None and outcome == _ROW_WRONG:
                recording.watch.check(self.time)
            elif recording is not None:
                recording.grow()
                self._make_room()

    def _make_room(self) -> None:
        """Tell C where the rows are."""
        if self._recording is not None:
            time, values = self._recording.room
            run = self._run_in_c
            run.time, run.values = time.ctypes.data, values.ctypes.data
            run.rows, run.capacity = self._recording.rows, len(time)
