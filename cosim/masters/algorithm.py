"""A co-simulation algorithm: one row of the table (`algorithms.py`), beside the code that it names.

    ALGORITHMS = (
        Algorithm("jacobi", "all instances step with the outputs of the communication point", order=1, rank=2,
                  inputs="held", scheme=jacobi, make=stepped),
    )

A file of this room with such a tuple is all that an algorithm takes. Command line, README, advice on steps, tests of
orders and limits go through the table.
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
"""What inputs do within a communication step; `exact`: there is none, they follow the outputs at every instant."""

Ports = Mapping[str, Sequence[tuple[str, str]]]
"""Inputs that are to follow outputs within a step, (input, output) each, by component."""


@dataclass
class Scheme:
    """An algorithm on one system: its actions from one communication point to the next.

    Attributes:
        step: actions that lead to the next communication point.
        point: a complete exchange of values there.
        moving: what lets inputs move within a step, `None` where they are held.
        warnings: what an FMU does not offer, by instance.
    """

    wiring: Wiring
    step: Sequence[Action]
    point: Sequence[Action]
    moving: Extrapolation | IteratedStep | None = None
    warnings: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def cycle(self) -> list[Action]:
        """All actions in order, without those that would change nothing."""
        return without_repetition([*self.step, *self.point])

    @property
    def first_of_point(self) -> int:
        """Index of the first action of `cycle` after all instances have stepped."""
        steppers = [i for i, action in enumerate(self.cycle) if isinstance(action, Stepper | IteratedStep)]
        return steppers[-1] + 1 if steppers else 0


@dataclass(frozen=True)
class Algorithm:
    """One way to run a system.

    Attributes:
        name: as on the command line.
        summary: one line of what it does.
        rank: place in the table; cheaper steps first.
        inputs: what they do within a step.
        order: of the error in the communication step; `None` where the algorithm chooses its steps.
        scheme: its actions on the instances of a system; `None` where it takes no steps.
        make: the master that runs it, from instances, system, this row, step size [s], the stepping loop in C (`None`
            for Python's) and the tolerance of a response.
        is_ordered: whether the order of the components makes a difference.
        is_candidate: whether `auto` may take it; `is_advised`: whether it is named in place of an unstable one.
        is_model_exchange: whether FMUs are loaded for Model Exchange.
        ports: parameters that parts are exported with for it.
        layout: its linear map, where that is not one of its actions.
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
        """Whether its communication step is given and can be too long."""
        return self.order is not None

    def layout_of(
        self, system: System, instances: Mapping[str, Instance], blocks: Mapping[str, Block], *observation: Any
    ) -> Layout:
        """Return the linear maps of its actions on linearised FMUs; `StructureError` where it is not offered."""
        if self.layout is not None:
            return self.layout(system, instances, blocks, *observation)
        scheme = self.scheme(instances, system)
        return Layout(scheme.wiring, scheme.cycle, blocks, *observation)
