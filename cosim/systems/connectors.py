"""Connectors: the variables of FMUs, and the check of the connections against them before anything runs.

check(system, connectors)
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.kinds import is_number
from hfsa.cosim.systems.names import DERIVATIVES, companions, nearest
from hfsa.cosim.systems.system import System


@dataclass(frozen=True)
class Connector:
    """Variable of an FMU, from its model description.

    Attributes:
        base_unit: exponents of kg, m, s, A, K, mol, cd, rad, then factor and offset of the unit; `None` if undeclared.
        nominal: nominal value, 1 where the description declares none; `has_nominal` is whether it declares one.
        dependencies: inputs with direct feedthrough to an output; `None` where every input may have it.
        is_conventional: whether its name means what it would mean in an FMU of hfsa: the derivative of another input, a
            limit flag, a sample time.
    """

    name: str
    reference: int
    causality: str
    variability: str = "continuous"
    type: str = "Float64"
    unit: str | None = None
    base_unit: tuple[float, ...] | None = None
    start: float | None = None
    nominal: float = 1.0
    min: float | None = None
    max: float | None = None
    dependencies: tuple[str, ...] | None = ()
    has_nominal: bool = False
    is_conventional: bool = False

    @property
    def is_real(self) -> bool:
        """Whether it is a scalar Real (FMI 2) or Float64 (FMI 3), the only types that connections carry."""
        return self.type in ("Real", "Float64")

    @property
    def typical(self) -> float:
        """Typical size: the nominal value, 0 where an FMU of another maker declares none."""
        return self.nominal if self.has_nominal or self.is_conventional else 0.0

    @property
    def changes_at_events(self) -> bool:
        """Whether it changes at events only: it is discrete, or not a real number."""
        is_smooth = self.type.startswith(("Real", "Float"))
        return self.variability == "discrete" or (self.variability == "continuous" and not is_smooth)


def check(system: System, connectors: Mapping[str, Mapping[str, Connector]]) -> None:
    """Raise `StructureError` unless every connection joins an output to an input of the same unit.

    `connectors` holds the variables of each component's FMU by name.
    """
    for connection in system.connections:
        start = connector(system, connectors, connection.start)
        end = connector(system, connectors, connection.end)
        for side, full, wanted in ((start, connection.start, "output"), (end, connection.end, "input")):
            if side.causality != wanted:
                raise StructureError(
                    f"connection {connection}: {full} is an FMU's {side.causality}, expected an {wanted}"
                )
            if not side.is_real:
                raise StructureError(
                    f"connection {connection}: {full} is of type {side.type}, expected a scalar Real or Float64"
                )
        if not _same_unit(start, end):
            raise StructureError(
                f"connection {connection}: {connection.start} is in {start.unit}, but {connection.end} in {end.unit}"
            )
    for component in system.components:
        for name, value in component.start.items():
            _check_start(connector(system, connectors, full := f"{component.name}.{name}"), full, value)


def _check_start(variable: Connector, name: str, value: Any) -> None:
    """Raise `StructureError` for a start value that is no number or outside the bounds of its variable."""
    low = -math.inf if variable.min is None else variable.min
    high = math.inf if variable.max is None else variable.max
    if not (is_number(value) and math.isfinite(value) and low <= value <= high):
        unit = f" {variable.unit}" if variable.unit not in (None, "1") else ""
        raise StructureError(f"{name} starts at {value}{unit}, expected a number from {low:g} to {high:g}{unit}")


def connector(system: System, connectors: Mapping[str, Mapping[str, Connector]], name: str) -> Connector:
    """Return the variable with a full name; `StructureError` with the nearest names if there is none."""
    component, variable = system.split(name)
    if variable not in connectors[component]:
        raise StructureError(
            f"{component} ({system[component].part}) has no variable {variable!r}"
            f"{nearest(variable, connectors[component])}"
        )
    return connectors[component][variable]


def derivative_inputs(known: Mapping[str, Connector], name: str) -> dict[str, str]:
    """Return the inputs that take the derivatives of another, by `DERIVATIVES`, where they mean that.

    `known` holds the variables of the FMU by name. An FMU of another maker has none: its `flow_rate` may be anything.
    """
    pairs = zip(DERIVATIVES, companions(name), strict=True)
    return {order: other for order, other in pairs if other in known and known[other].is_conventional}


def _same_unit(start: Connector, end: Connector) -> bool:
    """Whether two units need no conversion; foreign FMUs may spell a unit differently or declare none."""
    if start.unit is None or end.unit is None or start.unit == end.unit:
        return True
    return start.base_unit is not None and start.base_unit == end.base_unit
