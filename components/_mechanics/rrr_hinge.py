"""Flexure hinge of the 3-RRR stage: a neck between two semicircular notches, and the bending stress in it.

    K_b = 2 E b t^(5/2) / (9 pi r^(1/2))     (eq 2.3)         sigma = 6 K_b |phi| / (b t^2)     (eqs 2.4, 2.6)

The formula holds for t << r. Integration over the true profile gives 45.43 N.m/rad, 11 % more; the value of the source
is kept.
"""

import math

MODULUS = 101e9
"""E, Young's modulus [Pa] (sec. 2.2)."""
WIDTH = 10e-3
"""b, width of the hinge [m]."""
THICKNESS = 0.8e-3
"""t, thickness of the neck [m]."""
RADIUS = 1e-3
"""r, radius of the notches [m]."""

STIFFNESS = 2 * MODULUS * WIDTH * THICKNESS**2.5 / (9 * math.pi * math.sqrt(RADIUS))
"""K_b, stiffness of the hinge [N.m/rad]."""
STRESS_PER_ANGLE = 6 * STIFFNESS / (WIDTH * THICKNESS**2)
"""Bending stress per angle [Pa/rad]."""
ALLOWED_STRESS = 350e6 / 1.5
"""Allowable stress, yield stress / safety factor [Pa] (eq 3.6)."""
