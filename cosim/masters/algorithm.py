"""A co-simulation algorithm: one row of the table (`algorithms.py`), beside the code that it names.

    ALGORITHMS = (
        Algorithm("jacobi", "all instances step with the outputs of the communication point", order=1, rank=20,
                  inputs="held", scheme=jacobi, make=stepped),
    )

An algorithm is complete with a file of this folder that has such a tuple. The command line, the first table of
`docs/algorithms.md`, the advice on steps, and the tests of orders and limits read the table.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

from hfsa.cosim.actions.action import Stepper
from hfsa.cosim.actions.extrapolation import Extrapolation
from hfsa.cosim.actions.iterated import IteratedStep
from hfsa.cosim.actions.schedule import Action, without_repetition
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.fmi.co_simulation import Instance
from hfsa.cosim.linear.blocks import Block
from hfsa.cosim.linear.cycle import Layout
from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.system import System

Inputs = Literal["held", "extrapolated", "iterated", "fed back", "exact"]
"""Behaviour of inputs within a communication step; `exact`: equal to the outputs at every instant, without steps."""

Ports = Mapping[str, Sequence[tuple[str, str]]]
"""Feedback ports: pairs (input, output) that an FMU closes within a step, by component."""


@dataclass
class Scheme:
    """An algorithm on one system: its actions from one communication point to the next.

    Attributes:
        step: actions up to the next communication point.
        point: a complete exchange of values there.
        moving: extrapolation or iterated step that moves inputs within a step, `None` where inputs are held.
        warnings: warning about a capability that an FMU lacks, by instance.
    """

    wiring: Wiring
    step: Sequence[Action]
    point: Sequence[Action]
    moving: Extrapolation | IteratedStep | None = None
    warnings: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def cycle(self) -> list[Action]:
        """All actions in order, without those that have no effect."""
        return without_repetition([*self.step, *self.point])

    @property
    def first_of_point(self) -> int:
        """Index of the first action of `cycle` after all instances have stepped."""
        steppers = [i for i, action in enumerate(self.cycle) if isinstance(action, Stepper | IteratedStep)]
        return steppers[-1] + 1 if steppers else 0


@dataclass(frozen=True)
class Algorithm:
    """A co-simulation algorithm.

    Attributes:
        name: name on the command line.
        summary: description in one line.
        rank: place in the table, cheaper steps first: any whole number that no other row has.
        inputs: behaviour of inputs within a step.
        order: order of the error in the communication step; `None` where the algorithm chooses its steps.
        scheme: function that returns the actions on the instances of a system.
        make: function that returns the master, from instances, system, this row, step size [s], the stepping loop in C
            (`None` for Python's) and the tolerance of a response.
        is_ordered: whether the order of the components has an effect.
        is_candidate: whether `auto` may choose it; `is_advised`: whether advice may recommend it.
        is_model_exchange: whether FMUs are loaded for Model Exchange.
        ports: function that returns the feedback ports with which parts are exported.
        layout: function that returns its linear map, where that is not the product of its actions' maps.
    """

    name: str
    summary: str
    rank: int
    inputs: Inputs
    order: int | None
    scheme: Callable[[Mapping[str, Instance], System], Scheme]
    make: Callable[..., Any]
    is_ordered: bool = False
    is_candidate: bool = False
    is_advised: bool = False
    is_model_exchange: bool = False
    ports: Callable[[System, Mapping[str, Mapping[str, Connector]]], Ports] | None = None
    layout: Callable[..., Layout] | None = None

    @property
    def is_limited(self) -> bool:
        """Whether its communication step is prescribed, and so may be too long."""
        return self.order is not None

    def layout_of(
        self, system: System, instances: Mapping[str, Instance], blocks: Mapping[str, Block], *observation: Any
    ) -> Layout:
        """Return the linear maps of its actions on linearised FMUs; raises `StructureError` as `scheme`."""
        if self.layout is not None:
            return self.layout(system, instances, blocks, *observation)
        scheme = self.scheme(instances, system)
        return Layout(scheme.wiring, scheme.cycle, blocks, *observation)
