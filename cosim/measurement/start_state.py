"""State of a running system at a communication point, as a vector: what another run can start with.

The vector holds values of the FMUs by full name, then connected outputs at the two points before (`Master.earlier`).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.analysis.steady_start import SteadyStart
from hfsa.cosim.masters.master import Master


class StartState:
    """Reads the state of a master's system; `values` are full names.

    Attributes:
        nominal: nominal sizes of the vector's members, (n,).
    """

    def __init__(self, master: Master, values: Sequence[str]):
        self._master, self._values = master, tuple(values)
        by_component: dict[str, list[int]] = {}
        for i, name in enumerate(values):
            by_component.setdefault(master.system.split(name)[0], []).append(i)
        parts = [
            (where, master.instances[component], [master.system.split(values[i])[1] for i in where])
            for component, where in by_component.items()
        ]
        self._handles = [(where, instance, instance.handle(names)) for where, instance, names in parts]
        own = [self._nominal(name) for name in values]
        bus = [self._nominal(connection.start) for connection in master.wiring.connections]
        self.nominal = np.array([*own, *bus, *bus] if master.earlier.size else own)

    def _nominal(self, name: str) -> float:
        """Return the nominal size of a variable of a full name."""
        component, variable = self._master.system.split(name)
        return abs(self._master.wiring.connectors[component][variable].nominal) or 1.0

    def read(self) -> NDArray[np.float64]:
        """Return the present state, (n,)."""
        now = np.empty(len(self._values))
        for where, instance, handle in self._handles:
            now[where] = instance.get(handle)
        return np.concatenate([now, self._master.earlier.ravel()])

    def vector(self, start: SteadyStart) -> NDArray[np.float64]:
        """Return a start as the vector, (n,)."""
        return np.concatenate([[start.values[name] for name in self._values], start.earlier.ravel()])

    def start(self, start: SteadyStart, vector: NDArray[np.float64]) -> SteadyStart:
        """Return a start with the vector as its state."""
        n = len(self._values)
        values = dict(zip(self._values, vector[:n].tolist(), strict=True))
        return replace(start, values=values, earlier=vector[n:].reshape(2, -1))
