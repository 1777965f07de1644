"""The same FMUs as one linear system: exact small-signal response, without a simulation.

    linear = linearize(system, instances, inputs, outputs)
    linear.state_space                                   # control.StateSpace with signal names
    response = linear_response(system, instances, inputs, outputs, frequency)

Each FMU states its own derivatives at an operating point, der(x) = A x + B u, y = C x + D u, and the connections
u = L y + e close them:

    u = (1 - L D)^-1 (L C x + e)

The operating point is an equilibrium, found by Newton's method in initialization mode, where states may be set. A
sinusoid e enters with its rate and acceleration wherever the FMU has inputs for them, as a sine source would feed it:

    H = H_value + j omega H_rate - omega^2 H_acceleration
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.linalg

from hfsa.cosim.instance import Instance
from hfsa.cosim.master import Master
from hfsa.cosim.system import StructureError, System, companions, connector

if TYPE_CHECKING:
    from control import StateSpace

NEWTON_STEPS = 20
"""Newton steps after which an equilibrium must be found."""

NEWTON_TOLERANCE = 1e-9
"""Largest last Newton step, relative to a state's size or its nominal."""


@dataclass(frozen=True)
class Linearization:
    """A system of FMUs at an operating point.

    Attributes:
        A, B, C, D: matrices, (states, states), (states, inputs), (outputs, states), (outputs, inputs), in the
            variables' units.
        states, inputs, outputs: full names.
        operating_point: states at the equilibrium by full name.
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    operating_point: Mapping[str, float]

    @property
    def state_space(self) -> "StateSpace":
        """The system as `control.StateSpace`; signals keep their full names, with `/` where `control` refuses a dot."""
        import control  # takes seconds

        labels = {
            key: [name.replace(".", "/") for name in getattr(self, key)] for key in ("inputs", "outputs", "states")
        }
        return control.StateSpace(self.A, self.B, self.C, self.D, remove_useless_states=False, **labels)

    def response(self, frequency: np.ndarray, orders: Sequence[tuple[int, int, int]]) -> np.ndarray:
        """Return the complex response to sinusoids, (frequencies, outputs, sinusoids).

        `frequency` [Hz] is (n,); each sinusoid enters at the inputs of three indices: value, rate, acceleration, where
        -1 stands for none.
        """
        _, (scale, _) = scipy.linalg.matrix_balance(self.A, permute=False, separate=True)
        A = self.A * scale / scale[:, None]  # powers of two: nothing is rounded
        B, C = self.B / scale[:, None], self.C * scale
        unit = np.eye(len(A))
        result = np.zeros((len(frequency), len(self.outputs), len(orders)), complex)
        for i, omega in enumerate(2 * np.pi * np.asarray(frequency, float)):
            enters = np.zeros((len(self.inputs), len(orders)), complex)
            for j, indices in enumerate(orders):
                for index, factor in zip(indices, (1, 1j * omega, -(omega**2)), strict=True):
                    if index >= 0:
                        enters[index, j] += factor
            result[i] = C @ np.linalg.solve(1j * omega * unit - A, B @ enters) + self.D @ enters
        return result


def linear_response(
    system: System,
    instances: Mapping[str, Instance],
    inputs: Sequence[str],
    outputs: Sequence[str],
    frequency: np.ndarray,
    starts: Mapping[str, float] | None = None,
) -> np.ndarray:
    """Return the response of outputs to sinusoids at inputs, complex, (frequencies, outputs, inputs).

    `frequency` is in Hz. An input's companions, `command.position_rate[3]` and `command.position_acceleration[3]` of
    `command.position[3]`, take part where the FMU has them and nothing else feeds them. Raises as `linearize`.
    """
    fed = {connection.end for connection in system.connections}
    columns: list[str] = []
    orders = []
    for name in inputs:
        component, variable = system.split(name)
        known = instances[component].fmu.variables
        companion = [f"{component}.{c}" if c in known else "" for c in companions(variable)]
        full = [name, *(c if c not in fed else "" for c in companion)]
        orders.append(tuple(_place(columns, c) for c in full))
    return linearize(system, instances, columns, outputs, starts).response(frequency, orders)


def linearize(
    system: System,
    instances: Mapping[str, Instance],
    inputs: Sequence[str],
    outputs: Sequence[str],
    starts: Mapping[str, float] | None = None,
) -> Linearization:
    """Return the linear system from unconnected inputs to outputs (full names) at an equilibrium.

    Components that neither reach the outputs nor hold an input take no part. `starts` holds start values by full name.
    Raises `StructureError` for a sampled FMU, an FMU without directional derivatives, an input that is fed, or where no
    equilibrium is found.
    """
    system = _relevant(system, [*inputs, *outputs])
    starts = {name: value for name, value in (starts or {}).items() if name.partition(".")[0] in _names(system)}
    for component in system.components:
        if instances[component.name].fmu.description.is_sampled:
            raise StructureError(
                f"{component.name} ({component.part}) is sampled; the linear method takes continuous FMUs only. "
                "Sweep with the method stepped instead"
            )
    blocks = _Blocks(system, instances, inputs, outputs)
    master = Master(instances, system)
    master.enter(starts=starts)
    point = _equilibrium(master, blocks)
    A, B, C, D = blocks.close()
    return Linearization(A, B, C, D, blocks.states, tuple(inputs), tuple(outputs), point)


class _Blocks:
    """The FMUs side by side: states; inputs, the fed ones first; outputs, the feeding ones first."""

    def __init__(
        self, system: System, instances: Mapping[str, Instance], inputs: Sequence[str], outputs: Sequence[str]
    ):
        names = _names(system)
        variables = {name: instances[name].fmu.variables for name in names}
        feeder = {connection.end: connection.start for connection in system.connections}
        for full_names, causality in ((inputs, "input"), (outputs, "output")):
            for name in full_names:
                found = connector(system, variables, name).causality
                if found != causality:
                    raise StructureError(f"{name} is an FMU's {found}, expected an {causality}")
                if name in feeder:
                    raise StructureError(f"{name} is fed by {feeder[name]} and cannot be excited as well")
        self.instances = {name: instances[name] for name in names}
        self.pairs = {name: instances[name].fmu.description.states for name in names}
        self.states = tuple(f"{name}.{state}" for name, pairs in self.pairs.items() for state, _ in pairs)
        self.inputs, self.outputs = [*feeder, *inputs], [*feeder.values(), *outputs]
        self.loops = len(feeder)
        nominal = (variables[name][state].nominal for name, pairs in self.pairs.items() for state, _ in pairs)
        self.nominal = np.abs([*nominal])

    def matrices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return A, B, C, D of the FMUs, not yet connected."""
        x, u, y = len(self.states), len(self.inputs), len(self.outputs)
        A, B, C, D = np.zeros((x, x)), np.zeros((x, u)), np.zeros((y, x)), np.zeros((y, u))
        for name, instance in self.instances.items():
            states, rates = zip(*self.pairs[name], strict=True) if self.pairs[name] else ((), ())
            ix = [i for i, full in enumerate(self.states) if full.partition(".")[0] == name]
            iu, inputs = _of(name, self.inputs)
            iy, outputs = _of(name, self.outputs)
            jacobian = instance.jacobian([*rates, *outputs], [*states, *inputs])
            n = len(states)
            A[np.ix_(ix, ix)], B[np.ix_(ix, iu)] = jacobian[:n, :n], jacobian[:n, n:]
            C[np.ix_(iy, ix)], D[np.ix_(iy, iu)] = jacobian[n:, :n], jacobian[n:, n:]
        return A, B, C, D

    def close(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return A, B, C, D from the excited inputs to the wanted outputs, connections closed.

        Fed input k follows feeding output k, so that L is the identity on the first `loops` places.
        """
        A, B, C, D = self.matrices()
        k = self.loops
        through = np.linalg.solve(np.eye(k) - D[:k, :k], np.hstack([C[:k], D[:k, k:]]))
        states, excited = through[:, : len(A)], through[:, len(A) :]
        return (
            A + B[:, :k] @ states,
            B[:, k:] + B[:, :k] @ excited,
            C[k:] + D[k:, :k] @ states,
            D[k:, k:] + D[k:, :k] @ excited,
        )

    def read(self, which: int) -> np.ndarray:
        """Return x (`which` 0) or der(x) (1), (states,)."""
        parts = [i.get(i.handle([pair[which] for pair in self.pairs[name]])) for name, i in self.instances.items()]
        return np.concatenate([np.zeros(0), *parts])

    def set(self, x: np.ndarray) -> None:
        """Set x, (states,)."""
        done = 0
        for name, instance in self.instances.items():
            states = [state for state, _ in self.pairs[name]]
            instance.set(instance.handle(states), x[done : done + len(states)])
            done += len(states)


def _equilibrium(master: Master, blocks: _Blocks) -> dict[str, float]:
    """Bring the system, in initialization mode, to where no state changes; returns the states by full name.

    Where a direction is free (a body without a spring), the shortest step is taken, in units of the nominals.
    """
    x, nominal = blocks.read(0), blocks.nominal
    worst = ""
    for _ in range(NEWTON_STEPS):
        A = blocks.close()[0] * nominal
        rows = np.maximum(np.abs(A).max(axis=1, initial=0.0), 1e-300)
        rates = blocks.read(1)
        step = nominal * np.linalg.lstsq(A / rows[:, None], -rates / rows, rcond=1e-12)[0]
        x = x + step
        blocks.set(x)
        master.settle()
        relative = np.abs(step) / np.maximum(np.abs(x), nominal)
        left = np.abs(blocks.read(1)) / rows
        if np.all(relative <= NEWTON_TOLERANCE) and np.all(left <= NEWTON_TOLERANCE):
            return dict(zip(blocks.states, x.tolist(), strict=True))
        worst = blocks.states[int(np.argmax(np.maximum(relative, left)))]
    raise StructureError(
        f"no equilibrium found within {NEWTON_STEPS} Newton steps; {worst} keeps changing. "
        "Give start values nearer to one, or a system at rest"
    )


def _relevant(system: System, names: Iterable[str]) -> System:
    """Return the part of the system that the components of these variables, or what feeds them, are in."""
    kept = {system.split(name)[0] for name in names}
    while True:
        feeding = {system.split(c.start)[0] for c in system.connections if system.split(c.end)[0] in kept}
        if feeding <= kept:
            break
        kept |= feeding
    return System(
        [component for component in system.components if component.name in kept],
        [c for c in system.connections if {system.split(c.start)[0], system.split(c.end)[0]} <= kept],
    )


def _names(system: System) -> list[str]:
    return [component.name for component in system.components]


def _of(component: str, names: Sequence[str]) -> tuple[list[int], list[str]]:
    """Return places and variables of those full names that belong to a component."""
    own = [(i, name.partition(".")[2]) for i, name in enumerate(names) if name.partition(".")[0] == component]
    return [i for i, _ in own], [variable for _, variable in own]


def _place(names: list[str], name: str) -> int:
    """Return the place of a name, added where it is new; -1 for no name."""
    if not name:
        return -1
    if name not in names:
        names.append(name)
    return names.index(name)
