"""What a master does between two communication points: fetch outputs, set inputs, step.

All connected outputs lie in one array, the bus. An algorithm is an order of actions; each has a `call`, whose `run`
returns the status of what it did.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Self

from hfsa.cosim.fmi.co_simulation import Call


class CompositeAction:
    """An action that is more than one call of an FMU: what a master runs is the action itself.

    Attributes:
        failing: the call that the last status is of.
    """

    failing: Call | None = None

    @property
    def call(self) -> Self:
        """What a master runs."""
        return self

    def _run(self, calls: Iterable[Call]) -> int:
        """Run calls; return the first status that is worse than a warning, else the first warning's."""
        warning = 0
        for call in calls:
            if status := call.run():
                self.failing, warning = call, warning or status
                if status > 1:
                    return status
        return warning

    def _checked(self, status: int, time: float) -> int:
        """Return a status that is not worse than a warning; `StepError` at `time` [s] for any other."""
        if status > 1:
            assert self.failing is not None
            self.failing.instance.time = time
            self.failing.instance.check(self.failing, status)
        return status


def failing_call(call: Call | CompositeAction) -> Call | None:
    """Return the FMU's own call that the last status of a call is of."""
    return call if isinstance(call, Call) else call.failing


@dataclass(eq=False)
class Group:
    """Connected outputs of one instance at one feedthrough level, fetched by one call.

    Attributes:
        transfers: what it feeds.
        loop: number of the algebraic loop that it is on.
    """

    instance: str
    outputs: list[str]
    call: Call
    transfers: list["Transfer"] = field(default_factory=list)
    loop: int | None = None


@dataclass(eq=False)
class Transfer:
    """Inputs of instance `target` that one group feeds, set by one call; `affected` groups follow them directly."""

    target: str
    inputs: list[str]
    call: Call
    affected: list[Group] = field(default_factory=list)


@dataclass(eq=False)
class Stepper:
    """One step of one instance; afterwards all its `groups` may have changed."""

    instance: str
    call: Call
    groups: list[Group]
