"""The PZT stack that drives the 3-RRR stage (Tokin AE0505D16): its static line and what a mechanism feels of it.

    F = alpha V - k l,   k = F0 / s0,   alpha = F0 / Vmax     (eq 5.9)

Source: thesis of 2000 on the 3-RRR stage, eq 5.9, for the line. Assumed: the mass, of 5 x 5 x 20 mm at 7700 kg/m3, one
third of it at the tip, and a quality factor of 25.
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

STIFFNESS = BLOCKING_FORCE / FREE_STROKE
"""k [N/m]."""
FORCE_PER_VOLT = BLOCKING_FORCE / FULL_VOLTAGE
"""alpha [N/V]."""
TIP_MASS = 7700 * 5e-3 * 5e-3 * 20e-3 / 3
"""Mass that moves with the tip [kg]."""
DAMPING = math.sqrt(STIFFNESS * TIP_MASS) / 25
"""c [N.s/m]."""
