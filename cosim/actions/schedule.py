"""Schedule of the actions between two communication points: sampled instances first, no action without effect."""

from collections.abc import Iterable, Iterator

from hfsa.cosim.actions.action import CompositeAction, Group, Stepper, Transfer
from hfsa.cosim.actions.algebraic_loop import AlgebraicLoop
from hfsa.cosim.actions.feed import Feed
from hfsa.cosim.actions.iterated import IteratedStep
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.fmi.co_simulation import Call

Runnable = Call | CompositeAction
"""Types of the `call` of an action."""

Action = Group | Transfer | Stepper | CompositeAction


def discrete_first(wiring: Wiring) -> Iterator[Action]:
    """Yield the steps of the sampled instances, one after the other, each followed by an exchange.

    The exchange sets the inputs of all instances that have not stepped yet, through direct feedthrough as well.
    """
    stepped = set()
    for stepper in wiring.discrete:
        yield stepper
        stepped.add(stepper.instance)
        for action in wiring.exchange():
            if not (isinstance(action, Transfer) and action.target in stepped):
                yield action


def without_repetition(cycle: Iterable[Action]) -> list[Action]:
    """Return a cycle without the actions that would repeat an earlier one.

    Outputs are fetched only where they may have changed since the last fetch, and inputs set only after a new fetch.
    The cycle begins after a complete exchange and ends with one, so the result is the same for every cycle.
    """
    stale_groups: set[Group] = set()
    stale_transfers: set[Transfer] = set()
    stale_loops: set[int] = set()

    def touch(groups: Iterable[Group]) -> None:
        """Mark groups, and the algebraic loops through them, as changed."""
        for group in groups:
            stale_groups.add(group)
            if group.loop is not None:
                stale_loops.add(group.loop)

    kept: list[Action] = []
    for action in cycle:
        if isinstance(action, Stepper | IteratedStep):
            touch(action.groups)
        elif isinstance(action, Feed):
            touch(action.affected)
        elif isinstance(action, Group):
            if action not in stale_groups:
                continue
            stale_groups.discard(action)
            stale_transfers.update(action.transfers)
        elif isinstance(action, Transfer):
            if action not in stale_transfers:
                continue
            stale_transfers.discard(action)
            touch(action.affected)
        elif isinstance(action, AlgebraicLoop):
            if action.number not in stale_loops:
                continue
            stale_transfers.update(action.transfers)
            touch(group for transfer in action.inner for group in transfer.affected)
            stale_groups.difference_update(action.groups)
            stale_loops.discard(action.number)
        kept.append(action)
    return kept
