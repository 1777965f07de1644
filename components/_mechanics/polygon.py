"""Regular polygons: area, and the torsion constant that also tells the damping of a film squeezed between two of them.

    laplace(psi) = -2 inside, psi = 0 on the boundary,    J = 2 integral psi

With polar coordinates from the centre, of the n-fold symmetry of the polygon,

    psi = c_0 + sum c_k r^(k n) cos(k n angle) - r^2 / 2,    k = 1, 2, ...

The coefficients are those of least squares on half a side. J is exact for a triangle, sqrt(3) / 80 a^4, and accurate to
1e-7 for a square.
"""

import math
from functools import cache
from typing import Any

import numpy as np

_TERMS, _POINTS = 40, 400


def polygon_area(side: Any, sides: int) -> Any:
    """Return the area of a regular polygon [m2]; the side [m] may be a CasADi expression."""
    return sides / (4 * math.tan(math.pi / sides)) * side**2


def torsion_constant(side: float, sides: int) -> float:
    """Return J of a regular polygon [m4]."""
    return _unit_torsion(sides) * side**4


@cache
def _unit_torsion(sides: int) -> float:
    """Return J of a polygon with sides of length 1."""
    apothem, corner = 1 / (2 * math.tan(math.pi / sides)), math.pi / sides
    largest = apothem / math.cos(corner)
    # points that crowd towards the corner, where psi is least smooth
    angles = corner * np.sin(np.linspace(0, math.pi / 2, _POINTS))
    radii = apothem / np.cos(angles)
    orders = sides * np.arange(_TERMS)
    basis = (radii[:, None] / largest) ** orders * np.cos(np.outer(angles, orders))
    c = np.linalg.lstsq(basis, radii**2 / 2, rcond=None)[0]
    # the integral over r is in closed form, that over the angle by Gauss
    nodes, weights = np.polynomial.legendre.leggauss(2 * _TERMS)
    angle = corner * (1 + nodes) / 2
    edge = apothem / np.cos(angle)
    along = (edge[:, None] / largest) ** orders * edge[:, None] ** 2 / (orders + 2) * np.cos(np.outer(angle, orders))
    slices = along @ c - edge**4 / 8
    return float(2 * 2 * sides * (weights @ slices) * corner / 2)
