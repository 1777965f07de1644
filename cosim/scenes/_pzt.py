"""Piezo stacks of a scene by their data sheet, as one argument that is passed on to all parts that depend on it.

The stacks have the maximum force, elongation and voltage, and the clamped capacitance. The stage has stiffness, damping
and tip mass of the stacks, and its equilibrium at a voltage. A converter from force to voltage has stiffness and force
per volt, a voltage limit the full voltage, and a reference pose stays within the stroke.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hfsa.cosim.scenes._given import given
from hfsa.cosim.systems.system import Analysis, Component


@dataclass(frozen=True)
class Pzt:
    """Piezo stack; by default the Tokin AE0505D16.

    Values that are not given are those of the same ceramic in a size that fits the given ones: another blocking force
    means another cross-section, with its capacitance, mass and damping.

    Attributes:
        blocking_force: force at the full voltage without elongation [N] (default: 833, or stiffness times stroke).
        stroke: elongation of the free stack at the full voltage [m] (default: 16e-6).
        stiffness: stiffness [N/m] (default: blocking force per stroke, so that two of the three are enough).
        full_voltage: full voltage [V] (default: 150).
        capacitance: capacitance of the free stack [F] (default: 1.4e-6).
        tip_mass: mass that moves with the tip [kg] (default: a third of the mass of the stack).
        damping: damping [N.s/m] (default: of the quality factor 25).
    """

    blocking_force: float | None = None
    stroke: float | None = None
    stiffness: float | None = None
    full_voltage: float | None = None
    capacitance: float | None = None
    tip_mass: float | None = None
    damping: float | None = None

    @property
    def arguments(self) -> dict[str, Any]:
        """The stack as arguments of an analysis, or of a stage of causality `source`."""
        return given(self, "stack")

    def stacks(self, level: str, start: Mapping[str, float] | None = None) -> list[Component]:
        """Return three stacks of causality `source`, with further start values."""
        own = {
            "maximum.force": self._of("blocking_force"),
            "maximum.elongation": self._of("free_stroke"),
            "maximum.voltage": self._of("full_voltage"),
            "clamped_capacitance": self._of("clamped_capacitance"),
        }
        values = {**own, **(start or {})}
        return [Component(f"stack[{i}]", "pzt_stack", level, {"causality": "source"}, values) for i in (1, 2, 3)]

    @property
    def line(self) -> dict[str, Analysis]:
        """Start values of a converter from force to voltage."""
        return {"stack.stiffness": self._of("stiffness"), "stack.coupling": self._of("coupling")}

    @property
    def highest(self) -> dict[str, Analysis]:
        """Start values of a voltage limit."""
        return {"maximum.voltage": self._of("full_voltage")}

    def _of(self, key: str) -> Analysis:
        """Return a number of the stack, computed by its analysis."""
        return Analysis("pzt_stack", key, self.arguments)


TOKIN = Pzt()
"""Stack of the published stage."""
