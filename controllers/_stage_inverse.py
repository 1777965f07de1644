"""Inverse dynamics of the 3-RRR stage: forces of its stacks for a motion of its elongations.

    Q = L^-T (M p'' + c + dP/dp) + beta K0 l',    p'' = L^-1 (l'' - L' p'),    p' = L^-1 l',    L = dl/dp

with the coordinates p of a level: the elongations themselves for `constant_jacobian` (L = 1), the pose for `exact`,
computed from the elongations by Newton's method. The stiffness of the stacks is not included.
"""

from typing import Literal, get_args

import casadi as ca

from hfsa.components._mechanics import rrr_dynamics as dynamics
from hfsa.components._mechanics.rrr_design import Design
from hfsa.components._mechanics.rrr_kinematics import Links, elongations
from hfsa.components._modelling.model import one_of

StageModel = Literal["exact", "constant_jacobian"]

_NEWTON_STEPS = 3
"""Newton steps from J0 l; the convergence is quadratic: 0.2 um, 5e-12 m, then far below rounding error."""


def stack_forces(model: str, design: Design) -> ca.Function:
    """Return the function (elongation, rate, acceleration) -> forces of the undamped stage.

    All columns are (3, 1), in [m], [m/s], [m/s2] and [N].

    Raises:
        ModelError: an unknown model; a design without link dimensions, or with a Jacobian for `exact`.
    """
    one_of(model, get_args(StageModel), "model of the stage")
    mechanism = design.mechanism(model, ca.SX.sym("p", 3), ca.SX.sym("p_rate", 3))
    elongation, rate, acceleration = (ca.SX.sym(name, 3) for name in ("l", "l_rate", "l_acceleration"))
    p, v, terms = mechanism.coordinates, mechanism.rates, dynamics.terms(mechanism)
    from_stacks = ca.inv(terms.slope[3:, :])
    demanded = from_stacks @ (acceleration - terms.bias[3:])
    forces = from_stacks.T @ (terms.mass @ demanded + terms.velocity + terms.elastic)
    at = ca.Function("at", [p, v, acceleration], [forces])
    speed = ca.Function("speed", [p, elongation], [from_stacks @ elongation])
    coordinates = _pose(design.links_at_rest, elongation) if model == "exact" else elongation
    result = at(coordinates, speed(coordinates, rate), acceleration)
    return ca.Function("stack_forces", [elongation, rate, acceleration], ca.cse([result]))


def _pose(geometry: Links, elongation: ca.SX) -> ca.SX:
    """Return the pose of the exact kinematics at elongations, (3, 1)."""
    pose = ca.SX.sym("pose", 3)
    reached = elongations(geometry, pose)
    step = ca.Function("step", [pose, elongation], [pose - ca.inv(ca.jacobian(reached, pose)) @ (reached - elongation)])
    found = ca.DM(geometry.jacobian) @ elongation
    for _ in range(_NEWTON_STEPS):
        found = step(found, elongation)
    return found
