"""Check of a system against the variables of its FMUs, before anything runs.

check(system, connectors)
"""

import math
from collections.abc import Mapping
from typing import Any

from hfsa.cosim.systems.connectors import WHOLE, Connector, connector
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.kinds import is_number, refuse, text
from hfsa.cosim.systems.system import System
from hfsa.cosim.systems.transformations import transformation


def check(system: System, connectors: Mapping[str, Mapping[str, Connector]]) -> None:
    """Raise `StructureError` unless every connection joins an output to an input of a unit that it can be converted to.

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
            if not side.is_number:
                raise StructureError(
                    f"connection {connection}: {full} is of type {side.type}, expected a number or a Boolean"
                )
        transformation(connection, start, end)
    for component in system.components:
        for name, value in component.start.items():
            _check_start(connector(system, connectors, full := f"{component.name}.{name}"), full, value)


def _check_start(variable: Connector, name: str, value: Any) -> None:
    """Raise `StructureError` for a start value of another type than its variable, or outside its bounds."""
    if variable.type == "String":
        text(f"the start value of {name}", value)
        return
    if variable.type == "Boolean":
        if not (isinstance(value, bool) or (is_number(value) and value in (0, 1))):
            refuse(f"the start value of {name}", value, "true or false")
        return
    if not variable.is_number:
        raise StructureError(f"{name} is of type {variable.type} and takes no start value; expected a number or a text")
    if variable.type in WHOLE and is_number(value) and value != round(value):
        refuse(f"the start value of {name}", value, f"a whole number, as the variable is of type {variable.type}")
    low = -math.inf if variable.min is None else variable.min
    high = math.inf if variable.max is None else variable.max
    if not (is_number(value) and math.isfinite(value) and low <= value <= high):
        unit = f" {variable.unit}" if variable.unit not in (None, "1") else ""
        raise StructureError(f"{name} starts at {value}{unit}, expected a number from {low:g} to {high:g}{unit}")
