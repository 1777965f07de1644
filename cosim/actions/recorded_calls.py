"""Calls that fetch recorded variables, for FMUs of hfsa and for those of others.

An FMU of hfsa gives every variable at every time. FMI 2 forbids to get a variable after one was set without a step
between, and some FMUs refuse to give an input at all. Therefore, of an FMU of others

* a connected input has the value that was set, which is on the bus, and a driven one that of its signal;
* outputs without direct feedthrough are fetched right after the step, before any input of the next is set: the same
  values, in the order that the standard allows. This holds where the algorithm steps the instance once.

All other variables are fetched at the point, so that they agree with the inputs there.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from hfsa.cosim.actions.action import Group, Stepper
from hfsa.cosim.actions.schedule import Action
from hfsa.cosim.actions.wiring import Wiring
from hfsa.cosim.fmi.base_instance import BaseInstance, Call

Fetched = tuple[BaseInstance, Sequence[str], np.ndarray]
"""Instance, its recorded variables (n names), and the array (n,) that has their values in the row."""

Driven = Mapping[str, np.ndarray]
"""Present values, (1,), by full name."""


def recorded_calls(
    wiring: Wiring, cycle: Iterable[Action], fetched: Iterable[Fetched], driven: Driven
) -> tuple[dict[str, Group], list[Call]]:
    """Return the groups to fetch right after the step, by instance, and the calls that complete a row.

    `driven` holds the present values of inputs that a signal feeds, (1,), by full name.
    """
    stepping = {action.instance for action in cycle if isinstance(action, Stepper)}
    early: dict[str, list[tuple[str, np.ndarray]]] = {}
    calls: list[Call] = []
    for instance, names, values in fetched:
        for own, place in _runs(wiring, instance, names, instance.name in stepping, driven):
            part = values[place : place + len(own)]
            if own[0] in _early_names(wiring, instance, own, instance.name in stepping):
                early.setdefault(instance.name, []).extend((name, part[i : i + 1]) for i, name in enumerate(own))
            elif (known := _set_value(wiring, instance, own[0], driven)) is not None:
                calls.append(_copy(instance, own, part, known))
            else:
                calls.append(instance.getter(instance.handle(own, part)))
    groups = {}
    for name, pairs in early.items():
        instance = wiring.instances[name]
        handle = instance.handle([variable for variable, _ in pairs])
        groups[name] = Group(name, list(handle.names), instance.getter(handle))
        calls += [
            _copy(instance, [variable], target, handle.values[i : i + 1]) for i, (variable, target) in enumerate(pairs)
        ]
    return groups, calls


def with_early(cycle: Iterable[Action], early: Mapping[str, Group]) -> list[Action]:
    """Return a cycle in which each early group follows the step of its instance."""
    found: list[Action] = []
    for action in cycle:
        found.append(action)
        if isinstance(action, Stepper) and action.instance in early:
            found.append(early[action.instance])
    return found


def _runs(
    wiring: Wiring, instance: BaseInstance, names: Sequence[str], steps: bool, driven: Driven
) -> list[tuple[list[str], int]]:
    """Return consecutive variables that are fetched alike, each run with its first place; a value set is alone."""
    runs: list[tuple[list[str], int]] = []
    kinds: list[tuple[bool, bool]] = []
    for place, name in enumerate(names):
        known = _set_value(wiring, instance, name, driven)
        kind = bool(_early_names(wiring, instance, [name], steps)), known is not None
        if runs and kinds[-1] == kind and not kind[1]:
            runs[-1][0].append(name)
        else:
            runs.append(([name], place))
            kinds.append(kind)
    return runs


def _early_names(wiring: Wiring, instance: BaseInstance, names: Sequence[str], steps: bool) -> list[str]:
    """Return the variables that are fetched right after a step: outputs that follow no input at once."""
    description = instance.fmu.description
    if description.is_ours or description.version != 2 or not steps:
        return []
    known = wiring.connectors[instance.name]
    if wiring.system[instance.name].calls == "strict":
        return [name for name in names if known[name].causality != "input"]
    return [name for name in names if known[name].causality == "output" and known[name].dependencies == ()]


def _set_value(wiring: Wiring, instance: BaseInstance, name: str, driven: Driven) -> np.ndarray | None:
    """Return the value that was set, (1,), of an input of an FMU of others; `None` for any other variable."""
    description = instance.fmu.description
    is_held = description.interface == "co_simulation" and not description.is_ours
    if not is_held or wiring.connectors[instance.name][name].causality != "input":
        return None
    if (full := f"{instance.name}.{name}") in driven:
        return driven[full]
    places = (i for i, c in enumerate(wiring.connections) if c.end == full)
    return next((wiring.bus[i : i + 1] for i in places), None)


def _copy(instance: BaseInstance, names: Sequence[str], target: np.ndarray, source: np.ndarray) -> Call:
    """Return the call that copies values of variables from an array (n,) to another."""

    def copy() -> int:
        """Copy them; return the status ok."""
        target[:] = source
        return 0

    return instance.served(instance.handle(names, target), copy)
