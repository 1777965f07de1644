"""Connectors: the variables of FMUs."""

from collections.abc import Mapping
from dataclasses import dataclass

from hfsa.cosim.systems.errors import StructureError
from hfsa.cosim.systems.names import DERIVATIVES, companions, nearest
from hfsa.cosim.systems.system import System

WHOLE = ("Integer", "Enumeration", *(f"{sign}{bits}" for sign in ("Int", "UInt") for bits in (8, 16, 32, 64)))
"""Types of whole numbers."""

NUMBERS = ("Real", "Float64", "Float32", *WHOLE, "Boolean")
"""Types of numbers; the others are texts, bytes and clocks."""


@dataclass(frozen=True, slots=True)
class Connector:
    """Variable of an FMU, from its model description.

    Attributes:
        base_unit: exponents of kg, m, s, A, K, mol, cd, rad, then factor and offset of the unit; `None` if undeclared.
        nominal: nominal value, 1 where the description declares none; `has_nominal` is whether it declares one.
        is_relative: whether it is a difference, such as a rise of temperature, which an offset of units leaves alone.
        element: place in the array of which it is an element, row by row from 0, `None` for a scalar; `size` is that of
            the array.
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
    is_relative: bool = False
    element: int | None = None
    size: int = 1
    is_conventional: bool = False

    @property
    def is_real(self) -> bool:
        """Whether it is a scalar Real (FMI 2) or Float64 (FMI 3), which directional derivatives and slopes need."""
        return self.type in ("Real", "Float64") and self.element is None

    @property
    def is_number(self) -> bool:
        """Whether it is a number of any type, Booleans among them: what connections and recordings carry."""
        return self.type in NUMBERS

    @property
    def typical(self) -> float:
        """Typical size: the nominal value, 0 where an FMU of another maker declares none."""
        return self.nominal if self.has_nominal or self.is_conventional else 0.0

    @property
    def changes_at_events(self) -> bool:
        """Whether it changes at events only: it is discrete, or not a real number."""
        is_smooth = self.type.startswith(("Real", "Float"))
        return self.variability == "discrete" or (self.variability == "continuous" and not is_smooth)


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
