"""Appendix D.2 of the 3-RRR stage's source: its functions of the elongations, and our model in the same functions.

    K_ii = a . (1, c_i, s_i),  K_ij = b . (1, c_i, s_i, c_j, s_j),  (i, j, k) = (1, 2, 3), (2, 3, 1), (3, 1, 2)
    H_i  = f . (1 + c_i - 2 c_i^2, s_i, s_i c_i, s_j - s_k, c_j - c_k) + g . (l_i, l_j + l_k, c_i (l_j - l_k),
           s_i (l_j - l_k)),   s = sin(l / R0), c = cos(l / R0)

Its numbers a, b, f, g are in `published.toml`. It leaves the yaw out of the hinges' energy and has the sign of H's even
terms reversed, so it is no level of the part.
"""

from typing import Any, NamedTuple
from unittest.mock import patch

import casadi as ca
import numpy as np

from hfsa.components import _rrr_dynamics as dynamics
from hfsa.components._rrr_kinematics import NOMINAL

LEGS = ((0, 1, 2), (1, 2, 0), (2, 0, 1))
MASSES = {"PLATFORM_MASS": 0.1322698, "PLATFORM_INERTIA": 9.618918e-6, "COUPLER_MASS": 7.627785e-3}
"""What D.2 was made with, to the seven digits that can be told; the source's tables round them."""

length, rate = ca.SX.sym("l", 3), ca.SX.sym("l_rate", 3)

_RNG = np.random.default_rng(1)
_POINTS = np.vstack([NOMINAL.arm * _RNG.uniform(-np.pi, np.pi, (3, 200)), _RNG.standard_normal((3, 200))])
"""l all around the circle, where the functions differ most, and l'."""


class PrintedStage(NamedTuple):
    """The stage as printed: forces = K(l) l'' + C(l, l') l' + H(l)."""

    K: ca.SX
    C: ca.SX
    H: ca.SX


def waves(elongation: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return cosines and sines of the cranks' turns, each (3, 1)."""
    return ca.cos(elongation / NOMINAL.arm), ca.sin(elongation / NOMINAL.arm)


def diagonal_functions(elongation: ca.SX, i: int) -> ca.SX:
    """Return the functions of K_ii."""
    c, s = waves(elongation)
    return ca.vertcat(1, c[i], s[i])


def coupling_functions(elongation: ca.SX, i: int, j: int) -> ca.SX:
    """Return the functions of K_ij."""
    c, s = waves(elongation)
    return ca.vertcat(1, c[i], s[i], c[j], s[j])


def force_functions(elongation: ca.SX, i: int, j: int, k: int) -> ca.SX:
    """Return the functions of H_i, those of f before those of g."""
    (c, s), between = waves(elongation), elongation[j] - elongation[k]
    f = ca.vertcat(1 + c[i] - 2 * c[i] ** 2, s[i], s[i] * c[i], s[j] - s[k], c[j] - c[k])
    return ca.vertcat(f, elongation[i], elongation[j] + elongation[k], c[i] * between, s[i] * between)


def assembled(
    a: np.ndarray, b: np.ndarray, f: np.ndarray, g: np.ndarray, elongation: ca.SX, rates: ca.SX
) -> PrintedStage:
    """Return D.2 with these numbers over elongations and their rates, each (3, 1); C is made of K as there."""
    K, H = ca.SX.zeros(3, 3), []
    for i, j, k in LEGS:
        K[i, i] = ca.dot(ca.DM(a), diagonal_functions(elongation, i))
        K[i, j] = K[j, i] = ca.dot(ca.DM(b), coupling_functions(elongation, i, j))
        H.append(ca.dot(ca.DM([*f, *g]), force_functions(elongation, i, j, k)))
    C = ca.jtimes(K, elongation, rates) - ca.jacobian(K @ rates, elongation).T / 2
    return PrintedStage(K, C, ca.vertcat(*H))


def values(expression: ca.SX) -> np.ndarray:
    """Return the values of an expression of `length` and `rate` at 200 points, shape (200, entries)."""
    found = ca.Function("f", [length, rate], [ca.vec(ca.densify(expression))]).map(_POINTS.shape[1])
    return np.array(found(_POINTS[:3], _POINTS[3:])).T


def projected(expression: ca.SX, basis: ca.SX) -> np.ndarray:
    """Return the coefficients of an expression's entries, shape (entries, functions); the basis leaves nothing out."""
    functions, wanted = values(basis), values(expression)
    size = np.abs(functions).max(axis=0)
    found = np.linalg.lstsq(functions / size, wanted)[0]
    np.testing.assert_allclose(functions / size @ found, wanted, rtol=0, atol=1e-13 * np.abs(wanted).max())
    found[np.abs(found) < 1e-13 * np.abs(found).max()] = 0
    return found.T / size


def with_its_masses() -> dynamics.Mechanism:
    """Return our mechanism over `length` and `rate` with the masses of D.2."""
    with patch.multiple(dynamics, **MASSES):
        return dynamics.constant_jacobian(NOMINAL, length, rate)


def without_yaw(mechanism: dynamics.Mechanism) -> dynamics.Mechanism:
    """Leave the yaw out of the corners and of the hinges, in the potential energy."""
    return mechanism._replace(bends=ca.substitute(mechanism.bends, mechanism.parts[2], 0))


def our_numbers() -> dict[str, Any]:
    """Return a, b, f, g of our model with D.2's masses, the yaw left out of the potential energy."""
    found = dynamics.terms(without_yaw(with_its_masses()))
    force = projected(found.elastic[0], force_functions(length, *LEGS[0]))[0]
    return {
        "a": projected(found.mass[0, 0], diagonal_functions(length, 0))[0],
        "b": projected(found.mass[0, 1], coupling_functions(length, 0, 1))[0],
        "f": force[:5],
        "g": force[5:],
    }
