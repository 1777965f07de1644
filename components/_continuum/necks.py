"""The largest von Mises stress of all necks as an expression of elongations and pose.

The stress is that of a piece without mass of its own between stacks and platform, good below the swing of the end
blocks. It is evaluated at the points of `recovery.py`, and within their tolerance.
"""

import casadi as ca

from hfsa.components._continuum.design import Continuum, Solved
from hfsa.components._continuum.elements import von_mises_squared
from hfsa.components._continuum.recovery import few_points
from hfsa.components._continuum.stress import neck_stresses


def largest_stress(design: Continuum, solved: Solved, place: ca.SX) -> ca.SX:
    """Return the largest von Mises stress [Pa] over the necks at elongations and pose (6, 1); 0 at rest."""
    statics, material = solved.stage.statics, design.shape.material
    squares = []
    for found in neck_stresses(*solved.solution, material, statics.interface).values():
        for points in few_points(found, statics.stiffness):
            xx, yy, xy = (ca.DM(points[:, component]) @ place for component in range(3))
            squares.append(von_mises_squared(xx, yy, xy, material))
    largest = ca.mmax(ca.vertcat(*squares))
    # the slope of a root at 0 is not finite
    return ca.if_else(largest > 0, ca.sqrt(largest), 0)
