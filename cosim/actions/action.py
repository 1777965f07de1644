"""Actions between two communication points: fetch outputs, set inputs, step.

All connected outputs lie in one array, the bus. An algorithm is an order of actions; each has a `call`, whose `run`
performs the action and returns its FMI status.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Self

from hfsa.cosim.fmi.co_simulation import Call
from hfsa.cosim.fmi.library import fails


class CompositeAction(ABC):
    """An action made of several FMI calls; the action is its own `call`.

    Attributes:
        failing: the FMI call that produced the last status.
    """

    failing: Call | None = None

    @property
    def call(self) -> Self:
        """The action itself."""
        return self

    @abstractmethod
    def run(self) -> int:
        """Do it; return the first status that is worse than a warning, else the first warning's."""

    def _run(self, calls: Iterable[Call]) -> int:
        """Run calls; return the first status worse than a warning, else the first warning."""
        warning = 0
        for call in calls:
            if status := call.run():
                self.failing, warning = call, warning or status
                if fails(status):
                    return status
        return warning

    def _checked(self, status: int, time: float) -> int:
        """Return a status that is ok or a warning; raise `StepError` at `time` [s] for a worse one."""
        if fails(status):
            assert self.failing is not None
            self.failing.instance.time = time
            self.failing.instance.check(self.failing, status)
        return status


def failing_call(call: Call | CompositeAction) -> Call | None:
    """Return the FMI call that produced the last status."""
    return call if isinstance(call, Call) else call.failing


@dataclass(eq=False)
class Group:
    """Connected outputs of one instance at one feedthrough level, fetched by one call.

    Attributes:
        transfers: inputs that these outputs feed.
        loop: number of the algebraic loop through the group, `None` if there is none.
    """

    instance: str
    outputs: list[str]
    call: Call
    transfers: list["Transfer"] = field(default_factory=list)
    loop: int | None = None


@dataclass(eq=False)
class Transfer:
    """Inputs of instance `target` that one group feeds, set by one call.

    Attributes:
        affected: groups with direct feedthrough from these inputs.
    """

    target: str
    inputs: list[str]
    call: Call
    affected: list[Group] = field(default_factory=list)


@dataclass(eq=False)
class Stepper:
    """One step of one instance; it may change all `groups` of that instance."""

    instance: str
    call: Call
    groups: list[Group]
