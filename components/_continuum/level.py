"""Level `continuum` of the stage: its ports, states and outputs, declared in a model."""

import casadi as ca

from hfsa.components._continuum.design import Continuum
from hfsa.components._continuum.dynamics import equations
from hfsa.components._continuum.necks import largest_stress
from hfsa.components._mechanics.rrr_levels import (
    MOVE,
    Motion,
    declare_loads,
    declare_stack_damping,
    declare_stacks,
    declare_stress,
)
from hfsa.components._modelling.model import Model

DAMPING = 0.01
"""Damping ratio of each mode (typical)."""


def elastic(m: Model, design: Continuum) -> Motion:
    """Add the modes of a stage, the outputs of stacks and necks; return the motion of the platform.

    Raises:
        ModelError: as `solution` of a shape that cannot be built or meshed.
    """
    solved = design.solved(design.size)
    small, stack = design.small(solved.stage), design.stack
    words = "Damping ratio of each mode, without that of the stacks"
    damping = m.parameter("damping_ratio", DAMPING, "1", words, min=0)
    loads = declare_loads(m, "source")
    c = declare_stack_damping(m, stack)
    mode = f"mode[1..{len(small.omega)}]"
    coordinates = m.state(f"{mode}.displacement", "m", "Largest displacement in the mode", nominal=MOVE[0])
    rates = m.state(f"{mode}.velocity", "m/s", "Rate of the displacement", nominal=MOVE[1])
    forces, radius = ca.vertcat(loads.drive, loads.wrench), design.shape.links.radius
    found = equations(small, radius, coordinates, rates, forces, loads.base, damping, c)
    m.der[coordinates], m.der[rates] = rates, found.acceleration
    (at, x), (rate, v), (acceleration, a) = (ca.vertsplit(part, 3) for part in found.motion)
    inertia = stack.tip_mass * (acceleration + ca.DM(solved.stage.pushes) @ loads.base)
    declare_stacks(m, "source", at, rate, loads.drive - stack.stiffness * at - c * rate - inertia)
    declare_stress(m, largest_stress(design, solved, found.motion.place), design.dimensions.hinge.allowed_stress)
    return Motion(x, v, a)
