"""Exchange of values across all connections: at the start, in initialization mode, and at communication points.

exchange = Exchange(wiring)
exchange.enter(start_time=0.0)         # all instances in initialization mode, values settled
exchange.leave()                       # from then on they may step
exchange.run(wiring.exchange())        # fetch and set; StepError where a call fails
"""

from collections.abc import Iterable, Mapping

import numpy as np

from hfsa.cosim.actions.action import failing_call
from hfsa.cosim.actions.algebraic_loop import STALE, AlgebraicLoop
from hfsa.cosim.actions.feed import Ahead
from hfsa.cosim.actions.iterated import IteratedStep
from hfsa.cosim.actions.recording import Watch
from hfsa.cosim.actions.schedule import Action, Runnable
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.fmi.co_simulation import StepError
from hfsa.cosim.systems.connectors import connector
from hfsa.cosim.systems.errors import StructureError

SETTLING_PASSES = 100
"""Exchanges in initialization mode after which the values across connections must agree."""

SETTLING_TOLERANCE = 1e-12
"""Largest change between two such exchanges, relative to the value or its nominal."""


class Exchange:
    """Runs actions on the instances of a wiring, raises errors and collects warnings.

    Attributes:
        watch: checks the values on the bus.
        warnings: the first warning of each instance, by name.
        told: number and first sentence of the warnings of each instance, by a key; number 0 for what the algorithm
            says of an instance.
    """

    def __init__(self, wiring: Wiring, warnings: Mapping[str, str] | None = None):
        self.wiring, self.system = wiring, wiring.system
        starts = [connection.start for connection in wiring.connections]
        self.watch = Watch(starts, [connector(self.system, wiring.connectors, name) for name in starts], wiring.bus)
        self._notices = dict(warnings or {})
        self.warnings: dict[str, str] = {}
        self.told: dict[str, tuple[int, str]] = {}
        self.forget_warnings()

    @property
    def time(self) -> float:
        """Present time [s]."""
        return self.wiring.time.value

    def enter(
        self, start_time: float = 0.0, stop_time: float | None = None, starts: Mapping[str, float] | None = None
    ) -> None:
        """Bring all instances into initialization mode, with values that agree across connections.

        `starts` holds start values by full name, which override those of the components. Raises `StructureError` for a
        start value of a variable that does not exist, or that is not finite; `StepError` as `settle`.
        """
        starts = dict(starts or {})
        for name, value in starts.items():
            connector(self.system, self.wiring.connectors, name)
            if not np.isfinite(value):
                raise StructureError(f"{name} starts at {value:g}, expected a finite number")
        self.wiring.time.value = start_time
        self.wiring.bus[:] = 0.0
        for loop in self.wiring.loops:
            loop.forget()
        for component in self.system.components:
            own = {self.system.split(n)[1]: v for n, v in starts.items() if self.system.split(n)[0] == component.name}
            self.wiring.instances[component.name].enter(start_time, stop_time, {**component.start, **own})
        self.settle()

    def settle(self) -> None:
        """Exchange values in initialization mode until none changes; `StepError` names a connection that does not."""
        bus, watch = self.wiring.bus, self.watch
        before, change = np.full_like(bus, np.nan), np.full_like(bus, np.inf)
        for _ in range(SETTLING_PASSES):
            self.run(self.wiring.exchange())
            watch.check(self.time, bounds=False)
            change = np.abs(bus - before) / np.maximum(np.abs(bus), watch.nominal)
            if np.all(change <= SETTLING_TOLERANCE):
                return
            before = bus.copy()
        worst = int(np.argmax(change))
        connection = self.wiring.connections[worst]
        raise StepError(
            self.system.split(connection.end)[0],
            str(connection),
            "does not settle",
            self.time,
            f"after {SETTLING_PASSES} exchanges at initialization it still changes, now to {bus[worst]:.6g}",
        )

    def leave(self) -> None:
        """Bring all instances out of initialization mode."""
        for component in self.system.components:
            self.wiring.instances[component.name].exit()

    def run(self, actions: Iterable[Action]) -> None:
        """Run actions; `report` handles every status that is not ok."""
        self.run_calls(action.call for action in actions)

    def run_calls(self, calls: Iterable[Runnable]) -> None:
        """Run calls; `report` handles every status that is not ok."""
        for call in calls:
            status = call.run()
            if status:
                self.report(call, status)

    def report(self, call: Runnable, status: int) -> None:
        """Handle a status that is not ok.

        An error raises `StepError`, the first warning of an instance is kept, and `STALE` solves the loop or the
        iterated step with a new inverse, or computes what is fed next.
        """
        if status == STALE and isinstance(call, AlgebraicLoop | IteratedStep | Ahead):
            status = call.solve(self.time)
            if not status:
                return
        failing = failing_call(call)
        assert failing is not None
        failing.instance.time = self.time
        failing.instance.check(failing, status)
        self._add_warnings(failing.instance.name, 1, failing.instance.warning(failing))

    def hear(self) -> None:
        """Add the warnings that instances have logged in calls that returned ok."""
        for name, instance in self.wiring.instances.items():
            count, sentence = instance.logged_warnings()
            if count:
                self._add_warnings(name, count, sentence)

    def _add_warnings(self, name: str, number: int, sentence: str) -> None:
        """Count warnings of an instance; the first sentence is kept."""
        count, first = self.told.get(name, (0, sentence))
        self.told[name] = count + number, first
        if not count:
            self.warnings[name] = "; ".join(filter(None, (self._notices.get(name), first)))

    def give_notice(self, notices: Mapping[str, str]) -> None:
        """Add sentences on what the algorithm does to instances, by their names."""
        self._notices |= notices
        for name, sentence in notices.items():
            self.warnings.setdefault(name, sentence)
            self.told[f"{name}: notice"] = 0, sentence

    def forget_warnings(self) -> None:
        """Forget the warnings of the instances, before another run."""
        self.warnings.clear()
        self.warnings.update(self._notices)
        self.told.clear()
        self.told.update({f"{name}: notice": (0, text) for name, text in self._notices.items()})
