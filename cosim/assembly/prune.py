"""Pruning of a system to what some of its variables need.

    system, left_out = prune(scene.system, observed=["robot.platform.position[3]"], excited=scene.inputs)
    left_out.sentence

Kept are the observed variables, the excited inputs, every limit flag (`measurement/limit_flags.py`), and all that
these depend on: within a part through its equations (`components/_modelling/prune.py`), between parts through the
connections. Inputs that reach nothing are left out with their connections, and a part of which nothing is needed is
left out altogether, so that what feeds it alone is left out as well. All parameters and the sample time of a part stay.

A foreign FMU stays whole, with all that feeds it: what it does besides its outputs is not known.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from hfsa.components._modelling.model import Kind
from hfsa.components._modelling.prune import OUTPUTS, STATES, Dependencies
from hfsa.cosim.assembly.outline import outline_of
from hfsa.cosim.measurement.limit_flags import is_limit
from hfsa.cosim.systems.names import compact
from hfsa.cosim.systems.system import Component, System

_OF_SOLVER = "solver."
"""Prefix of the variables of a solver, which an FMU without states does not have."""


@dataclass(frozen=True)
class Share:
    """Share of a component that is left out; `is_whole` where nothing of it is left."""

    states: int
    of_states: int
    outputs: int
    is_whole: bool = False

    def __str__(self) -> str:
        if self.is_whole:
            return "all states and outputs" if self.of_states else "all outputs"
        states = [f"{self.states} of {_counted(self.of_states, 'state')}"] if self.states else []
        outputs = [_counted(self.outputs, "output")] if self.outputs else []
        return " and ".join([*states, *outputs]) or "some inputs"


@dataclass(frozen=True)
class LeftOut:
    """What is left out of a system, by component."""

    shares: Mapping[str, Share] = field(default_factory=dict)

    @property
    def sentence(self) -> str:
        """One line about what is left out; empty where nothing is."""
        alike: dict[Share, list[str]] = {}
        for name, share in self.shares.items():
            alike.setdefault(share, []).append(name)
        words = [f"{', '.join(compact(names))}: {share}" for share, names in alike.items()]
        return f"{'; '.join(words)} reach nothing observed and are left out; --keep all keeps them" if words else ""

    @property
    def warning(self) -> str:
        """The sentence where states are left out; outputs alone are no part of the motion."""
        return self.sentence if any(share.states for share in self.shares.values()) else ""


def prune(system: System, observed: Iterable[str], excited: Iterable[str] = ()) -> tuple[System, LeftOut]:
    """Return the system of what variables (full names) need, and what is left out.

    `system` is not fused. `observed` are outputs, inputs or local variables, and `excited` inputs that stay even where
    they reach nothing. Raises as `outline.outline_of`.
    """
    known = {component.name: outline_of(component).dependencies for component in system.components}
    kept = _kept(system, known, [*observed, *excited])
    components, shares = [], {}
    for component in system.components:
        dependencies, names = known[component.name], kept.get(component.name)
        if dependencies is None:
            components.append(component)
            continue
        if names is not None:
            components.append(_restricted(component, dependencies, names))
        if names is None or len(names) < len(dependencies.kinds):
            shares[component.name] = _share(dependencies, names)
    connections = [c for c in system.connections if _is_kept(system, known, kept, c.end)]
    return System(components, connections), LeftOut(shares)


def _kept(system: System, known: Mapping[str, Dependencies | None], names: Iterable[str]) -> dict[str, list[str]]:
    """Return the kept inputs, states and outputs of each component of which something is needed."""
    feeding = {connection.end: system.split(connection.start) for connection in system.connections}
    wanted: dict[str, set[str]] = {}
    for name in names:
        component, variable = system.split(name)
        wanted.setdefault(component, set()).update(_quantities(variable, known[component]))
    for component, dependencies in known.items():
        if dependencies is not None and (flags := set(filter(is_limit, dependencies.kinds))):
            wanted.setdefault(component, set()).update(flags)
    for end, (source, output) in feeding.items():
        if known[system.split(end)[0]] is None:
            wanted.setdefault(source, set()).add(output)
    kept: dict[str, list[str]] = {}
    waiting = list(wanted)
    while waiting:
        component = waiting.pop()
        dependencies = known[component]
        if dependencies is None:
            continue
        before = set(kept.get(component, ()))
        kept[component] = dependencies.reached(wanted[component] & dependencies.kinds.keys())
        for name in kept[component]:
            source, output = feeding.get(f"{component}.{name}", ("", ""))
            if name not in before and source and output not in wanted.setdefault(source, set()):
                wanted[source].add(output)
                waiting.append(source)
    return kept


def _restricted(component: Component, dependencies: Dependencies, names: list[str]) -> Component:
    """Return a component with these quantities alone, without start values of others."""
    if len(names) == len(dependencies.kinds):
        return component
    gone = dependencies.kinds.keys() - set(names)
    has_states = any(dependencies.kinds[name] is Kind.STATE for name in names)
    start = {
        name: value
        for name, value in component.start.items()
        if name not in gone and (has_states or not name.startswith(_OF_SOLVER))
    }
    return replace(component, start=start, kept=tuple(names))


def _is_kept(system: System, known: Mapping[str, Dependencies | None], kept: Mapping[str, list[str]], end: str) -> bool:
    """Whether the input at the end of a connection is kept."""
    component, variable = system.split(end)
    return known[component] is None or variable in kept.get(component, ())


def _share(dependencies: Dependencies, names: list[str] | None) -> Share:
    """Return what is left out of a component of which `names` are kept, `None` for nothing."""
    gone = [kind for name, kind in dependencies.kinds.items() if name not in (names or ())]
    states = sum(kind in STATES for kind in dependencies.kinds.values())
    return Share(sum(k in STATES for k in gone), states, sum(k in OUTPUTS for k in gone), names is None)


def _quantities(variable: str, dependencies: Dependencies | None) -> Iterable[str]:
    """Return the quantities that an observed variable needs: of `der(state)` and `next.state` the state."""
    if dependencies is None or variable in dependencies.kinds:
        return [variable]
    if variable.startswith(_OF_SOLVER):
        return dependencies.kinds
    is_derivative = variable.startswith("der(") and variable.endswith(")")
    return [variable[4:-1] if is_derivative else variable.removeprefix("next.")]


def _counted(number: int, noun: str) -> str:
    """Return a number with its noun: `1 state`, `12 states`."""
    return f"{number} {noun}{'' if number == 1 else 's'}"
