"""The PZT stack Tokin AE0505D16: its static line, its size, and what a mechanism feels of it.

    F = alpha V - k l,   k = F0 / s0,   alpha = F0 / Vmax     (eq 5.9)

Source: thesis of 2000 on the 3-RRR stage, eq 5.9, for the line. Assumed: a third of the mass moves with the tip.
"""

import math

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

STIFFNESS = BLOCKING_FORCE / FREE_STROKE
"""k [N/m]."""
FORCE_PER_VOLT = BLOCKING_FORCE / FULL_VOLTAGE
"""alpha [N/V]."""
TIP_MASS = DENSITY * math.prod(SIZE) / 3
"""Mass that moves with the tip [kg]."""
DAMPING = math.sqrt(STIFFNESS * TIP_MASS) / QUALITY
"""c [N.s/m]."""

PULL_FROM_ROUNDING = 1e-6 * BLOCKING_FORCE
"""Pull [N] that rounding and a solver's tolerance may show in a stack at rest: not yet a lost contact."""
