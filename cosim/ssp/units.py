"""Units of connectors and parameters, and the affine maps between values.

A unit is (kg, m, s, A, K, mol, cd, rad, factor, offset), as `Connector.base_unit`: its value u is the value
factor u + offset in base units.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from hfsa.cosim.archives.xml import Node, attribute, number
from hfsa.cosim.ssp.vocabulary import BASE_UNITS, SSC
from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.units import known_base

_ROUNDING = 1e-12


@dataclass(frozen=True)
class Unit:
    """A unit: its name, and its base unit, `None` where no document defines it and the name alone does not tell."""

    name: str
    base: tuple[float, ...] | None


@dataclass(frozen=True)
class Affine:
    """The map `factor * value + offset`."""

    factor: float = 1.0
    offset: float = 0.0

    def applied(self, value: float) -> float:
        """Return what a value becomes."""
        return value if self == IDENTITY else self.factor * value + self.offset

    def then(self, after: "Affine") -> "Affine":
        """Return the map that applies this one and then another."""
        return Affine(after.factor * self.factor, after.factor * self.offset + after.offset)

    @property
    def inverse(self) -> "Affine":
        """The map back."""
        return Affine(1 / self.factor, -self.offset / self.factor)

    @property
    def is_identity(self) -> bool:
        """Whether it changes a value by rounding only."""
        return self.is_like(Affine())

    def is_like(self, other: "Affine") -> bool:
        """Whether it differs from another by rounding only."""
        return all(
            abs(own - its) <= _ROUNDING * max(abs(own), abs(its))
            for own, its in ((self.factor, other.factor), (self.offset, other.offset))
        )


IDENTITY = Affine()


def conversion(start: Unit | None, end: Unit | None, place: str) -> Affine:
    """Return the map from one unit to another; of a unit that is not defined it is the identity.

    `StructureError` for units of different dimensions.
    """
    if start is None or end is None or start.base is None or end.base is None:
        return IDENTITY
    if start.base[:8] != end.base[:8]:
        raise StructureError(f"{place} converts {start.name} to {end.name}, expected units of one dimension")
    (factor, offset), (other, beside) = start.base[8:], end.base[8:]
    return Affine(factor / other, (offset - beside) / other)


def read_units(groups: list[Node], where: str) -> dict[str, Unit]:
    """Return the units of a document by name, from its nodes `Units`."""
    units = {}
    for node in (unit for group in groups for unit in group.findall(f"{{{SSC}}}Unit")):
        name, base = attribute(node, "name", where), node.find(f"{{{SSC}}}BaseUnit")
        defined = None if base is None else _base(base, where)
        units[name] = Unit(name, defined)
    return units


def unit_named(name: str | None, units: Mapping[str, Unit]) -> Unit | None:
    """Return a unit by name, by its usual meaning where the document does not define it; `None` without a name."""
    return None if not name else units.get(name, Unit(name, known_base(name)))


def _base(node: Node, where: str) -> tuple[float, ...]:
    """Return a base unit."""
    exponents = [number(node, key, 0.0, where) for key in BASE_UNITS]
    factor, offset = number(node, "factor", 1.0, where), number(node, "offset", 0.0, where)
    return (*exponents, factor, offset)
