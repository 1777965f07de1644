"""Contact of a stack and its lever, and the joint of bolts and platform, on a stage whose necks or bodies give.

The end of the lever on which a stack pushes has three coordinates: l along the push, s across it, counter-clockwise by
90 degrees from the push, and phi, its rotation.

    locked    s = 0, phi = 0      held sideways: the condition of the source's finite elements
    slide     s free, phi = 0     a flat end without friction
    ball      s, phi free         a ball tip
    stack     s, phi elastic      a bonded or flat preloaded stack, a beam that is clamped at its back end

The drive hinge sits above the pivot of the lever, so that a lever that turns moves its end sideways: what holds it
there takes up to half the motion. The beam has the bending stiffness that follows from the stack's axial one, and gives
in shear (Timoshenko),

    E = k L / A,   Phi = 12 E I / (kappa G A L^2),   f = E I / (L^3 (1 + Phi))
    K_ss = 12 f,   K_s,phi = -6 L f,   K_phi,phi = (4 + Phi) L^2 f

A stack of another size is the Tokin with its cross-section in proportion to the blocking force, its length in
proportion to the stroke.
"""

from typing import Literal

import numpy as np

from hfsa.components._mechanics.pzt import BLOCKING_FORCE, FREE_STROKE, SIZE, Stack

Contact = Literal["locked", "slide", "ball", "stack"]
Bolts = Literal["pin", "rigid"]

SHEAR_FACTOR = 5 / 6
"""kappa of a rectangular cross-section."""
POISSON = 0.3
"""Poisson's ratio of the ceramic (assumed)."""


def held(contact: Contact) -> tuple[bool, bool]:
    """Return whether a contact holds s and phi at zero."""
    return contact == "locked", contact in ("locked", "slide")


def sideways_stiffness(contact: Contact, stack: Stack) -> np.ndarray:
    """Return the stiffness of a contact on s and phi, shape (2, 2) [N/m, N; N, N.m]; of what it holds, zero."""
    if contact != "stack":
        return np.zeros((2, 2))
    side, _, length = SIZE
    area = side**2 * stack.blocking_force / BLOCKING_FORCE
    length *= stack.stroke / FREE_STROKE
    modulus, inertia = stack.stiffness * length / area, area**2 / 12
    shear = 12 * 2 * (1 + POISSON) * inertia / (SHEAR_FACTOR * area * length**2)
    per_length = modulus * inertia / (length**3 * (1 + shear))
    coupled = -6 * length * per_length
    return np.array([[12 * per_length, coupled], [coupled, (4 + shear) * length**2 * per_length]])
