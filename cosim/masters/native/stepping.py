"""Masters whose stepping loop is in C, `step.c`: bit for bit what is done without, but no Python in between.

    master = make_master(instances, system, "gauss_seidel", 50e-6, library)     # library: Path; None takes Python's

A master decides which prepared calls are made and in which order, here and there. The loop in C is given their
function pointers, components, value references and arrays, and makes them for some 50 ms at a time, so that Ctrl-C is
heard. Whatever is not plainly well it hands back at once: a status, a value that is not finite or out of bounds, a full
recording, an iteration that needs a new inverse. Then the same methods speak and solve as in Python's loop, and where
it was no failure the one in C goes on behind it.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from time import perf_counter

from hfsa.cosim.actions.iterated import IteratedStep
from hfsa.cosim.actions.recording import Recording
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.fmi.isolation.waiting import interrupted_by
from hfsa.cosim.masters.algorithm import Algorithm
from hfsa.cosim.masters.master import Master
from hfsa.cosim.masters.native.details import watched
from hfsa.cosim.masters.native.library import Library
from hfsa.cosim.masters.native.program import Program
from hfsa.cosim.results.interrupts import deferred_interrupts, is_pending
from hfsa.cosim.signals.drive import Signal
from hfsa.cosim.systems.system import System

_SPELL = 0.05
"""Time [s] after which the loop in C comes back to see whether anybody wants something else."""


def step_in_c(action: IteratedStep, library: Path) -> None:
    """Let an iterated step be made in C wherever it is run; it stays what it is, bit for bit."""
    program, wiring = Program([action], Library.load(library)), action.wiring
    call = program.calls[0]
    perform = call.perform

    def attempt() -> int:
        """Make the step in C, and tell which of its calls the status is of."""
        status = program.run(perform, program.calls, wiring.time.value, wiring.step_size.value)
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
        self._library = Library.load(library)
        self._run_in_c = self._library.ffi.new("Run *")
        self._spell = 1
        self._prepare()

    def record(self, names: Iterable[str], rows: int, every: int = 1) -> Recording:
        """Record as `Master.record`."""
        recording = super().record(names, rows, every)
        self._prepare()
        return recording

    def drive(self, signals: Mapping[str, Signal]) -> None:
        """Drive inputs as `Master.drive`."""
        super().drive(signals)
        self._prepare()

    def _prepare(self) -> None:
        """Lay out the cycle for C: to the next point, the exchange at it, what is recorded there."""
        recording = self._recording
        program = Program([*(action.call for action in self.cycle), *self._record_calls], self._library)
        fields = {
            "calls": program.calls,
            "exchange": self.first_of_point,
            "record": len(self.cycle),
            "end": len(program.calls),
            "bus": watched(self._watch),
            "step_size": self.step_size,
        }
        if recording is not None:
            fields |= {"row": watched(recording.watch), "every": recording.every}
        self._program, self._cycle = program, program.structure("Cycle", fields)

    def _take(self, steps: int) -> None:
        """Take steps in C, as many at a time as `_SPELL` lets it, and say what it hands back."""
        c, cycle, run, recording = self._library.c, self._cycle, self._run_in_c, self._recording
        last, outcome = self._count + steps, None
        cycle.start_time = self._start_time
        run.count, run.next, run.phase = self._count, 0, 0
        self._make_room()
        while outcome != c.COMPLETE or self._count < last:
            begin, before = perf_counter(), self._count
            try:
                # C may call Python, through which no exception passes
                with deferred_interrupts(), interrupted_by(is_pending):
                    outcome = self._program.run(c.hfsa_advance, cycle, run, min(last, before + self._spell))
            finally:  # where a Ctrl-C that came meanwhile is raised
                self._count = run.count
                self.wiring.time.value = self.time
                if recording is not None:
                    recording.rows = run.rows
            if outcome == c.COMPLETE:
                if self._count > before:
                    fitting = int((self._count - before) * _SPELL / (perf_counter() - begin))
                    self._spell = max(1, min(fitting, 100 * self._spell))
            elif outcome == c.CALL_NOT_OK:
                self._exchange.report(self._program.failed(run.next - 1), run.status)
            elif outcome == c.BUS_WRONG:
                self._watch.check(self.time)
            elif recording is not None and outcome == c.ROW_WRONG:
                recording.watch.check(self.time)
            elif recording is not None:
                recording.grow()
                self._make_room()

    def _make_room(self) -> None:
        """Tell C where the rows are."""
        if self._recording is not None:
            time, values = self._recording.room
            run = self._run_in_c
            ffi = self._library.ffi
            run.time, run.values = ffi.from_buffer("double[]", time), ffi.from_buffer("double[]", values)
            run.rows, run.capacity = self._recording.rows, len(time)
