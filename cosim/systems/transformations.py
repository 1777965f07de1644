"""Linear transformation of the value that a connection carries, in the terms of SSP.

    value at the end = factor * value at the start + offset

A connection with a factor or an offset of its own does what they say and no more: units are not compared. Any other
connection converts between two units with the same base unit, and passes the value on where nothing is to be converted.
`assembly/transformations.py` makes a component of what a transformation does.
"""

from dataclasses import dataclass

from hfsa.cosim.systems.connectors import Connector
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.system import Connection
from hfsa.cosim.systems.units import conversion, known_base


@dataclass(frozen=True)
class Transformation:
    """Factor and offset of a connection, with its units: those of the output and of the input."""

    factor: float
    offset: float
    units: tuple[str, str]


def transformation(connection: Connection, start: Connector, end: Connector) -> Transformation | None:
    """Return the transformation of a connection, `None` where it passes the value on as it is.

    Raises:
        StructureError: units of different kinds, on a connection without factor and offset.
    """
    units = start.unit or "1", end.unit or "1"
    if connection.is_transformed:
        return Transformation(connection.factor, connection.offset, units)
    if start.unit is None or end.unit is None or start.unit == end.unit:
        return None
    bases = [v.base_unit or known_base(v.unit) for v in (start, end)]
    found = conversion(*bases, is_relative=start.is_relative or end.is_relative)
    if found is None:
        raise StructureError(
            f"connection {connection}: {connection.start} is in {start.unit}, but {connection.end} in {end.unit}; "
            "expected units with the same base unit, or a factor and an offset on the connection"
        )
    return None if found == (1.0, 0.0) else Transformation(*found, units)
