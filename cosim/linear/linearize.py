"""Linearisation of a system of FMUs: exact small-signal response, without a simulation.

    linear = linearize(system, instances, inputs, outputs)
    linear.state_space                                   # control.StateSpace with signal names
    response = linear_response(system, instances, inputs, outputs, frequency)

Each FMU provides its directional derivatives at an operating point, der(x) = A x + B u, y = C x + D u, and the
connections u = L y + e close them:

    u = (1 - L D)^-1 (L C x + e)

The operating point is an equilibrium, found by Newton's method in initialization mode, where states may be set. The
excitation e is a sinusoid; its derivatives enter wherever the FMU has inputs for them, as from a sine source:

    H = H_value + j omega H_rate - omega^2 H_acceleration - j omega^3 H_jerk

Sampled FMUs are exact discrete systems, around which the continuous ones are discretised exactly (`linear/sampled.py`).
Where ticks of several FMUs coincide, the FMUs tick in the system's order, each with the newest outputs of those before
it, as in the algorithms `jacobi` and `gauss_seidel` (with `jacobi_plain` only at the next tick).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hfsa.cosim.actions.exchange import Exchange
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.linear.blocks import Blocks, ClosedSystem
from hfsa.cosim.linear.equilibrium import equilibrium
from hfsa.cosim.linear.portions import portions
from hfsa.cosim.linear.sampled import SampledSystem
from hfsa.cosim.systems.connectors import derivative_inputs
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import DERIVATIVES
from hfsa.cosim.systems.system import Connection, System

if TYPE_CHECKING:
    from control import StateSpace

FORGOTTEN = 1e-9
"""Multiplier per period below which a mode is overwritten memory, not decaying motion."""

NEUTRAL = 1e-3
"""Growth rate [1/s] up to which a mode counts as neutral."""

_ROUNDING = 100.0
"""Largest rounding error of an eigenvalue, in units of its first-order bound for one rounding of the matrix."""

Orders = Sequence[tuple[int, ...]]
"""Excitations: for each sinusoid the indices of the inputs for its value and its derivatives, by order; -1 for none."""


@dataclass(frozen=True)
class Growth:
    """Fastest growing mode: its rate [1/s], 0 where no mode grows, and its frequency [Hz]."""

    rate: float = 0.0
    frequency: float = 0.0

    def __bool__(self) -> bool:
        return self.rate > 0


class Linearization:
    """A system of FMUs, linearised at an operating point.

    Attributes:
        A, B, C, D: matrices, (states, states), (states, inputs), (outputs, states), (outputs, inputs), in the
            variables' units; with ticks, A and C have further columns for the sampled values.
        states, inputs, outputs: full names.
        closed: the connected system, ticks included.
        is_sampled: whether any FMU has ticks.
        operating_point: states, sampled states and sampled outputs at the equilibrium, by full name.
    """

    def __init__(self, closed: ClosedSystem, operating_point: Mapping[str, float]):
        self.closed, self.operating_point = closed, operating_point
        self.states, self.inputs, self.outputs = closed.states, closed.inputs, closed.outputs
        self.is_sampled = bool(closed.ticking)
        n = len(closed.states) + len(closed.sampled)
        self.A, self.B = closed.rate[:, :n], closed.rate[:, n:]
        self.C, self.D = closed.output[:, :n], closed.output[:, n:]

    @property
    def state_space(self) -> "StateSpace":
        """The system as `control.StateSpace`; signals keep their full names, with `/` in place of dots.

        Raises `StructureError` for a sampled system, whose response to a sinusoid has more than one frequency.
        """
        if self.is_sampled:
            names = ", ".join(ticking.component for ticking in self.closed.ticking)
            raise StructureError(f"a system with sampled parts ({names}) is no StateSpace; take its response")
        import control  # takes seconds

        labels = {
            key: [name.replace(".", "/") for name in getattr(self, key)] for key in ("inputs", "outputs", "states")
        }
        return control.StateSpace(self.A, self.B, self.C, self.D, remove_useless_states=False, **labels)

    @cached_property
    def sampled(self) -> SampledSystem:
        """The exact discretisation between ticks."""
        return SampledSystem(self.closed)

    @property
    def poles(self) -> NDArray[np.complex128]:
        """Eigenvalues [1/s], complex; with ticks the continuous equivalents of the multipliers of one period.

        A pole with a negative real part is stable.
        """
        if not self.is_sampled:
            return np.linalg.eigvals(self.A).astype(complex)
        multipliers = np.linalg.eigvals(self.sampled.transition).astype(complex)
        # overwritten memory has no rate
        multipliers = multipliers[np.abs(multipliers) > FORGOTTEN]
        return np.asarray(np.log(multipliers) / self.sampled.period, dtype=complex)

    @cached_property
    def growth(self) -> "Growth":
        """Fastest mode whose growth exceeds rounding; rate 0 if there is none.

        Rounding shifts an eigenvalue by up to the norm of the balanced matrix times its condition number: much for the
        double eigenvalue 0 of a free body, little for a single one.
        """
        matrix = self.sampled.transition if self.is_sampled else self.closed.balanced().rate[:, : len(self.states)]
        if not len(matrix):
            return Growth()
        values = np.linalg.eigvals(matrix)
        size = np.maximum(np.abs(values), np.finfo(float).tiny)
        if not np.any((np.log(size) / self.sampled.period if self.is_sampled else values.real) > NEUTRAL / 2):
            return Growth()
        import scipy.linalg  # imported here, as it takes a fifth of a second and few systems grow

        values, left, right = scipy.linalg.eig(matrix, left=True, right=True)  # pyright: ignore[reportAssignmentType]
        condition = 1 / np.maximum(np.abs(np.sum(left.conj() * right, axis=0)), np.finfo(float).tiny)
        rounding = _ROUNDING * np.finfo(float).eps * np.linalg.norm(matrix) * condition
        if self.is_sampled:
            period, size = self.sampled.period, np.maximum(np.abs(values), np.finfo(float).tiny)
            rates, surely = np.log(size) / period, np.log1p(rounding / size) / period
            turns = np.angle(values) / period
        else:
            rates, surely, turns = np.real(values), rounding, np.imag(values)
        grows = rates > NEUTRAL + surely
        if not grows.any():
            return Growth()
        fastest = int(np.argmax(np.where(grows, rates, -np.inf)))
        return Growth(float(rates[fastest]), abs(float(turns[fastest])) / (2 * np.pi))

    def response(self, frequency: np.ndarray, orders: Orders) -> NDArray[np.complex128]:
        """Return the complex response to sinusoids, (frequencies, outputs, sinusoids); `frequency` [Hz] is (n,)."""
        evaluate = self.sampled.response if self.is_sampled else _Continuous(self.closed).response
        result = np.zeros((len(frequency), len(self.outputs), len(orders)), complex)
        omega = 2 * np.pi * np.asarray(frequency, float)
        for some in portions(len(omega), len(self.closed.states)):
            result[some] = evaluate(omega[some], entering(omega[some], orders, len(self.inputs)))
        return result


class _Continuous:
    """A closed system without ticks."""

    def __init__(self, closed: ClosedSystem):
        self._closed, self._n = closed.balanced(), len(closed.states)

    def response(self, omega: np.ndarray, enters: np.ndarray) -> np.ndarray:
        """Return the outputs, (f, outputs, m), to excitations (f, inputs, m) at frequencies omega [rad/s], (f,)."""
        rate, output, n = self._closed.rate, self._closed.output, self._n
        x = np.linalg.solve(1j * omega[:, None, None] * np.eye(n) - rate[:, :n], rate[:, n:] @ enters)
        return output[:, :n] @ x + output[:, n:] @ enters


def entering(omega: np.ndarray, orders: Orders, inputs: int) -> np.ndarray:
    """Return the complex amplitudes of inputs, (f, inputs, sinusoids).

    For sinusoids of amplitude 1 at frequencies omega [rad/s], (f,).
    """
    enters = np.zeros((len(omega), inputs, len(orders)), complex)
    for j, indices in enumerate(orders):
        for order, index in enumerate(indices):
            if index >= 0:
                enters[:, index, j] += (1j * omega) ** order
    return enters


def linear_response(
    system: System,
    instances: Mapping[str, Instance],
    inputs: Sequence[str],
    outputs: Sequence[str],
    frequency: np.ndarray,
    starts: Mapping[str, float] | None = None,
) -> np.ndarray:
    """Return the complex response of outputs to sinusoids at inputs, (frequencies, outputs, inputs).

    `frequency` is in Hz. The companions of an input, `command.position_rate[3]` and `command.position_acceleration[3]`
    of `command.position[3]`, are excited too where the FMU has them and no connection feeds them. Raises as
    `linearize`.
    """
    columns, orders = sinusoids(system, instances, inputs)
    return linearize(system, instances, columns, outputs, starts).response(frequency, orders)


def sinusoids(system: System, instances: Mapping[str, Instance], inputs: Sequence[str]) -> tuple[list[str], Orders]:
    """Return the inputs that sinusoids at `inputs` excite, companions included, and the indices for each sinusoid."""
    fed = {connection.end for connection in system.connections}
    columns: list[str] = []
    orders = []
    for name in inputs:
        component, variable = system.split(name)
        own = derivative_inputs(instances[component].fmu.variables, variable)
        companion = [f"{component}.{own[order]}" if order in own else "" for order in DERIVATIVES]
        orders.append(tuple(_place(columns, c) for c in (name, *(c if c not in fed else "" for c in companion))))
    return columns, orders


def linearize(
    system: System,
    instances: Mapping[str, Instance],
    inputs: Sequence[str],
    outputs: Sequence[str],
    starts: Mapping[str, float] | None = None,
    opened: Connection | None = None,
) -> Linearization:
    """Return the linear system from unconnected inputs to outputs (full names) at an equilibrium.

    Components that neither reach the outputs nor have one of the inputs are left out. `starts` holds start values by
    full name. The connection `opened` is closed at the equilibrium and open in the result: its end is the last input,
    its start the last output. Raises `StructureError` for an FMU without directional derivatives, a connected input,
    sample times without a common grid, or where no equilibrium is found.
    """
    ends = [opened.start, opened.end] if opened else []
    system = upstream(system, [*inputs, *outputs, *ends])
    names = [component.name for component in system.components]
    starts = {name: value for name, value in (starts or {}).items() if name.partition(".")[0] in names}
    blocks = Blocks(system, instances, inputs, outputs)
    point = operating_point(system, instances, blocks, starts)
    return Linearization(blocks.close(opened), point)


def operating_point(
    system: System, instances: Mapping[str, Instance], blocks: Blocks, starts: Mapping[str, float]
) -> dict[str, float]:
    """Bring instances, in initialization mode, to an equilibrium of the system; return x and v by full name."""
    exchange = Exchange(Wiring(system, instances))
    exchange.enter(starts=starts)
    return equilibrium(exchange, blocks)


def upstream(system: System, names: Iterable[str]) -> System:
    """Return the subsystem of the components of these variables and all components upstream of them."""
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


def _place(names: list[str], name: str) -> int:
    """Return the index of a name, appended if new; -1 for an empty name."""
    if not name:
        return -1
    if name not in names:
        names.append(name)
    return names.index(name)
