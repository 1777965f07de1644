"""Levels that do not fit together although their connectors do."""

from collections.abc import Mapping
from dataclasses import dataclass

from hfsa.cosim.assembly.models import level_of
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import System


@dataclass(frozen=True)
class Rule:
    """A part at a level whose inputs that begin with `inputs` only the parts (at levels) of `allowed` may feed."""

    part: str
    level: str
    inputs: str
    allowed: Mapping[str, tuple[str, ...] | None]
    reason: str


RULES = (
    Rule(
        "sdelta",
        "rigid",
        "drive[",
        {"sdelta_reference": None, "c_drive": ("ideal",)},
        "it puts out its static reaction only, because a held inertial reaction diverges at every step",
    ),
)
"""Levels that do not fit together although their connectors do."""


def check_levels(system: System) -> None:
    """Raise `StructureError` where `RULES` forbid that two components are joined, also within one FMU."""
    system = system.unfused
    for connection in system.connections:
        (target, variable), (source, _) = system.split(connection.end), system.split(connection.start)
        for rule in RULES:
            if system[target].part != rule.part or level_of(system[target]) != rule.level:
                continue
            part, level = system[source].part, level_of(system[source])
            levels = rule.allowed.get(part, ())
            if variable.startswith(rule.inputs) and not (levels is None or level in levels):
                allowed = (f"{p} ({' or '.join(ls)})" if ls else p for p, ls in rule.allowed.items())
                raise StructureError(
                    f"{connection}: {target} is {rule.part} at level {rule.level}, which may be joined to "
                    f"{' or '.join(allowed)} only: {rule.reason}. {source} is {part} at level {level or 'none'}"
                )
