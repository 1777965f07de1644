"""The piezo stacks of a scene by their data sheet, as one argument, handed on to all who know something of them.

The stacks take force, elongation and voltage at the maximum, and their clamped capacitance. The stage takes stiffness,
damping and the mass that moves with the tip, and rests at a voltage where their line says. What makes volts of forces
takes stiffness and force per volt, what clips volts the full voltage, and no pose is asked for beyond the stroke.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hfsa.cosim.scenes._given import given
from hfsa.cosim.systems.system import Analysis, Component


@dataclass(frozen=True)
class Pzt:
    """One stack; by default the Tokin AE0505D16.

    What is left out is that of the same ceramic in the size of what is given: another blocking force is another
    cross-section, with the capacitance, mass and damping of that.

    Attributes:
        blocking_force: at the full voltage [N]; 833, or stiffness by stroke.
        stroke: of the free stack at the full voltage [m]; 16e-6.
        stiffness: [N/m]; blocking force by stroke, so that two of the three are enough.
        full_voltage: [V]; 150.
        capacitance: of the free stack [F]; 1.4e-6.
        tip_mass: that moves with the tip [kg]; a third of the stack's.
        damping: [N.s/m]; of the quality factor 25.
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
        """The stack as arguments of an analysis."""
        return given(self, "stack")

    def stacks(self, level: str, start: Mapping[str, float] | None = None) -> list[Component]:
        """Return three stacks of the causality `source`, with more start values."""
        own = {
            "maximum.force": self._of("blocking_force"),
            "maximum.elongation": self._of("free_stroke"),
            "maximum.voltage": self._of("full_voltage"),
            "clamped_capacitance": self._of("clamped_capacitance"),
        }
        values = {**own, **(start or {})}
        return [Component(f"stack[{i}]", "pzt_stack", level, {"causality": "source"}, values) for i in (1, 2, 3)]

    @property
    def on_stage(self) -> dict[str, Analysis]:
        """Start values of a stage of the causality `source`."""
        names = {"stiffness": "stiffness", "damping": "damping", "tip_mass": "effective_mass"}
        return {f"stack.{name}": self._of(key) for name, key in names.items()}

    @property
    def line(self) -> dict[str, Analysis]:
        """Start values of what makes volts of forces."""
        return {"stack.stiffness": self._of("stiffness"), "stack.coupling": self._of("coupling")}

    @property
    def highest(self) -> dict[str, Analysis]:
        """Start values of what clips its volts."""
        return {"maximum.voltage": self._of("full_voltage")}

    def _of(self, key: str) -> Analysis:
        """Return a number of the stack."""
        return Analysis("pzt_stack", key, self.arguments)


TOKIN = Pzt()
"""The stack of the source."""
