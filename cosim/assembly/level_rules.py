"""Levels that do not fit together although their ports do: parts declare by which others alone they may be fed."""

from hfsa.components._modelling.arguments import argument_values
from hfsa.components._modelling.joins import Join
from hfsa.cosim.assembly.models import is_part, level_of, named_part
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Component, System


def check_levels(system: System) -> None:
    """Raise `StructureError` where a part's `JOINS` forbid that two components are joined, also within one FMU."""
    system = system.unfused
    for connection in system.connections:
        (target, variable), (source, _) = system.split(connection.end), system.split(connection.start)
        for join in _joins(system[target]):
            part, level = _name(system[source]), level_of(system[source])
            levels = join.allowed.get(part, ())
            if not variable.startswith(join.inputs):
                continue
            found = {name: _argument(system[source], name) for name in join.having} if part in join.allowed else {}
            strange = [f"{name} {value}" for name, value in found.items() if value not in join.having[name]]
            if strange or not (levels is None or level in levels):
                allowed = (f"{p} ({' or '.join(ls)})" if ls else p for p, ls in join.allowed.items())
                having = "".join(f" with {name} {' or '.join(values)}" for name, values in join.having.items())
                raise StructureError(
                    f"{connection}: {target} is {_name(system[target])} at level {join.level}, which may be joined to "
                    f"{' or '.join(allowed)}{having} only: {join.reason}. {source} is {part} at level "
                    f"{' with '.join([level or 'none', *strange])}"
                )


def _joins(component: Component) -> list[Join]:
    """Return what a component's part declares at the component's level."""
    if not is_part(component.part):
        return []
    declared = named_part(component).joins
    return [join for join in declared if join.level == level_of(component)]


def _argument(component: Component, name: str) -> object:
    """Return the value of an argument of a component's part."""
    part = named_part(component)
    given = {key: value for key, value in component.arguments.items() if part.has_argument(key)}
    return argument_values(part.name, part.build, given).get(name)


def _name(component: Component) -> str:
    """Return the name of a component's part; that of a foreign FMU is its path."""
    return named_part(component).name if is_part(component.part) else component.part
