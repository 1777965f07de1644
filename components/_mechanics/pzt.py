"""Data sheet of a PZT stack: static force-elongation line, capacitance, tip mass and damping; default Tokin AE0505D16.

    F = alpha V - k l,   k = F0 / s0,   alpha = F0 / Vmax     (eq 5.9)

Values that are not given are scaled from the Tokin, for the same ceramic in another size: cross-section in proportion
to F0, length to s0, layer thickness to Vmax.

    C_T ~ F0 s0 / Vmax^2 (one coupling factor),   m ~ F0 s0 (one density),   c = sqrt(k m) / Q_m (one quality)

Source: thesis of 2000 on the 3-RRR stage, eq 5.9, for the line. Assumed: a third of the mass moves with the tip.
"""

import math
from dataclasses import dataclass

from hfsa.components._modelling.errors import ModelError
from hfsa.components._modelling.follows import follows

BLOCKING_FORCE = 833.0
"""F0, blocking force at `FULL_VOLTAGE` [N]."""
FREE_STROKE = 16e-6
"""s0, free stroke at `FULL_VOLTAGE` [m]."""
FULL_VOLTAGE = 150.0
"""Vmax, largest admissible voltage; the smallest is 0 [V]."""
STROKE_IN_USE = 12e-6
"""Elongation for which the source gives the range of the stage [m]."""

SIZE = (5e-3, 5e-3, 20e-3)
"""Width, depth and length [m] (given)."""
DENSITY = 7700.0
"""Density of the ceramic [kg/m3] (typical)."""
CAPACITANCE = 1.4e-6
"""C_T, capacitance of the free stack at low frequency [F] (typical)."""
QUALITY = 25.0
"""Q_m, mechanical quality factor (typical)."""

PULL_FROM_ROUNDING = 1e-6 * BLOCKING_FORCE
"""Pulling force [N] above which contact is lost; larger than rounding and solver error of a stack at rest."""

_TIP_MASS = DENSITY * math.prod(SIZE) / 3
_DEFAULTS_SIZE = BLOCKING_FORCE * FREE_STROKE
_CONSISTENT = 1e-9
"""Relative tolerance of the identity blocking force = stiffness * stroke."""


@dataclass(frozen=True)
class Stack:
    """Data sheet of one stack; missing values are scaled from the Tokin.

    Attributes:
        blocking_force: F0, force of the blocked stack at the full voltage, stiffness * stroke [N].
        stroke: s0, elongation of the free stack at the full voltage [m].
        stiffness: k, blocking_force / stroke [N/m].
        full_voltage: Vmax, largest admissible voltage; the smallest is 0 [V].
        capacitance: C_T, capacitance of the free stack at low frequency [F].
        tip_mass: effective mass at the tip, a third of the stack's mass [kg].
        damping: c, damping along the stack [N.s/m].

    Raises:
        ModelError: a number that is not finite or not above 0 (damping: below 0); inconsistent blocking force, stroke
            and stiffness; a capacitance that gives a clamped capacitance of 0 or less.
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
                f"stack: blocking_force {self.blocking_force:g} N is not stiffness {self.stiffness:g} N/m times stroke "
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
                f"stack: capacitance is {self.capacitance:g} F, expected more than {least:g} F, the share of the "
                "motion of the free stack, blocking_force times stroke over the square of full_voltage"
            )

    @property
    def coupling(self) -> float:
        """alpha, force per volt [N/V = C/m]."""
        return self.blocking_force / self.full_voltage

    @property
    def clamped_capacitance(self) -> float:
        """C_S, capacitance at constant elongation [F]."""
        return self.capacitance - self.coupling**2 / self.stiffness

    def _set(self, name: str, value: float) -> None:
        object.__setattr__(self, name, value)

    def _check(self, *names: str) -> None:
        """Raise `ModelError` if one of the fields is not finite or not above 0."""
        for name in names:
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ModelError(f"stack: {name} is {value:g}, expected more than 0")


TOKIN = Stack()
"""The stack Tokin AE0505D16."""
