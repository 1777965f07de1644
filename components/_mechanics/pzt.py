"""A PZT stack: its static line, what a mechanism feels of it, and the stack Tokin AE0505D16, the default.

    F = alpha V - k l,   k = F0 / s0,   alpha = F0 / Vmax     (eq 5.9)

What is not said of a stack is that of a stack of the Tokin's ceramic in another size, its cross-section in proportion
to F0, its length to s0, its layers as thick as Vmax asks for:

    C_T ~ F0 s0 / Vmax^2 (one coupling factor),   m ~ F0 s0 (one density),   c = sqrt(k m) / Q_m (one quality)

Source: thesis of 2000 on the 3-RRR stage, eq 5.9, for the line. Assumed: a third of the mass moves with the tip.
"""

import math
from dataclasses import dataclass

from hfsa.components._modelling.errors import ModelError
from hfsa.components._modelling.follows import follows

BLOCKING_FORCE = 833.0
"""F0, at `FULL_VOLTAGE` [N]."""
FREE_STROKE = 16e-6
"""s0, at `FULL_VOLTAGE` [m]."""
FULL_VOLTAGE = 150.0
"""Vmax; a stack takes 0 to this [V]."""
STROKE_IN_USE = 12e-6
"""Elongation over which the source states the stage's range [m]."""

SIZE = (5e-3, 5e-3, 20e-3)
"""Width, depth and length [m] (given)."""
DENSITY = 7700.0
"""[kg/m3] (typical)."""
CAPACITANCE = 1.4e-6
"""C_T, of the free stack at low frequency [F] (typical)."""
QUALITY = 25.0
"""Q_m, mechanical quality factor (typical)."""

PULL_FROM_ROUNDING = 1e-6 * BLOCKING_FORCE
"""Pull [N] that rounding and a solver's tolerance may show in a stack at rest: not yet a lost contact."""

_TIP_MASS = DENSITY * math.prod(SIZE) / 3
_DEFAULTS_SIZE = BLOCKING_FORCE * FREE_STROKE
_CONSISTENT = 1e-9
"""Relative difference that rounding may make between a force and its stiffness by stroke."""


@dataclass(frozen=True)
class Stack:
    """One stack by its data sheet; by default the Tokin, and what is left out as the module says.

    Attributes:
        blocking_force: F0, at the full voltage [N]; stiffness by stroke.
        stroke: s0, of the free stack at the full voltage [m].
        stiffness: k, blocking force by stroke [N/m].
        full_voltage: Vmax [V]; a stack takes 0 to this.
        capacitance: C_T, of the free stack at low frequency [F].
        tip_mass: that moves with the tip, a third of the stack's [kg].
        damping: c [N.s/m].

    Raises:
        ModelError: a number that is not above 0 (a damping below 0) or not finite; force, stroke and stiffness that do
            not belong together; a capacitance that the motion of the free stack alone exceeds.
    """

    blocking_force: float = follows("stiffness")
    stroke: float = FREE_STROKE
    stiffness: float = follows("blocking_force", "stroke")
    full_voltage: float = FULL_VOLTAGE
    capacitance: float = follows("blocking_force", "stroke", "stiffness", "full_voltage")
    tip_mass: float = follows("blocking_force", "stroke", "stiffness")
    damping: float = follows("blocking_force", "stroke", "stiffness", "tip_mass")

    def __post_init__(self):
        self._check("stroke", "full_voltage")
        if self.blocking_force is None:
            self._set("blocking_force", BLOCKING_FORCE if self.stiffness is None else self.stiffness * self.stroke)
        if self.stiffness is None:
            self._set("stiffness", self.blocking_force / self.stroke)
        self._check("blocking_force", "stiffness")
        if not math.isclose(self.blocking_force, self.stiffness * self.stroke, rel_tol=_CONSISTENT):
            raise ModelError(
                f"stack: blocking_force {self.blocking_force:g} N is not stiffness {self.stiffness:g} N/m by stroke "
                f"{self.stroke:g} m; leave one of the three out"
            )
        size = self.blocking_force * self.stroke / _DEFAULTS_SIZE
        if self.capacitance is None:
            self._set("capacitance", size * (FULL_VOLTAGE / self.full_voltage) ** 2 * CAPACITANCE)
        if self.tip_mass is None:
            self._set("tip_mass", size * _TIP_MASS)
        self._check("capacitance", "tip_mass")
        if self.damping is None:
            self._set("damping", math.sqrt(self.stiffness * self.tip_mass) / QUALITY)
        if not (math.isfinite(self.damping) and self.damping >= 0):
            raise ModelError(f"stack: damping is {self.damping:g} N.s/m, expected 0 or more")
        if not self.clamped_capacitance > 0:
            least = self.capacitance - self.clamped_capacitance
            raise ModelError(
                f"stack: capacitance is {self.capacitance:g} F, expected more than {least:g} F, blocking_force by "
                "stroke over the square of full_voltage: that much the motion of the free stack takes alone"
            )

    @property
    def coupling(self) -> float:
        """Force per volt alpha [N/V = C/m]."""
        return self.blocking_force / self.full_voltage

    @property
    def clamped_capacitance(self) -> float:
        """C_S, of the stack whose elongation is held [F]."""
        return self.capacitance - self.coupling**2 / self.stiffness

    def _set(self, name: str, value: float) -> None:
        object.__setattr__(self, name, value)

    def _check(self, *names: str) -> None:
        """Raise `ModelError` for a field that is not above 0 or not finite."""
        for name in names:
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ModelError(f"stack: {name} is {value:g}, expected more than 0")


TOKIN = Stack()
"""Tokin AE0505D16."""
